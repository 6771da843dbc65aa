//! Equilibria between two grips that stand anywhere: how many linear solves they take.

use std::f64::consts::{FRAC_PI_3, PI, TAU};

use acceptance::Beam;
use cosserat::assembly::{Assembly, Material, RestShape, RodSpec, shape};
use cosserat::state::{Model, State};
use cosserat::statics::{StaticParams, equilibrium};
use nalgebra::{Unit, UnitQuaternion, Vector3};

/// The fractional parts of k times roots of primes fill the unit cube evenly.
const PRIMES: [f64; 12] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0, 29.0, 31.0, 37.0];

/// Ends at distances of 0.3 to 0.95 of the length in all directions, tangents up to 60 degrees off the chord, twist of up to half a
/// turn either way, `rho A g L^3 / B` from 1 to 100 and C / B from 0.7 to 1; the start is a smooth curve.
fn query(k: usize, segments: usize) -> (Model, State) {
    let mut numbers = PRIMES.iter().map(|prime| ((k + 1) as f64 * prime.sqrt()).fract());
    let mut unit = || numbers.next().unwrap();
    let mut direction = || {
        let (z, angle) = (2.0 * unit() - 1.0, TAU * unit());
        Vector3::new(angle.cos(), angle.sin(), 0.0) * (1.0 - z * z).sqrt() + Vector3::z() * z
    };
    let (chord, axes) = (direction(), [direction(), direction()]);
    let tangent =
        |axis: Vector3<f64>, angle: f64| UnitQuaternion::from_axis_angle(&Unit::new_normalize(axis), angle) * chord;
    let [start, end] = axes.map(|axis| tangent(axis, FRAC_PI_3 * unit()));
    let distance = 0.3 + 0.65 * unit();
    let (twist, ratio) = (PI * (2.0 * unit() - 1.0), 100f64.powf(unit()));
    let beam = Beam::rubber(segments);
    let youngs_modulus = beam.material.youngs_modulus;
    let material = Material { torsion_modulus: (0.7 + 0.3 * unit()) * 0.5 * youngs_modulus, ..beam.material };
    let gravity = -Vector3::z() * beam.gravity_for(ratio);
    let hung = shape::Hung {
        from: Vector3::zeros(),
        to: chord * distance,
        length: beam.length,
        start_direction: Some(start),
        end_direction: Some(end),
        gravity,
    };
    let nodes = hung.nodes(segments).expect("a curve");
    let mut assembly = Assembly::new(gravity);
    let rod = assembly.rod(&RodSpec { rest: RestShape::Straight, twist, ..RodSpec::new(nodes, beam.radius, material) });
    assembly.clamp_start(&rod).clamp_end(&rod);
    assembly.finish()
}

#[test]
fn anywhere_a_cable_comes_to_rest_in_few_solves() {
    let solve = |k: usize| {
        let (model, mut state) = query(k, 50);
        let report = equilibrium(&model, &mut state, &StaticParams::default()).unwrap();
        assert!(report.converged && report.stable == Some(true), "query {k}: {report:?}");
        report.steps
    };
    let mut solves: Vec<usize> = (0..500).map(solve).collect();
    solves.sort_unstable();
    let mean = solves.iter().sum::<usize>() as f64 / solves.len() as f64;
    println!("solves: median {}, mean {mean}, 90 % {}, most {}", solves[250], solves[450], solves[499]);
    assert!(solves[250] <= 10 && mean < 12.0 && solves[450] <= 20, "{solves:?}");
}
