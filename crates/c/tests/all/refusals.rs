//! What is not valid gives a code and a line, and changes nothing.

use std::ffi::{CStr, CString};
use std::ptr::{null, null_mut};

use cosserat_c::handle::Handle;
use cosserat_c::interface::*;

fn last() -> String {
    // SAFETY: the text is this thread's, and is copied at once.
    #[allow(unsafe_code)]
    unsafe { CStr::from_ptr(cosserat_last_error()) }.to_string_lossy().into_owned()
}

#[test]
#[allow(unsafe_code)]
fn bad_arguments_are_named() {
    let [helix, nothing, euler] = ["helix", "nothing", "eular"].map(|text| CString::new(text).expect("text"));
    let mut simulation: *mut Handle = null_mut();
    // SAFETY: pointers are null, or to what the header asks for.
    unsafe {
        assert_eq!(cosserat_builtin(nothing.as_ptr(), null(), null(), &mut simulation), 2);
        assert!(last().contains("nothing") && simulation.is_null(), "{}", last());
        assert_eq!(cosserat_builtin(helix.as_ptr(), null(), euler.as_ptr(), &mut simulation), 2);
        assert!(last().contains("euler, bdf2"), "{}", last());
        assert_eq!(cosserat_open(null(), null(), null(), &mut simulation), 2);
        assert_eq!(last(), "path is a null pointer");
        assert_eq!(cosserat_builtin(helix.as_ptr(), null(), null(), null_mut()), 2);
        assert_eq!(last(), "out is a null pointer");
        assert_eq!(cosserat_segments(null()), 0);
        assert_eq!(cosserat_step(null_mut(), 0.0), 2);
        cosserat_free(null_mut());

        assert_eq!(cosserat_builtin(helix.as_ptr(), null(), null(), &mut simulation), 0);
        assert_eq!([cosserat_segments(simulation), cosserat_grips(simulation)], [60, 1]);
        assert_eq!(cosserat_own_step(simulation), 0.02);
        let mut poses = vec![0.0; 7 * 60];
        assert_eq!(cosserat_poses(simulation, poses.as_mut_ptr(), 419), 2);
        assert_eq!(last(), "room for 419 numbers is given; there are 420");
        assert_eq!(cosserat_poses(simulation, null_mut(), 420), 2);
        assert_eq!(cosserat_poses(simulation, poses.as_mut_ptr(), 420), 0);
        let before = poses.clone();
        for dt in [-1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(cosserat_step(simulation, dt), 2);
        }
        for pose in [[f64::NAN, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0]] {
            assert_eq!(cosserat_set_grip(simulation, 0, pose.as_ptr()), 2);
        }
        assert_eq!(cosserat_set_grip(simulation, 1, poses.as_ptr()), 2);
        assert_eq!(last(), "grip 1: there are 1 grips");
        assert_eq!(cosserat_set_load(simulation, 0, poses.as_ptr()), 2);
        assert_eq!(cosserat_set_gravity(simulation, [0.0, f64::NAN, 0.0].as_ptr()), 2);
        let [mut first, mut count] = [7, 7];
        assert_eq!(cosserat_find(simulation, nothing.as_ptr(), &mut first, &mut count), 2);
        assert_eq!(last(), "no rod or body is called \"nothing\"; there are helix");
        assert_eq!(cosserat_find(simulation, helix.as_ptr(), &mut first, &mut count), 0);
        assert_eq!([first, count], [0, 60]);
        assert_eq!(cosserat_snapshot_restore(simulation, null()), 2);
        assert_eq!(cosserat_poses(simulation, poses.as_mut_ptr(), 420), 0);
        assert_eq!((before, cosserat_time(simulation)), (poses, 0.0));
        cosserat_free(simulation);
    }
}
