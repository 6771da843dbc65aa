//! Equilibria, and paths of equilibria, of rods whose joints are not elastic: closed forms, and what a run comes to.

use std::sync::Arc;

use nalgebra::Vector3;
use rod::measure::{bend_strain, dissipated, energy};
use rod::{
    Assembly, Body, Change, Changing, Driven, Integrator, Interpolation, JointForce, JointLaw, Keyframe, Load,
    Material, MaxwellBranch, Model, Motion, RodSpec, State, StrandFriction, Track, Unloading, shape,
};
use statics::path::{PathEnd, PathParams, path};
use statics::{StaticMethod, StaticParams, equilibrium};

use crate::inelastic::{
    LENGTH, RADIUS, SEGMENTS, WIRE, angle, bending, bent_by, cantilever, plastic, run, settings, table,
};
use crate::inelastic_modes::drooping;

/// A moment by the curvature.
type Curve<'a> = Box<dyn Fn(f64) -> f64 + 'a>;

fn rest(model: &Model, state: &mut State) -> Vec<JointForce> {
    let found = equilibrium(model, state, &StaticParams::default()).unwrap();
    assert!(found.converged, "{} solves, moved {:e}", found.steps, found.movement);
    println!("{} solves", found.steps);
    found.forces
}

/// Follows a path to its end; shows each equilibrium.
fn along(model: &Model, state: &mut State, until: f64, mut see: impl FnMut(f64, &State, &[JointForce])) {
    let params = PathParams::until(until);
    let found = path(model, state, &params, &mut |point, state, forces| {
        see(point.time, state, forces);
        true
    });
    let found = found.unwrap();
    println!("{} equilibria, {} solves, {:?}", found.points, found.solves, found.end);
    assert_eq!(found.end, PathEnd::Until);
}

/// Asserts that each joint transmits the moment of its law at the end of an increment from `before`.
fn assert_balanced(model: &Model, before: &State, state: &State, forces: &[JointForce]) {
    for (k, own) in model.laws.iter().enumerate() {
        let joint = &model.joints[own.joint];
        let virgin = own.law.rest();
        let at = before.internal(k).unwrap_or(&virgin);
        let strain = bend_strain(model, state, joint);
        let moment = own.law.answer(&joint.bend_twist_stiffness(), &strain, at, f64::INFINITY).moment;
        let [a, b] = joint.frames(model, state);
        let none = Vector3::zeros();
        let moment = JointForce::of_multipliers(model.strain_measure, none, moment, [&a, &b], 1.0).moment.norm();
        let found = forces[own.joint].moment.norm();
        assert!((found - moment).abs() < 1e-6 * found.max(0.1), "joint {}: {found} {moment}", own.joint);
        let now = state.internals[k].strain;
        assert!((now - strain).norm() < 1e-9, "joint {}: {now} {strain}", own.joint);
    }
}

#[test]
fn a_wire_that_is_bent_over_springs_back_to_its_plastic_curvature() {
    let (hardening, most) = (0.1, 0.7);
    let (bending, yields) = (bending(), 0.5);
    let bent = most / bending + (most - yields) / (hardening * bending);
    let left = bent - most / bending;
    for (isotropic, kinematic) in [(hardening, 0.0), (0.0, hardening), (0.04, 0.06)] {
        let (mut model, mut state) = cantilever(&plastic(isotropic, kinematic), &[(0.0, Vector3::zeros())], 0.005);
        model.changes.clear();
        model.loads[0].torque = Vector3::y() * most;
        let forces = rest(&model, &mut state);
        assert_balanced(&model, &cantilever(&plastic(0.0, 0.0), &[(0.0, Vector3::zeros())], 0.0).1, &state, &forces);
        let top = angle(&state, &Vector3::y());
        model.loads[0].torque = Vector3::zeros();
        let before = state.clone();
        let forces = rest(&model, &mut state);
        assert_balanced(&model, &before, &state, &forces);
        let end = angle(&state, &Vector3::y());
        println!("{top} {bent} {end} {left}");
        assert!((top / bent - 1.0).abs() < 0.01, "{top} of {bent}");
        assert!((end / left - 1.0).abs() < 0.01, "{end} of {left}");
        // The spring's energy is gone, the work of the set is lost or stored in the back moment.
        let lost = dissipated(&model, &state);
        assert!(lost > 0.0 && energy(&model, &state).bend < lost);
    }
}

#[test]
fn joints_of_a_cantilever_unload_along_their_elastic_slope() {
    // A force at the end comes and goes; each joint has its largest moment, and then none.
    let (hardening, yields) = (0.1, 0.5);
    let (mut model, state) = cantilever(&plastic(0.0, hardening), &[(0.0, Vector3::zeros())], 0.0);
    model.changes.clear();
    model.loads = vec![Load {
        segment: SEGMENTS - 1,
        offset: 0.0,
        force: Vector3::zeros(),
        torque: Vector3::zeros(),
        follows: false,
    }];
    let track =
        Track::new(&[(0.0, 0.0), (1.0, 0.8), (2.0, 0.0)].map(|(t, f)| (t, -Vector3::z() * f)), Interpolation::Linear);
    model.changes.push(Change { of: Changing::Force(0), track: Arc::new(track.unwrap()) });
    let mut end = state.clone();
    let mut most = vec![0.0_f64; model.joints.len()];
    let mut top = None;
    along(&model, &mut end, 2.0, |time, state, forces| {
        for (most, force) in most.iter_mut().zip(forces) {
            *most = most.max(force.moment.norm());
        }
        if time == 1.0 {
            top = Some(state.clone());
        }
    });
    let top = top.unwrap();
    let mut yielded = 0;
    for (j, joint) in model.joints.iter().enumerate() {
        let plastic = ((most[j] - yields) / (hardening * bending())).max(0.0);
        let [at_top, at_end] = [&top, &end].map(|state| bend_strain(&model, state, joint).norm());
        yielded += usize::from(plastic > 0.0);
        // The moment is that of the joint's law along the arc of the joint.
        assert!((at_top - plastic - most[j] / bending()).abs() < 5e-3 * at_top, "joint {j}: {at_top}");
        assert!((at_end - plastic).abs() < 5e-3 * at_top, "joint {j}: {at_end} of {plastic}");
    }
    println!("{yielded} joints yielded");
    assert!((3..15).contains(&yielded), "{yielded}");
}

/// A straight wire between two grips, the second of which bends it to these curvatures over time [s], [1/m].
fn between_grips(law: &JointLaw, curvatures: &[(f64, f64)]) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::zeros());
    let nodes = shape::straight(Vector3::zeros(), Vector3::x(), LENGTH, SEGMENTS);
    let rod = assembly.rod(&RodSpec { laws: vec![law.clone()], ..RodSpec::new(nodes, RADIUS, WIRE) });
    assembly.clamp_start(&rod).clamp_end(&rod);
    let (mut model, state) = assembly.finish();
    // Between so many that what lies between them presses the wire by less than a hundredth of Euler's load.
    let (count, mut keys, mut before) = (160, Vec::new(), 0.0);
    for k in 0..=count * (curvatures.len() - 1) {
        let (from, share) = (k / count, (k % count) as f64 / count as f64);
        let [(t0, first), (t1, second)] = [curvatures[from], curvatures[(from + 1).min(curvatures.len() - 1)]];
        let curvature = first + (second - first) * share;
        // Joints at both ends have half a segment to bend over, those between them a whole one: the nodes of the arc are on a polygon of as many equal
        // turns, with half a turn at its ends.
        let turn = curvature * LENGTH;
        let each = turn / SEGMENTS as f64;
        let headings = (0..SEGMENTS).map(|i| each * (i as f64 + 0.5));
        let end =
            headings.map(|a| Vector3::new(a.cos(), 0.0, -a.sin())).sum::<Vector3<f64>>() * (LENGTH / SEGMENTS as f64);
        keys.push(Keyframe { time: t0 + (t1 - t0) * share, position: end, turn: Vector3::y() * (turn - before) });
        before = turn;
    }
    let motion = Motion::new(model.anchors[1].orientation, &keys, Interpolation::Linear).unwrap();
    model.motions.push(Driven::new(Body::Anchor(1), Arc::new(motion)));
    (model, state)
}

#[test]
fn a_path_goes_along_the_curve_of_a_law_and_back() {
    let (most, yields, hardening) = (0.6, 0.5, 0.1);
    let back = 0.35;
    let ways = [(0.0, 0.0), (1.0, most), (2.0, back)];
    let slope = bending() * hardening / (1.0 + hardening);
    let bilinear = |bent: f64| (bending() * bent).min(yields + slope * (bent - yields / bending()));
    let (friction, sticking) = (0.2, 5.0);
    let slips = |bent: f64| friction * (1.0 - (-sticking * bent / friction).exp());
    let turned = |bent: f64| -friction + (slips(most) + friction) * (-sticking * (most - bent) / friction).exp();
    let curve = |bent: f64| {
        bending() * [bent, 0.1 + 0.5 * (bent - 0.1), 0.2 + 0.2 * (bent - 0.3)].into_iter().fold(bent, f64::min)
    };
    let cases: [(JointLaw, Curve<'_>, Curve<'_>); 5] = [
        (plastic(0.0, hardening), Box::new(bilinear), Box::new(move |bent| bilinear(most) - bending() * (most - bent))),
        (
            JointLaw::Friction(StrandFriction { moment: friction, stiffness: sticking }),
            Box::new(move |bent| bending() * bent + slips(bent)),
            Box::new(move |bent| bending() * bent + turned(bent)),
        ),
        (
            JointLaw::Viscoelastic(vec![MaxwellBranch { share: 0.4, time: 0.3 }]),
            Box::new(|bent| 0.6 * bending() * bent),
            Box::new(|bent| 0.6 * bending() * bent),
        ),
        (table(Unloading::Elastic), Box::new(curve), Box::new(curve)),
        (
            table(Unloading::Masing),
            Box::new(curve),
            Box::new(move |bent| curve(most) - 2.0 * curve(0.5 * (most - bent))),
        ),
    ];
    for (law, on, off) in cases {
        let (model, mut state) = between_grips(&law, &ways);
        let joint = SEGMENTS / 2;
        let mut worst = 0.0_f64;
        along(&model, &mut state, 2.0, |time, state, forces| {
            let bent = bend_strain(&model, state, &model.joints[joint]).y;
            let expected = if time <= 1.0 { on(bent) } else { off(bent) };
            worst = worst.max((forces[joint].moment.y - expected).abs() / on(most));
        });
        println!("{law:?}: off by {worst:e} of the largest moment");
        assert!(worst < 0.01, "{law:?}: {worst}");
    }
}

#[test]
fn loops_of_moment_and_curvature_take_their_area() {
    // A torque at the end goes to and fro, by so many equilibria a quarter.
    let (most, hardening, quarter) = (0.65, 0.1, 20);
    let (moment, stiffness) = (0.2, 5.0);
    let cases = [
        (plastic(0.0, hardening), most),
        (JointLaw::Friction(StrandFriction { moment, stiffness }), most),
        (table(Unloading::Masing), 0.35 * bending()),
    ];
    for (law, most) in cases {
        let (mut model, mut state) = cantilever(&law, &[(0.0, Vector3::zeros())], 0.0);
        model.changes.clear();
        let (mut work, mut lost, mut before, mut largest) = (vec![0.0], vec![0.0], [0.0; 2], 0.0_f64);
        for k in 1..=12 * quarter {
            let phase = (f64::from(k) / f64::from(quarter) + 1.0).rem_euclid(4.0);
            let torque = most * if phase < 2.0 { phase - 1.0 } else { 3.0 - phase };
            model.loads[0].torque = Vector3::y() * torque;
            let found = equilibrium(&model, &mut state, &StaticParams::default()).unwrap();
            assert!(found.converged, "{k}: {found:?}");
            let turned = angle(&state, &Vector3::y());
            work.push(work.last().unwrap() + 0.5 * (torque + before[0]) * (turned - before[1]));
            lost.push(dissipated(&model, &state) / (LENGTH - 0.5 * LENGTH / SEGMENTS as f64));
            (before, largest) = ([torque, turned], largest.max(turned));
        }
        let expected = match &law {
            JointLaw::Plastic(_) => 4.0 * 0.5 * (most - 0.5) / (hardening * bending()),
            JointLaw::Friction(_) => {
                4.0 * moment * (largest - moment / stiffness * (stiffness * largest / moment).tanh())
            }
            _ => {
                let bent = bent_by(most);
                8.0 * bending() * (0.5 * 0.1 * 0.1 + 0.15 * 0.2 + 0.5 * (0.2 + 0.35) * (bent - 0.3)) - 4.0 * most * bent
            }
        };
        let cycle = 4 * quarter as usize;
        for (what, sum) in [("work", work), ("lost", lost)] {
            let found = sum[3 * cycle] - sum[2 * cycle];
            println!("{law:?}: {what} {found} of {expected}, off by {:e}", found / expected - 1.0);
            assert!((found / expected - 1.0).abs() < 0.01, "{law:?}: {what} {found} of {expected}");
        }
    }
}

#[test]
fn an_equilibrium_is_what_a_slow_run_comes_to() {
    let laws = [
        plastic(0.05, 0.05),
        JointLaw::Friction(StrandFriction { moment: 0.2, stiffness: 2.0 }),
        JointLaw::Viscoelastic(vec![MaxwellBranch { share: 0.3, time: 0.2 }]),
        table(Unloading::Elastic),
        table(Unloading::Masing),
    ];
    for law in laws {
        let (mut model, state) = drooping(Some(&law));
        let gravity = model.gravity * if let JointLaw::Plastic(_) = law { 1.5 } else { 1.0 };
        let track = Track::new(&[(0.0, Vector3::zeros()), (8.0, gravity)], Interpolation::Smooth).unwrap();
        for joint in &mut model.joints {
            joint.inner_damping.bending = 0.02;
        }
        let mut still = model.clone();
        still.gravity = gravity;
        model.gravity = Vector3::zeros();
        model.changes.push(Change { of: Changing::Gravity, track: Arc::new(track) });
        let (_, settled) = run(&(model.clone(), state.clone()), &settings(Integrator::Bdf2), (0.02, 500), |_, _| {});
        let mut at_once = state.clone();
        let forces = rest(&still, &mut at_once);
        assert_balanced(&still, &state, &at_once, &forces);
        let mut on_the_way = state.clone();
        along(&model, &mut on_the_way, 8.0, |_, _, _| {});
        let tip = |state: &State| state.positions[SEGMENTS - 1].z;
        println!("{law:?}: {} {} {}", tip(&settled), tip(&at_once), tip(&on_the_way));
        for found in [tip(&at_once), tip(&on_the_way)] {
            assert!((found / tip(&settled) - 1.0).abs() < 0.01, "{law:?}: {found} of {}", tip(&settled));
        }
        // Nothing moves any more: the equilibrium is at rest for a run, and for another search.
        let mut again = at_once.clone();
        rest(&still, &mut again);
        assert!((tip(&again) / tip(&at_once) - 1.0).abs() < 1e-9);
        assert_eq!(again.internals.len(), at_once.internals.len());
    }
}

#[test]
fn a_wire_that_yields_much_comes_to_rest_in_one_increment() {
    // In the plane, and out of it, where joints twist, too; from the flow as from Newton's method.
    for law in [plastic(0.0, 0.01), plastic(0.01, 0.0), table(Unloading::Masing)] {
        for helix in [false, true] {
            let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81 * 5.0));
            let straight = shape::straight(Vector3::zeros(), Vector3::x(), LENGTH, SEGMENTS);
            let nodes = if helix { shape::helix(Vector3::zeros(), 0.1, 0.3, 1.5, SEGMENTS) } else { straight };
            let material = Material { density: 8000.0, ..WIRE };
            let rod = assembly.rod(&RodSpec { laws: vec![law.clone()], ..RodSpec::new(nodes, RADIUS, material) });
            assembly.clamp_start(&rod);
            let (model, state) = assembly.finish();
            let ends = [StaticMethod::Newton, StaticMethod::Flow].map(|method| {
                let mut end = state.clone();
                let params = StaticParams { method, ..StaticParams::default() };
                let found = equilibrium(&model, &mut end, &params).unwrap();
                assert!(found.converged, "{law:?} {method:?}: {} solves", found.steps);
                assert_balanced(&model, &state, &end, &found.forces);
                end
            });
            let apart = (ends[0].positions[SEGMENTS - 1] - ends[1].positions[SEGMENTS - 1]).norm();
            assert!(apart < 1e-6 * LENGTH, "{law:?}: {apart} m");
        }
    }
}
