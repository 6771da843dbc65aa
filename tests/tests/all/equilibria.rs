//! How equilibria are found: few solves, the same shapes as by the flow, and whether they are stable.

use acceptance::Beam;
use cosserat::assembly::{Assembly, Load, RodSpec, shape};
use cosserat::scene::{self, Scene};
use cosserat::state::{Model, State};
use cosserat::statics::{StaticError, StaticMethod, StaticParams, StaticReport, equilibrium};
use nalgebra::Vector3;

fn found(model: &Model, state: &State, params: StaticParams) -> (State, StaticReport) {
    let mut end = state.clone();
    let report = equilibrium(model, &mut end, &params).unwrap();
    assert!(report.converged, "{report:?}");
    (end, report)
}

/// Ten solves and more are saved; both are at rest to 1e-9 of a segment, which is as far as the slowest motion lets them
/// agree.
#[test]
fn newton_and_the_flow_agree_and_newton_takes_few_solves() {
    for (name, in_air, most) in [
        ("helix", true, 15),
        ("hung-cable", true, 8),
        ("elastica", true, 8),
        ("branch", true, 15),
        ("tree-10", false, 12),
        ("tree-10", true, 100),
    ] {
        let Scene { mut model, state, .. } = scene::builtin(name).unwrap();
        if !in_air {
            model.air = None;
        }
        let (newton, report) = found(&model, &state, StaticParams::default());
        assert_eq!(report.stable, Some(true), "{name}");
        assert!(report.steps <= most, "{name}, air {in_air}: {} solves", report.steps);
        let (flow, slow) =
            found(&model, &state, StaticParams { method: StaticMethod::Flow, ..StaticParams::default() });
        assert_eq!(slow.stable, None, "{name}");
        println!("{name}, air {in_air}: {} solves in {} loops, the flow {}", report.steps, report.loops, slow.steps);
        assert!(report.most_in_loop <= 15, "{name}, air {in_air}: {} solves in a loop", report.most_in_loop);
        assert_eq!(report.loops > 1, name == "tree-10" && in_air, "{name}, air {in_air}: {} loops", report.loops);
        assert!(2 * report.steps < slow.steps, "{name}: {} solves, the flow {}", report.steps, slow.steps);
        let length: f64 = model.segments.iter().map(|segment| segment.length).sum();
        for (a, b) in newton.positions.iter().zip(&flow.positions) {
            assert!((a - b).norm() < 1e-6 * length, "{name}, air {in_air}: {a}, not {b}");
        }
    }
}

/// A column that stands exactly straight: beyond Greenhill's load `rho g A L^3 / B = 7.837` it is an equilibrium all the same.
#[test]
fn a_straight_column_is_said_to_be_unstable_or_left() {
    let beam = Beam::rubber(20);
    let column = |ratio: f64| {
        let mut assembly = Assembly::new(Vector3::z() * -beam.gravity_for(7.837 * ratio));
        let rod = assembly.rod(&beam.spec(Vector3::zeros(), Vector3::z()));
        assembly.clamp_start(&rod);
        assembly.finish()
    };
    let aside = |state: &State| state.positions.iter().map(|x| x.xy().norm()).fold(0.0, f64::max);
    for (ratio, leave_unstable, stable, leaves) in
        [(0.98, true, true, false), (0.98, false, true, false), (1.02, false, false, false), (1.02, true, true, true)]
    {
        let (model, state) = column(ratio);
        let (end, report) = found(&model, &state, StaticParams { leave_unstable, ..StaticParams::default() });
        assert_eq!(report.stable, Some(stable), "{ratio} {leave_unstable}");
        let aside = aside(&end);
        assert!(if leaves { aside > 0.2 } else { aside < 1e-6 }, "{ratio} {leave_unstable}: {aside}");
    }
}

/// Beyond Euler's load of a cantilever, `pi^2 B / 4 L^2`.
#[test]
fn a_push_beyond_eulers_load_is_left_for_the_bent_shape() {
    let beam = Beam::rubber(20);
    for (ratio, leave_unstable, stable) in [(0.98, false, true), (1.02, false, false), (1.02, true, true)] {
        let load = ratio * std::f64::consts::PI.powi(2) * beam.bending() / (4.0 * beam.length.powi(2));
        let (mut assembly, rod) = beam.cantilever(Vector3::zeros());
        assembly.load(beam.end_load(&rod, Vector3::x() * -load, Vector3::zeros()));
        let (model, state) = assembly.finish();
        let (_, report) = found(&model, &state, StaticParams { leave_unstable, ..StaticParams::default() });
        assert_eq!(report.stable, Some(stable), "{ratio}");
    }
}

#[test]
fn nothing_is_said_of_the_stability_of_several_loops_and_of_torques() {
    let mut rings = Assembly::new(Vector3::zeros());
    let material = Beam::rubber(1).material;
    let [one, other] = [0.0, 1.0].map(|x| {
        let nodes = shape::ring(Vector3::new(x, 0.0, 0.0), 0.5, 14);
        rings.rod(&RodSpec { closed: true, ..RodSpec::new(nodes, 0.03, material) })
    });
    rings.branch(one.start, 0.5, &other);
    let (model, state) = rings.finish();
    assert_eq!(found(&model, &state, StaticParams::default()).1.stable, None);

    let (mut assembly, rod) = Beam::rubber(10).cantilever(Vector3::zeros());
    let torque = Vector3::y() * 1e-3;
    assembly.load(Load { segment: rod.end - 1, offset: 0.0, force: Vector3::zeros(), torque, follows: false });
    let (model, state) = assembly.finish();
    assert_eq!(found(&model, &state, StaticParams::default()).1.stable, None);
}

/// What nothing holds has an equilibrium where forces are in balance, and one clear error where they are not.
#[test]
fn what_is_driven_off_is_refused_and_what_floats_is_not() {
    let beam = Beam::rubber(10);
    let free = |gravity: f64, forces: &[f64]| {
        let mut assembly = Assembly::new(Vector3::z() * gravity);
        let rod = assembly.rod(&beam.spec(Vector3::zeros(), Vector3::x()));
        for (&force, segment) in forces.iter().zip([rod.start, rod.end - 1]) {
            assembly.load(Load {
                segment,
                offset: 0.0,
                force: Vector3::x() * force,
                torque: Vector3::zeros(),
                follows: false,
            });
        }
        let (model, mut state) = assembly.finish();
        equilibrium(&model, &mut state, &StaticParams::default())
    };
    for (gravity, forces) in [(-9.81, &[][..]), (0.0, &[1.0]), (0.0, &[-1e-3, 2e-3])] {
        let error = free(gravity, forces).unwrap_err();
        assert!(matches!(error, StaticError::DrivenOff { segment: 0 }), "{error}");
    }
    for forces in [&[][..], &[-1e-3, 1e-3]] {
        let report = free(0.0, forces).unwrap();
        assert!(report.converged && report.stable == Some(true), "{report:?}");
    }
}
