//! Iterations with the exact tangent of a set that contacts push: the rods' own step, the set's share of the contacts' operator, the
//! step with their impulses, all from one factor.

use std::sync::Arc;

use component::Component;
use jointed::linear::LinearInfo;
use jointed::linear::articulated::{Articulated, Side};
use jointed::topology::Topology;
use kernels::Spatial;

use super::{Attempt, Exact, Touching};
use crate::attempt::count_iteration;
use crate::counters::{Counters, Stopwatch};

impl Exact<f64> {
    /// Begins an attempt at a step.
    pub(crate) fn begin_attempt(&mut self) {
        self.factored_at = f64::INFINITY;
        (self.touching.is_taken, self.touching.is_given_up) = (false, false);
    }

    /// Leaves all further iterations of the attempt to the positive matrix: the last one was of no use.
    pub(crate) fn give_up(&mut self) {
        self.touching.is_given_up = true;
    }

    /// Leaves an iteration to the positive matrix.
    pub(crate) fn leave(&mut self) {
        self.touching.is_taken = false;
    }

    /// Whether the iteration under way takes the exact tangent.
    pub(crate) fn is_taken(&self) -> bool {
        self.touching.is_taken
    }

    /// The rods' own step from the last evaluation, an iteration of `attempt`; returns whether there is one.
    pub(crate) fn project(
        &mut self,
        component: &mut Component<f64>,
        attempt: &Attempt<f64>,
        counters: &mut Counters,
    ) -> bool {
        let may_be = !self.touching.is_given_up && self.elimination.is_of_tree() && component.has_multipliers(0);
        let worst = (attempt.residuals.worst(), attempt.target);
        self.touching.is_taken = match component.slides() {
            true => self.find_bordered(component, counters),
            false => may_be && self.find(component, 1, worst, counters) != 0,
        };
        if self.touching.is_taken {
            count_iteration(component, &LinearInfo::default(), 1, false, counters);
        }
        self.touching.is_taken
    }

    /// The corrections dp of the step as it is, one entry a body.
    pub(crate) fn corrections(&self) -> &[Spatial<f64>] {
        &self.dp
    }

    /// Takes the component's `pushes` into the step.
    pub(crate) fn answer_pushes(&mut self, component: &mut Component<f64>, counters: &mut Counters) {
        let mut watch = Stopwatch::start();
        let Self { equations, elimination, dp, .. } = self;
        let bodies = equations.bodies.iter_mut().zip(&component.pushes);
        for (body, push) in bodies.filter(|(body, _)| !body.is_held()) {
            body.defect = body.defect.plus(*push, 1.0);
        }
        elimination.solve_again(equations);
        match component.slides() {
            // What has a factor has a solution.
            true => _ = self.solve_border(component),
            false => component.take_solution(elimination, dp, 1.0),
        }
        watch.mark(&mut counters.times.contact);
    }

    /// Takes the step.
    pub(crate) fn go_on(&mut self, component: &mut Component<f64>, counters: &mut Counters) {
        let mut watch = Stopwatch::start();
        let Self { dp, poses, lambda, .. } = self;
        poses.clone_from(&component.poses);
        lambda.clone_from(&component.lambda);
        component.go_on_from((poses, lambda), dp, 1.0, 1.0);
        if component.slides() {
            component.move_eyelets(1.0);
            component.correction = component.correction.max(component.eyelet_correction());
        }
        watch.mark(&mut counters.times.update);
    }

    /// The work that unit forces of the `sides` do on each other's answers: see [`Transfers::couple`].
    pub(crate) fn couple(
        &mut self,
        topology: &Arc<Topology>,
        sides: &[Side],
        mut block: impl FnMut(usize, usize, [[f64; 3]; 3]),
    ) {
        let Self { equations, elimination, touching: Touching { transfers, .. }, .. } = self;
        if transfers.as_ref().is_none_or(|transfers| !transfers.is_of(topology)) {
            *transfers = Articulated::rooted(topology).map(Box::new);
        }
        let Some(transfers) = transfers else { return };
        transfers.couple_following(|take| elimination.each_answer(equations, take), sides, &mut block);
        if self.bordered.is_there() {
            self.couple_through_eyelets(sides, block);
        }
    }
}

#[cfg(test)]
mod tests {
    use component::{Change, split};
    use kernels::math::Vec3;
    use nalgebra::Vector3;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rod::{Assembly, Material, RodSpec, shape};

    use super::*;
    use crate::attempt::begin;
    use crate::formulation::Formulation;
    use crate::start::NoGuess;
    use crate::step::{Interval, StepParams};

    fn random(random: &mut ChaCha8Rng, size: f64) -> Vec3<f64> {
        Vec3([(); 3].map(|()| random.random_range(-size..size)))
    }

    /// A rod of `segments`, with a branch if it is to have one, held at its start or not.
    fn rod(segments: usize, has_branch: bool, is_held: bool) -> Component<f64> {
        let mut assembly = Assembly::new(Vector3::z() * -9.81);
        let material = Material { youngs_modulus: 1e5, torsion_modulus: 3e4, density: 300.0 };
        let line = |from: Vector3<f64>, direction: Vector3<f64>, segments: usize| {
            RodSpec::new(shape::straight(from, direction, 0.1 * segments as f64, segments), 0.02, material)
        };
        let rod = assembly.rod(&line(Vector3::zeros(), Vector3::x(), segments));
        if has_branch {
            let middle = rod.start + segments / 2;
            let twig = assembly.rod(&line(Vector3::x() * (0.1 * (segments / 2 + 1) as f64), Vector3::y(), 3));
            assembly.branch(middle, 1.0, &twig);
        }
        if is_held {
            assembly.fix(rod.start);
        }
        let (model, state) = assembly.finish();
        let (members, topology) = split(&model).swap_remove(0);
        Component::new(&model, &state, Arc::new(topology), &[&members])
    }

    /// Answers by transfers are those of solves with the same factor, for unit forces one by one.
    #[test]
    fn the_operator_is_that_of_solves_with_the_factor() {
        let params = StepParams { formulation: Formulation::Newton, ..StepParams::DEFAULT };
        let rng = &mut ChaCha8Rng::seed_from_u64(11);
        for (segments, has_branch, is_held, holds) in [
            (1, false, false, None),
            (2, false, false, None),
            (8, false, false, None),
            (9, false, true, None),
            (6, true, false, None),
            (7, true, true, None),
            // Held on the way, which the connectivity does not know.
            (8, false, false, Some(0)),
            (9, false, false, Some(3)),
            (8, true, true, Some(5)),
        ] {
            let what = format!("{segments} segments, branch {has_branch}, held {is_held}, then {holds:?}");
            let (mut component, mut counters) = (rod(segments, has_branch, is_held), Counters::default());
            holds.into_iter().for_each(|body| component.change(0, body, Change::Hold));
            let interval = Interval { time: 0.0, dt: 0.01 };
            let mut attempt = begin(&mut component, interval, &params, &mut NoGuess, &mut counters);
            for lambda in &mut component.lambda {
                *lambda = Spatial { linear: random(rng, 1e-5), angular: random(rng, 1e-6) };
            }
            attempt.residuals = crate::attempt::evaluate(&mut component, Formulation::Newton, &mut counters);
            let topology = component.system.topology.clone();
            let mut exact = Exact::new(&topology).unwrap();
            exact.begin_attempt();
            // A single segment transmits nothing, and has the tangent all the same.
            let is_taken = exact.project(&mut component, &attempt, &mut counters)
                || exact.find(&mut component, 1, (attempt.residuals.worst(), attempt.target), &mut counters) != 0;
            assert!(is_taken, "{what}");
            let is_free = |body: &usize| !topology.fixed[*body] && holds != Some(*body);
            let moves: Vec<_> = (0..topology.bodies()).filter(is_free).collect();
            let sides: Vec<_> = (0..7)
                .map(|contact| {
                    let forces = [(); 3].map(|()| Spatial { linear: random(rng, 1.0), angular: random(rng, 0.1) });
                    Side { contact, body: moves[rng.random_range(0..moves.len())] as u32, forces }
                })
                .collect();
            let mut blocks = vec![[[f64::NAN; 3]; 3]; sides.len() * sides.len()];
            exact.couple(&topology, &sides, |s, t, block| blocks[s * sides.len() + t] = block);
            exact.equations.bodies.iter_mut().for_each(|body| body.defect = Spatial::zero());
            exact.equations.joints.iter_mut().for_each(|joint| joint.rhs = Spatial::zero());
            let mut pairs = 0;
            for (t, side) in sides.iter().enumerate() {
                for c in 0..3 {
                    exact.equations.bodies[side.body as usize].defect = side.forces[c];
                    assert!(exact.elimination.solve_again(&exact.equations));
                    for (s, other) in sides.iter().enumerate() {
                        let [found, mirrored] = [s * sides.len() + t, t * sides.len() + s].map(|k| blocks[k]);
                        let answer = exact.elimination.corrections[other.body as usize];
                        for r in 0..3 {
                            let found = if found[r][c].is_nan() { mirrored[c][r] } else { found[r][c] };
                            let expected = other.forces[r].dot(answer);
                            let size = side.forces[c].dot(exact.elimination.corrections[side.body as usize]);
                            assert!((found - expected).abs() < 1e-7 * size.abs(), "{what}: {found} {expected} {size}");
                            pairs += 1;
                        }
                    }
                    exact.equations.bodies[side.body as usize].defect = Spatial::zero();
                }
            }
            assert_eq!(pairs, 9 * 49, "{what}");
        }
    }
}
