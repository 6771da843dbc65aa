//! Trainings of small networks on a few steps of a few scenes.

use std::sync::Arc;

use clap::Parser;
use copingnet::Encoding;
use dataset::{Config, Dataset, generate};
use rayon::ThreadPoolBuilder;
use tempfile::TempDir;

use super::*;
use crate::cli::Cli;
use crate::samples::whitening;

/// A training's plan, and a data set in a folder of its own.
struct Small {
    plan: Plan,
    dataset: Dataset,
    encoding: Arc<Encoding>,
    samples: Samples,
    _directory: TempDir,
}

impl Small {
    fn new(trajectories: usize, steps: usize, arguments: &str) -> Self {
        let plan = Cli::parse_from(["train"].into_iter().chain(arguments.split_whitespace())).train.plan().unwrap();
        let directory = tempfile::tempdir().unwrap();
        let config = Config {
            train_trajectories: trajectories,
            validation_trajectories: 1,
            steps,
            ..Config::table_1(plan.scenario)
        };
        generate(directory.path(), &config, None, &|_| ()).unwrap();
        let dataset = Dataset::open(directory.path()).unwrap();
        let mut encoding = Encoding {
            features: plan.features,
            head: plan.head,
            norms: dataset.norms(),
            whitening: plan.features.unwhitened(),
        };
        // Targets of at most a half: the tanh before outputs comes to 1 in no finite time.
        let norms = &mut encoding.norms;
        for norm in [&mut norms.dx, &mut norms.dphi, &mut norms.dlambda_stretch, &mut norms.dlambda_bend] {
            *norm *= 2.0;
        }
        encoding.whitening = whitening(&dataset, &Arc::new(encoding.clone()), 1);
        let encoding = Arc::new(encoding);
        let samples = Samples::of_solves(&dataset, &encoding);
        assert_eq!(samples.len(), trajectories * steps);
        Self { plan, dataset, encoding, samples, _directory: directory }
    }

    fn trainer(&self) -> Trainer<'_> {
        let objective = match self.plan.loss {
            Loss::Mse => Objective::MeanSquare,
            Loss::Cg => Objective::cg(&self.dataset, &self.encoding),
            Loss::Log => Objective::LogSquare,
        };
        Trainer::new(&self.plan, &self.samples, objective)
    }

    /// A trainer with weights none of which is zero, as some are at first, and a chunk of samples.
    fn under_way(&self) -> (Trainer<'_>, Chunk) {
        let mut trainer = self.trainer();
        for (k, x) in trainer.weights.values_mut().iter_mut().enumerate() {
            *x += 0.1 * (7.3 * k as f32).sin();
        }
        (trainer, self.samples.chunk(&[0, 3, 2, 5]))
    }
}

/// The paper's loss on its network and on ours, the loss through conjugate gradients on ours and on the paper's, and the
/// logarithmic one.
const KINDS: [&str; 5] = ["", "--recipe best --loss mse", "--recipe best", "--loss cg", "--recipe best --loss log"];

fn rows(chunk: &Chunk) -> [usize; 2] {
    [chunk.graphs.nodes(), chunk.graphs.edges()]
}

/// (f(h) - f(-h)) / (2 h) as h goes to 0, by Richardson's extrapolation.
fn slope(mut f: impl FnMut(f64) -> f64, h: f64) -> f64 {
    let mut difference = |h: f64| (f(h) - f(-h)) / (2.0 * h);
    (4.0 * difference(0.5 * h) - difference(h)) / 3.0
}

#[test]
fn a_sample_is_learned_by_heart() {
    let trained = |arguments: &str| {
        let small = Small::new(1, 1, &format!("{arguments} --scans 16 --learning-rate 5e-3 --schedule cosine"));
        let mut trainer = small.trainer();
        let losses: Vec<f64> = (0..small.plan.epochs).map(|epoch| trainer.step(&trainer.order(epoch)).0).collect();
        [losses[0], losses[losses.len() - 1]]
    };
    for mean_square in ["--epochs 600", "--recipe best --loss mse --epochs 200"] {
        let [first, last] = trained(mean_square);
        assert!(last < 1e-6 && last < 1e-4 * first, "{mean_square}: {first:e} {last:e}");
    }
    for cg in ["--recipe best --epochs 200", "--loss cg --epochs 200"] {
        // Logarithms of squares.
        let [first, last] = trained(cg);
        assert!(last < first - 5.0, "{cg}: {first} {last}");
    }
}

#[test]
fn the_seed_alone_decides_on_the_weights() {
    for kind in KINDS {
        let small = |seed: u64| Small::new(7, 10, &format!("{kind} --width 16 --batch 70 --seed {seed}"));
        let trained = |small: &Small, threads: usize| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let mut trainer = small.trainer();
                let losses: Vec<f64> = (0..3).map(|epoch| trainer.step(&trainer.order(epoch)).0).collect();
                (trainer.weights, losses)
            })
        };
        let one = small(0);
        assert!(one.plan.batch > 2 * CHUNK);
        let expected = trained(&one, 1);
        assert!(trained(&one, 2) == expected, "{kind}");
        assert!(trained(&small(0), 2) == expected, "{kind}");
        let (other, _) = trained(&small(1), 1);
        assert!(other != expected.0, "{kind}");
    }
}

#[test]
fn weights_and_moments_are_all_that_a_training_needs_to_go_on() {
    for kind in [KINDS[0], KINDS[2]] {
        let small = Small::new(2, 3, &format!("{kind} --width 16 --batch 4 --schedule cosine"));
        let go_on = |trainer: &mut Trainer, epochs: std::ops::Range<u64>| {
            for epoch in epochs {
                for batch in trainer.order(epoch).chunks(small.plan.batch) {
                    trainer.step(batch);
                }
            }
        };
        let mut whole = small.trainer();
        go_on(&mut whole, 0..3);
        assert_eq!((whole.batches(), whole.adam.steps), (2, 6));
        let (mut first, mut second) = (small.trainer(), small.trainer());
        go_on(&mut first, 0..2);
        (second.weights, second.adam) = (first.weights, first.adam);
        go_on(&mut second, 2..3);
        assert!(second.weights == whole.weights && second.adam == whole.adam);
    }
}

#[test]
fn a_batch_in_parts_has_the_gradient_of_the_whole() {
    for kind in KINDS {
        let small = Small::new(2, 3, &format!("{kind} --width 16"));
        let (trainer, whole) = small.under_way();
        let parts = [&whole.samples[..1], &whole.samples[1..]].map(|samples| small.samples.chunk(samples));
        let (loss, gradient) = trainer.gradient(&whole, 4, rows(&whole));
        let [(a, first), (b, second)] = parts.map(|part| trainer.gradient(&part, 4, rows(&whole)));
        let [a, b, loss] = [a.loss, b.loss, loss.loss];
        assert!((a + b - loss).abs() < 1e-6 * loss.abs(), "{kind}: {a} + {b} {loss}");
        let largest = gradient.iter().fold(0.0_f32, |largest, g| largest.max(g.abs()));
        for ((a, b), g) in first.iter().zip(&second).zip(&gradient) {
            assert!((a + b - g).abs() < 1e-5 * largest, "{kind}: {a} + {b} {g}");
        }
    }
}

#[test]
fn losses_have_the_gradients_of_central_differences() {
    for kind in KINDS {
        let small = Small::new(2, 3, kind);
        let (trainer, chunk) = small.under_way();
        let [n, m] = rows(&chunk);
        let outputs = |count: usize, shift: f32| -> Vec<f32> {
            (0..count * small.plan.head.outputs()[0]).map(|k| 0.5 * (12.9 * k as f32 + shift).sin()).collect()
        };
        let [nodes, edges] = [outputs(n, 0.0), outputs(m, 1.0)];
        let evaluate = |nodes: &[f32], edges: &[f32]| {
            trainer.objective.evaluate(&small.samples, &chunk, [nodes, edges], 4, [n, m])
        };
        let gradient = evaluate(&nodes, &edges);
        for seed in [2.0, 3.0, 4.0] {
            for (own, found) in [(&nodes, &gradient.nodes), (&edges, &gradient.edges)] {
                // Steps with few digits, so that moved outputs are hardly rounded.
                let direction: Vec<f32> = outputs(own.len() / small.plan.head.outputs()[0], seed)
                    .iter()
                    .map(|x| (x * 8.0).round() / 8.0)
                    .collect();
                let expected = slope(
                    |h| {
                        let moved: Vec<f32> = own.iter().zip(&direction).map(|(x, d)| x + h as f32 * d).collect();
                        if std::ptr::eq(own, &nodes) {
                            evaluate(&moved, &edges).loss
                        } else {
                            evaluate(&nodes, &moved).loss
                        }
                    },
                    1.0 / 256.0,
                );
                let found: f64 = found.iter().zip(&direction).map(|(g, d)| f64::from(*g) * f64::from(*d)).sum();
                assert!((found - expected).abs() <= 1e-5 * expected.abs(), "{kind}: {found:e} {expected:e}");
            }
        }
    }
}

#[test]
fn the_whole_has_the_gradient_of_central_differences() {
    for kind in KINDS {
        let small = Small::new(2, 3, &format!("{kind} --width 16 --scans 3"));
        let (mut trainer, chunk) = small.under_way();
        let (_, gradient) = trainer.gradient(&chunk, 4, rows(&chunk));
        let norm = |part: &[f32]| part.iter().map(|&g| f64::from(g).powi(2)).sum::<f64>().sqrt();
        let specs: Vec<_> = trainer.weights.tensors().map(|(spec, _)| spec.clone()).collect();
        let weights = trainer.weights.values().to_vec();
        let mut first = 0;
        for spec in specs {
            let range = first..first + spec.len();
            first = range.end;
            // Along the tensor's own gradient, where the loss changes most.
            let found = norm(&gradient[range.clone()]);
            if found == 0.0 {
                // The paper's multipliers are outputs of edges alone, which hear nothing of the nodes' last change.
                let is_unheard =
                    ["block.2.scan", "block.2.node", "decoder.node"].iter().any(|x| spec.name.starts_with(x));
                assert!(kind == "--loss cg" && is_unheard, "{kind} {}", spec.name);
                continue;
            }
            let along = |h: f64| {
                trainer.weights.values_mut().copy_from_slice(&weights);
                for k in range.clone() {
                    trainer.weights.values_mut()[k] += (h * f64::from(gradient[k]) / found) as f32;
                }
                trainer.gradient(&chunk, 4, rows(&chunk)).0.loss
            };
            // Outputs are in single precision: steps are as short as that allows, so that few ReLUs turn within them.
            let expected = slope(along, 3e-4);
            let error = (found - expected).abs();
            assert!(error < 1e-4 * norm(&gradient), "{kind} {}: {found:e} {expected:e}", spec.name);
        }
    }
}

#[test]
fn step_sizes_follow_the_schedule() {
    let small = Small::new(1, 4, "--batch 2 --learning-rate 0.5 --epochs 1000 --schedule cosine");
    let mut trainer = small.trainer();
    let mut rate = |steps: u64| {
        trainer.adam.steps = steps;
        trainer.rate()
    };
    // Up over 200 of 2000 steps, then down to nothing.
    assert_eq!(rate(0), 0.5 / 200.0);
    assert!((rate(1000) - 0.25).abs() < 1e-12 && rate(2000).abs() < 1e-12);
    assert!((200..1999).all(|steps| rate(steps + 1) < rate(steps)));
    assert!((0..199).all(|steps| rate(steps + 1) > rate(steps)));
    let small = Small::new(1, 4, "--learning-rate 0.5");
    assert_eq!(small.trainer().rate(), 0.5);
}
