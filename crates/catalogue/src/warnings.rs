//! What is said of learned guesses in a scene that is unlike what they learned from.

use anyhow::Result;
use cosserat::scene::Scene;
use dataset::Scenario;
use terminal::say;

use crate::fitting::foreign;
use crate::guess::Guess;
use crate::name::GuessName;
use crate::training::Training;

impl Training {
    /// Says so where time steps of `dt` [s] are not within those that a network learned from, as far as its card names them.
    pub fn say_time_steps(&self, name: GuessName, guess: &Guess, dt: f64) -> Result<()> {
        #[cfg(feature = "gn")]
        if let Some(simulated) = guess.simulated().filter(|simulated| !self.quiet && !simulated.has_time_step(dt)) {
            let learned = simulated.time_steps();
            say!(
                "{name} learned from time steps of {learned}, but these are of {dt:?} s: its starts may cost more iterations \
                 than they save"
            )?;
        }
        let _ = (name, guess, dt);
        Ok(())
    }

    /// Says so where a scene is unlike all that the learned ones of these guesses learned from.
    pub fn say_foreign(&self, names: &[GuessName], scene: &Scene) -> Result<()> {
        let solves = self.scenario;
        let steps = if solves.teaches_steps() { solves } else { Scenario::Rod };
        for (of_steps, scenario, ranges) in [(false, solves, solves.ranges()), (true, steps, steps.ranges_with_slack())]
        {
            let learned = names.iter().filter(|name| name.is_learned() && name.helps_steps() == of_steps);
            let learned = learned.map(GuessName::to_string).collect::<Vec<_>>().join(", ");
            if let Some(what) = foreign(scene, &ranges).filter(|_| !self.quiet && !learned.is_empty()) {
                say!("{learned} learned from random scenes ({scenario}), where nothing is like this scene: {what}")?;
            }
        }
        Ok(())
    }
}
