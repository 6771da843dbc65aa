//! What is chosen for a scene, and that it costs no accuracy.

use acceptance::Beam;
use cosserat::assembly::{Assembly, Surface};
use cosserat::guess::{Choice, GuessKind, Members, Topology, choose};
use cosserat::internals::component::split;
use cosserat::scene::{builtin, builtins};
use cosserat::simulation::{Formulation, Settings, Simulation, SolverKind, StepParams};
use cosserat::state::{Model, State};
use nalgebra::Vector3;

fn step(formulation: Formulation) -> StepParams {
    StepParams { formulation, ..StepParams::default() }
}

/// A simulation in the way that was chosen.
fn simulation(model: &Model, state: &State, step: &StepParams, choice: &Choice) -> Simulation {
    let build = |model: &Model, members: &Members, topology: &Topology| choice.build_guess(model, members, topology);
    Simulation::new(model, state, &Settings { step: *step, solver: choice.solver }, Some(&build)).unwrap()
}

/// Rods of these numbers of segments side by side, held at one end.
fn rods(segments: &[usize]) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::z() * -9.81);
    for (k, &segments) in segments.iter().enumerate() {
        let rod = assembly.rod(&Beam::rubber(segments).spec(Vector3::y() * k as f64, Vector3::x()));
        assembly.fix(rod.start);
    }
    assembly.finish()
}

#[test]
fn all_builtin_scenes_are_solved_directly_and_newton_alone_has_a_start() {
    for known in builtins() {
        let scene = builtin(known.name).unwrap();
        for formulation in Formulation::ALL {
            let choice = choose(&scene.model, &step(formulation), None);
            assert_eq!(choice.solver, SolverKind::Direct, "{}", known.name);
            let sets = split(&scene.model).len();
            let has_start = formulation.momentum() && choice.in_lanes < sets;
            let expected = if has_start { GuessKind::StepAdaptive } else { GuessKind::Zero };
            assert_eq!(choice.guess, expected, "{}, {formulation}", known.name);
            assert!(!choice.reason().contains('\n'));
        }
    }
}

#[test]
fn the_reason_names_what_was_found() {
    let reason = |name: &str| choose(&builtin(name).unwrap().model, &StepParams::default(), None).reason();
    assert!(reason("bending-rod").contains("1 chain, eliminated without iterating"), "{}", reason("bending-rod"));
    assert!(reason("tree-10").contains("1 tree, eliminated without iterating"));
    assert!(reason("net").contains("1 set with loops, solved by sparse Cholesky"));
    let asked = choose(&builtin("net").unwrap().model, &StepParams::default(), Some(SolverKind::Sparse));
    assert_eq!((asked.solver, asked.reason_of_solver()), (SolverKind::Sparse, None));
}

/// Sets that are alike move in lanes; the others have a start each.
#[test]
fn lanes_and_starts_go_side_by_side() {
    let (model, state) = rods(&[10, 10, 10, 14, 10, 7, 7]);
    let step = step(Formulation::Newton);
    let choice = choose(&model, &step, None);
    assert_eq!((choice.in_lanes, choice.guess), (4, GuessKind::StepAdaptive));
    assert!(choice.reason().contains("7 chains (4 in lanes), eliminated"), "{}", choice.reason());
    let mut chosen = simulation(&model, &state, &step, &choice);
    assert_eq!((chosen.components(), chosen.in_lanes()), (7, 4));
    let mut plain = Simulation::new(&model, &state, &Settings { step, ..Settings::default() }, None).unwrap();
    for _ in 0..20 {
        chosen.step(0.01).unwrap();
        plain.step(0.01).unwrap();
    }
    let [mut a, mut b] = [state.clone(), state];
    chosen.store(&mut a);
    plain.store(&mut b);
    // Rods in lanes move to the bit as they do without a start, the others to the tolerance.
    let lanes = [0..30, 44..54];
    for i in 0..a.len() {
        let apart = (a.positions[i] - b.positions[i]).norm();
        let in_lane = lanes.iter().any(|lane| lane.contains(&i));
        assert!(if in_lane { apart == 0.0 } else { apart < 1e-6 }, "segment {i}: {apart:e}");
    }
    assert!(chosen.counters().guesses_used > 0);
    let alone = choose(&model, &step, Some(SolverKind::Sparse));
    assert_eq!((alone.in_lanes, alone.guess), (0, GuessKind::StepAdaptive));
    let (model, _) = rods(&[10, 10, 10]);
    assert_eq!(choose(&model, &step, None).guess, GuessKind::Zero);
}

#[test]
fn sets_that_can_touch_do_not_move_in_lanes() {
    let (mut model, _) = rods(&[10, 10, 10]);
    model.contacts.between_segments = Some(Surface::default());
    let choice = choose(&model, &step(Formulation::Newton), None);
    assert_eq!((choice.in_lanes, choice.guess), (0, GuessKind::StepAdaptive));
}
