//! Equilibria against theory: bending, large deflection, twist, buckling.
//!
//! Rods are clamped at their first face, so that the tip's error is of second order in the segments' length.

use std::f64::consts::{PI, TAU};

use acceptance::reference::KirchhoffRod;
use acceptance::{Beam, assert_order, end_of, relaxed};
use cosserat::assembly::{Assembly, Load, Material, RestShape, RodSpec, Stretch, shape};
use cosserat::scene::{self, Scene};
use cosserat::simulation::{Formulation, Settings, Simulation};
use cosserat::state::{Body, JointForce, Model, State, measure};
use cosserat::statics::{StaticMethod, StaticParams, equilibrium};
use nalgebra::{UnitQuaternion, Vector3};

const DOWN: Vector3<f64> = Vector3::new(0.0, 0.0, -1.0);

fn tip_under(beam: &Beam, gravity: f64, force: Vector3<f64>, torque: Vector3<f64>) -> Vector3<f64> {
    let (mut assembly, rod) = beam.cantilever(DOWN * gravity);
    assembly.load(beam.end_load(&rod, force, torque));
    let (model, state) = relaxed(assembly);
    end_of(&model, &state, rod.end - 1)
}

#[test]
fn small_deflections_of_a_cantilever() {
    let zero = Vector3::zeros();
    // So small that the next term of theory (relative size a^2) is below the finest grid's error.
    let errors = |drop: &dyn Fn(&Beam) -> f64, exact: f64| {
        [25, 50, 100].map(|segments| drop(&Beam::rubber(segments)) / exact - 1.0)
    };
    let small = 1e-4;
    let load = errors(&|beam| -tip_under(beam, 0.0, DOWN * (small * beam.bending()), zero).z, small / 3.0);
    assert_order("small cantilever, P L^3 / 3B", &load, 2.0);
    assert!(load[2].abs() < 1e-4);
    let weight = errors(&|beam| -tip_under(beam, beam.gravity_for(small), zero, zero).z, small / 8.0);
    assert_order("small cantilever, rho g A L^4 / 8B", &weight, 2.0);
    assert!(weight[2].abs() < 2e-4);
}

/// Large deflections: within 0.5 % of L at N = 100, 0.1 % at N = 400, of second order.
fn large_deflection(case: &str, published: [f64; 2], force: f64, weight: f64) {
    let rod = KirchhoffRod::straight(1.0, 1.0, 1.0);
    let exact = KirchhoffRod { force: DOWN * force, line_load: DOWN * weight, ..rod }.tip().position;
    assert!((exact - Vector3::new(published[1], 0.0, -published[0])).norm() < 2e-5, "{case}: shooting gives {exact}");
    let errors = [50, 100, 200, 400].map(|segments| {
        let beam = Beam::rubber(segments);
        let force = DOWN * (force * beam.bending());
        (tip_under(&beam, beam.gravity_for(weight), force, Vector3::zeros()) - exact).norm()
    });
    assert_order(case, &errors, 2.0);
    assert!(errors[1] < 5e-3 && errors[3] < 1e-3, "{case}: {errors:?}");
}

#[test]
fn elastica_under_a_tip_load() {
    let published = [
        (1.0, 0.30172, 0.05643, 0.46135),
        (2.0, 0.49346, 0.16064, 0.78175),
        (5.0, 0.71379, 0.38763, 1.21537),
        (10.0, 0.81061, 0.55500, 1.43029),
    ];
    for (load, drop, shortening, angle) in published {
        large_deflection(&format!("elastica, P L^2 / B = {load}"), [drop, 1.0 - shortening], load, 0.0);
        let axis = KirchhoffRod { force: DOWN * load, ..KirchhoffRod::straight(1.0, 1.0, 1.0) }.tip().axis;
        assert!(((-axis.z).atan2(axis.x) - angle).abs() < 2e-5);
        let angles = [50, 100, 200].map(|segments| {
            let beam = Beam::rubber(segments);
            let (mut assembly, rod) = beam.cantilever(Vector3::zeros());
            assembly.load(beam.end_load(&rod, DOWN * (load * beam.bending()), Vector3::zeros()));
            let (_, state) = relaxed(assembly);
            (state.axis(rod.end - 1) - axis).norm()
        });
        println!("  its last segment's axis: errors {angles:.6?}");
        assert!(angles[2] < angles[0] && angles[2] < 1e-5);
    }
}

#[test]
fn heavy_cantilever() {
    let published = [
        (1.0, 0.12347, 0.99125),
        (5.0, 0.49591, 0.84666),
        (10.0, 0.70020, 0.65635),
        (20.0, 0.82988, 0.44523),
        (50.0, 0.90792, 0.24501),
        (100.0, 0.93752, 0.15922),
    ];
    for (weight, drop, reach) in published {
        large_deflection(&format!("heavy cantilever, rho g A L^3 / B = {weight}"), [drop, reach], 0.0, weight);
    }
}

#[test]
fn an_end_moment_rolls_a_rod_up_to_a_circle() {
    let gaps = [25, 50, 100, 200].map(|segments| {
        let beam = Beam::rubber(segments);
        tip_under(&beam, 0.0, Vector3::zeros(), Vector3::y() * (TAU * beam.bending() / beam.length)).norm()
    });
    assert!(gaps.iter().all(|gap| *gap < 1e-9), "{gaps:?}");
    assert!(gaps[2] < 1e-3);
}

/// Bathe and Bolourchi's bend (1979): R = 100, 45 degrees, a unit square with E = 1e7 and nu = 0, a force of 600 out of
/// the plane. Our sections are circles: this one has the square's bending stiffness E / 12, and its torsion modulus is
/// chosen so that T J is the square's G 0.1406 (Saint-Venant), G = E / 2. Neither stretches nor shears here, which moves
/// the tip by about F / (E A) = 6e-5 of the length.
///
/// The published tip, (15.79, 47.23, 53.37) of Simo and Vu-Quoc (1986), comes from eight straight elements. The exact
/// one, by shooting, lies 0.47 off it, which is 0.6 % of the length; so the tests of the solver rest on the exact one.
#[test]
fn the_45_degree_bend() {
    let (radius, youngs_modulus, force) = (100.0, 1e7, Vector3::new(0.0, 0.0, 600.0));
    let (bending, torsion) = (youngs_modulus / 12.0, 0.5 * youngs_modulus * 0.1406);
    let clamp = UnitQuaternion::rotation_between(&Vector3::z(), &Vector3::y()).expect("not opposite");
    let rod = KirchhoffRod {
        length: radius * PI / 4.0,
        clamp,
        curvature: clamp.inverse() * Vector3::new(0.0, 0.0, -1.0 / radius),
        force,
        ..KirchhoffRod::straight(1.0, bending, torsion)
    };
    let exact = rod.tip().position;
    let published = Vector3::new(15.79, 47.23, 53.37);
    println!(
        "45-degree bend: shooting {:.3?}, off the published tip by {:.3}",
        exact.as_slice(),
        (exact - published).norm()
    );
    assert!((exact - published).norm() < 7e-3 * rod.length);
    let section_radius = (1.0 / (3.0 * PI)).powf(0.25);
    let material = Material { youngs_modulus, torsion_modulus: 6.0 * torsion, density: 1.0 };
    let errors = [8, 16, 32, 64].map(|segments| {
        let node = |k: usize| {
            let angle = PI / 4.0 * k as f64 / segments as f64;
            radius * Vector3::new(1.0 - angle.cos(), angle.sin(), 0.0)
        };
        let mut assembly = Assembly::new(Vector3::zeros());
        let rod = assembly.rod(&RodSpec::new((0..=segments).map(node).collect(), section_radius, material));
        assembly.clamp_start(&rod);
        let offset = 0.5 * assembly.model_mut().segments[rod.end - 1].length;
        assembly.load(Load { segment: rod.end - 1, offset, force, torque: Vector3::zeros(), follows: false });
        let (model, state) = relaxed(assembly);
        let tip = end_of(&model, &state, rod.end - 1);
        println!("  N = {segments}: {:.3?}", tip.as_slice());
        (tip - exact).norm()
    });
    assert_order("45-degree bend, tip against shooting", &errors, 2.0);
    assert!(errors[1] < 5e-3 * rod.length && errors[3] < 5e-4 * rod.length);
}

/// Each joint turns by theta with `theta = l T / C`, so that the angle at the last segment's centre is that of theory.
#[test]
fn uniform_twist() {
    let angle = 2.0;
    for segments in [1, 10, 20, 40] {
        let beam = Beam::rubber(segments);
        let torque = angle * beam.torsion() / beam.length;
        let (mut assembly, rod) = beam.cantilever(Vector3::zeros());
        assembly.load(beam.end_load(&rod, Vector3::zeros(), Vector3::x() * torque));
        let (model, state) = relaxed(assembly);
        let mut total = 0.0;
        for joint in &model.joints {
            let (a, b) = (model.pose(joint.a, &state), model.pose(joint.b, &state));
            let turn = (a.orientation.inverse() * b.orientation).scaled_axis();
            assert!(turn.xy().norm() < 1e-10);
            assert!((turn.z - joint.length * torque / beam.torsion()).abs() < 1e-10, "twist {}", turn.z);
            total += turn.z;
        }
        let expected = angle * (1.0 - 0.5 * beam.segment_length() / beam.length);
        assert!((total - expected).abs() < 1e-9, "{segments} segments: {total} for {expected} rad");
    }
}

/// Largest distance from the line of the unloaded rod, across it.
fn deflection(state: &State, axis: Vector3<f64>) -> f64 {
    state.positions.iter().map(|x| (x - axis * axis.dot(x)).norm()).fold(0.0, f64::max)
}

/// The threshold lies within `margin` of 1: a rod stays straight below it and buckles above it.
fn bracket(case: &str, margin: f64, straight: f64, buckled: f64, deflection: impl Fn(f64) -> f64) {
    let (below, above) = (deflection(1.0 - margin), deflection(1.0 + margin));
    println!("{case}: deflection {below:.2e} at {}, {above:.2e} at {} of theory", 1.0 - margin, 1.0 + margin);
    assert!(below < straight, "{case}: buckled below the threshold, by {below}");
    assert!(above > buckled, "{case}: still straight above the threshold, {above}");
}

#[test]
fn euler_buckling_of_a_cantilever() {
    let deflected = |segments: usize| {
        move |ratio: f64| {
            let beam = Beam::rubber(segments);
            let load = ratio * PI.powi(2) * beam.bending() / (4.0 * beam.length.powi(2));
            let (mut assembly, rod) = beam.cantilever(Vector3::zeros());
            let force = Vector3::new(-load, 0.0, 1e-6 * load);
            assembly.load(beam.end_load(&rod, force, Vector3::zeros()));
            deflection(&relaxed(assembly).1, Vector3::x())
        }
    };
    bracket("Euler, cantilever, N = 20", 0.02, 1e-3, 0.2, deflected(20));
    bracket("Euler, cantilever, N = 50", 0.005, 1e-3, 0.1, deflected(50));
}

/// Columns between two ends that approach each other until the compressive force Y A e reaches the critical load; the
/// ends' faces are held, or turn freely about everything but the axis.
#[test]
fn euler_buckling_between_two_ends() {
    for (case, factor, held) in [("clamped", 4.0, true), ("pinned", 1.0, false)] {
        let beam = Beam::rubber(50);
        // Y A e = P with I / A = r^2 / 4.
        let critical = factor * PI.powi(2) * beam.radius.powi(2) / (4.0 * beam.length.powi(2));
        // What is left of the approach shortens the sine: amplitude 2 / pi sqrt(excess).
        let buckled = 2.0 / PI * (0.02 * critical).sqrt();
        bracket(&format!("Euler, both ends {case}, N = 50"), 0.02, 1e-4, 0.9 * buckled, |ratio| {
            let mut assembly = Assembly::new(Vector3::zeros());
            let spec = beam.spec(Vector3::zeros(), Vector3::x());
            let rod = assembly.rod(&RodSpec { stretch: Stretch::Physical, ..spec });
            assembly.clamp_start(&rod).clamp_end(&rod);
            let strain = ratio * critical;
            for position in &mut assembly.state_mut().positions {
                position.x *= 1.0 - strain;
            }
            let model = assembly.model_mut();
            model.anchors[1].position.x *= 1.0 - strain;
            if !held {
                let count = model.joints.len();
                for joint in &mut model.joints[count - 2..] {
                    joint.bend_compliance *= 1e9;
                }
            }
            let force = Vector3::z() * (1e-5 * beam.bending() / beam.length.powi(2));
            assembly.load(Load { segment: 25, offset: 0.0, force, torque: Vector3::zeros(), follows: false });
            deflection(&relaxed(assembly).1, Vector3::x())
        });
    }
}

#[test]
fn self_buckling_of_a_heavy_column() {
    let deflected = |segments: usize| {
        move |ratio: f64| {
            let beam = Beam::rubber(segments);
            let gravity = beam.gravity_for(7.837 * ratio);
            let mut assembly = Assembly::new(DOWN * gravity);
            let rod = assembly.rod(&beam.spec(Vector3::zeros(), Vector3::z()));
            assembly.clamp_start(&rod);
            assembly.load(beam.end_load(&rod, Vector3::x() * (1e-6 * beam.bending()), Vector3::zeros()));
            deflection(&relaxed(assembly).1, Vector3::z())
        }
    };
    bracket("self-buckling, N = 20", 0.02, 1e-3, 0.2, deflected(20));
    bracket("self-buckling, N = 50", 0.005, 1e-3, 0.1, deflected(50));
}

/// A closed ring, straight without load, whose ends were turned by one full turn before they were joined, leaves its
/// plane when that exceeds 2 pi sqrt(3) B / C, here when C / B exceeds sqrt(3) (Michell 1889).
#[test]
fn michells_ring() {
    let out_of_plane = |segments: usize| {
        move |ratio: f64| {
            let mut beam = Beam::rubber(segments);
            // C / B = 2 T / Y.
            beam.material.torsion_modulus = 0.5 * 3.0_f64.sqrt() * ratio * beam.material.youngs_modulus;
            let nodes = shape::ring(Vector3::zeros(), 1.0, segments);
            let mut assembly = Assembly::new(Vector3::zeros());
            assembly.rod(&RodSpec {
                closed: true,
                // The seam's joint twists as much as the others.
                twist: TAU * (segments - 1) as f64 / segments as f64,
                rest: RestShape::Straight,
                ..RodSpec::new(nodes, beam.radius, beam.material)
            });
            for (i, position) in assembly.state_mut().positions.iter_mut().enumerate() {
                position.z += 1e-4 * (2.0 * TAU * i as f64 / segments as f64).cos();
            }
            let (model, state) = relaxed(assembly);
            assert!(measure::worst_gap(&model, &state) < 1e-6);
            deflection_from_plane(&state)
        }
    };
    bracket("Michell's ring, N = 40", 0.02, 1e-4, 0.05, out_of_plane(40));
    bracket("Michell's ring, N = 80", 0.01, 1e-4, 0.05, out_of_plane(80));
}

/// Largest distance of a segment from the best plane through all of them.
fn deflection_from_plane(state: &State) -> f64 {
    let count = state.len() as f64;
    let centre = state.positions.iter().sum::<Vector3<f64>>() / count;
    let spread =
        state.positions.iter().map(|x| (x - centre) * (x - centre).transpose()).sum::<nalgebra::Matrix3<f64>>();
    let eigen = spread.symmetric_eigen();
    let normal = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    state.positions.iter().map(|x| normal.dot(&(x - centre)).abs()).fold(0.0, f64::max)
}

/// A beam of weight w between a clamp and a pin: the pin bears 3/8 of the load (Euler and Bernoulli), the sag between two hinges
/// is `5 w L^4 / (384 B)`.
#[test]
fn beams_on_pins_and_hinges_sag_as_theory_says() {
    let parse = |grips: &str| {
        scene::parse(
            &format!(
                "gravity_m_s2 = [0, 0, -0.01]\n[[rods]]\nradius_m = 0.01\nyoungs_modulus_pa = 2e9\ntorsion_modulus_pa = 8e8\n\
                 density_kg_m3 = 1000\nstretch = \"physical\"\nshape.straight = {{ length_m = 1, segments = 100 }}\n{grips}"
            ),
            "beam.toml",
        )
        .unwrap()
    };
    let grip = |at: &str, joint: &str| format!("[[rods.grips]]\nat = \"{at}-face\"\n{joint}\n");
    let (ball, hinge) = ("joint = \"ball\"", "joint = \"hinge\"\naxis = [0, 1, 0]");
    let (area, bending) = (std::f64::consts::PI * 1e-4, 2e9 * std::f64::consts::PI * 1e-8 / 4.0);
    let sag = 5.0 * 1000.0 * area * 0.01 / (384.0 * bending);
    for (joint, share) in [(ball, 1.0), (hinge, 1.0), ("", 0.2)] {
        let scene = parse(&(grip("start", joint) + &grip("end", joint)));
        let mut state = scene.state.clone();
        let report = equilibrium(&scene.model, &mut state, &StaticParams::default()).unwrap();
        assert!(report.converged && report.stable == Some(true), "{joint}: {report:?}");
        let found = -state.positions.iter().map(|x| x.z).fold(0.0, f64::min);
        println!("{joint}: {found} m in {} solves, theory {} m", report.steps, share * sag);
        // Shear adds 4e-3 between clamps.
        assert!((found / (share * sag) - 1.0).abs() < 5e-3, "{joint}: {found} m");
        assert!(report.steps < 20, "{joint}: {} solves", report.steps);
    }
}

/// A mooring line of 850 m from an anchor on the sea bed, EA 3.27e9 N: the elastic catenary's T = 2.43639e6 N at its upper end,
/// whatever its bending stiffness and its segments.
#[test]
fn a_mooring_line_on_the_sea_bed_pulls_as_the_elastic_catenary() {
    for (segments, bending) in [(50, 1e3), (100, 1e3), (100, 1e6), (200, 1e8)] {
        let text = format!(
            "gravity_m_s2 = [0, 0, -9.81]\n[[obstacles]]\nshape.plane = {{ point_m = [0, 0, -200.1665] }}\n[[rods]]\n\
             radius_m = 0.1665\nstretch = \"physical\"\nsection.stiffness = {{ bending_n_m2 = [{bending}, {bending}], torsion_n_m2 \
             = {bending}, mass_kg_m = 595.7306826354959, stretch_n = 3.27e9, shear_n = 3.27e9 }}\nshape.hung = {{ from_m = \
             [-837.6, 0, -200], to_m = [-58, 0, -14], length_m = 850, segments = {segments} }}\nrest_length_m = 850\n\
             [[rods.grips]]\nat = \"start-face\"\njoint = \"ball\"\n[[rods.grips]]\nat = \"end-face\"\njoint = \"ball\"\n"
        );
        let scene = scene::parse(&text, "mooring.toml").unwrap();
        let mut state = scene.state.clone();
        let report = equilibrium(&scene.model, &mut state, &StaticParams::default()).unwrap();
        assert!(report.converged, "{segments} segments, B = {bending:e} N m^2: {report:?}");
        // The force of the last joint follows from a step of the simulation that begins at rest.
        let forces = rest_forces(&scene.model, &state);
        let tension = forces.iter().map(|given| given.force.norm()).fold(0.0, f64::max);
        println!("{segments} segments, B = {bending:e}: {tension} N, {} solves", report.steps);
        assert!((tension / 2.43639e6 - 1.0).abs() < 3e-3, "{segments} segments, B = {bending:e} N m^2: {tension} N");
    }
}

/// What joints transmit in a state at rest, after a step that is too short for anything to move.
fn rest_forces(model: &Model, state: &State) -> Vec<JointForce> {
    let mut settings = Settings::default();
    settings.step.formulation = Formulation::Newton;
    let mut simulation = Simulation::new(model, state, &settings, None).unwrap();
    simulation.step(1e-4).unwrap();
    let mut forces = vec![JointForce::default(); model.joints.len()];
    simulation.store_joint_forces(&mut forces);
    forces
}

/// A cable that is drawn 0.5 m into the floor lies on it at rest.
#[test]
fn a_slack_line_that_starts_below_the_floor_comes_to_rest_on_it() {
    let scene = scene::parse(
        "[[obstacles]]\nshape.plane = { point_m = [0, 0, -0.5] }\n[[rods]]\nradius_m = 0.01\n\
         youngs_modulus_pa = 1e8\ndensity_kg_m3 = 1200\nclamp = [\"start-face\", \"end-face\"]\nshape.hung = { to_m = [4, 0, 0], \
         length_m = 5, segments = 80 }\n",
        "slack.toml",
    )
    .unwrap();
    let mut state = scene.state.clone();
    let report = equilibrium(&scene.model, &mut state, &StaticParams::default()).unwrap();
    println!("{} solves", report.steps);
    assert!(report.converged, "{report:?}");
    let lowest = state.positions.iter().map(|x| x.z).fold(0.0, f64::min);
    assert!((lowest + 0.49).abs() < 1e-4, "{lowest} m");
    let weight: f64 = scene.model.segments.iter().map(|segment| segment.mass() * 9.81).sum();
    let borne: f64 = report.contacts.iter().map(|contact| contact.force.z).sum();
    assert!(borne > 0.1 * weight && borne < weight, "{borne} of {weight} N");
}

/// The pull at a grip on springs is the same whether these differ or not.
#[test]
fn springs_that_differ_tell_the_pull_of_their_rod() {
    for ends in ["start", "end"] {
        let pulls = ["1e4, 1e4", "1e4, 2e4"].map(|stiffness| {
            let text = format!(
                "[[rods]]\nradius_m = 0.01\nyoungs_modulus_pa = 4e7\ndensity_kg_m3 = 1000\n\
                 shape.straight = {{ direction = [0, 0, {}], length_m = 1, segments = 10 }}\n\
                 grips = [{{ at = \"{ends}-face\", stiffness_n_m = [{stiffness}] }}]",
                if ends == "start" { -1 } else { 1 }
            );
            let Scene { model, mut state, .. } = scene::parse(&text, "cable.toml").unwrap();
            let report = equilibrium(&model, &mut state, &StaticParams::default()).unwrap();
            assert!(report.converged);
            let held =
                |joint: &&cosserat::state::Joint| [joint.a, joint.b].iter().any(|body| matches!(body, Body::Anchor(_)));
            let (k, joint) = model.joints.iter().enumerate().find(|(_, joint)| held(joint)).unwrap();
            report.forces[k].tension(&model, &state, joint)
        });
        let weight = PI * 1e-4 * 1000.0 * 9.81;
        assert!(pulls.iter().all(|pull| (pull / weight - 1.0).abs() < 1e-6), "{ends}: {pulls:?} N, {weight} N");
    }
}

/// A rod that nothing but the wind bends.
#[test]
fn wind_alone_bends_a_rod() {
    let text = "gravity_m_s2 = [0, 0, 0]\nair.wind = { velocity_m_s = [0, 3, 0] }\n[[rods]]\nradius_m = 0.01\nclamp = [\"start-face\"]\n\
                shape.straight = { length_m = 1, segments = 20 }";
    let Scene { model, state, .. } = scene::parse(text, "wind.toml").unwrap();
    let tips = [StaticMethod::Newton, StaticMethod::Flow].map(|method| {
        let mut end = state.clone();
        assert!(equilibrium(&model, &mut end, &StaticParams { method, ..StaticParams::default() }).unwrap().converged);
        end_of(&model, &end, 19)
    });
    assert!(tips[0].y > 0.5 && (tips[0] - tips[1]).norm() < 1e-3, "{tips:?}");
}
