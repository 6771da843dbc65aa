//! Hands: compliant grips that pull at segments, through loads that change before each step.
//!
//! The solver adds no joint to a simulation that runs, so that a hand is a spring and a damper outside of it, on a load of each
//! segment ([`with_hands`]). Its force is that of a stable proportional-derivative controller (Tan, Liu and Turk 2011): the spring
//! at the end of the step, if the hand had the mass that it holds alone. What hangs on that makes it heavier only, so that no
//! stiffness and no time step drive the force unstable.

use std::collections::{BTreeMap, HashMap};

use nalgebra::Vector3;
use rod::{Body, Load, Model, Segment, State, successors};

/// Share of its set's mass that a hand holds at least, where the rod has as much.
const HELD: f64 = 0.1;
/// A set that hangs from a hand stretches it by this share of its own extent.
const SAG: f64 = 0.02;
/// Acceleration that this is said of where there is no gravity [m/s^2].
const WEIGHT: f64 = 9.81;

/// The model with a load on each segment that hands can use, without force. Its indices follow those of the model's own loads.
pub fn with_hands(model: &Model) -> Model {
    let mut model = model.clone();
    let load =
        |segment| Load { segment, offset: 0.0, force: Vector3::zeros(), torque: Vector3::zeros(), follows: false };
    model.loads.extend((0..model.segments.len()).map(load));
    model
}

/// Where the loads of hands begin in a model, if it is one [`with_hands`].
pub(crate) fn first_load(model: &Model) -> Option<usize> {
    let first = model.loads.len().checked_sub(model.segments.len())?;
    let zero = Vector3::zeros();
    let fits = model.loads[first..].iter().enumerate().all(|(i, load)| {
        (load.segment, load.offset, load.force, load.torque, load.follows) == (i, 0.0, zero, zero, false)
    });
    fits.then_some(first)
}

/// What a hand holds.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Hand {
    /// The segment that was grabbed.
    pub(crate) segment: usize,
    /// Segments with their shares of the force.
    held: Vec<(usize, f64)>,
    /// Of a rigid body, the place in its own axes [m].
    arm: Option<Vector3<f64>>,
    /// From where the hand is to the place that it pulls at [m].
    offset: Vector3<f64>,
    /// Where it is [m].
    pub(crate) target: Vector3<f64>,
    /// Stiffness [N/m].
    stiffness: f64,
    /// Damping [N s/m].
    damping: f64,
    /// Mass that follows the force at once, at least [kg].
    mass: f64,
}

/// Force [N] and torque [N m] about the centre, by segment.
pub(crate) type Pulls = BTreeMap<usize, [Vector3<f64>; 2]>;

impl Hand {
    /// One that takes hold of a segment at a place [m].
    pub(crate) fn new(model: &Model, state: &State, segment: usize, at: Vector3<f64>) -> Self {
        let set = set_of(model, segment);
        let total: f64 = set.iter().map(|&i| model.segments[i].mass()).sum();
        let own = &model.segments[segment];
        let (held, arm, mass) = if let Some(body) = &own.body {
            let arm = state.orientations[segment].inverse() * (at - state.positions[segment]);
            let mass = 1.0 / (1.0 / own.mass() + arm.norm_squared() / body.inertia.min());
            (vec![(segment, 1.0)], Some(arm), mass)
        } else {
            let stretch = stretch_about(model, segment, HELD * total);
            let mass: f64 = stretch.iter().map(|&i| model.segments[i].mass()).sum();
            (stretch.into_iter().map(|i| (i, model.segments[i].mass() / mass)).collect(), None, mass)
        };
        let low = set.iter().fold(state.positions[segment], |low, &i| low.inf(&state.positions[i]));
        let high = set.iter().fold(state.positions[segment], |high, &i| high.sup(&state.positions[i]));
        let extent = (high - low).norm().max(own.length);
        let stiffness = total * model.gravity.norm().max(WEIGHT) / (SAG * extent);
        let damping = 2.0 * (stiffness * mass).sqrt();
        let mut hand = Self { segment, held, arm, offset: Vector3::zeros(), target: at, stiffness, damping, mass };
        hand.offset = hand.place(state) - at;
        hand
    }

    /// The place that it pulls at [m].
    fn place(&self, state: &State) -> Vector3<f64> {
        match self.arm {
            Some(arm) => state.positions[self.segment] + state.orientations[self.segment] * arm,
            None => self.held.iter().map(|&(i, share)| state.positions[i] * share).sum(),
        }
    }

    /// Where on the segments the hand is: to draw it [m].
    pub(crate) fn grip(&self, state: &State) -> Vector3<f64> {
        self.place(state) - self.offset
    }

    fn velocity(&self, state: &State) -> Vector3<f64> {
        match self.arm {
            Some(arm) => {
                let arm = state.orientations[self.segment] * arm;
                state.velocities[self.segment] + state.angular_velocities[self.segment].cross(&arm)
            }
            None => self.held.iter().map(|&(i, share)| state.velocities[i] * share).sum(),
        }
    }

    /// The force for a step of `dt` [s] from a state [N].
    pub(crate) fn force(&self, state: &State, dt: f64) -> Vector3<f64> {
        let (stretch, velocity) = (self.grip(state) - self.target, self.velocity(state));
        let pull = (stretch + velocity * dt) * self.stiffness + velocity * self.damping;
        -pull / (1.0 + dt * (self.damping + dt * self.stiffness) / self.mass)
    }

    /// Adds its pulls.
    pub(crate) fn pull(&self, state: &State, dt: f64, pulls: &mut Pulls) {
        let force = self.force(state, dt);
        for &(i, share) in &self.held {
            let [own, torque] = pulls.entry(i).or_insert([Vector3::zeros(); 2]);
            *own += force * share;
            if let Some(arm) = self.arm {
                *torque += (state.orientations[i] * arm).cross(&force);
            }
        }
    }
}

/// The segments that hang together with one, itself included.
fn set_of(model: &Model, segment: usize) -> Vec<usize> {
    let mut beside: HashMap<usize, Vec<usize>> = HashMap::new();
    for joint in &model.joints {
        if let (Body::Segment(a), Body::Segment(b)) = (joint.a, joint.b) {
            beside.entry(a).or_default().push(b);
            beside.entry(b).or_default().push(a);
        }
    }
    let mut is_known = vec![false; model.segments.len()];
    is_known[segment] = true;
    let mut set = vec![segment];
    let mut next = 0;
    while let Some(&i) = set.get(next) {
        for &other in beside.get(&i).into_iter().flatten() {
            if !std::mem::replace(&mut is_known[other], true) {
                set.push(other);
            }
        }
        next += 1;
    }
    set.sort_unstable();
    set
}

/// The stretch of a rod about a segment that has so much mass [kg], or all of the rod's; one segment at least.
fn stretch_about(model: &Model, segment: usize, mass: f64) -> Vec<usize> {
    let next: Vec<Option<usize>> = successors(model).into_iter().map(|next| next.map(|next| next.segment)).collect();
    let mut before = vec![None; next.len()];
    next.iter().enumerate().for_each(|(i, next)| {
        if let Some(next) = *next {
            before[next] = Some(i);
        }
    });
    let is_free = |i: &usize| !model.segments[*i].fixed;
    let weight = |i: usize| Segment::mass(&model.segments[i]);
    let mut stretch = vec![segment];
    let mut sum = weight(segment);
    let (mut back, mut on) = (before[segment].filter(is_free), next[segment].filter(is_free));
    while sum < mass && (back.is_some() || on.is_some()) {
        for (end, links) in [(&mut back, &before), (&mut on, &next)] {
            if let Some(i) = *end {
                if stretch.contains(&i) {
                    *end = None;
                    continue;
                }
                stretch.push(i);
                sum += weight(i);
                *end = links[i].filter(is_free);
            }
        }
    }
    stretch.sort_unstable();
    stretch
}

#[cfg(test)]
mod tests {
    use super::*;
    use rod::{Assembly, Material, RodSpec, shape};

    #[test]
    fn a_hand_holds_a_tenth_of_a_rod_about_the_segment() {
        let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
        let rubber = Material { youngs_modulus: 2e6, torsion_modulus: 7e5, density: 1100.0 };
        assembly.rod(&RodSpec::new(shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 50), 0.005, rubber));
        let (model, state) = assembly.finish();
        assert_eq!(
            stretch_about(&model, 20, 0.1 * 50.0 * model.segments[0].mass() * (1.0 - 1e-9)),
            [18, 19, 20, 21, 22]
        );
        assert_eq!(stretch_about(&model, 0, 0.0), [0]);
        let hand = Hand::new(&model, &state, 20, state.positions[20]);
        // At rest where it was grabbed it pulls at nothing.
        assert!(hand.force(&state, 0.01).norm() < 1e-12);
    }
}
