/* A rope that is pulled by its grip: cc -I include examples/pull.c -L ../../target/debug -lcosserat_c -o pull */
#include <stdio.h>
#include <stdlib.h>

#include "cosserat.h"

static void check(int32_t code) {
    if (code != COSSERAT_OK) {
        fprintf(stderr, "%s\n", cosserat_last_error());
        exit(code);
    }
}

int main(int count, char **arguments) {
    cosserat_simulation *rope = NULL;
    cosserat_snapshot *before = NULL;
    double pose[7], again[7], *poses, force[6];
    size_t first, segments, numbers, step, round;

    check(cosserat_open(count > 1 ? arguments[1] : "rope.toml", NULL, NULL, &rope));
    check(cosserat_find(rope, "rope", &first, &segments));
    numbers = 7 * cosserat_segments(rope);
    poses = malloc(numbers * sizeof *poses);
    check(cosserat_snapshot_take(rope, &before));
    for (round = 0; round < 2; round++) { /* twice from the same moment */
        for (step = 0; step < 50; step++) {
            check(cosserat_grip_pose(rope, 0, pose));
            pose[0] += 0.002; /* metres along x in each step */
            check(cosserat_set_grip(rope, 0, pose));
            check(cosserat_step(rope, 0.01));
        }
        check(cosserat_poses(rope, poses, numbers));
        check(cosserat_grip_forces(rope, force, 6 * cosserat_grips(rope)));
        printf("%.2f %.17g %.17g %.17g\n", cosserat_time(rope), pose[0], poses[7 * (first + segments - 1)], force[0]);
        check(cosserat_snapshot_restore(rope, before));
    }
    check(cosserat_grip_pose(rope, 0, again));
    printf("%.2f %.17g\n", cosserat_time(rope), again[0]);
    free(poses);
    cosserat_snapshot_free(before);
    cosserat_free(rope);
    return 0;
}
