//! All tests of the crate's public side as one program, which builds faster than one program a file.

use std::path::Path;

use cosserat::simulation::{Formulation, Integrator};
use laws::{Case, Checked, Failure, Found, Law, Method, campaign, check, draw};

#[test]
fn the_same_seed_draws_the_same_scenes_and_others_draw_others() {
    for index in 0..20 {
        assert_eq!(draw(5, index), draw(5, index));
        assert_ne!(draw(5, index), draw(6, index));
        assert_ne!(draw(5, index), draw(5, index + 1));
    }
}

#[test]
fn every_feature_is_drawn() {
    let texts: String = (0..400).map(|index| draw(3, index).file()).collect();
    let methods = "--formulation newton,--formulation xpbd ,--integrator bdf2,--solver sparse,--solver cg";
    let shapes = "helix,arc,ring,polyline,hung,curve,straight,knot,sphere,capsule,cylinder,box,mesh";
    let makings = "tube,rectangle,ellipse,stiffness =,pieces,\"physical\",compliance_m_per_n,strain,inner_damping,rest = \"straight\",\
                   darboux_per_m,twist_deg,rods.masses";
    let holds = "clamp,fixed_segments,rods.grips,rods.motions,from_s,until_s,stiffness_n_m ,stiffness_n_m_rad,velocities_m_s,file = ";
    let loads = "rods.loads,torque_n_m,forces_n,gravity_over_time,[air],air.wind,gusts,rotation_period_s,[damping]";
    let others =
        "branch_of,branch_joint,[[bodies]],[[joins]],[[nets]],tree =,heap =,strands =,[[copies]],rest-rotation";
    let contacts = "[[obstacles]],{ plane =,{ sphere =,{ capsule =,{ box =,{ cylinder =,{ mesh =,obstacles.motion,friction =,at_rest,\
                    restitution,[contact],[[sheaths]]";
    let features = [methods, makings, holds, loads, others, contacts].into_iter().flat_map(|all| all.split(','));
    let shapes = shapes.split(',').map(|shape| format!("shape.{shape}"));
    let missing: Vec<_> =
        features.map(str::to_owned).chain(shapes).filter(|feature| !texts.contains(feature.as_str())).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn a_case_is_read_back_as_it_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let with_files = (0..200).map(|index| draw(1, index)).find(|case| !case.files.is_empty()).unwrap();
    for (name, text) in &with_files.files {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let path = folder.path().join("case.toml");
    std::fs::write(&path, with_files.file()).unwrap();
    assert_eq!(Case::load(&path).unwrap(), with_files);
    std::fs::write(&path, "[[rods]]\n").unwrap();
    assert!(Case::load(&path).unwrap_err().to_string().contains("the first line must be"));
    assert!(Case::load(Path::new("nowhere.toml")).unwrap_err().to_string().contains("cannot read nowhere.toml"));
}

#[test]
fn a_scene_that_is_refused_says_why_and_breaks_nothing() {
    let text = "[[rods]]\nradius_m = -1\nshape.straight = { length_m = 1, segments = 2 }\n";
    let checked = check(&Case { text: text.to_owned(), files: Vec::new(), method: Method::default() });
    assert!(matches!(&checked, Checked::Refused(message) if message.contains("radius_m = -1")), "{checked:?}");
    assert_eq!(checked.breaks(Law::Energy), None);
}

/// A branch that is pressed against another less and less while `newton` iterates: bounds of friction that stayed were a hundred times
/// the normal force.
#[test]
fn friction_follows_a_normal_force_that_falls_within_a_step() {
    let text = "\
        bending = \"paper\"\n\
        contact.friction = { at_rest = 0.847, sliding = 0.283 }\n\
        run = { dt_s = 0.0197, steps = 20 }\n\
        [[rods]]\n\
        shape.straight = { direction = [0, 0, 1], length_m = 0.26, segments = 3 }\n\
        youngs_modulus_pa = 6180000.0\n\
        density_kg_m3 = 2070.0\n\
        radius_m = 0.00698\n\
        clamp = [\"start-face\"]\n\
        tree = { branches = 3, levels = 1, segments = 3, seed = 74 }\n";
    let method = Method { formulation: Formulation::Newton, ..Method::default() };
    let Checked::Ran(report) = check(&Case { text: text.to_owned(), files: Vec::new(), method }) else {
        panic!("refused")
    };
    assert!(report.violations.is_empty() && report.contacts > 0 && report.unsolved == 0, "{report:?}");
}

/// Steps whose last correction is small, and that are not solved: a rod led along its axis against a segment that is fixed, whose matrix has the stiffness of
/// a force that is not there, and a joint that turns past half a turn.
#[test]
fn a_small_correction_hides_no_residual() {
    let pressed = "\
        run = { steps = 12 }\n\
        [[obstacles]]\n\
        shape.cylinder = { start_m = [-0.00006, 0.009, -0.02], end_m = [-0.01, 0.0006, -0.02], radius_m = 0.002 }\n\
        [[rods]]\n\
        fixed_segments = [3]\n\
        radius_m = 0.001\n\
        youngs_modulus_pa = 200000000.0\n\
        shape.straight = { start_m = [-0.00122705, 0.01, 0.0007], length_m = 0.0431, segments = 7 }\n\
        [[rods.motions]]\n\
        at = \"start-segment\"\n\
        times_s = [0.0, 0.1]\n\
        velocities_m_s = [[-0.00355, 0.00644, 0.000885], [0.006, -0.003, 0.002]]\n";
    let turned = "\
        run = { dt_s = 0.044, steps = 30 }\n\
        contact = {}\n\
        [[rods]]\n\
        shape.helix = { height_m = 2.0, radius_m = 0.5, segments = 5, winding = 2.0 }\n\
        [[rods.loads]]\n\
        segment = -1\n\
        torque_n_m = [33.6, 1.0, -5.52]\n";
    for text in [pressed, turned] {
        let case = Case { text: text.to_owned(), files: Vec::new(), method: Method::default() };
        let Checked::Ran(report) = check(&case) else { panic!("refused") };
        assert!(report.violations.is_empty() && report.unsolved < report.steps / 2, "{report:?}");
    }
}

/// What a scene of `newton` with Euler's rule breaks, and how many of its steps are not solved.
fn broken(text: &str) -> (Vec<laws::Violation>, usize) {
    let case = Case { text: text.to_owned(), files: Vec::new(), method: Method::default() };
    let Checked::Ran(report) = check(&case) else { panic!("refused") };
    (report.violations, report.unsolved)
}

/// What an end face that turns by 9 degrees a step gives to a joint that is bent by nearly half a turn, and an eyelet that is led to a rod that runs through it.
#[test]
fn what_is_led_gives_energy_and_is_no_error() {
    let face = "\
        run = { dt_s = 0.007, steps = 40 }\n\
        [[rods]]\n\
        density_kg_m3 = 2000.0\n\
        youngs_modulus_pa = 200000000.0\n\
        shape.straight = { length_m = 2.0, segments = 1 }\n\
        [[rods.motions]]\n\
        at = \"start-face\"\n\
        times_s = [0.0, 0.2, 0.4]\n\
        turns_deg = [[0.0, 0.0, 0.0], [0.0, 250.0, 0.0], [0.0, 300.0, 0.0]]\n";
    let eyelet = "\
        run = { dt_s = 0.02, steps = 20 }\n\
        [[rods]]\n\
        name = \"r1\"\n\
        shape.helix = { height_m = 0.04, radius_m = 0.01, segments = 1, winding = 0.8 }\n\
        [[rods]]\n\
        name = \"r2\"\n\
        shape.straight = { length_m = 0.09, segments = 1 }\n\
        [[rods.motions]]\n\
        at = \"start-segment\"\n\
        times_s = [0.0, 0.2, 0.3]\n\
        turns_deg = [[0.0, 0.0, 0.0], [4.0, 20.0, 6.0], [-200.0, -200.0, -300.0]]\n\
        [[eyelets]]\n\
        at = { rod = \"r1\" }\n\
        on = { rod = \"r2\" }\n";
    for text in [face, eyelet] {
        assert_eq!(broken(text), (Vec::new(), 0));
    }
}

/// A rod on the rim of a cylinder that turns about all axes: the rim's edges turn with it.
#[test]
fn the_rim_of_a_cylinder_turns_with_it() {
    let text = "\
        run = { dt_s = 0.01, steps = 40 }\n\
        [[obstacles]]\n\
        shape.cylinder = { start_m = [0.35, 0.1, -1.0], end_m = [0.7, -0.08, -0.8], radius_m = 0.07 }\n\
        [obstacles.motion]\n\
        times_s = [0.0, 0.2]\n\
        angular_velocities_rad_s = [[5.0, -7.0, 4.0], [-5.32, -2.0, -3.0]]\n\
        [[rods]]\n\
        radius_m = 0.02\n\
        shape.straight = { start_m = [0.2, 0.2, -0.07], direction = [0.6, -0.5, -0.7], length_m = 1.0, segments = 2 }\n";
    assert_eq!(broken(text), (Vec::new(), 0));
}

/// A rod that breaks as it falls on its end: where its joints part, each of the two ends touches the plane, of which one stood for both before.
#[test]
fn pieces_touch_with_both_ends_where_they_part() {
    let text = "\
        [[obstacles]]\n\
        shape.plane = { point_m = [0, 0, -0.6] }\n\
        [[rods]]\n\
        section.ellipse = { width_m = 0.01, height_m = 0.007 }\n\
        shape.straight = { direction = [0, 0, -1], length_m = 0.4, segments = 3 }\n\
        strength = { curvature_per_m = 0.1 }\n";
    assert_eq!(broken(text), (Vec::new(), 0));
}

/// A plane that has stopped half-way through the step in which it meets a rod: the rod leaves by the speed at which they meet over the step.
#[test]
fn what_bounces_wins_no_more_than_the_work_of_the_obstacle() {
    let text = "\
        run = { dt_s = 0.02, steps = 20 }\n\
        [[obstacles]]\n\
        restitution = 0.9\n\
        shape.plane = { point_m = [0, 0, 0] }\n\
        motion = { times_s = [0.0, 0.05, 0.1], shifts_m = [[0, 0, 0], [0, 0, 0.1], [0, 0, 0.1]], interpolation = \"linear\" }\n\
        [[rods]]\n\
        radius_m = 0.01\n\
        shape.straight = { start_m = [0, 0, 0.11], direction = [1, 0, 0], length_m = 0.1, segments = 1 }\n";
    assert_eq!(broken(text), (Vec::new(), 0));
}

/// A stiff rod between two grips, which iterations of `xpbd` press on another one and take away again along another normal: all that a contact has
/// moved is taken back with it.
#[test]
fn a_contact_that_ends_within_a_step_leaves_no_momentum() {
    let text = "\
        contact = {}\n\
        run.dt_s = 0.008\n\
        [[rods]]\n\
        clamp = [\"end-segment\"]\n\
        radius_m = 0.02\n\
        shape.straight = { start_m = [-0.09, 0.05, -0.07], direction = [0, 0, -1], length_m = 0.4, segments = 1 }\n\
        [[rods]]\n\
        radius_m = 0.02\n\
        youngs_modulus_pa = 900000000.0\n\
        shape.straight = { start_m = [-0.126474, 0.09, -0.08], direction = [0, 0, -1], length_m = 0.5, segments = 2 }\n\
        [[rods.grips]]\n\
        at = \"end-face\"\n\
        [[rods.motions]]\n\
        at = \"start-face\"\n\
        times_s = [0.0, 0.08]\n\
        velocities_m_s = [[0.03, 0.007, 0.03], [-0.002, 0.04, 0.007]]\n";
    let method = Method { formulation: Formulation::Xpbd, integrator: Integrator::Euler, ..Method::default() };
    let Checked::Ran(report) = check(&Case { text: text.to_owned(), files: Vec::new(), method }) else {
        panic!("refused")
    };
    assert!(report.violations.is_empty() && report.unsolved < report.steps / 2, "{report:?}");
}

/// What is found in these scenes of a seed.
fn found(seed: u64, scenes: std::ops::Range<u64>, threads: usize) -> Found {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let tell = |failures: &[Failure]| {
        for Failure { index, drawn, case, minimal } in failures {
            println!("scene {index}: {drawn}; minimal: {minimal}\n{}", case.file());
        }
        true
    };
    pool.install(|| campaign(seed, scenes, &tell))
}

#[test]
fn what_is_found_does_not_depend_on_threads() {
    let one = found(2, 10..20, 1);
    assert_eq!(one.scenes, 10);
    assert_eq!(one, found(2, 10..20, 3));
}

#[test]
fn a_hundred_random_scenes_break_no_law() {
    let found = found(1, 0..100, 2);
    assert_eq!((found.scenes, found.failures), (100, 0), "{found:?}");
    // Most steps are solved, and contacts press.
    assert!(10 * found.unsolved_steps < found.steps && found.contacts > 500, "{found:?}");
}
