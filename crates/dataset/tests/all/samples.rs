//! Samples: what is stored rebuilds the linear systems to the last bit, and batches have the right rows.

use cosserat::internals::jointed::linear::direct::Direct;
use cosserat::internals::jointed::linear::{LinearSolver, LinearStatus};
use cosserat::internals::kernels::Spatial;
use cosserat::simulation::{CgParams, PreconditionerKind, SolverKind};
use dataset::{Config, PaperBatch, Scenario, Split, shuffled};
use graph::{Normal, Norms, corrections, paper};

use crate::common::{generated, small};

fn single(x: Spatial<f64>) -> [f32; 6] {
    x.to_array().map(|x| x as f32)
}

#[test]
fn systems_are_rebuilt_to_the_last_bit() {
    for scenario in Scenario::ALL {
        let directory = tempfile::tempdir().unwrap();
        let dataset = generated(directory.path(), &small(scenario));
        for trajectory in dataset.trajectories(Split::Train) {
            let mut component = trajectory.component();
            let mut direct = Direct::new(trajectory.topology()).unwrap();
            let mut dlambda = vec![Spatial::zero(); trajectory.graph().edges().len()];
            let mut dp = vec![Spatial::zero(); trajectory.graph().nodes().len()];
            let mut next: Option<Vec<Spatial<f64>>> = None;
            for sample in trajectory.samples() {
                sample.restore(&mut component);
                assert!(component.system.joints.iter().map(|joint| single(joint.rhs)).eq(sample.rhs()));
                direct.solve(&component.system, false, &mut dlambda);
                assert!(dlambda.iter().map(|&x| single(x)).eq(sample.dlambda()));
                corrections(&component, &dlambda, &mut dp);
                assert!(dp.iter().take(component.segments()).map(|&x| single(x)).eq(sample.dp()));
                // The multipliers add up over a step's iterations.
                match next {
                    Some(next) if sample.iteration() > 0 => assert!(next.into_iter().eq(sample.lambda())),
                    _ => assert!(sample.lambda().all(|x| x == Spatial::zero())),
                }
                next = Some(sample.lambda().zip(&dlambda).map(|(x, &d)| x.plus(d, 1.0)).collect());
                assert_eq!((sample.dt(), component.dt()), (0.02, 0.02));
            }
        }
    }
}

#[test]
fn systems_of_a_rope_that_touches_itself_are_rebuilt_too() {
    let directory = tempfile::tempdir().unwrap();
    let config = Config { train_trajectories: 1, validation_trajectories: 0, steps: 100, ..small(Scenario::Knot) };
    let dataset = generated(directory.path(), &config);
    let trajectory = dataset.trajectory(Split::Train, 0).unwrap();
    assert_eq!(trajectory.planar_normal(), None);
    let mut component = trajectory.component();
    let mut direct = Direct::new(trajectory.topology()).unwrap();
    let mut dlambda = vec![Spatial::zero(); trajectory.graph().edges().len()];
    let (mut next, mut pushed): (Vec<Spatial<f64>>, usize) = (Vec::new(), 0);
    for sample in trajectory.samples() {
        sample.restore(&mut component);
        assert!(component.system.joints.iter().map(|joint| single(joint.rhs)).eq(sample.rhs()));
        direct.solve(&component.system, false, &mut dlambda);
        assert!(dlambda.iter().map(|&x| single(x)).eq(sample.dlambda()));
        // What is stored is the rods' own answer; contacts add theirs to the multipliers.
        pushed += usize::from(sample.iteration() > 0 && !next.iter().copied().eq(sample.lambda()));
        next = sample.lambda().zip(&dlambda).map(|(x, &d)| x.plus(d, 1.0)).collect();
    }
    assert!(pushed > 0);
    let ends = |k: usize| trajectory.sample(k).unwrap().pose_rows().next().unwrap()[0];
    assert!(ends(trajectory.len() - 1) < ends(0) - 0.3, "the rope's start is pulled");
}

#[test]
fn conjugate_gradients_find_the_stored_solution() {
    let directory = tempfile::tempdir().unwrap();
    let dataset = generated(directory.path(), &small(Scenario::Rod));
    let trajectory = dataset.trajectory(Split::Validation, 1).unwrap();
    let mut component = trajectory.component();
    let params = CgParams { preconditioner: PreconditionerKind::BlockJacobi, tolerance: 1e-10, max_iterations: None };
    let mut solver: Box<dyn LinearSolver> =
        SolverKind::Cg(params).build(trajectory.model(), trajectory.members(), trajectory.topology()).unwrap();
    let sample = trajectory.sample(0).unwrap();
    sample.restore(&mut component);
    let exact = component.dlambda.clone();
    let mut found = exact.clone();
    let info = solver.solve(&component.system, false, &mut found);
    assert!(info.status == LinearStatus::Solved && info.iterations > 5);
    let norm = |x: &[Spatial<f64>]| x.iter().map(|x| x.dot(*x)).sum::<f64>().sqrt();
    let apart: Vec<Spatial<f64>> = found.iter().zip(&exact).map(|(a, b)| a.plus(*b, -1.0)).collect();
    assert!(norm(&apart) < 1e-5 * norm(&exact));
    let from_zero = info.iterations;
    found.copy_from_slice(&exact);
    assert!(solver.solve(&component.system, true, &mut found).iterations < from_zero);
}

#[test]
fn steps_and_iterations_are_in_order_and_found_by_index() {
    let directory = tempfile::tempdir().unwrap();
    let dataset = generated(directory.path(), &small(Scenario::Rod));
    let indices: Vec<u64> = Split::ALL
        .into_iter()
        .flat_map(|split| dataset.trajectories(split).map(|trajectory| trajectory.index()))
        .collect();
    assert_eq!(indices, [0, 1, 2, 3, 4, 5, 6]);
    for split in Split::ALL {
        let mut index = 0;
        for trajectory in dataset.trajectories(split) {
            let places: Vec<_> = trajectory.samples().map(|s| (s.step(), s.iteration())).collect();
            assert!(places.is_sorted() && places[0] == (0, 0) && places.last().unwrap().0 == 3);
            for sample in trajectory.samples() {
                let found = dataset.sample(split, index).unwrap();
                assert_eq!(found.trajectory().index(), trajectory.index());
                assert_eq!((found.step(), found.iteration()), (sample.step(), sample.iteration()));
                assert!(found.pose_rows().eq(sample.pose_rows()));
                index += 1;
            }
            assert!(trajectory.sample(trajectory.len()).is_none());
        }
        assert_eq!((index, dataset.sample_count(split)), (dataset.manifest().numbers(split).samples, index));
        assert!(dataset.sample(split, index).is_none());
        assert!(dataset.trajectory(split, dataset.trajectory_count(split)).is_none());
    }
}

#[test]
fn rods_are_planar_and_helices_are_not() {
    for (scenario, normal) in [(Scenario::Rod, Some(Normal::D2)), (Scenario::Helix, None)] {
        let directory = tempfile::tempdir().unwrap();
        let dataset = generated(directory.path(), &small(scenario));
        assert!(dataset.trajectories(Split::Train).all(|trajectory| trajectory.planar_normal() == normal));
    }
}

#[test]
fn norms_are_those_of_the_training_split() {
    let directory = tempfile::tempdir().unwrap();
    let dataset = generated(directory.path(), &small(Scenario::Helix));
    let mut norms = Norms::default();
    for sample in dataset.trajectories(Split::Train).flat_map(|trajectory| trajectory.samples()) {
        let spatial = |x: [f32; 6]| Spatial::from_array(x.map(f64::from));
        let (dp, dlambda): (Vec<_>, Vec<_>) =
            (sample.dp().map(spatial).collect(), sample.dlambda().map(spatial).collect());
        norms.include(&dp, &dlambda);
    }
    assert_eq!(dataset.norms(), norms);
    let mut batch = PaperBatch::default();
    for trajectory in dataset.trajectories(Split::Train) {
        trajectory.samples().for_each(|sample| batch.push(&sample, &norms));
    }
    for targets in [&batch.node_targets, &batch.edge_targets] {
        assert_eq!(targets.iter().map(|x| x.abs()).fold(0.0, f32::max), 1.0);
    }
}

#[test]
fn batches_hold_the_features_of_their_samples() {
    let directory = tempfile::tempdir().unwrap();
    let dataset = generated(directory.path(), &small(Scenario::Rod));
    let order = shuffled(dataset.sample_count(Split::Train), 1, 0);
    let mut batch = PaperBatch::default();
    let mut components: Vec<_> = dataset.trajectories(Split::Train).map(|t| t.component()).collect();
    for _ in 0..2 {
        batch.clear();
        let (mut nodes, mut edges) = (0, 0);
        for &index in order.iter().take(6) {
            let sample = dataset.sample(Split::Train, index).unwrap();
            let graph = sample.trajectory().graph();
            batch.push(&sample, &dataset.norms());
            let component = &mut components[sample.trajectory().index() as usize];
            sample.restore(component);
            let mut own = vec![0.0; graph.nodes().len() * paper::NODE];
            paper::fill_constant_nodes(graph, &mut own);
            paper::fill_changing_nodes(&component.poses, &mut own);
            assert_eq!(batch.nodes[nodes * paper::NODE..], own);
            let mut dlambda = vec![Spatial::zero(); graph.edges().len()];
            dataset.norms().dlambda(&batch.edge_targets[edges * paper::EDGE_TARGET..], &mut dlambda);
            let largest = component.dlambda.iter().map(|x| x.dot(*x)).fold(0.0, f64::max);
            for (a, b) in dlambda.iter().zip(&component.dlambda) {
                assert!(a.plus(*b, -1.0).dot(a.plus(*b, -1.0)) <= 1e-10 * largest);
            }
            nodes += graph.nodes().len();
            edges += graph.edges().len();
        }
        assert_eq!((batch.graphs.n_node.len(), batch.graphs.nodes(), batch.graphs.edges()), (6, nodes, edges));
        assert_eq!(batch.edges.len(), edges * paper::EDGE);
    }
}

#[test]
fn orders_are_permutations_fixed_by_seed_and_epoch() {
    let order = shuffled(1000, 7, 3);
    assert_eq!(order, shuffled(1000, 7, 3));
    assert!(order != shuffled(1000, 7, 4) && order != shuffled(1000, 8, 3));
    let mut sorted = order;
    sorted.sort_unstable();
    assert!(sorted.into_iter().eq(0..1000));
    assert!(shuffled(0, 0, 0).is_empty());
}

#[test]
fn attempts_that_were_taken_back_leave_no_samples() {
    let directory = tempfile::tempdir().unwrap();
    let config = Config { dt_s: 0.1, max_iterations: 2, steps: 12, ..small(Scenario::Helix) };
    let dataset = generated(directory.path(), &config);
    let mut divided = 0;
    for trajectory in dataset.trajectories(Split::Train) {
        for step in 0..12 {
            let samples: Vec<_> = trajectory.samples().filter(|sample| sample.step() == step).collect();
            let substeps = samples.chunk_by(|_, next| next.iteration() > 0);
            let mut time = 0.0;
            for substep in substeps {
                assert!(
                    substep.iter().enumerate().all(|(k, s)| s.iteration() == k as u32 && s.dt() == substep[0].dt())
                );
                time += substep[0].dt();
                divided += usize::from(substep[0].dt() < 0.1);
            }
            assert!((time - 0.1).abs() < 1e-12, "step {step} of {}: {time} s", trajectory.index());
        }
    }
    assert!(divided > 0);
}
