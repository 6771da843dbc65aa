//! Error against run time: levels, references, cells.

use std::num::NonZeroUsize;

use cosserat::guess::GuessKind;
use cosserat::internals::component::Component;
use cosserat::internals::dynamics::projection::Projection;
use cosserat::internals::kernels::Spatial;
use cosserat::scene;
use cosserat::simulation::{
    CgParams, Formulation, Integrator, PreconditionerKind, Settings, SolverKind, Status, StepParams,
};
use evaluation::precision::{Against, Budget, Curve, GivenUp, Level, Outer, Problem, Start, Way, run_way};

const PLENTY: Budget = Budget { seconds: 100.0, repetitions: 1 };

const ROD: &str = "[[rods]]\nclamp = [\"start-segment\"]\nshape.straight = { length_m = 2, segments = 10 }";

/// A rod of ten segments that falls, 20 steps, with a converged reference if there are `factors`.
fn rod(formulations: &[Formulation], factors: &[usize]) -> Problem {
    let scene = |factor| scene::parse_refined(ROD, "rod.toml", NonZeroUsize::new(factor).unwrap()).unwrap();
    let refined: Vec<_> = factors.iter().map(|&factor| scene(factor)).collect();
    Problem::new(scene(1), 20, formulations, &refined, || true).unwrap().unwrap()
}

fn way(name: &str, formulation: Formulation, solver: SolverKind) -> Way<'static> {
    let settings =
        Settings { step: StepParams { formulation, integrator: Integrator::Euler, ..StepParams::default() }, solver };
    Way { name: name.to_owned(), kind: solver.name(), settings, start: Start::Plain(GuessKind::Zero) }
}

fn curve(problem: &Problem, way: &Way<'_>, levels: &[Level]) -> Curve {
    run_way(problem, way, levels, &PLENTY, || true).unwrap().unwrap()
}

fn errors(curve: &Curve) -> Vec<f64> {
    curve.points.iter().map(|point| point.error(Against::Exact, usize::MAX).unwrap()).collect()
}

/// Rounding errors of a run, relative to the rods' length.
const ROUNDING: f64 = 1e-11;

/// Errors of a run's steps partly cancel each other: where a tighter tolerance costs some of the steps another iteration,
/// the others' errors may stand out a little more (2 % were seen).
const MIXED: f64 = 1.2;

#[test]
fn tighter_tolerances_do_not_err_more() {
    let problem = rod(&Formulation::ALL, &[]);
    let tolerances = [1e-1, 1e-2, 1e-3, 1e-5, 1e-7, 1e-9, 1e-11];
    for formulation in Formulation::ALL {
        for solver in [SolverKind::Direct, SolverKind::cg(PreconditionerKind::BlockJacobi)] {
            // Both tolerances go down together.
            let levels: Vec<Level> = tolerances
                .map(|t| Level {
                    outer: Outer::Tolerance(t),
                    linear: (solver != SolverKind::Direct).then_some(t),
                    substeps: 1,
                })
                .to_vec();
            let curve = curve(&problem, &way("w", formulation, solver), &levels);
            let errors = errors(&curve);
            for pair in errors.windows(2) {
                assert!(pair[1] <= MIXED * pair[0] + ROUNDING, "{formulation}, {solver}: {errors:?}");
            }
            assert!(errors[6] < 1e-9 && errors[0] > 1e-6, "{formulation}, {solver}: {errors:?}");
            assert!(curve.points.iter().all(|point| point.given_up.is_none() && point.status == "converged"));
        }
    }
}

#[test]
fn more_iterations_do_not_err_more() {
    let problem = rod(&[Formulation::Newton], &[]);
    let levels: Vec<Level> =
        [1, 2, 3, 5, 8].map(|count| Level { outer: Outer::Iterations(count), linear: None, substeps: 1 }).to_vec();
    let curve = curve(&problem, &way("direct", Formulation::Newton, SolverKind::Direct), &levels);
    let errors = errors(&curve);
    for (pair, level) in errors.windows(2).zip(&levels) {
        assert!(pair[1] <= pair[0] + ROUNDING, "after {level:?}: {errors:?}");
    }
    assert!(errors[0] > 1e-6 && errors[4] < ROUNDING, "{errors:?}");
    let outer: Vec<f64> = curve.points.iter().map(|point| point.outer_per_step).collect();
    assert_eq!(outer, [1.0, 2.0, 3.0, 5.0, 8.0]);
}

#[test]
fn cells_repeat_bit_by_bit_but_for_their_times() {
    let problem = rod(&[Formulation::Newton], &[1, 2]);
    let solver = SolverKind::cg(PreconditionerKind::Jacobi);
    let way = Way { start: Start::Plain(GuessKind::Fischer(4)), ..way("fischer", Formulation::Newton, solver) };
    let levels = Level::of_tolerances(solver, &[1e-2, 1e-6]);
    let budget = Budget { repetitions: 3, ..PLENTY };
    let run = || run_way(&problem, &way, &levels, &budget, || true).unwrap().unwrap();
    let (first, again) = (run(), run());
    for point in &first.points {
        let (time, ratio) = (point.time.unwrap(), point.ratio.unwrap());
        assert!(time.median > 0.0 && ratio.lower <= ratio.median && ratio.median <= ratio.upper);
        assert!(point.linear_per_step > point.outer_per_step && point.outer_per_step >= 1.0);
        assert_eq!(point.converged.as_ref().unwrap().len(), problem.samples.len());
    }
    // It survives a file, up to the last bit of a number.
    let read: Curve = serde_json::from_str(&serde_json::to_string(&first).unwrap()).unwrap();
    for (read, point) in read.points.iter().zip(&first.points) {
        assert_eq!((read.level, &read.status, read.given_up), (point.level, &point.status, point.given_up));
        assert!((read.time.unwrap().median / point.time.unwrap().median - 1.0).abs() < 1e-14);
    }
    assert_eq!((read.points.len(), &read.samples), (first.points.len(), &problem.samples));
    let timeless = |mut curve: Curve| {
        curve.yardstick = None;
        for point in &mut curve.points {
            (point.time, point.ratio) = (None, None);
        }
        curve
    };
    assert_eq!(timeless(first), timeless(again));
}

#[test]
fn ways_that_run_out_are_given_up() {
    let problem = rod(&[Formulation::Newton], &[]);
    let params = CgParams { preconditioner: PreconditionerKind::Raw, max_iterations: Some(3), ..CgParams::default() };
    let base = way("raw", Formulation::Newton, SolverKind::Cg(params));
    let settings =
        Settings { step: StepParams { max_iterations: 2, max_halvings: 0, ..base.settings.step }, ..base.settings };
    let way = Way { settings, ..base };
    let levels = [
        Level { outer: Outer::Tolerance(1e-8), linear: Some(1e-8), substeps: 1 },
        Level { outer: Outer::Iterations(2), linear: Some(1e-8), substeps: 1 },
    ];
    let curve = curve(&problem, &way, &levels);
    assert_eq!(curve.points[0].given_up, Some((1, GivenUp::LinearSolver)));
    assert_eq!((curve.points[0].time, curve.points[0].error(Against::Exact, usize::MAX)), (None, None));
    assert_eq!(curve.points[1].given_up, None, "so many iterations are what was asked for");
    assert!(curve.points[1].error(Against::Exact, usize::MAX).unwrap() > 1e-6);
    assert_eq!(curve.line(Against::Exact, usize::MAX).places.len(), 1);

    let no_time = Budget { seconds: 0.0, repetitions: 3 };
    let direct = self::way("direct", Formulation::Newton, SolverKind::Direct);
    let mut levels = Level::of_tolerances(SolverKind::Direct, &[1e-4, 1e-6]);
    levels.push(Level { substeps: 2, ..levels[0] });
    let curve = run_way(&problem, &direct, &levels, &no_time, || true).unwrap().unwrap();
    assert!(curve.points.iter().all(|point| point.given_up == Some((1, GivenUp::OverBudget))));
    let was_run: Vec<bool> = curve.points.iter().map(|point| point.outer_per_step > 0.0).collect();
    assert_eq!(was_run, [true, false, true], "a finer level takes no less time");
    assert!(run_way(&problem, &direct, &levels, &PLENTY, || false).unwrap().is_none());
}

#[test]
fn substeps_come_nearer_to_the_converged_reference() {
    let problem = rod(&[Formulation::Newton], &[1, 2, 4]);
    let levels = [1, 2, 4, 8].map(|substeps| Level { outer: Outer::Tolerance(1e-8), linear: None, substeps }).to_vec();
    let curve = curve(&problem, &way("direct", Formulation::Newton, SolverKind::Direct), &levels);
    let error = |index: usize| curve.points[index].error(Against::Converged, usize::MAX).unwrap();
    assert!((1..4).all(|index| error(index) < error(index - 1)), "{:?}", [0, 1, 2, 3].map(error));
    let is_same_motion = |index: usize| curve.points[index].error(Against::Exact, usize::MAX).is_some();
    assert_eq!([0, 1, 2, 3].map(is_same_motion), [true, false, false, false]);
}

#[test]
fn predictions_in_the_place_of_solves_are_a_way() {
    struct Nothing;
    impl Projection for Nothing {
        fn project(&mut self, _: &Component<f64>, _: usize, _: &mut [Spatial<f64>], _: &mut [Spatial<f64>]) {}
    }
    let problem = rod(&[Formulation::Xpbd], &[]);
    let nothing = Start::EndToEnd(Box::new(|_, _, _| Box::new(Nothing)));
    let way = Way { start: nothing, ..way("nothing", Formulation::Xpbd, SolverKind::Direct) };
    let curve = curve(&problem, &way, &[Level { outer: Outer::Iterations(1), linear: None, substeps: 1 }]);
    // Without solves the segments fall freely: g t^2 / 2, and a little more for symplectic Euler, but the clamped one.
    let (t, n) = (0.4, 20.0);
    let fallen = 9.81 * t * t / 2.0 * (1.0 + 1.0 / n);
    let point = &curve.points[0];
    let error = point.error(Against::Exact, usize::MAX).unwrap();
    assert!(error > 0.1 * fallen / 2.0 && error < fallen / 2.0, "{error}");
    assert_eq!(point.outer_per_step, 1.0);
}

/// Position error at the end of each refinement against the next.
fn differences(name: &str, steps: usize, factors: &[usize]) -> Vec<f64> {
    let refined = |&factor: &usize| scene::builtin_refined(name, NonZeroUsize::new(factor).unwrap()).unwrap();
    let refined: Vec<_> = factors.iter().map(refined).collect();
    let scene = scene::builtin(name).unwrap();
    let problem = Problem::new(scene, steps, &[], &refined, || true).unwrap().unwrap();
    let converged = problem.converged.unwrap();
    assert_eq!((converged.status, converged.first_contact), (Status::Converged, None));
    assert_eq!(converged.frames.len(), problem.samples.len());
    assert_eq!(converged.error(), converged.differences.last().unwrap());
    converged.differences.iter().map(|errors| *errors.last().unwrap()).collect()
}

#[test]
fn references_converge() {
    // Each refinement by two leaves a half of the clamped segment's error, and a quarter of the time step's.
    for (name, steps, factors) in [("bending-rod", 25, [1, 2, 4, 8].as_slice()), ("tree-10", 5, &[1, 2, 4])] {
        let differences = differences(name, steps, factors);
        println!("{name}: {differences:?}");
        for pair in differences.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            assert!((0.9..2.3).contains(&order), "{name}: order {order}, {differences:?}");
        }
    }
}
