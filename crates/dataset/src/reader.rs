//! A data set, open for reading: trajectories and samples by index.

use std::path::Path;
use std::sync::Arc;

use cosserat::guess::{Members, Topology};
use cosserat::internals::component::{Component, split};
use cosserat::internals::kernels::Spatial;
use cosserat::internals::kernels::math::{Quat, Vec3};
use cosserat::simulation::Formulation;
use cosserat::state::{Model, State};
use graph::{Graph, Normal, Norms};
use rayon::prelude::*;

use crate::DatasetError;
use crate::config::Split;
use crate::layout::Name;
use crate::manifest::{MANIFEST, Manifest, Numbers, ShardInfo};
use crate::record::state_of;
use crate::shard::Shard;

/// A data set whose files are mapped into memory.
#[derive(Debug)]
pub struct Dataset {
    manifest: Manifest,
    shards: Vec<Shard>,
    splits: [Vec<Entry>; 2],
    /// Of every split, number of samples before each trajectory, and of all.
    starts: [Vec<usize>; 2],
}

/// A trajectory's constants, and where its samples are.
#[derive(Debug)]
struct Entry {
    shard: usize,
    /// Place in the shard.
    place: usize,
    index: u64,
    model: Model,
    members: Members,
    topology: Arc<Topology>,
    graph: Graph,
    planar: Option<Normal>,
}

impl Dataset {
    /// Opens the data set in `directory`. Every file is read once, for its checksum and its constants.
    ///
    /// # Errors
    /// If anything is missing, damaged, foreign or of another version.
    pub fn open(directory: impl AsRef<Path>) -> Result<Self, DatasetError> {
        let directory = directory.as_ref();
        let manifest = Manifest::read(directory)?;
        let open = |info: &ShardInfo| {
            let shard = Shard::open(&directory.join(&info.file), &info.blake3)?;
            let found = Numbers::new(shard.counts(), info.numbers.unconverged_steps);
            if (found, shard.len()) != (info.numbers, info.bytes) {
                let value = format!("{found:?}, {} bytes", shard.len());
                let allowed = format!("{:?}, {} bytes, by {MANIFEST}", info.numbers, info.bytes);
                return Err(DatasetError::value(&shard.file, "numbers", value, allowed));
            }
            Ok(shard)
        };
        let shards: Vec<Shard> = manifest.shards.par_iter().map(open).collect::<Result<_, _>>()?;
        let mut dataset = Self { manifest, shards, splits: Default::default(), starts: [vec![0], vec![0]] };
        for k in 0..dataset.shards.len() {
            let info = &dataset.manifest.shards[k];
            let (split, first, shard) = (info.split as usize, info.first_trajectory, &dataset.shards[k]);
            let entry = |place: usize| entry(shard, k, place, first + place as u64);
            let entries: Vec<Entry> =
                (0..shard.counts().trajectories).into_par_iter().map(entry).collect::<Result<_, _>>()?;
            for (place, entry) in entries.into_iter().enumerate() {
                let samples = shard.starts[place + 1].samples - shard.starts[place].samples;
                let before = dataset.starts[split].last().copied().unwrap_or(0);
                dataset.starts[split].push(before + samples);
                dataset.splits[split].push(entry);
            }
        }
        Ok(dataset)
    }

    /// What the data set is.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// The recorded norms, of the training split.
    pub fn norms(&self) -> Norms {
        self.manifest.norms
    }

    /// Number of trajectories of a split.
    pub fn trajectory_count(&self, split: Split) -> usize {
        self.splits[split as usize].len()
    }

    /// Number of samples of a split.
    pub fn sample_count(&self, split: Split) -> usize {
        self.starts[split as usize].last().copied().unwrap_or(0)
    }

    /// Trajectory `index` of a split, from 0.
    pub fn trajectory(&self, split: Split, index: usize) -> Option<Trajectory<'_>> {
        let entry = self.splits[split as usize].get(index)?;
        Some(Trajectory { shard: &self.shards[entry.shard], entry })
    }

    /// The trajectories of a split.
    pub fn trajectories(&self, split: Split) -> impl ExactSizeIterator<Item = Trajectory<'_>> {
        self.splits[split as usize].iter().map(|entry| Trajectory { shard: &self.shards[entry.shard], entry })
    }

    /// Sample `index` of a split, counted from 0 through its trajectories.
    pub fn sample(&self, split: Split, index: usize) -> Option<Sample<'_>> {
        let starts = &self.starts[split as usize];
        let trajectory = starts.partition_point(|&start| start <= index).checked_sub(1)?;
        self.trajectory(split, trajectory)?.sample(index - starts[trajectory])
    }
}

/// Decodes and checks a trajectory's constants.
fn entry(shard: &Shard, number: usize, place: usize, index: u64) -> Result<Entry, DatasetError> {
    let wrong = |key: &str, value: String, allowed: &str| {
        Err(DatasetError::value(&shard.file, format!("{key} of trajectory {index}"), value, allowed))
    };
    let found = shard.u64s(Name::Index, place..place + 1).next().unwrap_or_default();
    if found != index {
        return wrong("trajectory.index", found.to_string(), &index.to_string());
    }
    let planar = match shard.u32s(Name::Planar, place..place + 1).next().unwrap_or_default() {
        0 => None,
        1 => Some(Normal::D1),
        2 => Some(Normal::D2),
        other => return wrong("trajectory.planar", other.to_string(), "0, 1 or 2"),
    };
    let model = shard.model(place)?;
    let rest = state_of(model.segments.iter().map(|_| [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]));
    if let Err(error) = model.validate(&rest) {
        return wrong("model", error.to_string(), "one that can be simulated");
    }
    let mut sets = split(&model);
    let Some((members, topology)) = sets.pop().filter(|_| sets.is_empty()) else {
        return wrong("connected sets", (sets.len() + 1).to_string(), "1");
    };
    if members.anchors.len() != model.anchors.len() {
        return wrong("anchors", model.anchors.len().to_string(), &members.anchors.len().to_string());
    }
    let graph = Graph::new(&model, &members, &topology);
    Ok(Entry { shard: number, place, index, model, members, topology: Arc::new(topology), graph, planar })
}

/// A recorded trajectory of one connected set of segments.
#[derive(Clone, Copy, Debug)]
pub struct Trajectory<'a> {
    shard: &'a Shard,
    entry: &'a Entry,
}

impl<'a> Trajectory<'a> {
    /// Its index in the whole set: the stream of its random numbers.
    pub fn index(&self) -> u64 {
        self.entry.index
    }

    /// The model: segments, joints and anchors in the order of the samples' rows, without loads and damping.
    pub fn model(&self) -> &'a Model {
        &self.entry.model
    }

    /// The model as one connected set, as guesses and linear solvers are built for.
    pub fn members(&self) -> &'a Members {
        &self.entry.members
    }

    /// Its connectivity.
    pub fn topology(&self) -> &'a Arc<Topology> {
        &self.entry.topology
    }

    /// The graph: what stays the same of its features.
    pub fn graph(&self) -> &'a Graph {
        &self.entry.graph
    }

    /// The axis normal to the plane in which all of it lies and stays, if there is one.
    pub fn planar_normal(&self) -> Option<Normal> {
        self.entry.planar
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.shard.starts[self.entry.place + 1].samples - self.shard.starts[self.entry.place].samples
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Sample `k`, from 0, in the order of the simulation.
    pub fn sample(&self, k: usize) -> Option<Sample<'a>> {
        (k < self.len()).then_some(Sample { trajectory: *self, k })
    }

    /// The samples in the order of the simulation.
    pub fn samples(&self) -> impl ExactSizeIterator<Item = Sample<'a>> + use<'a> {
        let trajectory = *self;
        (0..self.len()).map(move |k| Sample { trajectory, k })
    }

    /// A component to restore samples into ([`Sample::restore`]), its poses those of the first.
    pub fn component(&self) -> Component<f64> {
        let identity = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        let state: State = match self.sample(0) {
            Some(first) => state_of(first.pose_rows()),
            None => state_of(self.entry.model.segments.iter().map(|_| identity)),
        };
        Component::new(&self.entry.model, &state, self.entry.topology.clone(), &[&self.entry.members])
    }
}

/// One outer iteration: a linear system and its exact solution.
#[derive(Clone, Copy, Debug)]
pub struct Sample<'a> {
    trajectory: Trajectory<'a>,
    k: usize,
}

impl<'a> Sample<'a> {
    /// The trajectory it is of.
    pub fn trajectory(&self) -> Trajectory<'a> {
        self.trajectory
    }

    /// Step of the simulation, from 0.
    pub fn step(&self) -> u32 {
        self.place()[0]
    }

    /// Outer iteration within the step, from 0; substeps, which are rare, begin with 0 again.
    pub fn iteration(&self) -> u32 {
        self.place()[1]
    }

    /// Time step of the linear system [s]: the data set's, or a fraction where a step was divided.
    pub fn dt(&self) -> f64 {
        let row = self.row();
        self.shard().f64s(Name::Dt, row..row + 1).next().unwrap_or_default()
    }

    /// Multipliers before the iteration, one entry an edge: [N s^2], [N m^2 s^2].
    pub fn lambda(&self) -> impl Iterator<Item = Spatial<f64>> + use<'a> {
        self.shard().arrays(Name::Lambda, self.joints()).map(Spatial::from_array)
    }

    /// Right-hand side b, one entry an edge: [m], [1/m].
    pub fn rhs(&self) -> impl Iterator<Item = [f32; 6]> + use<'a> {
        self.shard().singles(Name::Rhs, self.joints())
    }

    /// The exact solution, one entry an edge: [N s^2], [N m^2 s^2].
    pub fn dlambda(&self) -> impl Iterator<Item = [f32; 6]> + use<'a> {
        self.shard().singles(Name::Dlambda, self.joints())
    }

    /// Its corrections (dx [m], dphi [rad]), one entry a segment; those of anchors are zero.
    pub fn dp(&self) -> impl Iterator<Item = [f32; 6]> + use<'a> {
        self.shard().singles(Name::Dp, self.segments())
    }

    /// Puts the sample into a component of its trajectory: poses, multipliers, the linear system (to the last bit the
    /// one that was solved), and the solution in `dlambda`, in single precision. Start and velocities are not restored.
    pub fn restore(&self, component: &mut Component<f64>) {
        let dt = self.dt();
        if component.dt() != dt {
            // Compliances go with the time step; the prediction that comes with them is overwritten.
            component.predict(0.0, dt, Formulation::Xpbd);
        }
        for (pose, [x, y, z, i, j, k, w]) in component.poses.iter_mut().zip(self.pose_rows()) {
            (pose.x, pose.q) = (Vec3([x, y, z]), Quat { v: Vec3([i, j, k]), w });
        }
        if self.shard().has(Name::Inertia) {
            for (segment, inertia) in self.shard().arrays(Name::Inertia, self.segments()).enumerate() {
                component.set_inertia(segment, inertia);
            }
        }
        component.lambda.iter_mut().zip(self.lambda()).for_each(|(own, stored)| *own = stored);
        component.evaluate(Formulation::Xpbd);
        for (own, stored) in component.dlambda.iter_mut().zip(self.dlambda()) {
            *own = Spatial::from_array(stored.map(f64::from));
        }
    }

    /// Poses at the iteration, one row a segment: x, y, z [m] and the quaternion x, y, z, w.
    pub fn pose_rows(&self) -> impl Iterator<Item = [f64; 7]> + use<'a> {
        self.shard().arrays(Name::Poses, self.segments())
    }

    fn shard(&self) -> &'a Shard {
        self.trajectory.shard
    }

    fn row(&self) -> usize {
        self.shard().starts[self.trajectory.entry.place].samples + self.k
    }

    fn place(&self) -> [u32; 2] {
        let row = self.row();
        let mut place = self.shard().u32s(Name::Places, row..row + 1);
        [place.next().unwrap_or_default(), place.next().unwrap_or_default()]
    }

    fn segments(&self) -> std::ops::Range<usize> {
        let n = self.trajectory.entry.model.segments.len();
        let first = self.shard().starts[self.trajectory.entry.place].sample_segments + self.k * n;
        first..first + n
    }

    fn joints(&self) -> std::ops::Range<usize> {
        let n = self.trajectory.entry.model.joints.len();
        let first = self.shard().starts[self.trajectory.entry.place].sample_joints + self.k * n;
        first..first + n
    }
}

#[cfg(test)]
mod tests {
    use cosserat::scene;

    use super::*;
    use crate::batch::PaperBatch;
    use crate::{Config, record, write};

    /// The format is not restricted to the data set's scenarios.
    #[test]
    fn a_tree_with_an_anchor_is_read_back() {
        let scene = scene::parse(
            "[[rods]]\nname = \"trunk\"\nradius_m = 0.05\nclamp = [\"start-face\"]\n\n[rods.shape.straight]\nlength_m = 1.0\n\
             segments = 5\n\n[rods.tree]\nbranches = 3\nlevels = 2\nsegments = 4\nseed = 1\n",
            "small-tree.toml",
        );
        let scene = scene.unwrap();
        let record = record::record(&scene, 3, &Config { steps: 3, ..Config::default() }).unwrap();
        assert_eq!((record.model.anchors.len(), record.model.segments.len()), (1, 17));
        let bytes = write::shard(std::slice::from_ref(&record)).unwrap();
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), &bytes).unwrap();
        let shard = Shard::open(file.path(), blake3::hash(&bytes).to_hex().as_str()).unwrap();
        let entry = entry(&shard, 0, 0, 3).unwrap();
        assert_eq!(entry.model, record.model);
        let trajectory = Trajectory { shard: &shard, entry: &entry };
        let mut component = trajectory.component();
        let mut batch = PaperBatch::default();
        for sample in trajectory.samples() {
            sample.restore(&mut component);
            let rhs = component.system.joints.iter().map(|joint| joint.rhs.to_array().map(|x| x as f32));
            assert!(rhs.eq(sample.rhs()));
            batch.clear();
            batch.push(&sample, &record.norms);
            assert_eq!((batch.graphs.nodes(), batch.graphs.edges()), (18, 17));
            let anchor = &batch.nodes[17 * 14..];
            assert!(anchor[..3].iter().all(|x| x.abs() < 1e-9) && anchor[11] == 0.0);
            assert_eq!(batch.node_targets[17 * 6..], [0.0; 6]);
        }
        assert!(trajectory.len() >= 3);
    }

    #[test]
    fn scenes_that_cannot_be_stored_are_refused() {
        let two = "[[rods]]\nradius_m = 0.05\n[rods.shape.straight]\nlength_m = 1.0\nsegments = 3\n";
        let scene = scene::parse(&format!("{two}\n{two}"), "two.toml").unwrap();
        let error = record::record(&scene, 0, &Config { steps: 1, ..Config::default() }).unwrap_err();
        assert_eq!(error.to_string(), "trajectory 0: 2 connected sets of segments, but it must be one");
    }
}
