//! What is read at every step of a run, whichever frames are kept: extremes of what probes read, and of what is in rods.

use std::collections::BTreeMap;

use cosserat::motion::{Reaction, Wrench};
use cosserat::simulation::{ContactForce, Simulation, contact_wrenches};
use cosserat::state::{JointForce, Model, Probe, Quantity, Reading, Sliding, State};
use export::Envelope;
use serde::Serialize;

/// What one column of a probe reads over a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Extremes {
    /// At the end of the last step; NaN where there is nothing to read then.
    end: f64,
    min: f64,
    min_time_s: f64,
    max: f64,
    max_time_s: f64,
}

impl Extremes {
    /// Takes a value at a time into those of a column.
    fn take(of: &mut BTreeMap<&'static str, Self>, column: &'static str, value: f64, time: f64) {
        let new = Self { end: value, min: value, min_time_s: time, max: value, max_time_s: time };
        let own = of.entry(column).or_insert(new);
        own.end = value;
        if value < own.min {
            (own.min, own.min_time_s) = (value, time);
        }
        if value > own.max {
            (own.max, own.max_time_s) = (value, time);
        }
    }
}

/// Columns with what was read, by the names of the probes. A column that nothing was read of is missing: that of a force
/// before the first step.
pub(crate) type OfProbes = BTreeMap<String, BTreeMap<&'static str, Extremes>>;

/// Watches a run step by step.
pub(crate) struct Watch<'a> {
    probes: &'a [Probe],
    found: OfProbes,
    /// Names of eyelets, and what is read of them.
    eyelets: (&'a [String], OfProbes),
    /// Memory for where they are.
    sliding: Vec<Sliding>,
    pub(crate) envelope: Option<Envelope>,
    /// Whether a probe reads what holds rods, which needs the state before.
    reads_reactions: bool,
    before: Option<(f64, State)>,
    /// What joints transmit at the end of the last step.
    forces: Vec<JointForce>,
    /// Memory for what presses on what, and for what that gives to segments.
    contact_forces: Vec<ContactForce>,
    contacts: Vec<Wrench>,
}

impl<'a> Watch<'a> {
    /// A watch over a run that begins at `time` [s] with `state`, of these probes and, if that is wanted, of what is in rods;
    /// `None` where there is nothing to watch.
    pub(crate) fn new(
        model: &Model,
        state: &State,
        time: f64,
        (probes, eyelets): (&'a [Probe], &'a [String]),
        wants_envelope: bool,
    ) -> Option<Self> {
        if probes.is_empty() && eyelets.is_empty() && !wants_envelope {
            return None;
        }
        let mut quantities = probes.iter().flat_map(|probe| &probe.quantities);
        let mut watch = Self {
            probes,
            found: BTreeMap::new(),
            eyelets: (eyelets, BTreeMap::new()),
            sliding: vec![Sliding::default(); eyelets.len()],
            envelope: wants_envelope.then(|| Envelope::new(model)),
            reads_reactions: quantities.any(|&quantity| quantity == Quantity::Reaction),
            before: None,
            forces: vec![JointForce::default(); model.joints.len()],
            contact_forces: Vec::new(),
            contacts: Vec::new(),
        };
        watch.read(model, state, time, &[], &[]);
        Some(watch)
    }

    /// Takes the state at the end of a step, when what changes of the model is that of this time.
    pub(crate) fn observe(&mut self, model: &Model, state: &State, simulation: &Simulation) {
        let mut forces = std::mem::take(&mut self.forces);
        simulation.store_joint_forces(&mut forces);
        let mut contacts = std::mem::take(&mut self.contacts);
        if self.reads_reactions && !model.contacts.is_empty() {
            simulation.store_contact_forces(&mut self.contact_forces);
            contact_wrenches(&self.contact_forces, state, &mut contacts);
        }
        self.read(model, state, simulation.time(), &forces, &contacts);
        self.read_eyelets(simulation);
        (self.forces, self.contacts) = (forces, contacts);
    }

    /// What the probes have read; `None` where there are none.
    pub(crate) fn probes(&self) -> Option<&OfProbes> {
        (!self.probes.is_empty()).then_some(&self.found)
    }

    /// What was read of eyelets; `None` where there are none.
    pub(crate) fn eyelets(&self) -> Option<&OfProbes> {
        (!self.eyelets.0.is_empty()).then_some(&self.eyelets.1)
    }

    fn read_eyelets(&mut self, simulation: &Simulation) {
        let (names, found) = &mut self.eyelets;
        if names.is_empty() {
            return;
        }
        simulation.store_sliding(&mut self.sliding);
        for (name, Sliding { place, rate, force }) in names.iter().zip(&self.sliding) {
            let own = found.entry(name.clone()).or_default();
            for (column, value) in [("place_m", *place), ("rate_m_s", *rate), ("force_n", force.norm())] {
                Extremes::take(own, column, value, simulation.time());
            }
        }
    }

    fn read(&mut self, model: &Model, state: &State, time: f64, forces: &[JointForce], contacts: &[Wrench]) {
        if let Some(envelope) = &mut self.envelope {
            envelope.observe(model, state, forces);
        }
        let mut reactions = Vec::new();
        if let Some((before, earlier)) = self.before.as_ref().filter(|_| !forces.is_empty()) {
            reactions = Reaction::all(model, [earlier, state], [*before, time], forces, contacts);
        }
        let mut values = Vec::new();
        for probe in self.probes {
            probe.read(&Reading { model, time, state, forces, reactions: &reactions }, &mut values);
            let columns = probe.quantities.iter().flat_map(|quantity| quantity.columns());
            let found = self.found.entry(probe.name.clone()).or_default();
            for (&column, &value) in columns.zip(&values) {
                if value.is_finite() {
                    Extremes::take(found, column, value, time);
                } else if let Some(own) = found.get_mut(column) {
                    own.end = f64::NAN;
                }
            }
        }
        if self.reads_reactions {
            self.before = Some((time, state.clone()));
        }
    }
}
