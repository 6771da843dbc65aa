//! The ablation sweep: what networks of other sizes are worth after equal budgets of training (paper, supplement,
//! section "Architecture" and Fig. 11).
//!
//! These are its numbers, as they stand in files; the program `train` makes them.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::guesses::{BesideZero, Measured, Spread, beside_zero};

/// Version of [`CellKey`], [`NetworkOutcome`], [`Sweep`] and [`Summary`] in files.
pub const SCHEMA_VERSION: u32 = 1;

/// Sizes that are varied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Architecture {
    /// GN blocks M.
    pub gn_blocks: u16,
    /// Linear layers of every perceptron.
    pub mlp_layers: u16,
    /// Latent size l.
    pub width: u16,
}

impl Architecture {
    /// The paper's benchmark architecture.
    pub const BENCHMARK: Self = Self { gn_blocks: 3, mlp_layers: 2, width: 32 };

    /// What the training takes for one node, about: multiplications, and overheads of each layer.
    fn cost(&self) -> f64 {
        /// Overhead of a layer, in multiplications; measured for rods with the backend flex.
        const OVERHEAD: f64 = 1500.0;
        let [blocks, layers, width] = [self.gn_blocks, self.mlp_layers, self.width].map(f64::from);
        // A block's two perceptrons take three times the width; encoder and decoder are like half a block each.
        (blocks + 1.0) * (2.0 * width * width * (layers + 2.0) + 2.0 * layers * OVERHEAD)
    }
}

impl fmt::Display for Architecture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} GN blocks, {} layers, width {}", self.gn_blocks, self.mlp_layers, self.width)
    }
}

/// Which architectures: GN blocks x width at the benchmark's layers, and layers at the benchmark.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Grid {
    /// GN blocks, each with each width.
    pub gn_blocks: Vec<u16>,
    /// Widths.
    pub widths: Vec<u16>,
    /// Layers, at the benchmark.
    pub mlp_layers: Vec<u16>,
    /// The architecture around which one varies.
    pub benchmark: Architecture,
}

impl Grid {
    /// Each architecture once.
    pub fn architectures(&self) -> Vec<Architecture> {
        let benchmark = self.benchmark;
        let of =
            |&gn_blocks: &u16| self.widths.iter().map(move |&width| Architecture { gn_blocks, width, ..benchmark });
        let mut all: Vec<Architecture> = self.gn_blocks.iter().flat_map(of).collect();
        let deeper = self.mlp_layers.iter().map(|&mlp_layers| Architecture { mlp_layers, ..benchmark });
        let deeper: Vec<Architecture> = deeper.filter(|own| !all.contains(own)).collect();
        all.extend(deeper);
        all
    }
}

/// Scenes of one kind, and the data set of them that is learned from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Source {
    /// Kind of scenes.
    pub scenario: String,
    /// BLAKE3 hash of the hashes of the data set's files.
    pub data_blake3: String,
    /// Samples that are learned from.
    pub samples: u64,
    /// Nodes of all of them: one epoch visits so many.
    pub nodes: u64,
}

/// How every network is trained.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Budget {
    /// Recipe, which stands for the following where they are not given.
    pub recipe: String,
    /// Inputs.
    pub features: String,
    /// Outputs.
    pub head: String,
    /// Loss.
    pub loss: String,
    /// Scans along the rod in each block.
    pub scans: usize,
    /// Times through the samples.
    pub epochs: u64,
    /// Samples in a batch.
    pub batch: usize,
    /// Step size of Adam.
    pub learning_rate: f64,
    /// How the step size goes on.
    pub schedule: String,
    /// Epochs between two measurements on validation scenes, of which the best weights are kept.
    pub measure_every: u64,
    /// Validation scenes.
    pub validation_scenes: usize,
    /// What computed the tensors.
    pub backend: String,
}

/// What the networks are measured on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Test {
    /// Seed of the scenes, none of which is in the data sets.
    pub seed: u64,
    /// Simulations.
    pub simulations: u64,
    /// Steps of each.
    pub steps: usize,
}

/// A whole sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sweep {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// Seeds of the networks.
    pub seeds: Vec<u64>,
    /// The architectures.
    pub grid: Grid,
    /// Training.
    pub budget: Budget,
    /// Measurement.
    pub test: Test,
    /// The kinds of scenes.
    pub sources: Vec<Source>,
}

/// What a cell of a sweep, one network, is trained and measured on: all that its [`NetworkOutcome`] depends on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CellKey {
    /// Seed of the parameters and of the samples' order.
    pub seed: u64,
    /// The network's sizes.
    pub architecture: Architecture,
    /// Training.
    pub budget: Budget,
    /// Measurement.
    pub test: Test,
    /// Scenes and data.
    pub source: Source,
}

impl Sweep {
    /// All cells: by seed, then kind of scenes, then cost, the most expensive first.
    pub fn keys(&self) -> Vec<CellKey> {
        let mut architectures = self.grid.architectures();
        architectures.sort_by(|a, b| b.cost().total_cmp(&a.cost()));
        let mut keys = Vec::new();
        for &seed in &self.seeds {
            for source in &self.sources {
                let (budget, test) = (&self.budget, self.test);
                keys.extend(architectures.iter().map(|&architecture| CellKey {
                    seed,
                    architecture,
                    budget: budget.clone(),
                    test,
                    source: source.clone(),
                }));
            }
        }
        keys
    }
}

impl CellKey {
    /// What the training takes beside other cells of the sweep, about.
    pub fn cost(&self) -> f64 {
        (self.source.nodes * self.budget.epochs) as f64 * self.architecture.cost()
    }
}

impl fmt::Display for CellKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {}, seed {}", self.source.scenario, self.architecture, self.seed)
    }
}

/// What a network's guess saves with one preconditioner and tolerance, in later steps, over the simulations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GuessSavings {
    /// [`FREE`] or [`PLANAR`].
    pub guess: String,
    /// Preconditioner of conjugate gradients.
    pub preconditioner: String,
    /// Tolerance, relative to the right-hand side.
    pub tolerance: f64,
    /// Solves of all simulations.
    pub solves: u64,
    /// Those whose start was dropped.
    pub dropped: u64,
    /// Iterations relative to the zero start's.
    pub iteration_ratio: Option<Spread>,
    /// Time of the zero start's solve over that of the guess and its solve.
    pub speed_up: Option<Spread>,
    /// Time of the zero start's solve [us].
    pub zero_us: Option<Spread>,
    /// Time of the guess, features and network, for one solve [us].
    pub inference_us: Option<Spread>,
}

/// Name of the network's guess as it is.
pub const FREE: &str = "free";
/// Name of the network's guess restricted to the plane that the scene stays in.
pub const PLANAR: &str = "planar";

/// What came of a cell: a network's training, and what its guess saves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NetworkOutcome {
    /// Parameters of the network.
    pub parameters: usize,
    /// BLAKE3 hash of its weights' file.
    pub weights_blake3: String,
    /// Epochs after which the weights were the best on validation scenes: these were measured.
    pub best_epoch: u64,
    /// Mean loss since the measurement before the end.
    pub final_loss: f64,
    /// Time of the training, measurements on validation scenes included [s].
    pub training_s: f64,
    /// Time of the measurement on held-out scenes [s].
    pub measuring_s: f64,
    /// Processor and cores.
    pub machine: String,
    /// Threads.
    pub threads: usize,
    /// Version of the program.
    pub program_version: String,
    /// Revision of its source, where it was found.
    pub git_revision: Option<String>,
    /// One for each guess, preconditioner and tolerance.
    pub rows: Vec<GuessSavings>,
}

/// A cell that is done.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepCell {
    /// Kind of scenes.
    pub scenario: String,
    /// The network's sizes.
    pub architecture: Architecture,
    /// Its seed.
    pub seed: u64,
    /// What came of it.
    pub outcome: NetworkOutcome,
}

/// All cells of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// Cells that are missing, in words.
    pub lost: Vec<String>,
    /// What was swept.
    pub sweep: Sweep,
    /// Those that are there, in the order of [`Sweep::keys`].
    pub cells: Vec<SweepCell>,
}

/// Place of the later steps among [`crate::guesses::buckets`].
const LATER: usize = 4;

/// The steps that are measured: of [`crate::guesses::buckets`] the later ones alone.
pub fn buckets(steps: usize) -> Vec<Option<usize>> {
    crate::guesses::buckets(steps).into_iter().map(|bucket| bucket.filter(|&bucket| bucket == LATER)).collect()
}

/// Of the network's guess, [`FREE`] and [`PLANAR`], with each preconditioner and tolerance. The simulations' first guess
/// must be the zero start.
pub fn savings(simulations: &[Measured]) -> Vec<GuessSavings> {
    let per_solve = |seconds: f64, solves: u64| 1e6 * seconds / solves as f64;
    let savings = |own: BesideZero| GuessSavings {
        preconditioner: own.preconditioner.name().to_owned(),
        tolerance: own.tolerance,
        solves: own.count(|own| own.solves),
        dropped: own.count(|own| own.dropped),
        iteration_ratio: own.iteration_ratio(),
        speed_up: own.spread(|zero, own| zero.solve_s / (own.guess_s + own.solve_s)),
        zero_us: own.spread(|zero, _| per_solve(zero.solve_s, zero.solves)),
        inference_us: own.spread(|_, own| per_solve(own.guess_s, own.solves)),
        guess: own.guess,
    };
    let is_own = |own: &BesideZero| [FREE, PLANAR].contains(&own.guess.as_str());
    beside_zero(simulations, LATER).into_iter().filter(is_own).map(savings).collect()
}

#[cfg(test)]
mod tests {
    use cosserat::assembly::{Assembly, Material, RodSpec, shape};
    use cosserat::guess::{GuessFactory, GuessKind};
    use cosserat::simulation::{PreconditionerKind, Settings};
    use nalgebra::Vector3;

    use super::*;
    use crate::guesses::{self, Plan};

    #[test]
    fn savings_say_what_was_summed_in_later_steps() {
        let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
        let nodes = shape::straight(Vector3::zeros(), Vector3::new(1.0, 0.0, -0.5), 3.0, 12);
        let material = Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 100.0 };
        let rod = assembly.rod(&RodSpec::new(nodes, 0.05, material));
        assembly.fix(rod.start);
        let (model, state) = assembly.finish();
        let fischer = |model: &_, members: &_, topology: &_| GuessKind::Fischer(8).build(model, members, topology);
        let plan = Plan {
            guesses: vec![("zero".to_owned(), None), (FREE.to_owned(), Some(&fischer as GuessFactory<'_>))],
            preconditioners: vec![PreconditionerKind::Raw, PreconditionerKind::BlockJacobi],
            tolerances: vec![1e-2, 1e-4],
            max_iterations: None,
            buckets: buckets(30),
            is_struck: false,
        };
        let measured = guesses::measure(&model, &state, 0.02, &Settings::default(), &plan, || true).unwrap();
        let rows = savings(std::slice::from_ref(&measured));
        let sums: Vec<_> = beside_zero(&[measured], LATER).into_iter().map(|own| own.sums[0]).collect();
        assert_eq!(rows.len(), 4);
        for (column, row) in rows.into_iter().enumerate() {
            let [zero, own] = sums[4 + column];
            // Steps 15, 20, 25 and 30.
            assert_eq!((row.guess.as_str(), row.solves, own.solves, row.dropped), (FREE, 4, 4, own.dropped));
            let median = |spread: Option<Spread>| spread.unwrap().median;
            assert_eq!(median(row.iteration_ratio), own.iterations as f64 / zero.iterations as f64);
            assert!(median(row.iteration_ratio) < 1.0);
            assert_eq!(median(row.zero_us), 1e6 * zero.solve_s / 4.0);
            assert_eq!(median(row.speed_up), zero.solve_s / (own.guess_s + own.solve_s));
            assert_eq!(median(row.inference_us), 1e6 * own.guess_s / 4.0);
            assert!(own.guess_s > 0.0);
        }
    }
}
