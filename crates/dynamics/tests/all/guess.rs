//! Guesses inside and outside of the simulation.

use component::{BodyPose, Component, Members};
use dynamics::counters::Counters;
use dynamics::formulation::Formulation;
use dynamics::guess::{Fischer, GuessKind, InitialGuess};
use dynamics::simulation::{Settings, Simulation, SimulationError};
use dynamics::step::{Status, StepParams};
use jointed::linear::cg::CgParams;
use jointed::linear::precondition::PreconditionerKind;
use jointed::linear::solvers::SolverKind;
use jointed::topology::Topology;
use kernels::Spatial;
use kernels::math::Vec3;
use rod::Integrator;
use rod::{Model, State};

use crate::common::*;

fn built(kind: GuessKind, model: &Model, members: &Members, component: &Component<f64>) -> Box<dyn InitialGuess> {
    kind.build(model, members, &component.system.topology).unwrap()
}

fn started(guess: &mut dyn InitialGuess, component: &Component<f64>, iteration: usize) -> Option<Vec<Spatial<f64>>> {
    let mut x = vec![Spatial::zero(); component.system.joints.len()];
    guess.start_solve(component, iteration, &mut x).then_some(x)
}

/// Rotates a solved component about the vertical: positions do not matter to A, orientations do.
fn turned(component: &Component<f64>, angle: f64) -> Component<f64> {
    let turn = kernels::math::Quat { v: Vec3([0.0, 0.0, (0.5 * angle).sin()]), w: (0.5 * angle).cos() };
    let mut out = component.clone();
    for body in &mut out.system.bodies {
        body.orientation = (turn * body.orientation).normalized();
        body.axis = body.orientation.axis();
        let w = body.inverse_inertia.full().map(|row| turn.rotate(Vec3(row)));
        let columns = kernels::math::transposed(w.map(|row| row.0)).map(|column| turn.rotate(Vec3(column)).0);
        let [[xx, xy, xz], [_, yy, yz], [_, _, zz]] = columns;
        body.inverse_inertia = kernels::math::Sym3([xx, yy, zz, xy, xz, yz]);
    }
    for (joint, x) in out.system.joints.iter_mut().zip(&mut out.dlambda) {
        joint.t = turn.rotate(joint.t);
        joint.rhs.linear = turn.rotate(joint.rhs.linear);
        x.linear = turn.rotate(x.linear);
    }
    out
}

fn iterations(
    model: &Model,
    members: &Members,
    component: &Component<f64>,
    start: &[Spatial<f64>],
    tolerance: f64,
) -> u64 {
    let params = CgParams { preconditioner: PreconditionerKind::BlockJacobi, tolerance, ..CgParams::default() };
    let mut solver = SolverKind::Cg(params).build(model, members, &component.system.topology).unwrap();
    solver.solve(&component.system, true, &mut start.to_vec()).iterations
}

#[test]
fn the_exact_solution_in_the_history_is_found_even_if_the_rod_has_turned() {
    let (model, state) = rod(3.0, 25, 0.05, material(1e5, 1000.0));
    let (mut component, members) = component_after(&model, &state, 20, Formulation::Newton);
    let solution = spatials(&dense_solution(&component.system));
    for kind in [GuessKind::Previous, GuessKind::Fischer(1), GuessKind::Fischer(8)] {
        let mut guess = built(kind, &model, &members, &component);
        assert!(started(guess.as_mut(), &component, 0).is_none());
        component.dlambda.copy_from_slice(&solution);
        guess.observe_solve(&component, 0);
        guess.observe_step(&component);
        for angle in [0.0, 2.0] {
            let now = turned(&component, angle);
            let start = started(guess.as_mut(), &now, 0).unwrap();
            assert!(iterations(&model, &members, &now, &start, 1e-8) <= 1, "{kind}");
        }
        assert!(started(guess.as_mut(), &component, 1).is_none(), "no history of the second outer iteration");
    }
}

#[test]
fn a_projection_survives_dependent_huge_and_useless_solutions() {
    let (model, state) = helix(24);
    let (mut component, _) = component_after(&model, &state, 15, Formulation::Xpbd);
    let solution = dense_solution(&component.system);
    let a = dense_matrix(&component.system);
    let error = |x: &[Spatial<f64>]| {
        let e = flat(x) - &solution;
        (e.dot(&(&a * &e)) / solution.dot(&(&a * &solution))).sqrt()
    };
    let mut guess = Fischer::new(8, &component.system.topology);
    let mut rng = 1_u32;
    for round in 0..12 {
        for (j, x) in component.dlambda.iter_mut().enumerate() {
            let mut values = [0.0; 6];
            for (k, value) in values.iter_mut().enumerate() {
                rng = rng.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let noise = f64::from(rng) / f64::from(u32::MAX) - 0.5;
                *value = match round % 4 {
                    0 => solution[6 * j + k] * (1.0 + 0.1 * noise),
                    1 => 1e12 * noise,
                    2 => solution[6 * j + k] * 2.0,
                    _ => 0.0,
                };
            }
            *x = Spatial::from_array(values);
        }
        guess.observe_solve(&component, 0);
        let start = started(&mut guess, &component, 0).unwrap();
        assert!(error(&start) <= 1.0 + 1e-12, "a projection is never worse than zero");
        if round >= 2 {
            assert!(error(&start) < 1e-6, "round {round}: {}", error(&start));
        }
    }
    component.dlambda.fill(Spatial::from_array([f64::NAN; 6]));
    guess.observe_solve(&component, 0);
    assert!(error(&started(&mut guess, &component, 0).unwrap()) < 1e-6, "what is not finite is not kept");
}

#[test]
fn the_frozen_guess_is_exact_at_the_rest_shape() {
    for (model, state) in [tree(), ring(), helix(24)] {
        let (component, members) = component_after(&model, &state, 0, Formulation::Xpbd);
        let mut guess = built(GuessKind::Frozen, &model, &members, &component);
        let start = started(guess.as_mut(), &component, 0).unwrap();
        assert_eq!(iterations(&model, &members, &component, &start, 1e-8), 0);
    }
}

fn simulated(
    scene: &(Model, State),
    solver: SolverKind,
    formulation: Formulation,
    guess: GuessKind,
    dt: &dyn Fn(usize) -> f64,
) -> (State, Counters) {
    let (model, state) = scene;
    let integrator = Integrator::Euler;
    let step = StepParams {
        formulation,
        integrator,
        relative_tolerance: 1e-7,
        motion_tolerance: 1e-7,
        ..StepParams::default()
    };
    let factory = |model: &Model, members: &Members, topology: &Topology| guess.build(model, members, topology);
    let mut simulation = Simulation::new(model, state, &Settings { step, solver }, Some(&factory)).unwrap();
    for k in 0..30 {
        // Branches of the tree fold past half a turn.
        assert!(simulation.step(dt(k)).unwrap().status <= Status::PastHalfTurn);
    }
    let mut end = state.clone();
    simulation.store(&mut end);
    (end, simulation.counters())
}

fn distance(a: &State, b: &State) -> f64 {
    a.positions.iter().zip(&b.positions).map(|(x, y)| (x - y).norm()).fold(0.0, f64::max)
}

const SOLVE_GUESSES: [GuessKind; 5] =
    [GuessKind::Previous, GuessKind::Linear, GuessKind::Quadratic, GuessKind::Fischer(8), GuessKind::Frozen];
const STEP_GUESSES: [GuessKind; 4] =
    [GuessKind::StepPrevious, GuessKind::StepLinear, GuessKind::StepQuadratic, GuessKind::StepAdaptive];

#[test]
fn guesses_of_solves_save_iterations_and_leave_the_motion_alone() {
    let solver = SolverKind::Cg(CgParams { tolerance: 1e-5, ..CgParams::default() });
    for scene in [rod(3.0, 20, 0.05, material(1e5, 300.0)), tree()] {
        let (exact, _) = simulated(&scene, SolverKind::Sparse, Formulation::Xpbd, GuessKind::Zero, &|_| DT);
        let (zero, plain) = simulated(&scene, solver, Formulation::Xpbd, GuessKind::Zero, &|_| DT);
        assert!(distance(&exact, &zero) < 1e-5);
        for guess in SOLVE_GUESSES {
            let (end, counters) = simulated(&scene, solver, Formulation::Xpbd, guess, &|_| DT);
            assert!(distance(&exact, &end) < 1e-5, "{guess}");
            assert!(counters.guesses_used > 0 && counters.guesses_dropped == 0, "{guess}");
            let share = counters.linear_iterations as f64 / plain.linear_iterations as f64;
            assert!(
                share < if matches!(guess, GuessKind::Frozen | GuessKind::Previous) { 1.1 } else { 1.0 },
                "{guess}: {share}"
            );
        }
    }
}

#[test]
fn guesses_of_steps_save_outer_iterations_and_leave_the_motion_alone() {
    let scene = rod(3.0, 30, 0.01, material(1e4, 1000.0));
    let run = |guess| simulated(&scene, SolverKind::Direct, Formulation::Newton, guess, &|_| DT);
    let (exact, plain) = run(GuessKind::Zero);
    for guess in STEP_GUESSES {
        let (end, counters) = run(guess);
        assert!(distance(&exact, &end) < 1e-5, "{guess}: {:e}", distance(&exact, &end));
        assert!(counters.iterations <= plain.iterations, "{guess}: {} {}", counters.iterations, plain.iterations);
    }
    let best = run(GuessKind::StepQuadratic).1;
    assert!(10 * best.iterations < 9 * plain.iterations, "{} {}", best.iterations, plain.iterations);
}

/// The parabola where it saves iterations, and next to none where there are none to save; the motion is the same.
#[test]
fn the_adaptive_start_follows_the_cheaper_one() {
    let mut swings = rod(3.0, 30, 0.05, material(1e5, 100.0));
    swings.0.measure_as_in_paper();
    let (mut model, state) = rod(3.0, 30, 0.05, material(1e5, 100.0));
    model.gravity.fill(0.0);
    for (scene, pays) in [(swings, true), ((model, state), false)] {
        let run = |guess| simulated(&scene, SolverKind::Direct, Formulation::Newton, guess, &|_| DT);
        let [(exact, zero), (_, parabola), (end, adaptive)] =
            [GuessKind::Zero, GuessKind::StepQuadratic, GuessKind::StepAdaptive].map(run);
        assert!(distance(&exact, &end) < 1e-5);
        let tried = adaptive.guesses_used + adaptive.guesses_dropped;
        let iterations = [zero.iterations, parabola.iterations, adaptive.iterations];
        println!("from zero, the parabola, the cheaper: {iterations:?} iterations, {tried} tried");
        if pays {
            assert!(parabola.iterations < zero.iterations && tried > 15, "{iterations:?}, {tried}");
            assert!(2 * adaptive.iterations < zero.iterations + parabola.iterations, "{iterations:?}");
        } else {
            // Each of the 30 steps takes one solve to know. Two guesses in the beginning, and one turn of twelve steps.
            assert_eq!((iterations, tried), ([30; 3], 4));
        }
    }
}

#[test]
fn a_changing_time_step_does_no_harm() {
    let scene = rod(2.0, 15, 0.05, material(1e5, 300.0));
    let dt = |k: usize| [0.02, 0.02, 0.005, 0.04][k / 3 % 4];
    let solver = SolverKind::Cg(CgParams { tolerance: 1e-10, ..CgParams::default() });
    for (guesses, formulation) in [(&SOLVE_GUESSES[..], Formulation::Xpbd), (&STEP_GUESSES, Formulation::Newton)] {
        let (exact, plain) = simulated(&scene, solver, formulation, GuessKind::Zero, &dt);
        for &guess in guesses {
            let (end, counters) = simulated(&scene, solver, formulation, guess, &dt);
            assert!(distance(&exact, &end) < 1e-5, "{guess}");
            let share = counters.linear_iterations as f64 / plain.linear_iterations as f64;
            assert!(share < 1.25, "{guess}: {share}, {} of {}", counters.iterations, plain.iterations);
        }
    }
}

#[test]
fn only_newton_takes_guesses_of_steps() {
    let (model, state) = rod(1.0, 5, 0.05, material(1e5, 300.0));
    let factory =
        |model: &Model, members: &Members, topology: &Topology| GuessKind::StepLinear.build(model, members, topology);
    let settings = settings(Formulation::Xpbd, SolverKind::Direct);
    let error = Simulation::new(&model, &state, &settings, Some(&factory)).err().unwrap();
    assert!(matches!(error, SimulationError::StepGuess(Formulation::Xpbd)));
}

#[test]
fn a_wild_start_of_a_step_gives_way_to_the_prediction() {
    struct Wild;
    impl InitialGuess for Wild {
        fn helps_steps(&self) -> bool {
            true
        }
        fn start_step(
            &mut self,
            _: &Component<f64>,
            poses: &mut [component::BodyPose<f64>],
            _: &mut [Spatial<f64>],
        ) -> bool {
            poses.iter_mut().enumerate().skip(1).for_each(|(i, pose)| pose.x.0[1] += (7.0 * i as f64).sin());
            true
        }
    }
    let (model, state) = rod(1.0, 5, 0.05, material(1e5, 300.0));
    let factory = |_: &Model, _: &Members, _: &Topology| Some(Box::new(Wild) as Box<dyn InitialGuess>);
    let step = StepParams { formulation: Formulation::Newton, ..StepParams::default() };
    let settings = Settings { step, ..Settings::default() };
    let mut wild = Simulation::new(&model, &state, &settings, Some(&factory)).unwrap();
    let mut plain = Simulation::new(&model, &state, &settings, Some(&|_, _, _| None)).unwrap();
    for _ in 0..10 {
        wild.step(DT).unwrap();
        plain.step(DT).unwrap();
    }
    let [mut a, mut b] = [state.clone(), state];
    wild.store(&mut a);
    plain.store(&mut b);
    assert_eq!(a, b);
    assert_eq!((wild.counters().guesses_used, wild.counters().guesses_dropped), (0, 10));
}

/// A start that is finite, and nowhere near: poses this far off, and multipliers of this size.
struct Absurd {
    way: f64,
    multipliers: f64,
}

impl InitialGuess for Absurd {
    fn helps_steps(&self) -> bool {
        true
    }

    fn start_step(&mut self, _: &Component<f64>, poses: &mut [BodyPose<f64>], lambda: &mut [Spatial<f64>]) -> bool {
        lambda.fill(Spatial { linear: Vec3([self.multipliers; 3]), angular: Vec3([-self.multipliers; 3]) });
        for (k, pose) in poses.iter_mut().enumerate() {
            pose.x += Vec3([0.0, 1.0, -1.0]) * (self.way * (2 * (k % 2)) as f64 - self.way);
        }
        true
    }
}

#[test]
fn a_step_that_does_not_converge_from_its_guess_is_done_again_from_the_prediction() {
    let (model, state) = rod(3.0, 25, 0.05, material(1e5, 1000.0));
    let step = StepParams { formulation: Formulation::Newton, max_iterations: 4, ..StepParams::default() };
    let settings = Settings { step, ..Settings::default() };
    let mut plain = Simulation::new(&model, &state, &settings, None).unwrap();
    let mut expected = state.clone();
    for _ in 0..20 {
        plain.step(0.02).unwrap();
    }
    plain.store(&mut expected);
    // Dropped because the step did not converge; because of the poses, but for the multipliers; and because of both. A segment is 0.12 m long.
    for (way, multipliers) in [(0.08, 1e150), (1e5, 1e3), (1e5, 1e150)] {
        let absurd = |_: &_, _: &_, _: &_| Some(Box::new(Absurd { way, multipliers }) as Box<dyn InitialGuess>);
        let mut guessed = Simulation::new(&model, &state, &settings, Some(&absurd)).unwrap();
        for _ in 0..20 {
            assert_eq!(guessed.step(0.02).unwrap().status, Status::Converged);
        }
        let (mut found, counters) = (state.clone(), guessed.counters());
        guessed.store(&mut found);
        assert_eq!((counters.guesses_dropped, counters.guesses_used, counters.retries), (20, 0, 0));
        let apart = found.positions.iter().zip(&expected.positions).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(apart < 1e-5, "{way} m off, multipliers {multipliers:e}: {apart:e}");
    }
}

#[test]
fn a_step_that_still_converges_at_the_cap_goes_on_where_it_would_be_halved() {
    let (model, state) = rod(3.0, 25, 0.05, material(1e5, 1000.0));
    let step = StepParams {
        formulation: Formulation::Newton,
        relative_tolerance: 1e-9,
        motion_tolerance: 1e-9,
        ..StepParams::default()
    };
    let run = |max_iterations: usize, max_halvings: u32| {
        let settings = Settings { step: StepParams { max_iterations, max_halvings, ..step }, ..Settings::default() };
        let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
        let status = (0..10).map(|_| simulation.step(0.05).unwrap().status).max().unwrap();
        (status, simulation.counters())
    };
    let (_, free) = run(60, 0);
    let cap = (free.iterations / 10) as usize - 1;
    let (status, capped) = run(cap, 6);
    assert_eq!((status, capped.retries, capped.iterations), (Status::Converged, 0, free.iterations));
    let (status, capped) = run(cap, 0);
    assert_eq!(status, Status::OutOfIterations);
    assert!(capped.iterations <= 10 * cap as u64);
}
