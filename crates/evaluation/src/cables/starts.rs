//! Starts that a cable's equilibrium is searched from, beside those of `equilibria`.

use std::f64::consts::TAU;

use equilibria::known::Known;
use equilibria::start::Starts;
use equilibria::{Cut, Query, Scaled};
use knn::tree::{Nearest, Tree};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Turns that go evenly from one grip's to the other's.
pub struct Slerp;

impl Starts for Slerp {
    fn count(&self) -> usize {
        1
    }

    fn fill(
        &self,
        _: usize,
        query: &Scaled,
        cut: &Cut,
        turns: &mut [UnitQuaternion<f64>],
        _: &mut [Vector3<f64>],
    ) -> usize {
        for (k, out) in turns.iter_mut().enumerate() {
            *out = between(&query.ends, cut.place(k));
        }
        1
    }
}

fn between([a, b]: &[UnitQuaternion<f64>; 2], share: f64) -> UnitQuaternion<f64> {
    a.try_slerp(b, share, 1e-9).unwrap_or(*a)
}

/// Inputs of the search for neighbours.
const INPUTS: usize = 16;

/// A query turned about the vertical so that the second grip lies in the plane of x and z, mirrored at that plane so that the
/// cable leaves the first grip towards y, and turned about its own axis.
struct Canonical {
    inputs: [f32; INPUTS],
    /// Turn about the vertical, whether it is mirrored, and the turn about the cable's axis.
    about: UnitQuaternion<f64>,
    is_mirrored: bool,
    roll: UnitQuaternion<f64>,
    ends: [UnitQuaternion<f64>; 2],
}

impl Canonical {
    /// Of a round cable that is not twisted at rest, between two grips.
    fn new(query: &Scaled) -> Self {
        let about_z = |angle: f64| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
        let shortest = |a: &Vector3<f64>, b: &Vector3<f64>| {
            UnitQuaternion::rotation_between(a, b).unwrap_or_else(|| UnitQuaternion::new(Vector3::x() * (TAU / 2.0)))
        };
        let about = about_z(-query.chord.y.atan2(query.chord.x));
        let chord = about * query.chord;
        let is_mirrored = (about * query.ends[0] * Vector3::z()).y < 0.0;
        let [first, last] = query.ends.map(|q| mirrored(is_mirrored, about * q));
        let tangents = [first * Vector3::z(), last * Vector3::z()];
        let base = shortest(&Vector3::z(), &tangents[0]);
        let turn = |q: UnitQuaternion<f64>| 2.0 * q.k.atan2(q.w);
        let roll = about_z(-turn(base.inverse() * first));
        let end = last * roll;
        let twist = turn((shortest(&tangents[0], &tangents[1]) * base).inverse() * end);
        let [a, b] = tangents;
        let sign = if is_mirrored { -1.0 } else { 1.0 };
        let bent = roll.inverse() * Vector3::new(sign * query.rest[0], query.rest[1], 0.0) * 0.25;
        let [carried, place] = [query.carried[0] * 0.05, query.carried[1]];
        let numbers = [
            chord.x,
            chord.z,
            a.x,
            a.y,
            a.z,
            b.x,
            b.y,
            b.z,
            twist.cos(),
            twist.sin(),
            (1.0 + query.weight).log10() * 0.5,
            query.stiffness[2],
            bent.x,
            bent.y,
            carried,
            carried * (2.0 * place - 1.0),
        ];
        Self { inputs: numbers.map(|x| x as f32), about, is_mirrored, roll, ends: [base, end] }
    }

    fn turn(&self, q: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
        mirrored(self.is_mirrored, self.about * q) * self.roll
    }

    fn turn_back(&self, q: UnitQuaternion<f64>) -> UnitQuaternion<f64> {
        self.about.inverse() * mirrored(self.is_mirrored, q * self.roll.inverse())
    }

    fn force(&self, force: Vector3<f64>) -> Vector3<f64> {
        reflected(self.is_mirrored, self.about * force)
    }

    fn force_back(&self, force: Vector3<f64>) -> Vector3<f64> {
        self.about.inverse() * reflected(self.is_mirrored, force)
    }
}

/// A frame mirrored at the plane of x and z, its d2 turned round so that it stays right-handed.
fn mirrored(is_mirrored: bool, q: UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    if is_mirrored { UnitQuaternion::new_unchecked(Quaternion::new(q.w, -q.i, q.j, -q.k)) } else { q }
}

fn reflected(is_mirrored: bool, v: Vector3<f64>) -> Vector3<f64> {
    if is_mirrored { Vector3::new(v.x, -v.y, v.z) } else { v }
}

/// Answers in the canonical frame, of which the nearest is taken, its ends turned to the grips'.
pub struct Neighbours {
    inputs: Vec<[f32; INPUTS]>,
    known: Vec<(Known, [UnitQuaternion<f64>; 2])>,
    tree: Option<Tree<INPUTS>>,
}

impl Neighbours {
    /// Of queries and what is known of them; with a k-d tree, or searched through one by one.
    pub fn new(all: &[(Query, Known)], with_tree: bool) -> Self {
        let (mut inputs, mut known) = (Vec::new(), Vec::new());
        for (query, own) in all {
            let canonical = Canonical::new(&Scaled::new(query));
            let turns = own.turns.iter().map(|q| canonical.turn(q)).collect();
            known.push((Known { turns, begin: canonical.force(own.begin) }, canonical.ends));
            inputs.push(canonical.inputs);
        }
        let tree = with_tree.then(|| Tree::new(&inputs));
        Self { inputs, known, tree }
    }

    fn nearest(&self, inputs: &[f32; INPUTS]) -> usize {
        if let Some(tree) = &self.tree {
            let mut found = Nearest::new();
            tree.nearest(inputs, 1, &mut found);
            return found[0].1 as usize;
        }
        let distance = |own: &[f32; INPUTS]| (0..INPUTS).map(|k| (own[k] - inputs[k]).powi(2)).sum::<f32>();
        let mut best = (f32::INFINITY, 0);
        for (k, own) in self.inputs.iter().enumerate() {
            let own = distance(own);
            if own < best.0 {
                best = (own, k);
            }
        }
        best.1
    }
}

impl Starts for Neighbours {
    fn count(&self) -> usize {
        1
    }

    fn fill(
        &self,
        _: usize,
        query: &Scaled,
        cut: &Cut,
        turns: &mut [UnitQuaternion<f64>],
        forces: &mut [Vector3<f64>],
    ) -> usize {
        let canonical = Canonical::new(query);
        let (known, ends) = &self.known[self.nearest(&canonical.inputs)];
        let off = [0, 1].map(|k| canonical.ends[k] * ends[k].inverse());
        for (k, (out, own)) in turns.iter_mut().zip(&known.turns).enumerate() {
            *out = canonical.turn_back(between(&off, cut.place(k)) * own);
        }
        forces[0] = canonical.force_back(known.begin);
        1
    }
}

#[cfg(test)]
mod tests {
    use equilibria::sample::Distribution;
    use equilibria::{Params, solve, solve_from};

    use super::*;

    /// Of mirrored and turned queries the answers are mirrored and turned, and so a neighbour that is the same but for that is
    /// an answer.
    #[test]
    fn a_query_that_is_known_is_answered_at_once() {
        let distribution = Distribution { curvature: 4.0, carried: 50.0, plain: 0.5, ..Distribution::default() };
        let queries: Vec<Query> = (0..40).map(|k| distribution.query(2, k)).collect();
        let params = Params { segments: 30, ..Params::default() };
        let answers = solve(&queries, &params).unwrap();
        let all: Vec<(Query, Known)> = queries
            .iter()
            .zip(&answers)
            .map(|(query, own)| (*query, Known::of(query, own.as_ref().unwrap()).unwrap()))
            .collect();
        let about = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 2.1);
        let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -0.7);
        let changed = |grip: equilibria::Grip| equilibria::Grip {
            position: about * reflected(true, grip.position),
            orientation: about * mirrored(true, grip.orientation) * roll,
        };
        let other = |query: &Query| {
            let mut other = Query { start: changed(query.start), end: query.end.map(changed), ..*query };
            let rest = query.cable.rest;
            other.cable.rest = roll.inverse() * Vector3::new(-rest.x, rest.y, -rest.z);
            other
        };
        let others: Vec<Query> = queries.iter().map(other).collect();
        let direct = Params { levels: Vec::new(), again: false, ..params };
        for with_tree in [false, true] {
            let again = solve_from(&others, &direct, &Neighbours::new(&all, with_tree)).unwrap();
            for (k, (own, other)) in answers.iter().zip(&again).enumerate() {
                let (own, other) = (own.as_ref().unwrap(), other.as_ref().unwrap());
                assert!(other.solves <= 2, "query {k}: {} solves", other.solves);
                let [a, b] = [own, other].map(|answer| answer.equilibria[0].energy);
                assert!((a - b).abs() <= 1e-6 * a.abs().max(1.0), "query {k}: {a} J, {b} J");
            }
        }
    }
}
