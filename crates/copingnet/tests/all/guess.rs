//! The learned guess: bits that depend on the system alone, no allocations.

use copingnet::{GnGuess, Trained};
use dynamics::formulation::Formulation;
use dynamics::guess::InitialGuess;
use dynamics::projection::Projection;

use crate::moving::scenes::{DT, zeros};
use crate::moving::{KINDS, Prepared, in_motion, prepared};

impl Prepared {
    /// A guess that has seen nothing.
    fn new_guess(&self) -> GnGuess {
        let trained = Trained::new(&self.weights, self.encoding.clone());
        GnGuess::new(&trained, self.encoder.graph().clone(), self.normal)
    }

    /// The first system of a step of `dt` [s].
    fn set_dt(&mut self, dt: f64) {
        self.component.predict(0.0, dt, Formulation::Xpbd);
        self.component.evaluate(Formulation::Xpbd);
    }

    /// Another system of the same scene and step.
    fn go_on(&mut self) {
        for (pose, by) in self.component.poses.iter_mut().zip([0.01, -0.02, 0.03].into_iter().cycle()) {
            pose.x.0[0] += by;
        }
        self.component.evaluate(Formulation::Xpbd);
    }
}

#[test]
fn what_came_before_changes_no_bit() {
    for kind in KINDS {
        let (model, state) = in_motion(2);
        let mut prepared = prepared(kind, &model, &state);
        let mut seen = Vec::new();
        for dt in [DT, 0.5 * DT, DT, 0.5 * DT] {
            prepared.set_dt(dt);
            for _ in 0..2 {
                let found = prepared.predicted();
                let mut expected = zeros(found.len());
                prepared.new_guess().predict(&prepared.component, &mut expected);
                assert!(found == expected, "{kind:?} {dt}");
                seen.push(found);
                prepared.go_on();
            }
        }
        // Both what changes and what does not had a say; the paper's inputs know no time step, but poses follow it.
        assert!(seen[0] != seen[1] && seen[0] != seen[2]);
    }
}

#[test]
fn the_first_call_alone_allocates() {
    for kind in KINDS {
        let (model, state) = in_motion(2);
        let mut prepared = prepared(kind, &model, &state);
        let mut dlambda = prepared.predicted();
        let mut dp = zeros(prepared.component.poses.len());
        for dt in [DT, 0.5 * DT, DT] {
            prepared.set_dt(dt);
            let Prepared { guess, component, .. } = &mut prepared;
            let count = allocation_counter::measure(|| {
                guess.predict(component, &mut dlambda);
                guess.start_solve(component, 0, &mut dlambda);
                guess.project(component, 0, &mut dp, &mut dlambda);
            });
            assert_eq!(count.count_total, 0, "{kind:?} {dt}");
        }
    }
}

#[test]
fn only_the_first_outer_iteration_is_started() {
    for kind in KINDS {
        let (model, state) = in_motion(1);
        let mut prepared = prepared(kind, &model, &state);
        let expected = prepared.predicted();
        let mut dlambda = zeros(expected.len());
        assert!(prepared.guess.helps_solves() && !prepared.guess.helps_steps());
        for iteration in [1, 2] {
            assert!(!prepared.guess.start_solve(&prepared.component, iteration, &mut dlambda));
            assert!(dlambda == zeros(expected.len()));
        }
        assert!(prepared.guess.start_solve(&prepared.component, 0, &mut dlambda));
        assert!(dlambda == expected);
    }
}
