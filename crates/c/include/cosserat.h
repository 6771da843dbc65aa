/* Elastic rods: cables, ropes, springs, hair and trees.
 *
 * Units are SI throughout: metres, kilograms, seconds, newtons, radians. Quaternions are (w, x, y, z).
 *
 * Results. A function that can fail returns COSSERAT_OK or another code; cosserat_last_error() has the reason in words. A step that
 * does not converge is done all the same, and what is read after it is outside its tolerance. Poses are read as they are after the
 * last step.
 *
 * Threads. A simulation or a snapshot is used by one thread at a time, whichever. Different simulations may be used by different
 * threads at once. A step may use several threads of its own.
 *
 * Memory. What a function hands out is freed by the function named there, once. Texts are UTF-8 that ends in a zero and are read
 * during the call alone. Arrays are the caller's.
 */
#ifndef COSSERAT_H
#define COSSERAT_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
    COSSERAT_OK = 0,
    COSSERAT_NOT_CONVERGED = 1, /* a step did not meet its tolerance; it is done */
    COSSERAT_BAD_INPUT = 2,     /* an argument or a file is not valid; nothing is changed */
    COSSERAT_INTERNAL = 3       /* a fault of the library; free the simulation and begin anew */
};

typedef struct cosserat_simulation cosserat_simulation;
typedef struct cosserat_snapshot cosserat_snapshot;

/* The last error of the calling thread, valid until its next call that fails; empty before the first. */
const char *cosserat_last_error(void);

/* Loads a scene file (docs/scenes.md). `formulation` ("newton", "xpbd") and `integrator` ("bdf2", "euler") may be
 * NULL: those of the scene, else the defaults. `out` is freed by cosserat_free. */
int32_t cosserat_open(const char *path, const char *formulation, const char *integrator, cosserat_simulation **out);

/* The same with a scene that comes with the library, by its name ("helix"). */
int32_t cosserat_builtin(const char *name, const char *formulation, const char *integrator, cosserat_simulation **out);

/* Frees a simulation; NULL is ignored. */
void cosserat_free(cosserat_simulation *simulation);

/* One step of `dt_s` seconds, or of the scene's own for 0. Grips go where they were sent. */
int32_t cosserat_step(cosserat_simulation *simulation, double dt_s);

/* Time [s], and the scene's own time step [s]; 0 for NULL, as all numbers below. */
double cosserat_time(const cosserat_simulation *simulation);
double cosserat_own_step(const cosserat_simulation *simulation);

/* How many segments (rigid bodies included), joints, grips (fixed segments in their order, then clamped faces) and loads. */
size_t cosserat_segments(const cosserat_simulation *simulation);
size_t cosserat_joints(const cosserat_simulation *simulation);
size_t cosserat_grips(const cosserat_simulation *simulation);
size_t cosserat_loads(const cosserat_simulation *simulation);

/* The first segment of a rod or body, and how many it has. */
int32_t cosserat_find(const cosserat_simulation *simulation, const char *name, size_t *first, size_t *count);

/* Arrays, row by row. `numbers` is the room in `out` and must be exactly what is written.
 * poses: position of the centre, quaternion; 7 a segment.
 * velocities: velocity, angular velocity in world axes; 6 a segment.
 * joint_forces: force in world axes and moment in the axes of the joint's first body, of its second on its first; 6 a joint.
 * grip_forces: force on what is gripped and moment about its position, in world axes; 6 a grip. All but poses and velocities are
 * zero before the first step. */
int32_t cosserat_poses(const cosserat_simulation *simulation, double *out, size_t numbers);
int32_t cosserat_velocities(const cosserat_simulation *simulation, double *out, size_t numbers);
int32_t cosserat_joint_forces(const cosserat_simulation *simulation, double *out, size_t numbers);
int32_t cosserat_grip_forces(const cosserat_simulation *simulation, double *out, size_t numbers);

/* The pose of a grip, 7 numbers; and a pose that it goes to at constant velocity in the next step. It stays there until it is sent
 * on. */
int32_t cosserat_grip_pose(const cosserat_simulation *simulation, size_t grip, double *out);
int32_t cosserat_set_grip(cosserat_simulation *simulation, size_t grip, const double *pose);

/* A load of the scene (force and torque, 6 numbers in world axes, or in the segment's of a load that follows it) and gravity (3 numbers), from the
 * next step on. */
int32_t cosserat_set_load(cosserat_simulation *simulation, size_t load, const double *wrench);
int32_t cosserat_set_gravity(cosserat_simulation *simulation, const double *gravity);

/* All that the steps to come depend on; going back there gives the same bits again. A snapshot belongs to its simulation, outlives
 * it, and is freed by cosserat_snapshot_free (NULL is ignored). */
int32_t cosserat_snapshot_take(cosserat_simulation *simulation, cosserat_snapshot **out);
int32_t cosserat_snapshot_restore(cosserat_simulation *simulation, const cosserat_snapshot *snapshot);
void cosserat_snapshot_free(cosserat_snapshot *snapshot);

#ifdef __cplusplus
}
#endif

#endif
