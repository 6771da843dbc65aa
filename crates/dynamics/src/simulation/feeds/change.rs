//! Speeds of feeds, and what they store, on the way of a simulation.

use component::Change;
use rod::Body;

use crate::piece::Piece;
use crate::simulation::{Simulation, SimulationError};

impl Simulation {
    /// Lets a feed drive its rod with this speed [m/s] from the next step on, whatever the model says: > 0 pays out.
    ///
    /// # Errors
    /// If the sliding joint has no feed, or the speed is not finite.
    pub fn set_feed(&mut self, joint: usize, speed: f64) -> Result<(), SimulationError> {
        if !speed.is_finite() {
            return Err(SimulationError::NotFinite(format!("the speed of feed {joint}")));
        }
        let is_there =
            self.pieces.iter_mut().flat_map(Piece::singles_mut).any(|set| set.component.set_feed(joint, speed));
        if is_there { Ok(()) } else { Err(SimulationError::NoFeed(joint)) }
    }

    /// Stores segments and lets them out as the step to come needs it, which is so long [s].
    pub(in crate::simulation) fn keep_stores(&mut self, dt: f64) -> Result<(), SimulationError> {
        for k in 0..self.stores.len() {
            let (joint, start) = (self.stores[k].joint, self.stores[k].segments.start);
            let mut due = 0;
            self.singles().for_each(|component| {
                component.each_store(self.time, dt, |of, stored| due = if of == joint { stored } else { due });
            });
            while self.stores[k].stored < due {
                let next = start + self.stores[k].stored;
                self.stores[k].stored += 1;
                self.change(Body::Segment(next), Change::Store)?;
            }
            while self.stores[k].stored > due {
                self.stores[k].stored -= 1;
                let last = start + self.stores[k].stored;
                self.change(Body::Segment(last), Change::LetGo)?;
            }
        }
        Ok(())
    }
}
