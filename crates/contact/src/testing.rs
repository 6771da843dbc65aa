//! Free rods of one segment and more that may touch, for the tests of this crate.

use std::sync::Arc;

use component::{Component, Formulation, Members, split};
use nalgebra::Vector3;
use rod::{Assembly, Material, Model, RodSpec, Surface, shape};

use super::NarrowPhaseParams;
use super::broad_phase::BroadPhase;
use super::duplicates::shapes;
use super::exclusion::PairFilter;
use super::geometry::Contact;
use super::narrow_phase::NarrowPhase;
use super::shape::{Components, Shape};

/// A straight rod: its centre and the whole way along it [m], segments, radius [m] and velocity [m/s].
pub(super) type Straight = ([f64; 3], [f64; 3], usize, f64, [f64; 3]);

/// Rods, their connected sets and the shapes of their segments.
pub(super) struct Rods {
    model: Model,
    pub(super) sets: Vec<Component<f64>>,
    pub(super) shapes: Vec<Shape>,
}

impl Components for Vec<Component<f64>> {
    fn component(&self, number: u32) -> &Component<f64> {
        &self[number as usize]
    }
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
        let (members, topologies): (Vec<Members>, Vec<_>) = split(&model).into_iter().unzip();
        let component = |(members, topology)| Component::new(&model, &state, Arc::new(topology), &[members]);
        let sets = members.iter().zip(topologies).map(component).collect();
        let shapes = shapes(&model, members.iter());
        Self { model, sets, shapes }
    }

    /// Predicts a step of `dt` [s].
    pub(super) fn predict(&mut self, dt: f64) {
        for set in &mut self.sets {
            set.predict(0.0, dt, Formulation::Xpbd);
            set.evaluate(Formulation::Xpbd);
        }
    }

    /// Their contacts, and what has found them.
    pub(super) fn find(&mut self) -> (NarrowPhase, BroadPhase, Vec<Contact>) {
        let filter = PairFilter::new(&self.model);
        let detector = NarrowPhase::new(&self.model, self.shapes.clone(), filter, NarrowPhaseParams::DEFAULT);
        let (mut search, mut contacts) = (BroadPhase::default(), Vec::new());
        search.of(0..self.shapes.len() as u32);
        detector.detect(&mut search, false, &self.sets, &mut contacts);
        (detector, search, contacts)
    }
}
