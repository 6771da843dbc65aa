//! The derivative of an equilibrium, by the implicit function theorem.
//!
//! An equilibrium solves F(p, lambda; theta) = 0, the balance of all forces and what all joints ask for. So its poses and
//! multipliers change by `dF/d(p, lambda)^-1` of what F changes by: one elimination with the whole Jacobian
//! ([`jointed::tangent::jacobian`]), and transposed for the derivative of one number with respect to everything.

use std::sync::Arc;

use component::{Component, Members, split};
use jointed::tangent::Equations;
use jointed::tangent::jacobian::{Factor, Field, Jacobian, Whole, joined, of_six, six, split as parts};
use jointed::topology::Topology;
use kernels::Spatial;
use kernels::dual::Dual;
use nalgebra::{Matrix6, Vector3, Vector6};
use rod::{Body, JointForce, Model, State};
use statics::{StaticParams, StaticReport, equilibrium};

use super::check;
use super::error::refuse;
use super::hinges::Hinges;
use super::run::check_all;
use super::seed::is_held;
use super::{AirVariation, DerivativeError, HeldVariation, JointVariation, StateVariation, Variation, Wanted};

/// Most steps of Newton's method after those of the search.
const MOST_STEPS: usize = 12;
/// The first of them may move by this much [segment lengths, rad].
const NEAR: f64 = 1e-3;
/// Movements up to this many are rounding errors.
const ROUNDING: f64 = 1e-14;
/// Where movements become no less and are more than this, next to nothing resists.
const CALM: f64 = 1e-9;
/// A stiffness against turns below this share of the scale of forces, times a segment's length, is none.
const NEUTRAL: f64 = 1e-11;
/// Solves in which the softest turn of all comes out.
const POWERS: usize = 4;

type Pair = [Vector3<f64>; 2];

/// An equilibrium, and what it changes by with all that it depends on.
///
/// A [`Variation`] has here what does not change over time: of a held body the first of its poses, or, where it is a fixed
/// segment that nothing drives, its pose in the first state. Damping, velocities and where free segments began do not matter.
///
/// ```
/// use rod::{Assembly, Material, RodSpec, shape};
/// use nalgebra::Vector3;
/// use sensitivity::{Equilibrium, StateVariation, Wanted};
/// use statics::StaticParams;
///
/// let material = Material { youngs_modulus: 1e6, torsion_modulus: 4e5, density: 1000.0 };
/// let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
/// let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 20);
/// let rod = assembly.rod(&RodSpec::new(nodes, 0.01, material));
/// assembly.clamp_start(&rod);
/// let (model, state) = assembly.finish();
///
/// let mut equilibrium = Equilibrium::new(&model, &state, &StaticParams::default())?;
/// let mut height = StateVariation::zero(20);
/// height.positions[19].z = 1.0;
/// let gradient = equilibrium.backward(&height, Wanted::ALL)?;
/// // The tip goes with the clamp, metre by metre.
/// assert!((gradient.held[0].poses[0][0].z - 1.0).abs() < 1e-9);
/// # Ok::<(), sensitivity::DerivativeError>(())
/// ```
pub struct Equilibrium {
    model: Model,
    state: State,
    report: StaticReport,
    sets: Vec<Set>,
}

/// A connected set at rest.
struct Set {
    members: Members,
    component: Component<f64>,
    topology: Arc<Topology>,
    jacobian: Jacobian,
    factor: Factor,
    hinges: Hinges,
    /// What drag changes by with the air, one entry a segment; empty without air.
    blown: Vec<Matrix6<f64>>,
    /// Fixed segments that a motion drives.
    driven: Vec<bool>,
}

impl Equilibrium {
    /// The equilibrium that `state` comes to, as [`equilibrium`] finds it.
    ///
    /// # Errors
    /// If the search cannot start or does not come to rest, the model has what is not differentiated, or the equations of the
    /// equilibrium are singular.
    pub fn new(model: &Model, state: &State, params: &StaticParams) -> Result<Self, DerivativeError> {
        refuse(!model.contacts.is_empty(), "contacts of equilibria")?;
        check_all(model)?;
        let mut state = state.clone();
        let report = equilibrium(model, &mut state, params)?;
        if !report.converged {
            return Err(DerivativeError::NotAtRest);
        }
        let set = |(members, topology)| Search::new(model, &state, members, topology)?.settle(model);
        let sets: Vec<Set> = split(model).into_iter().map(set).collect::<Result<_, _>>()?;
        for set in &sets {
            set.component.store_state(&mut state, &set.members, 0);
        }
        Ok(Self { model: model.clone(), state, report, sets })
    }

    /// The equilibrium; velocities are zero.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// What the search for it came to.
    pub fn report(&self) -> &StaticReport {
        &self.report
    }

    /// Copies what each joint transmits to `forces`, which must have an entry for each joint of the model.
    pub fn store_joint_forces(&self, forces: &mut [JointForce]) {
        self.sets.iter().for_each(|set| set.component.store_joint_forces(forces, &set.members, 0));
    }

    /// What the equilibrium changes by along a direction, and what its joints transmit; velocities stay zero.
    ///
    /// # Errors
    /// If the variation does not fit the model, or moves what is not held.
    pub fn forward(&mut self, variation: &Variation) -> Result<StateVariation, DerivativeError> {
        check::check_all(variation, &self.model)?;
        if variation.held.iter().any(|held| !is_held(&self.model, held.body)) {
            return Err(DerivativeError::Unknown("motions of what is not held"));
        }
        let mut out = StateVariation::with_forces(&self.model);
        for set in &mut self.sets {
            set.forward(&self.model, variation, &mut out);
        }
        Ok(out)
    }

    /// The gradient of a number whose derivative with respect to the equilibrium is given. Of what is not wanted the gradient is
    /// zero. It lists all bodies that are held, each with one pose.
    ///
    /// # Errors
    /// If a list has another size than the model.
    pub fn backward(&mut self, objective: &StateVariation, wanted: Wanted) -> Result<Variation, DerivativeError> {
        check::check_state(objective, &self.model)?;
        let mut out = Variation::zero(&self.model);
        for set in &mut self.sets {
            set.backward(&self.model, objective, wanted, &mut out);
        }
        Ok(out)
    }
}

/// Memory to bring a set to rest to the last digits.
struct Search {
    members: Members,
    component: Component<f64>,
    /// For how drag changes.
    blown: Option<Component<Dual<6>>>,
    forces: Vec<Spatial<f64>>,
    equations: Equations,
    whole: Whole,
    topology: Arc<Topology>,
    factor: Factor,
    hinges: Hinges,
}

impl Search {
    fn new(model: &Model, state: &State, members: Members, topology: Topology) -> Result<Self, DerivativeError> {
        let topology = Arc::new(topology);
        let factor = Factor::new(&topology).ok_or(DerivativeError::Unknown("rods that form so many loops"))?;
        let mut component: Component<f64> = Component::new(model, state, topology.clone(), &[&members]);
        component.hold_still();
        component.stop_inner_damping();
        component.begin_equilibrium();
        let blown = component.has_air().then(|| Component::new(model, state, topology.clone(), &[&members]));
        Ok(Self {
            members,
            component,
            blown,
            forces: Vec::new(),
            equations: Equations::default(),
            whole: Whole::default(),
            topology,
            factor,
            hinges: Hinges::default(),
        })
    }

    /// Factors the Jacobian where the bodies are, with a `share` of their inertia over a second; `None` where it is singular.
    fn linearise(&mut self, model: &Model, share: f64) -> Option<(Jacobian, Vec<Matrix6<f64>>)> {
        let Self { members, component, blown, forces, equations, whole, .. } = self;
        component.weigh(forces, true);
        component.evaluate_equilibrium(forces);
        component.hold_hinges();
        component.gather(equations, share);
        component.whole_blocks(equations, share, whole);
        let mut jacobian = Jacobian::new(&self.topology, equations, whole);
        let drag = blown.as_mut().map_or(Vec::new(), |blown| blown.drag_slopes(&component.poses, members, model));
        for (i, [of_pose, _]) in drag.iter().enumerate().filter(|(i, _)| !component.is_still(*i)) {
            jacobian.add(i, &-of_pose);
        }
        if !self.factor.factor(&jacobian, 1) {
            return None;
        }
        self.hinges = Hinges::new(component, &self.topology, &jacobian, &mut self.factor)?;
        Some((jacobian, drag.into_iter().map(|[_, of_air]| of_air).collect()))
    }

    /// Newton's method with the whole Jacobian, to rounding errors.
    fn settle(mut self, model: &Model) -> Result<Set, DerivativeError> {
        // Forces first. Where they balance they follow without a movement, whatever the stiffness: there is some inertia, as
        // that of forces is not known yet.
        let (jacobian, _) = self.linearise(model, 1.0).ok_or(DerivativeError::Neutral)?;
        self.step(&jacobian, 0.0);
        let mut before = f64::INFINITY;
        for step in 0..MOST_STEPS {
            let (jacobian, _) = self.linearise(model, 0.0).ok_or(DerivativeError::Neutral)?;
            if step == 0 && self.is_neutral(&jacobian) {
                return Err(DerivativeError::Neutral);
            }
            let movement = self.step(&jacobian, 1.0);
            let is_last = movement <= ROUNDING || movement > 0.5 * before;
            if movement.is_nan() || movement > if is_last { CALM } else { NEAR } {
                return Err(DerivativeError::Neutral);
            }
            if is_last {
                break;
            }
            before = movement;
        }
        let (jacobian, blown) = self.linearise(model, 0.0).ok_or(DerivativeError::Neutral)?;
        let Self { members, component, topology, factor, hinges, .. } = self;
        let is_driven = |&i: &usize| model.motions.iter().any(|driven| driven.body == Body::Segment(i));
        let driven = members.segments.iter().map(is_driven).collect();
        Ok(Set { members, component, topology, jacobian, factor, hinges, blown, driven })
    }

    /// A step, with so much of its movement; returns that [segment lengths, rad].
    fn step(&mut self, jacobian: &Jacobian, share: f64) -> f64 {
        let mut field = Field {
            bodies: self.equations.bodies.iter().map(|body| body.defect).collect(),
            joints: self.equations.joints.iter().map(|joint| joint.rhs).collect(),
        };
        self.hinges.solve(jacobian, &mut self.factor, &mut field, false);
        let component = &mut self.component;
        component.take_multipliers(&field.joints);
        let dp: Vec<_> = field.bodies.iter().map(|&dp| Spatial::zero().plus(dp, share)).collect();
        let (poses, lambda) = (component.poses.clone(), component.lambda.clone());
        component.go_on_from((&poses, &lambda), &dp, 1.0, 0.0);
        let size = |(i, dp): (usize, &Spatial<f64>)| {
            (dp.linear.norm_squared().sqrt() / component.length(i)).max(dp.angular.norm_squared().sqrt())
        };
        let segments = dp[..component.segments()].iter().enumerate();
        segments.map(size).fold(0.0, |most, size| if size.is_nan() || size > most { size } else { most })
    }

    /// Whether some turn of the segments meets no resistance: the inverse power method for the softest.
    fn is_neutral(&mut self, jacobian: &Jacobian) -> bool {
        let component = &self.component;
        let lengths: Vec<f64> = (0..component.segments()).map(|i| component.length(i)).collect();
        let total: f64 = lengths.iter().sum();
        let bending = component.softest_bending() / (total * total);
        let weight: f64 = self.forces.iter().map(|force| force.linear.norm_squared().sqrt()).sum();
        let scale = weight + if bending.is_finite() { bending } else { 0.0 };
        let mut field = Field::zero(&self.topology);
        let mut turns: Vec<Vector3<f64>> = (0..lengths.len())
            .map(|i| Vector3::new(1.3, 2.3, 4.1).map(|k| (k * (i as f64 + 1.0) / lengths.len() as f64).sin()))
            .collect();
        let size = |turns: &[Vector3<f64>]| -> f64 {
            turns.iter().zip(&lengths).map(|(turn, length)| length * turn.norm_squared()).sum::<f64>().sqrt()
        };
        let mut softest = f64::INFINITY;
        for _ in 0..POWERS {
            let before = size(&turns);
            field.joints.fill(Spatial::zero());
            for (i, (turn, length)) in turns.iter().zip(&lengths).enumerate() {
                let torque = if component.is_still(i) { Vector3::zeros() } else { turn * (length / before) };
                field.bodies[i] = joined([Vector3::zeros(), torque]);
            }
            field.bodies[lengths.len()..].fill(Spatial::zero());
            self.hinges.solve(jacobian, &mut self.factor, &mut field, false);
            turns = field.bodies[..lengths.len()].iter().map(|dp| parts(*dp)[1]).collect();
            softest = 1.0 / size(&turns);
        }
        // Not a number where the factor is of no use.
        softest.is_nan() || softest <= NEUTRAL * scale
    }
}

impl Set {
    /// The body of the model.
    fn body(&self, i: usize) -> Body {
        match i.checked_sub(self.members.segments.len()) {
            None => Body::Segment(self.members.segments[i]),
            Some(anchor) => Body::Anchor(self.members.anchors[anchor]),
        }
    }

    fn forward(&mut self, model: &Model, variation: &Variation, out: &mut StateVariation) {
        let Self { members, component, jacobian, factor, hinges, .. } = self;
        let mut moved = Field::zero(&self.topology);
        for (body, &i) in members.segments.iter().enumerate() {
            if component.is_still(body) && !self.driven[body] {
                moved.bodies[body] = joined([variation.start.positions[i], variation.start.turns[i]]);
            }
        }
        for held in &variation.held {
            let body = members.body(held.body).filter(|&body| component.is_still(body));
            if let (Some(body), Some(&pose)) = (body, held.poses.first()) {
                add(&mut moved.bodies[body], joined(pose));
            }
        }
        let mut field = Field::zero(&self.topology);
        jacobian.apply(&moved, false, &mut field);
        field.bodies.iter_mut().chain(&mut field.joints).for_each(|own| *own = -*own);
        let gravity = component.gravity();
        for (body, &i) in members.segments.iter().enumerate().filter(|(body, _)| !component.is_still(*body)) {
            let weight = variation.gravity * model.segments[i].mass() + gravity * variation.segments[i].mass;
            add(&mut field.bodies[body], joined([weight, Vector3::zeros()]));
        }
        let AirVariation { density, normal_drag, tangential_drag, wind } = variation.air;
        let air = Vector6::new(density, normal_drag, tangential_drag, wind.x, wind.y, wind.z);
        for (body, blown) in self.blown.iter().enumerate().take(members.segments.len()) {
            if !component.is_still(body) {
                add(&mut field.bodies[body], of_six(&(blown * air)));
            }
        }
        for (index, body, arm) in component.load_arms().filter(|&(_, body, _)| !component.is_still(body)) {
            let [force, torque] = variation.loads[index];
            add(&mut field.bodies[body], joined([force, torque + arm.cross(&force)]));
        }
        for (j, &index) in members.joints.iter().enumerate() {
            add(&mut field.joints[j], joined(component.missed_along(j, &variation.joints[index])));
        }
        hinges.solve(jacobian, factor, &mut field, false);
        for (body, &i) in members.segments.iter().enumerate() {
            let from = if component.is_still(body) { &moved } else { &field };
            [out.positions[i], out.turns[i]] = parts(from.bodies[body]);
        }
        let turn = |body: u32| {
            let from = if component.is_still(body as usize) { &moved } else { &field };
            parts(from.bodies[body as usize])[1]
        };
        for (j, &index) in members.joints.iter().enumerate() {
            let rows = component.answered(j, field.joints[j]);
            out.forces[index] = component.transmitted_along(j, self.topology.joints[j].map(turn), rows);
        }
    }

    fn backward(&mut self, model: &Model, objective: &StateVariation, wanted: Wanted, out: &mut Variation) {
        let Self { members, component, jacobian, factor, hinges, .. } = self;
        let mut asked = Field::zero(&self.topology);
        for (body, &i) in members.segments.iter().enumerate() {
            asked.bodies[body] = joined([objective.positions[i], objective.turns[i]]);
        }
        for (j, of) in members.joints.iter().map_while(|&j| objective.forces.get(j)).enumerate() {
            let (of_y, turn) = component.transmitted_back(j, joined([of.force, of.moment]));
            asked.joints[j] = of_y;
            let [a, b] = self.topology.joints[j].map(|body| body as usize);
            asked.bodies[a].angular -= turn;
            asked.bodies[b].angular += turn;
        }
        let mut field = asked.clone();
        hinges.solve(jacobian, factor, &mut field, true);
        let mut moved = Field::zero(&self.topology);
        jacobian.apply(&field, true, &mut moved);
        let gravity = component.gravity();
        for (body, &i) in members.segments.iter().enumerate().filter(|(body, _)| !component.is_still(*body)) {
            let [force, _] = parts(field.bodies[body]);
            if wanted.segments {
                out.segments[i].mass += force.dot(&gravity);
            }
            if wanted.surroundings {
                out.gravity += force * model.segments[i].mass();
                if let Some(blown) = self.blown.get(body) {
                    let air = blown.tr_mul(&six(field.bodies[body]));
                    out.air.density += air[0];
                    out.air.normal_drag += air[1];
                    out.air.tangential_drag += air[2];
                    out.air.wind += air.fixed_rows::<3>(3);
                }
            }
        }
        for (index, body, arm) in component.load_arms().filter(|_| wanted.loads) {
            if !component.is_still(body) {
                let [force, torque] = parts(field.bodies[body]);
                out.loads[index][0] += force + torque.cross(&arm);
                out.loads[index][1] += torque;
            }
        }
        for (j, &index) in members.joints.iter().enumerate().filter(|_| wanted.joints) {
            let answer = parts(field.joints[j]);
            let mut numbers = out.joints[index].numbers();
            for (k, number) in numbers.iter_mut().enumerate() {
                let mut unit = [0.0; 12];
                unit[k] = 1.0;
                let missed = component.missed_along(j, &JointVariation::of_numbers(&unit));
                *number += answer[0].dot(&missed[0]) + answer[1].dot(&missed[1]);
            }
            out.joints[index] = JointVariation::of_numbers(&numbers);
        }
        for body in (0..self.topology.bodies()).filter(|&body| self.component.is_still(body)) {
            let pose: Pair = parts(asked.bodies[body].plus(moved.bodies[body], -1.0));
            if let Some(&i) = self.members.segments.get(body)
                && !self.driven[body]
            {
                out.start.positions[i] += pose[0];
                out.start.turns[i] += pose[1];
            }
            out.held.push(HeldVariation { body: self.body(body), poses: vec![pose] });
        }
    }
}

fn add(own: &mut Spatial<f64>, by: Spatial<f64>) {
    *own = own.plus(by, 1.0);
}
