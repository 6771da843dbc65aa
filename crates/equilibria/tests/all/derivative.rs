//! Derivatives of shapes against central differences.

use equilibria::derivative::{PARAMETERS, derivatives};
use equilibria::sample::Distribution;
use equilibria::{Equilibrium, Params, Query, solve};
use nalgebra::{UnitQuaternion, Vector3};

fn lowest(query: &Query) -> Equilibrium {
    let params = Params { segments: 24, tolerance: 1e-11, ..Params::default() };
    solve(std::slice::from_ref(query), &params).unwrap().remove(0).unwrap().equilibria.remove(0)
}

/// The query with a parameter changed by `by`.
fn changed(query: &Query, parameter: usize, by: f64) -> Query {
    let mut own = *query;
    let unit = Vector3::from_fn(|k, _| f64::from(u8::from(k == parameter % 3)));
    let turned = |q: &UnitQuaternion<f64>| UnitQuaternion::from_scaled_axis(unit * by) * q;
    match parameter {
        0..3 => own.start.position += unit * by,
        3..6 => own.start.orientation = turned(&own.start.orientation),
        6..9 => own.end.iter_mut().for_each(|end| end.position += unit * by),
        9..12 => own.end.iter_mut().for_each(|end| end.orientation = turned(&end.orientation)),
        12 => own.cable.length += by,
        13 | 14 => own.cable.bending[parameter - 13] += by,
        15 => own.cable.torsion += by,
        16 => own.cable.weight += by,
        17..20 => own.cable.rest[parameter - 17] += by,
        20 => own.cable.carried.weight += by,
        _ => own.cable.carried.place += by,
    }
    own
}

#[test]
fn shapes_change_as_their_derivatives_say() {
    let distribution = Distribution { curvature: 2.0, carried: 30.0, ..Distribution::default() };
    for k in 0..6 {
        let mut query = distribution.query(3, k);
        query.cable.bending[1] = 0.6;
        query.cable.stretch_compliance = 1e-5;
        if k % 3 == 2 {
            query.end = None;
        }
        let all = derivatives(&query, &lowest(&query));
        assert_eq!(all.len(), PARAMETERS);
        let mut moved = 0;
        for (parameter, own) in all.iter().enumerate() {
            let h = 1e-4;
            let [ahead, behind] = [h, -h].map(|by| lowest(&changed(&query, parameter, by)));
            let largest = own.positions.iter().map(Vector3::norm).fold(1.0, f64::max);
            for i in 0..own.positions.len() {
                let slope = (ahead.positions[i] - behind.positions[i]) / (2.0 * h);
                let off = (slope - own.positions[i]).norm() / largest;
                assert!(off < 1e-6, "query {k}, parameter {parameter}, segment {i}: {off}");
                let turn = ahead.orientations[i] * behind.orientations[i].inverse();
                let off = (turn.scaled_axis() / (2.0 * h) - own.turns[i]).norm() / largest;
                assert!(off < 1e-6, "query {k}, parameter {parameter}, segment {i}, turn: {off}");
            }
            moved += usize::from(own.positions.iter().any(|x| x.norm() > 1e-6));
        }
        assert_eq!(moved, if query.end.is_some() { PARAMETERS } else { PARAMETERS - 6 }, "query {k}");
    }
}
