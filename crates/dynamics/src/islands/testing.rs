//! Free rods of one segment and more that may touch, for the tests of this module.

use std::sync::Arc;

use component::{Component, split};
use contact::NarrowPhaseParams;
use contact::broad_phase::BroadPhase;
use contact::duplicates::shapes;
use contact::exclusion::PairFilter;
use contact::geometry::Contact;
use contact::narrow_phase::NarrowPhase;
use contact::shape::Shape;
use jointed::linear::compliance::Compliance;
use jointed::linear::solvers::SolverKind;
use kernels::Spatial;
use nalgebra::Vector3;
use rod::{Assembly, Material, Model, RodSpec, State, Surface, shape};

use super::Sets;
use crate::connected_set::{ConnectedSet, Projector, Touch};
use crate::formulation::Formulation;

/// A straight rod: its centre and the whole way along it [m], segments, radius [m] and velocity [m/s].
pub(super) type Straight = ([f64; 3], [f64; 3], usize, f64, [f64; 3]);

/// Rods, their connected sets and the shapes of their segments.
pub(super) struct Rods {
    pub(super) model: Model,
    #[allow(clippy::vec_box)]
    pub(super) sets: Vec<Box<ConnectedSet>>,
    /// Their numbers.
    pub(super) seats: Vec<u32>,
    pub(super) shapes: Vec<Shape>,
}

impl Rods {
    /// Straight rods without weight.
    pub(super) fn new(rods: &[Straight]) -> Self {
        let material = Material { youngs_modulus: 1e6, torsion_modulus: 1e6, density: 1000.0 };
        let mut assembly = Assembly::new(Vector3::zeros());
        for &(centre, along, segments, radius, velocity) in rods {
            let (centre, along) = (Vector3::from(centre), Vector3::from(along));
            let nodes = shape::straight(centre - along * 0.5, along.normalize(), along.norm(), segments);
            let rod = assembly.rod(&RodSpec::new(nodes, radius, material));
            assembly.state_mut().velocities[rod].fill(velocity.into());
        }
        assembly.model_mut().contacts.between_segments = Some(Surface::default());
        let (model, state) = assembly.finish();
        let sets = sets(&model, &state);
        let shapes = shapes(&model, sets.iter().map(|set| &set.members));
        let seats = (0..sets.len() as u32).collect();
        Self { model, sets, seats, shapes }
    }

    /// Predicts a step of `dt` [s].
    pub(super) fn predict(&mut self, dt: f64) {
        for set in &mut self.sets {
            set.component.predict(0.0, dt, Formulation::Xpbd);
            set.component.evaluate(Formulation::Xpbd);
        }
    }

    /// All sets.
    pub(super) fn all(&mut self) -> Sets<'_> {
        Sets::new(&mut self.sets, &self.seats)
    }

    /// Their contacts, and what has found them.
    pub(super) fn find(&mut self) -> (NarrowPhase, BroadPhase, Vec<Contact>) {
        let (detector, mut search, mut contacts) = (self.detector(), BroadPhase::default(), Vec::new());
        search.of(0..self.shapes.len() as u32);
        detector.detect(&mut search, false, &self.all(), &mut contacts);
        (detector, search, contacts)
    }

    /// What finds their contacts.
    fn detector(&self) -> NarrowPhase {
        NarrowPhase::new(&self.model, self.shapes.clone(), PairFilter::new(&self.model), NarrowPhaseParams::DEFAULT)
    }
}

#[allow(clippy::vec_box)]
fn sets(model: &Model, state: &State) -> Vec<Box<ConnectedSet>> {
    let set = |(number, (members, topology))| {
        let solver = SolverKind::Direct.build(model, &members, &topology).expect("a solver");
        let mut component = Component::new(model, state, Arc::new(topology), &[&members]);
        component.pushes = vec![Spatial::zero(); component.poses.len()];
        component.pushed = component.pushes.clone();
        let response = Compliance::new(&component.system, true).expect("a factor");
        let mut set = ConnectedSet::new(component, members, Projector::Solve { solver, guess: None });
        set.touch = Some(Box::new(Touch::new(number, response)));
        Box::new(set)
    };
    (0..).zip(split(model)).map(set).collect()
}
