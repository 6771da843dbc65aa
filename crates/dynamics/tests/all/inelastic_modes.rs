//! Modes of rods whose joints are not elastic, against elastic rods, closed forms and small oscillations in time.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;
use rod::measure::bend_strain;
use rod::{
    Assembly, InnerDamping, Integrator, Joint, JointLaw, Material, MaxwellBranch, Model, MomentTable, RodSpec, State,
    StrainMeasure, StrandFriction, Unloading, shape,
};
use statics::modes::{Mode, modes};
use statics::{StaticParams, equilibrium};

use crate::inelastic::{LENGTH, RADIUS, SEGMENTS, WIRE, bending, cantilever, plastic, run, settings, table};

/// Its weight bends a wire of this material at the clamp by 0.49 N m.
const HEAVY: Material = Material { density: 8000.0, ..WIRE };

/// A straight wire along x, clamped at its start, that droops under its weight.
pub(crate) fn drooping(law: Option<&JointLaw>) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let nodes = shape::straight(Vector3::zeros(), Vector3::x(), LENGTH, SEGMENTS);
    let rod = assembly.rod(&RodSpec { laws: law.into_iter().cloned().collect(), ..RodSpec::new(nodes, RADIUS, HEAVY) });
    assembly.clamp_start(&rod);
    assembly.finish()
}

fn lowest(model: &Model, state: &mut State, count: usize) -> Vec<Mode> {
    let found = modes(model, state, count, &StaticParams::default()).unwrap();
    assert!(found.equilibrium.converged && found.modes.len() == count);
    found.modes
}

fn assert_same(found: &[Mode], expected: &[Mode], tolerance: f64) {
    for (k, (found, expected)) in found.iter().zip(expected).enumerate() {
        let off = found.frequency() / expected.frequency() - 1.0;
        println!("mode {k}: {} Hz, expected {} Hz, off by {off:e}", found.frequency(), expected.frequency());
        assert!(off.abs() < tolerance, "mode {k}: {} Hz of {} Hz", found.frequency(), expected.frequency());
    }
}

#[test]
fn a_yielded_wire_has_the_modes_of_the_elastic_wire_of_its_shape() {
    let most = 0.9;
    for direction in [Vector3::y(), Vector3::new(0.4, 0.8, 0.0)] {
        let torque = [0.0, most, most, 0.0, 0.0].map(|m| direction * m);
        let track: Vec<_> = [0.0, 2.0, 3.0, 5.0, 7.0].into_iter().zip(torque).collect();
        let case = cantilever(&plastic(0.04, 0.06), &track, 0.005);
        let (_, released) = run(&case, &settings(Integrator::Bdf2), (0.02, 350), |_, _| {});
        let mut model = case.0;
        (model.loads, model.changes) = (Vec::new(), Vec::new());
        let mut state = released.clone();
        let found = lowest(&model, &mut state, 8);
        let kept = state.internals.iter().zip(&released.internals).all(|(now, then)| now.parts == then.parts);
        assert!(kept, "small vibrations do not yield");
        let mut elastic = model.clone();
        elastic.laws.clear();
        for joint in &mut elastic.joints {
            set_further(joint, &bend_strain(&model, &state, joint));
        }
        state.internals.clear();
        assert!(elastic.joints[SEGMENTS / 2].rest_darboux.norm() > 1.0, "{direction}: it has yielded");
        assert_same(&found, &lowest(&elastic, &mut state, 8), 1e-3);
        let straight = cantilever(&plastic(0.04, 0.06), &[(0.0, Vector3::zeros())], 0.0);
        let others = lowest(&straight.0, &mut straight.1.clone(), 8);
        assert!((others[1].frequency() / found[1].frequency() - 1.0).abs() > 0.01, "the shape counts");
    }
}

/// Between two grips that bend it to a curvature in the plane of z.
fn arched(law: &JointLaw, curvature: f64, segments: usize) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::zeros());
    let nodes = (0..=segments).map(|k| LENGTH * curvature * k as f64 / segments as f64);
    let nodes = nodes.map(|turn| Vector3::new(turn.sin(), 0.0, turn.cos() - 1.0) / curvature).collect();
    let rest = rod::RestShape::Straight;
    let rod = assembly.rod(&RodSpec { laws: vec![law.clone()], rest, ..RodSpec::new(nodes, RADIUS, HEAVY) });
    assembly.clamp_start(&rod).clamp_end(&rod);
    assembly.finish()
}

#[test]
fn a_wire_on_a_table_has_the_frequency_of_its_slope() {
    // Bent so little that it is a straight beam, in the plane with the slope of the table and across it with moment over curvature. Its second mode in
    // the plane keeps its length.
    let (stiffness, curvature) = (bending(), 0.015);
    let points = vec![[0.01, 0.01 * stiffness], [0.02, 0.014 * stiffness]];
    let law = JointLaw::Tabulated(MomentTable { points, unloading: Unloading::Elastic });
    let (model, mut state) = arched(&law, curvature, 200);
    let found = lowest(&model, &mut state, 6);
    let slope = 0.4 * stiffness;
    let secant = (0.01 + 0.4 * 0.005) / 0.015 * stiffness;
    let density = HEAVY.density * PI * RADIUS * RADIUS;
    let hertz = |beta: f64, stiffness: f64| beta * beta * (stiffness / density).sqrt() / (LENGTH * LENGTH) / TAU;
    for (what, expected) in [
        ("first across", hertz(4.730_040_744_9, secant)),
        ("second in the plane", hertz(7.853_204_624_1, slope)),
        ("second across", hertz(7.853_204_624_1, secant)),
    ] {
        let off = |mode: &Mode| (mode.frequency() / expected - 1.0).abs();
        let nearest = found.iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
        println!("{what}: {} Hz, theory {expected} Hz, off by {:e}", nearest.frequency(), off(nearest));
        assert!(off(nearest) < 1e-3, "{what}: {} Hz of {expected} Hz", nearest.frequency());
    }
}

#[test]
fn a_relaxed_wire_swings_with_its_unrelaxed_stiffness() {
    let branches = vec![MaxwellBranch { share: 0.3, time: 0.5 }, MaxwellBranch { share: 0.2, time: 3.0 }];
    let law = JointLaw::Viscoelastic(branches);
    let straight = |law: Option<&JointLaw>| {
        let (mut model, state) = drooping(law);
        model.gravity = Vector3::zeros();
        (model, state)
    };
    let (model, mut state) = straight(Some(&law));
    let found = lowest(&model, &mut state, 6);
    let (elastic, mut of_elastic) = straight(None);
    assert_same(&found, &lowest(&elastic, &mut of_elastic, 6), 1e-9);
    // Half the loss factor of the standard linear solid, with the unrelaxed modulus below.
    for mode in &found {
        let omega = mode.squared.sqrt();
        let expected = 0.5 * (0.3 * omega * 0.5 / (1.0 + (0.5 * omega).powi(2)))
            + 0.5 * (0.2 * omega * 3.0 / (1.0 + (3.0 * omega).powi(2)));
        println!("damping ratio {}, theory {expected}", mode.damping);
        assert!((mode.damping / expected - 1.0).abs() < 1e-3, "{} of {expected}", mode.damping);
    }
    // Under its weight the moments are those that last.
    let (model, mut state) = drooping(Some(&law));
    let found = lowest(&model, &mut state, 6);
    let mut softer = drooping(None);
    for joint in &mut softer.0.joints {
        for compliance in [&mut joint.bend_compliance, &mut joint.twist_compliance] {
            *compliance /= 0.5;
        }
    }
    assert!(equilibrium(&softer.0, &mut softer.1, &StaticParams::default()).unwrap().converged);
    let mut elastic = drooping(None).0;
    for joint in &mut elastic.joints {
        set_further(joint, &(bend_strain(&elastic_copy(&model), &softer.1, joint) * 0.5));
    }
    assert_same(&found, &lowest(&elastic, &mut softer.1, 6), 1e-6);
}

/// Lets a joint's strain at rest be so much more.
fn set_further(joint: &mut Joint, strain: &Vector3<f64>) {
    let rest = StrainMeasure::Angle.at_rest(&joint.rest_darboux, joint.length) + strain;
    joint.rest_darboux = StrainMeasure::Angle.darboux_of(&rest, joint.length);
}

/// The model without its laws.
fn elastic_copy(model: &Model) -> Model {
    Model { laws: Vec::new(), ..model.clone() }
}

#[test]
fn inner_damping_is_measured_with_the_elastic_stiffness() {
    // Strands that stick have 3 times the stiffness: the damping ratio is `tau omega / 2` of the elastic third.
    let law = JointLaw::Friction(StrandFriction { moment: 0.5, stiffness: 2.0 * bending() });
    let (mut model, mut state) = drooping(Some(&law));
    model.gravity = Vector3::zeros();
    for joint in &mut model.joints {
        joint.inner_damping = InnerDamping { bending: 0.01, ..InnerDamping::NONE };
    }
    for mode in lowest(&model, &mut state, 6) {
        let expected = 0.01 * mode.squared.sqrt() / 2.0 / 3.0;
        println!("damping ratio {}, theory {expected}", mode.damping);
        assert!((mode.damping / expected - 1.0).abs() < 1e-3, "{} of {expected}", mode.damping);
    }
}

/// Frequency [Hz] of a small oscillation by a mode, by the times at which it passes through its middle in the fifth period: before, a weight
/// may pull joints on a little.
fn swung(model: &Model, rest: &State, mode: &Mode, amplitude: f64) -> f64 {
    let start = mode.displaced(rest, amplitude);
    let along = |state: &State| -> f64 {
        let shift = |k: usize| (state.positions[k] - rest.positions[k]).dot(&mode.shifts[k]);
        (0..rest.len()).map(shift).sum()
    };
    let a_period = 400;
    let dt = 1.0 / (mode.frequency() * f64::from(a_period));
    let first = 4.0 * f64::from(a_period) * dt;
    let mut settings = settings(Integrator::Bdf2);
    settings.step.motion_tolerance *= 1e-4;
    settings.step.relative_tolerance *= 1e-4;
    let mut seen = Vec::new();
    run(&(model.clone(), start), &settings, (dt, 6 * a_period as usize), |time, state| {
        if time > first {
            seen.push((time, along(state)));
        }
    });
    let of = |pick: fn(f64, f64) -> f64| seen.iter().map(|(_, x)| *x).reduce(pick).unwrap();
    let middle = 0.5 * (of(f64::min) + of(f64::max));
    let passed = seen.windows(2).filter(|pair| (pair[0].1 - middle) * (pair[1].1 - middle) < 0.0).map(|pair| {
        let [(t0, x0), (t1, x1)] = [pair[0], pair[1]];
        t0 + (t1 - t0) * (middle - x0) / (x1 - x0)
    });
    let passed: Vec<f64> = passed.collect();
    1.0 / (passed[2] - passed[0])
}

#[test]
fn a_small_oscillation_in_time_has_the_frequency_of_the_mode() {
    let laws = [
        plastic(0.05, 0.05),
        JointLaw::Friction(StrandFriction { moment: 0.2, stiffness: 2.0 }),
        table(Unloading::Elastic),
        table(Unloading::Masing),
    ];
    for law in laws {
        let (mut model, mut state) = drooping(Some(&law));
        // Strands that are bent slip on one way more easily than on the other; those that are not stick alike.
        model.gravity *= match law {
            JointLaw::Plastic(_) => 1.5,
            JointLaw::Friction(_) => 0.0,
            _ => 1.0,
        };
        let found = lowest(&model, &mut state, 2);
        let loses = matches!(law, JointLaw::Plastic(_)) || law == table(Unloading::Masing);
        assert!(state.internals.iter().any(|at| at.dissipated > 1e-6) == loses, "{law:?}");
        for mode in &found {
            // So little that strands stick and slopes stay.
            let amplitude = 1e-5 / mode.largest()[0];
            let expected = swung(&model, &state, mode, amplitude);
            let off = mode.frequency() / expected - 1.0;
            println!("{law:?}: {} Hz, in time {expected} Hz, off by {off:e}", mode.frequency());
            assert!(off.abs() < 2e-3, "{law:?}: {} Hz of {expected} Hz", mode.frequency());
        }
    }
}
