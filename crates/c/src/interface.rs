//! What C calls: `include/cosserat.h` declares the same functions, and a test compares the two.
//!
//! All unsafe code of this crate is here: pointers from C are read and written. A null pointer is an error. That a pointer which is
//! not null points to what the header says, to as many numbers as it says, that a simulation is not used after it is freed, and by
//! one thread at a time, is up to the caller; no function can check it.

use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr::null;

use crate::handle::{Code, Failure, Handle, Snapshot};

thread_local! {
    /// The last error of this thread.
    static LAST: RefCell<CString> = RefCell::default();
}

/// The code of how `work` ended; its error becomes the thread's last one. No panic gets out.
fn guarded(work: impl FnOnce() -> Result<(), Failure>) -> i32 {
    let caught = catch_unwind(AssertUnwindSafe(work));
    let ended = caught.unwrap_or_else(|_| {
        let message = "a fault of the library, described on stderr; free the simulation and begin anew".to_owned();
        Err(Failure { code: Code::Internal, message })
    });
    let Err(Failure { code, message }) = ended else { return 0 };
    LAST.set(CString::new(message.replace('\0', " ")).unwrap_or_default());
    code as i32
}

/// A number that no error can take the place of: 0 where there is no simulation or a panic was caught.
fn counted<T: Default>(simulation: Option<&Handle>, read: impl FnOnce(&Handle) -> T) -> T {
    let read = || simulation.map(read).unwrap_or_default();
    catch_unwind(AssertUnwindSafe(read)).unwrap_or_default()
}

fn given<T>(pointer: Option<T>, name: &str) -> Result<T, Failure> {
    pointer.ok_or_else(|| Failure::input(format!("{name} is a null pointer")))
}

/// A text, or none for a null pointer.
///
/// # Safety
/// `text` is null, or points to bytes that end in a zero and stay as they are for `'a`.
unsafe fn text<'a>(text: *const c_char, name: &str) -> Result<Option<&'a str>, Failure> {
    if text.is_null() {
        return Ok(None);
    }
    // SAFETY: the caller's promise.
    let text = unsafe { CStr::from_ptr(text) };
    text.to_str().map(Some).map_err(|_| Failure::input(format!("{name} is not UTF-8")))
}

/// `N` numbers.
///
/// # Safety
/// `numbers` is null, or points to `N` numbers.
unsafe fn array<const N: usize>(numbers: *const f64, name: &str) -> Result<[f64; N], Failure> {
    // SAFETY: the caller's promise; an array of numbers has their alignment.
    given(unsafe { numbers.cast::<[f64; N]>().as_ref() }, name).copied()
}

/// Fills `out`, which has room for `room` numbers, with rows of `N` numbers.
///
/// # Safety
/// `out` is null, or points to `room` numbers that nothing else uses meanwhile.
unsafe fn fill<const N: usize>(
    simulation: Option<&Handle>,
    rows: fn(&Handle) -> usize,
    room: usize,
    out: *mut f64,
    read: impl FnOnce(&Handle, &mut dyn FnMut(usize, [f64; N])),
) -> Result<(), Failure> {
    let simulation = given(simulation, "simulation")?;
    let needed = N * rows(simulation);
    if room != needed {
        return Err(Failure::input(format!("room for {room} numbers is given; there are {needed}")));
    }
    if needed == 0 {
        return Ok(());
    }
    if out.is_null() {
        return given(None, "out");
    }
    // SAFETY: `out` is not null; the caller promises room for `room` numbers, which is `needed`.
    let out = unsafe { std::slice::from_raw_parts_mut(out, needed) };
    read(simulation, &mut |row, numbers| out[N * row..N * (row + 1)].copy_from_slice(&numbers));
    Ok(())
}

/// Hands out what `make` makes; null where it fails.
///
/// # Safety
/// `out` is null, or points to a pointer that may be written.
unsafe fn hand_out<T>(out: *mut *mut T, make: impl FnOnce() -> Result<T, Failure>) -> Result<(), Failure> {
    // SAFETY: the caller's promise.
    let out = given(unsafe { out.as_mut() }, "out")?;
    *out = std::ptr::null_mut();
    *out = Box::into_raw(Box::new(make()?));
    Ok(())
}

/// Hands out a simulation that `make` makes of its scene, by path or name (`what`), and of names of formulation and integrator.
///
/// # Safety
/// Texts are null or end in a zero; `out` is null or may be written.
unsafe fn begin(
    [scene, formulation, integrator]: [*const c_char; 3],
    what: &str,
    out: *mut *mut Handle,
    make: impl FnOnce(&str, [Option<&str>; 2]) -> Result<Handle, Failure>,
) -> Result<(), Failure> {
    // SAFETY: the caller's promises.
    unsafe {
        let scene = given(text(scene, what)?, what)?;
        let method = [text(formulation, "formulation")?, text(integrator, "integrator")?];
        hand_out(out, || make(scene, method))
    }
}

/// Frees what [`hand_out`] handed out; null is ignored.
///
/// # Safety
/// `pointer` is null, or came from `hand_out` and was not freed.
unsafe fn free<T>(pointer: *mut T) {
    if !pointer.is_null() {
        // SAFETY: `hand_out` has it from `Box::into_raw`.
        let own = unsafe { Box::from_raw(pointer) };
        let _ = catch_unwind(AssertUnwindSafe(|| drop(own)));
    }
}

/// The last error of the calling thread: text that ends in a zero, valid until the thread's next call that fails; empty before the
/// first.
#[unsafe(no_mangle)]
pub extern "C" fn cosserat_last_error() -> *const c_char {
    LAST.try_with(|last| last.borrow().as_ptr()).unwrap_or(null())
}

/// Loads a scene file. `formulation` and `integrator` are names, or null for the defaults.
///
/// # Safety
/// Texts are null or end in a zero; `out` is null or may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cosserat_open(
    path: *const c_char,
    formulation: *const c_char,
    integrator: *const c_char,
    out: *mut *mut Handle,
) -> i32 {
    // SAFETY: the caller's promises.
    guarded(|| unsafe { begin([path, formulation, integrator], "path", out, Handle::open) })
}

/// Takes a scene that comes with the library, by its name.
///
/// # Safety
/// As [`cosserat_open`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cosserat_builtin(
    name: *const c_char,
    formulation: *const c_char,
    integrator: *const c_char,
    out: *mut *mut Handle,
) -> i32 {
    // SAFETY: the caller's promises.
    guarded(|| unsafe { begin([name, formulation, integrator], "name", out, Handle::builtin) })
}

/// Frees a simulation; null is ignored.
///
/// # Safety
/// `simulation` is null, or came from this library and was not freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cosserat_free(simulation: *mut Handle) {
    // SAFETY: the caller's promise.
    unsafe { free(simulation) }
}

/// One step of `dt_s` [s], or of the scene's own for 0.
///
/// # Safety
/// `simulation` is null, or came from this library, was not freed, and is used by no other thread meanwhile.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cosserat_step(simulation: *mut Handle, dt_s: f64) -> i32 {
    // SAFETY: the caller's promise.
    guarded(|| given(unsafe { simulation.as_mut() }, "simulation")?.step(dt_s))
}

/// Time [s].
///
/// # Safety
/// As [`cosserat_step`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cosserat_time(simulation: *const Handle) -> f64 {
    // SAFETY: the caller's promise.
    counted(unsafe { simulation.as_ref() }, Handle::time)
}

/// The scene's own time step [s].
///
/// # Safety
/// As [`cosserat_step`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cosserat_own_step(simulation: *const Handle) -> f64 {
    // SAFETY: the caller's promise.
    counted(unsafe { simulation.as_ref() }, Handle::own_step)
}

/// Number of segments, rigid bodies included.
///
/// # Safety
/// As [`cosserat_step`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cosserat_segments(simulation: *const Handle) -> usize {
    // SAFETY: the caller's promise.
    counted(unsafe { simulation.as_ref() }, Handle::segments)
}

/// Number of joints.
///
/// # Safety
/// As [`cosserat_step`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cosserat_joints(simulation: *const Handle) -> usize {
    // SAFETY: the caller's promise.
    counted(unsafe { simulation.as_ref() }, Handle::joints)
}

/// Number of grips.
///
/// # Safety
/// As [`cosserat_step`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cosserat_grips(simulation: *const Handle) -> usize {
    // SAFETY: the caller's promise.
    counted(unsafe { simulation.as_ref() }, Handle::grips)
}

/// Number of the scene's loads.
///
/// # Safety
/// As [`cosserat_step`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cosserat_loads(simulation: *const Handle) -> usize {
    // SAFETY: the caller's promise.
    counted(unsafe { simulation.as_ref() }, Handle::loads)
}

/// The first segment of a rod or body, and how many it has.
///
/// # Safety
/// As [`cosserat_step`]; `name` is null or ends in a zero; `first` and `count` are null or may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cosserat_find(
    simulation: *const Handle,
    name: *const c_char,
    first: *mut usize,
    count: *mut usize,
) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promises.
        unsafe {
            let simulation = given(simulation.as_ref(), "simulation")?;
            let [a, b] = simulation.find(given(text(name, "name")?, "name")?)?;
            *given(first.as_mut(), "first")? = a;
            *given(count.as_mut(), "count")? = b;
            Ok(())
        }
    })
}

/// Poses of segments, seven numbers each: position [m], quaternion (w, x, y, z).
///
/// # Safety
/// As [`cosserat_step`]; `out` is null or has room for `numbers` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cosserat_poses(simulation: *const Handle, out: *mut f64, numbers: usize) -> i32 {
    // SAFETY: the caller's promises.
    guarded(|| unsafe { fill(simulation.as_ref(), Handle::segments, numbers, out, |own, write| own.poses(write)) })
}

/// Velocities of segments, six numbers each: [m/s], [rad/s].
///
/// # Safety
/// As [`cosserat_poses`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cosserat_velocities(simulation: *const Handle, out: *mut f64, numbers: usize) -> i32 {
    // SAFETY: the caller's promises.
    guarded(|| unsafe { fill(simulation.as_ref(), Handle::segments, numbers, out, |own, write| own.velocities(write)) })
}

/// What joints transmit, six numbers each: force [N], moment [N m].
///
/// # Safety
/// As [`cosserat_poses`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cosserat_joint_forces(simulation: *const Handle, out: *mut f64, numbers: usize) -> i32 {
    // SAFETY: the caller's promises.
    guarded(|| unsafe { fill(simulation.as_ref(), Handle::joints, numbers, out, |own, write| own.joint_forces(write)) })
}

/// What grips bear, six numbers each: force [N], moment [N m].
///
/// # Safety
/// As [`cosserat_poses`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cosserat_grip_forces(simulation: *const Handle, out: *mut f64, numbers: usize) -> i32 {
    // SAFETY: the caller's promises.
    guarded(|| unsafe { fill(simulation.as_ref(), Handle::grips, numbers, out, |own, write| own.grip_forces(write)) })
}

/// The pose of a grip: seven numbers.
///
/// # Safety
/// As [`cosserat_step`]; `out` is null or has room for seven numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cosserat_grip_pose(simulation: *const Handle, grip: usize, out: *mut f64) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promises; an array of numbers has their alignment.
        unsafe {
            let pose = given(simulation.as_ref(), "simulation")?.grip(grip)?;
            *given(out.cast::<[f64; 7]>().as_mut(), "out")? = pose;
            Ok(())
        }
    })
}

/// Sends a grip to a pose, at which it is at the end of the next step.
///
/// # Safety
/// As [`cosserat_step`]; `pose` is null or points to seven numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cosserat_set_grip(simulation: *mut Handle, grip: usize, pose: *const f64) -> i32 {
    // SAFETY: the caller's promises.
    guarded(|| unsafe { given(simulation.as_mut(), "simulation")?.send_grip(grip, array(pose, "pose")?) })
}

/// Sets a load of the scene from the next step on: force [N], torque [N m].
///
/// # Safety
/// As [`cosserat_step`]; `wrench` is null or points to six numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cosserat_set_load(simulation: *mut Handle, load: usize, wrench: *const f64) -> i32 {
    // SAFETY: the caller's promises.
    guarded(|| unsafe { given(simulation.as_mut(), "simulation")?.set_load(load, array(wrench, "wrench")?) })
}

/// Sets gravity from the next step on [m/s^2].
///
/// # Safety
/// As [`cosserat_step`]; `gravity` is null or points to three numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cosserat_set_gravity(simulation: *mut Handle, gravity: *const f64) -> i32 {
    // SAFETY: the caller's promises.
    guarded(|| unsafe { given(simulation.as_mut(), "simulation")?.set_gravity(array(gravity, "gravity")?) })
}

/// Takes a snapshot.
///
/// # Safety
/// As [`cosserat_step`]; `out` is null or may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cosserat_snapshot_take(simulation: *mut Handle, out: *mut *mut Snapshot) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promises.
        unsafe {
            let simulation = given(simulation.as_mut(), "simulation")?;
            hand_out(out, || Ok(simulation.snapshot()))
        }
    })
}

/// Goes back to a snapshot of the same simulation.
///
/// # Safety
/// As [`cosserat_step`]; `snapshot` is null, or came from this library and was not freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cosserat_snapshot_restore(simulation: *mut Handle, snapshot: *const Snapshot) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promises.
        unsafe { given(simulation.as_mut(), "simulation")?.restore(given(snapshot.as_ref(), "snapshot")?) }
    })
}

/// Frees a snapshot; null is ignored.
///
/// # Safety
/// `snapshot` is null, or came from this library and was not freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cosserat_snapshot_free(snapshot: *mut Snapshot) {
    // SAFETY: the caller's promise.
    unsafe { free(snapshot) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_panic_gets_out() {
        assert_eq!(guarded(|| panic!("a fault")), 3);
        assert!(LAST.with_borrow(|last| last.to_string_lossy().contains("a fault of the library")));
    }
}
