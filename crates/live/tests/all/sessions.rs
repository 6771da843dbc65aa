//! Sessions: hands, pins, quantities that change, the way back, and what was recorded.

use dynamics::simulation::Simulation;
use live::{Input, Knob, Replay, Session};
use nalgebra::Vector3;
use rod::{Model, State, measure};

use crate::ropes::{rebuild, rope, simulation};

fn steps(session: &mut Session<'_>, simulation: &mut Simulation, count: usize) {
    for _ in 0..count {
        session.prepare(simulation).expect("hands");
        simulation.step(session.dt()).expect("a step");
        session.stepped(simulation);
    }
}

/// The state of a simulation as bits.
fn bits(model: &Model, state: &State, simulation: &Simulation) -> Vec<u64> {
    let mut now = state.clone();
    simulation.store(&mut now);
    assert_eq!(now.positions.len(), model.segments.len());
    let vectors = [&now.positions, &now.velocities, &now.angular_velocities].into_iter().flatten().flatten();
    vectors.chain(now.orientations.iter().flat_map(|q| &q.coords)).map(|x| x.to_bits()).collect()
}

#[test]
fn a_rope_hangs_from_a_hand_that_carries_its_weight() {
    let (model, state) = rope(2.0);
    let mut sim = simulation(&model, &state);
    let mut session = Session::new(&model, &mut sim, 0.01, None);
    let at = state.positions[20];
    session.apply(&mut sim, Input::Grab { hand: 0, segment: 20, at: at.into() }).expect("a grab");
    steps(&mut session, &mut sim, 1500);
    let (model, now) = session.store(&mut sim);
    let speed = now.velocities.iter().map(|v| v.norm()).fold(0.0, f64::max);
    assert!(speed < 1e-4, "{speed} m/s");
    // A spring that the rope's weight stretches by 2 % of the rope at grab, longer by what the step's time costs.
    let sag = at.z - now.positions[20].z;
    assert!((0.02..0.1).contains(&sag), "{sag} m");
    // Both ends hang down.
    assert!(now.positions[0].z < at.z - 0.4 && now.positions[39].z < at.z - 0.4);
    let momentum = measure::linear_momentum(model, now).norm();
    assert!(momentum < 1e-5, "{momentum}");
    // Let go, it falls freely but for the damping.
    let height = now.positions[20].z;
    session.apply(&mut sim, Input::Drop { hand: 0 }).expect("a drop");
    steps(&mut session, &mut sim, 20);
    let (_, now) = session.store(&mut sim);
    let centre = |state: &State| state.positions.iter().map(|x| x.z).sum::<f64>() / 40.0;
    // v' = -g - 2 v: v(0.2 s) = -(g / 2) (1 - exp(-0.4)).
    let velocity = now.velocities.iter().map(|v| v.z).sum::<f64>() / 40.0;
    let expected = -9.81 / 2.0 * (1.0 - (-0.4_f64).exp());
    assert!((velocity / expected - 1.0).abs() < 0.02, "{velocity} m/s, not {expected}");
    assert!(centre(now) < height);
}

#[test]
fn hands_are_stable_at_every_time_step() {
    for dt in [1e-3, 0.01, 0.05, 0.2] {
        let (model, state) = rope(0.5);
        let mut sim = simulation(&model, &state);
        let mut session = Session::new(&model, &mut sim, dt, None);
        for (hand, segment) in [(0, 0), (1, 39)] {
            let at = state.positions[segment].into();
            session.apply(&mut sim, Input::Grab { hand, segment, at }).expect("a grab");
        }
        let total: f64 = model.segments.iter().map(|segment| segment.mass()).sum();
        steps(&mut session, &mut sim, (20.0 / dt) as usize);
        let (model, now) = session.store(&mut sim);
        let kinetic = measure::energy(model, now).kinetic;
        // Less than it has at a tenth of a metre a second.
        assert!(kinetic < 0.5 * total * 0.01, "{dt} s: {kinetic} J");
    }
}

#[test]
fn pins_hold_and_a_hand_leads_them() {
    let (model, state) = rope(1.0);
    let mut sim = simulation(&model, &state);
    let mut session = Session::new(&model, &mut sim, 0.01, None);
    session.apply(&mut sim, Input::Pin { segment: 0 }).expect("a pin");
    assert!(session.apply(&mut sim, Input::Pin { segment: 0 }).is_err(), "pinned twice");
    assert!(session.apply(&mut sim, Input::Unpin { segment: 5 }).is_err(), "nothing holds it");
    assert!(session.apply(&mut sim, Input::Pin { segment: 40 }).is_err(), "there is none");
    steps(&mut session, &mut sim, 100);
    assert_eq!(session.store(&mut sim).1.positions[0], state.positions[0]);
    assert!(session.store(&mut sim).1.positions[39].z < -0.3);
    // The hand leads it to where it is.
    let away = Vector3::new(0.1, -0.2, 0.3);
    session.apply(&mut sim, Input::Grab { hand: 3, segment: 0, at: state.positions[0].into() }).expect("a grab");
    session.apply(&mut sim, Input::Move { hand: 3, to: (state.positions[0] + away).into() }).expect("a move");
    steps(&mut session, &mut sim, 200);
    let off = (session.store(&mut sim).1.positions[0] - state.positions[0] - away).norm();
    assert!(off < 1e-9, "{off} m");
    session.apply(&mut sim, Input::Drop { hand: 3 }).expect("a drop");
    // Keys drive it on at a velocity, and it stops.
    let velocity = [0.0, 0.5, 0.0];
    session.apply(&mut sim, Input::Drive { segment: 0, velocity, turn: [0.0; 3] }).expect("a drive");
    steps(&mut session, &mut sim, 40);
    session.apply(&mut sim, Input::Drive { segment: 0, velocity: [0.0; 3], turn: [0.0; 3] }).expect("a stop");
    steps(&mut session, &mut sim, 40);
    let off = (session.store(&mut sim).1.positions[0] - state.positions[0] - away - Vector3::new(0.0, 0.2, 0.0)).norm();
    assert!(off < 1e-9, "{off} m");
    session.apply(&mut sim, Input::Unpin { segment: 0 }).expect("let go");
    let before = session.store(&mut sim).1.positions[0].z;
    steps(&mut session, &mut sim, 50);
    assert!(session.store(&mut sim).1.positions[0].z < before - 0.5);
}

/// Grabs, drags, pins, turns all quantities, goes back, and goes on otherwise.
fn play(session: &mut Session<'_>, sim: &mut Simulation, state: &State) {
    let at = state.positions[10];
    session.apply(sim, Input::Pin { segment: 0 }).expect("a pin");
    session.apply(sim, Input::Grab { hand: 1, segment: 10, at: at.into() }).expect("a grab");
    for k in 0..80 {
        let to = at + Vector3::new(0.0, 0.3 * (0.1 * k as f64).sin(), 0.004 * k as f64);
        session.apply(sim, Input::Move { hand: 1, to: (to * 0.5).into() }).expect("a move");
        session.apply(sim, Input::Move { hand: 1, to: to.into() }).expect("a move");
        steps(session, sim, 1);
    }
    for knob in [
        Knob::Gravity([0.0, 1.0, -3.0]),
        Knob::Stiffness(4.0),
        Knob::Damping(0.5),
        Knob::Wind([3.0, 0.0, 0.0]),
        Knob::Friction(0.5),
    ] {
        session.apply(sim, Input::Set(knob)).expect("a knob");
        steps(session, sim, 10);
    }
    session.go_to(sim, 0.6).expect("the way back");
    steps(session, sim, 30);
    session.apply(sim, Input::Grab { hand: 1, segment: 30, at: [0.7, 0.1, 0.0] }).expect("a grab");
    steps(session, sim, 30);
    session.apply(sim, Input::Set(Knob::Wind([0.0, 2.0, 0.0]))).expect("a knob");
    steps(session, sim, 25);
}

#[test]
fn what_is_recorded_replays_to_the_same_bits() {
    let (model, state) = rope(0.1);
    let mut sim = simulation(&model, &state);
    let mut session = Session::new(&model, &mut sim, 0.01, Some(rebuild(&state)));
    play(&mut session, &mut sim, &state);
    let text = serde_json::to_string(&session.recording()).expect("a text");
    let recording: live::Recording = serde_json::from_str(&text).expect("a recording");
    assert_eq!(recording, session.recording());
    // At 0.5 s, the last quarter of a second before 0.6 s, it went on otherwise.
    assert_eq!(recording.steps, 50 + 30 + 30 + 25);
    let mut again = simulation(&model, &state);
    let mut replay = Replay::new(recording.clone(), &model, &mut again, 0.01, Some(rebuild(&state))).expect("a replay");
    for _ in 0..replay.steps() {
        replay.before_step(&mut again).expect("inputs");
        again.step(0.01).expect("a step");
        replay.stepped(&mut again);
    }
    assert_eq!(bits(&model, &state, &again), bits(&model, &state, &sim));
    assert_eq!(again.time(), sim.time());
    // Of another time step, or another model, it is refused.
    assert!(Replay::new(recording.clone(), &model, &mut again, 0.02, None).is_err());
    let wrong = live::Recording { segments: 3, ..recording };
    assert!(Replay::new(wrong, &model, &mut again, 0.01, None).is_err());
}

#[test]
fn the_way_back_leads_to_the_same_bits() {
    let (model, state) = rope(0.1);
    let mut sim = simulation(&model, &state);
    let mut session = Session::new(&model, &mut sim, 0.01, Some(rebuild(&state)));
    let first = bits(&model, &state, &sim);
    session.apply(&mut sim, Input::Pin { segment: 39 }).expect("a pin");
    steps(&mut session, &mut sim, 75);
    let (time, there) = (sim.time(), bits(&model, &state, &sim));
    session.apply(&mut sim, Input::Set(Knob::Stiffness(2.0))).expect("a knob");
    steps(&mut session, &mut sim, 30);
    let end = bits(&model, &state, &sim);
    let last = session.times(&sim)[1];
    session.go_to(&mut sim, time).expect("the way back");
    assert_eq!(bits(&model, &state, &sim), there);
    assert_eq!(session.knobs().stiffness, 1.0);
    // What was after it is there until it goes on.
    session.go_to(&mut sim, last).expect("the way on");
    assert_eq!(bits(&model, &state, &sim), end);
    assert_eq!(session.knobs().stiffness, 2.0);
    session.go_to(&mut sim, time).expect("the way back");
    session.apply(&mut sim, Input::Set(Knob::Stiffness(2.0))).expect("a knob");
    steps(&mut session, &mut sim, 30);
    assert_eq!(bits(&model, &state, &sim), end);
    session.reset(&mut sim).expect("the start");
    assert_eq!(bits(&model, &state, &sim), first);
    assert_eq!((session.steps(), session.recording().inputs.len(), session.pins().len()), (0, 0, 0));
}

#[test]
fn quantities_do_what_they_say() {
    let (model, state) = rope(0.0);
    let mut sim = simulation(&model, &state);
    let mut session = Session::new(&model, &mut sim, 0.01, Some(rebuild(&state)));
    // Without gravity it goes on as it is, in damping d at exp(-d t).
    steps(&mut session, &mut sim, 50);
    session.apply(&mut sim, Input::Set(Knob::Gravity([0.0; 3]))).expect("gravity");
    session.apply(&mut sim, Input::Set(Knob::Damping(2.0))).expect("damping");
    let before = session.store(&mut sim).1.velocities[7].z;
    steps(&mut session, &mut sim, 50);
    let after = session.store(&mut sim).1.velocities[7].z;
    assert!((after / before / (-1.0_f64).exp() - 1.0).abs() < 0.02, "{before} m/s, then {after} m/s");
    // In wind alone it comes to move with it.
    session.apply(&mut sim, Input::Set(Knob::Damping(0.0))).expect("damping");
    session.apply(&mut sim, Input::Set(Knob::Wind([0.0, 4.0, 0.0]))).expect("wind");
    steps(&mut session, &mut sim, 2000);
    let speed = session.store(&mut sim).1.velocities[7].y;
    assert!(speed > 2.0 && speed < 4.0, "{speed} m/s");
    for wrong in [Knob::Stiffness(0.0), Knob::Stiffness(f64::NAN), Knob::Friction(-1.0), Knob::Gravity([0.0, 0.0, 1e9])]
    {
        assert!(session.apply(&mut sim, Input::Set(wrong)).is_err(), "{wrong:?}");
    }
    // Without a rebuild, gravity alone.
    let mut session = Session::new(&model, &mut sim, 0.01, None);
    assert!(session.apply(&mut sim, Input::Set(Knob::Stiffness(2.0))).is_err());
    assert!(session.apply(&mut sim, Input::Set(Knob::Gravity([1.0, 0.0, 0.0]))).is_ok());
}

/// A segment that the model fixes and a viewer lets go: quantities still change, and one can go back and on.
#[test]
fn one_goes_back_and_on_past_a_fixed_segment_that_was_let_go() {
    let (mut model, state) = rope(0.1);
    model.segments[0].fixed = true;
    let mut sim = simulation(&model, &state);
    let mut session = Session::new(&model, &mut sim, 0.01, Some(rebuild(&state)));
    let first = bits(&model, &state, &sim);
    steps(&mut session, &mut sim, 50);
    session.apply(&mut sim, Input::Unpin { segment: 0 }).expect("let go");
    session.apply(&mut sim, Input::Set(Knob::Stiffness(2.0))).expect("a knob");
    steps(&mut session, &mut sim, 30);
    let end = bits(&model, &state, &sim);
    let last = sim.time();
    session.go_to(&mut sim, 0.25).expect("the way back");
    assert_eq!(session.knobs().stiffness, 1.0);
    session.go_to(&mut sim, last).expect("the way on");
    assert_eq!((bits(&model, &state, &sim), session.knobs().stiffness), (end, 2.0));
    session.reset(&mut sim).expect("the start");
    assert_eq!(bits(&model, &state, &sim), first);
}

/// Without a rebuild there is no way back past it; a way that is refused changes nothing.
#[test]
fn a_way_back_that_is_refused_changes_nothing() {
    let (mut model, state) = rope(0.1);
    model.segments[0].fixed = true;
    let runs = [false, true].map(|tries| {
        let mut sim = simulation(&model, &state);
        let mut session = Session::new(&model, &mut sim, 0.01, None);
        steps(&mut session, &mut sim, 40);
        session.apply(&mut sim, Input::Set(Knob::Gravity([0.0; 3]))).expect("gravity");
        session.apply(&mut sim, Input::Unpin { segment: 0 }).expect("let go");
        steps(&mut session, &mut sim, 10);
        if tries {
            session.go_to(&mut sim, 0.3).expect_err("a way back");
            assert_eq!(session.knobs().gravity, [0.0; 3]);
        }
        steps(&mut session, &mut sim, 10);
        bits(&model, &state, &sim)
    });
    assert_eq!(runs[0], runs[1]);
}
