//! What guesses of whole steps are made of: turns of the last steps, and states from orientations.

use std::sync::{Arc, Mutex};

use component::{BodyPose, Component};
use dynamics::formulation::Formulation;
use dynamics::guess::InitialGuess;
use dynamics::simulation::{Settings, Simulation};
use dynamics::step::StepParams;
use graph::Lift;
use graph::turns::{NODE_HISTORY, NODE_OUTPUT, Turns};
use kernels::Spatial;
use kernels::math::Vec3;
use rod::Integrator;
use rod::{Model, State};

use crate::common::{component, helix, rod, tree};

/// Looks at every step of implicit Euler, solved tightly.
struct Watch {
    seen: Arc<Mutex<Vec<Component<f64>>>>,
}

impl InitialGuess for Watch {
    fn helps_steps(&self) -> bool {
        true
    }

    fn observe_step(&mut self, component: &Component<f64>) {
        self.seen.lock().unwrap().push(component.clone());
    }
}

/// The components at the ends of some steps.
fn steps(model: &Model, state: &State, dt: f64, count: usize) -> Vec<Component<f64>> {
    let step = StepParams {
        formulation: Formulation::Newton,
        integrator: Integrator::Euler,
        relative_tolerance: 1e-11,
        motion_tolerance: 1e-11,
        ..StepParams::default()
    };
    let settings =
        Settings { step: StepParams { absolute_tolerance: 1e-12, max_iterations: 60, ..step }, ..Settings::default() };
    let seen = Arc::new(Mutex::new(Vec::new()));
    let watch = seen.clone();
    let factory = move |_: &_, _: &_, _: &_| Some(Box::new(Watch { seen: watch.clone() }) as Box<dyn InitialGuess>);
    let mut simulation = Simulation::new(model, state, &settings, Some(&factory)).unwrap();
    for _ in 0..count {
        simulation.step(dt).unwrap();
    }
    assert_eq!(simulation.counters().retries, 0);
    std::mem::take(&mut *seen.lock().unwrap())
}

fn norm(x: Vec3<f64>) -> f64 {
    x.norm_squared().sqrt()
}

#[test]
fn a_state_follows_from_its_orientations() {
    for (mut model, state) in [rod(12, 0.4), helix(40), tree(false)] {
        model.measure_as_in_paper();
        let (_, graph, _) = component(&model, &state);
        for end in steps(&model, &state, 0.05, 6) {
            let mut at_prediction = end.clone();
            at_prediction.poses.clone_from(&end.predicted);
            // Positions of roots are known; all others are made.
            let mut poses: Vec<BodyPose<f64>> = end.poses.clone();
            for visit in graph.visits() {
                poses[visit.node as usize].x = Vec3([f64::NAN; 3]);
            }
            let mut lambda = vec![Spatial { linear: Vec3([9.0; 3]), angular: Vec3([9.0; 3]) }; graph.edges().len()];
            Lift::new(&graph).fill(&graph, &at_prediction, &mut poses, &mut lambda);
            for (made, exact) in poses.iter().zip(&end.poses) {
                assert!(norm(made.x - exact.x) < 1e-8, "{:?} {:?}", made.x, exact.x);
            }
            let largest =
                |part: fn(&Spatial<f64>) -> Vec3<f64>| end.lambda.iter().map(|x| norm(part(x))).fold(0.0, f64::max);
            let sizes = [largest(|x| x.linear), largest(|x| x.angular)];
            for (made, exact) in lambda.iter().zip(&end.lambda) {
                assert!(norm(made.linear - exact.linear) < 1e-5 * sizes[0]);
                assert!(norm(made.angular - exact.angular) < 1e-5 * sizes[1]);
            }
        }
    }
}

#[test]
fn outputs_stand_for_the_turns_of_the_step() {
    for (model, state) in [rod(12, 0.4), helix(40), tree(false)] {
        let (_, graph, _) = component(&model, &state);
        let mut turns = Turns::new(&graph);
        let mut targets = vec![f32::NAN; graph.nodes().len() * NODE_OUTPUT];
        let mut inputs = vec![f32::NAN; graph.nodes().len() * (2 + NODE_HISTORY)];
        for (step, end) in steps(&model, &state, 0.02, 6).into_iter().enumerate() {
            let scale = 0.01;
            turns.begin(0.02);
            turns.fill(&graph, scale, 2, &mut inputs);
            for row in inputs.chunks_exact(2 + NODE_HISTORY) {
                assert!(row[..2].iter().all(|x| x.is_nan()) && row[2..].iter().all(|x| x.is_finite()));
                assert_eq!(row[1 + NODE_HISTORY], step.min(4) as f32);
            }
            turns.fill_targets(&graph, &end, scale, &mut targets);
            for (node, outputs) in targets.chunks_exact(NODE_OUTPUT).enumerate() {
                let predicted = end.predicted[node].q;
                let turn = turns.decode(&graph, scale, node, outputs);
                let apart = (predicted.turned(predicted.rotate(turn)) * end.poses[node].q.conj()).upper().v;
                assert!(norm(apart) < 1e-7, "step {step}, node {node}: {apart:?}");
            }
            turns.push(&end);
        }
    }
}

#[test]
fn parabolas_are_continued_exactly_and_other_time_steps_forgotten() {
    let (model, state) = rod(5, 0.4);
    let (component, graph, _) = component(&model, &state);
    let turn = |t: f64, node: usize| Vec3([0.01 * t, 0.02 * t * t, 0.003 * node as f64]);
    let after = |t: f64| {
        let mut end = component.clone();
        for (node, (pose, predicted)) in end.poses.iter_mut().zip(&component.predicted).enumerate() {
            pose.q = predicted.q.turned(predicted.q.rotate(turn(t, node)));
        }
        end
    };
    let mut turns = Turns::new(&graph);
    for t in 0..6 {
        turns.begin(0.02);
        if t >= 3 {
            for node in 0..graph.nodes().len() {
                let continued = turns.decode(&graph, 1.0, node, &[0.0; 3]);
                assert!(norm(continued - turn(f64::from(t), node)) < 1e-14);
            }
        }
        turns.push(&after(f64::from(t)));
    }
    turns.begin(0.01);
    assert_eq!(turns.decode(&graph, 1.0, 2, &[0.0; 3]), Vec3::zero());
}
