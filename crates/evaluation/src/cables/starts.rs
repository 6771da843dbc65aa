//! Starts that a cable's equilibrium is searched from, beside those of `equilibria`.

use std::f64::consts::TAU;

use equilibria::start::Starts;
use equilibria::{Answer, Cut, Query, Scaled};
use knn::tree::{Nearest, Tree};
use nalgebra::{UnitQuaternion, Vector3};

/// Turns and the force on the first grip that are known: of an answer, over B / L^2.
#[derive(Clone, Debug, Default)]
pub struct Known {
    turns: Vec<UnitQuaternion<f64>>,
    force: Vector3<f64>,
}

impl Known {
    /// Whether there is anything.
    pub(super) fn is_known(&self) -> bool {
        !self.turns.is_empty()
    }

    /// Those of the lowest equilibrium; `None` where there is none.
    pub fn of(query: &Query, answer: &Answer) -> Option<Self> {
        let own = answer.equilibria.first()?;
        let unit = query.cable.bending[0].max(query.cable.bending[1]) / query.cable.length.powi(2);
        Some(Self { turns: own.orientations.clone(), force: own.grips[0].force / -unit })
    }
}

/// Turns that go evenly from one grip's to the other's.
pub struct Slerp;

impl Starts for Slerp {
    fn count(&self) -> usize {
        1
    }

    fn fill(&self, _: usize, query: &Scaled, cut: &Cut, turns: &mut [UnitQuaternion<f64>], _: &mut [Vector3<f64>]) {
        for (k, out) in turns.iter_mut().enumerate() {
            *out = between(&query.ends, cut.place(k));
        }
    }
}

fn between([a, b]: &[UnitQuaternion<f64>; 2], share: f64) -> UnitQuaternion<f64> {
    a.try_slerp(b, share, 1e-9).unwrap_or(*a)
}

/// The answers to the queries before, one a query.
pub struct Previous(
    /// What is known, on the segments of the answers to come.
    pub Vec<Known>,
);

impl Starts for Previous {
    fn count(&self) -> usize {
        1
    }

    fn fill(&self, index: usize, _: &Scaled, _: &Cut, turns: &mut [UnitQuaternion<f64>], forces: &mut [Vector3<f64>]) {
        turns.copy_from_slice(&self.0[index].turns);
        forces[0] = self.0[index].force;
    }
}

/// Inputs of the search for neighbours.
const INPUTS: usize = 12;

/// A query turned about the vertical so that the second grip lies in the plane of x and z, and about its own axis.
struct Canonical {
    inputs: [f32; INPUTS],
    /// Turn about the vertical, and about the cable's axis.
    about: UnitQuaternion<f64>,
    roll: UnitQuaternion<f64>,
    ends: [UnitQuaternion<f64>; 2],
}

impl Canonical {
    /// Of a round cable that is straight at rest, between two grips.
    fn new(query: &Scaled) -> Self {
        let about_z = |angle: f64| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
        let shortest = |a: &Vector3<f64>, b: &Vector3<f64>| {
            UnitQuaternion::rotation_between(a, b).unwrap_or_else(|| UnitQuaternion::new(Vector3::x() * (TAU / 2.0)))
        };
        let about = about_z(-query.chord.y.atan2(query.chord.x));
        let chord = about * query.chord;
        let [first, last] = query.ends.map(|q| about * q);
        let tangents = [first * Vector3::z(), last * Vector3::z()];
        let base = shortest(&Vector3::z(), &tangents[0]);
        let turn = |q: UnitQuaternion<f64>| 2.0 * q.k.atan2(q.w);
        let roll = about_z(-turn(base.inverse() * first));
        let end = last * roll;
        let twist = turn((shortest(&tangents[0], &tangents[1]) * base).inverse() * end);
        let [a, b] = tangents;
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
        ];
        Self { inputs: numbers.map(|x| x as f32), about, roll, ends: [base, end] }
    }
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
            let turns = own.turns.iter().map(|q| canonical.about * q * canonical.roll).collect();
            known.push((Known { turns, force: canonical.about * own.force }, canonical.ends));
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
    ) {
        let canonical = Canonical::new(query);
        let (known, ends) = &self.known[self.nearest(&canonical.inputs)];
        let (back, roll) = (canonical.about.inverse(), canonical.roll.inverse());
        let off = [0, 1].map(|k| canonical.ends[k] * ends[k].inverse());
        for (k, (out, own)) in turns.iter_mut().zip(&known.turns).enumerate() {
            *out = back * between(&off, cut.place(k)) * own * roll;
        }
        forces[0] = back * known.force;
    }
}
