//! Starts for the equilibria of cables with three arms: time, solves, and how often they lead to the lowest equilibrium.

mod neighbours;

use equilibria::branched::batch::KnownStar;
use equilibria::branched::learned::LearnedStar;
use equilibria::branched::sample::BranchedDistribution;
use equilibria::branched::start::{Begin, CLASSES, Pose, RandomStars, Shape, Site, StarStarts, Stars};
use equilibria::branched::{BranchedAnswer, BranchedError, BranchedQuery, Star, default_params, solve_from};
use equilibria::{Cut, Params, ParamsError};
use nalgebra::UnitQuaternion;

use crate::cables::{CHUNK, Measured, NEIGHBOURS_SEED, RANDOM, SAME, mean, now};

pub use neighbours::StarNeighbours;

/// A way to an equilibrium.
pub struct StarWay {
    /// Its name.
    pub name: String,
    /// Segments an arm of its coarse levels.
    pub levels: Vec<usize>,
    /// Where it begins.
    pub starts: Box<dyn StarStarts>,
}

impl StarWay {
    fn new(name: impl Into<String>, levels: &[usize], starts: impl StarStarts + 'static) -> Self {
        Self { name: name.into(), levels: levels.to_vec(), starts: Box::new(starts) }
    }
}

/// The searches over the junction's pose that are tried: names and poses.
const POSES: [(&str, &[Pose]); 6] = [
    ("mean pose", &[Pose::Mean]),
    ("pose of the triangle", &[Pose::Triangle]),
    ("pose between", &[Pose::Both]),
    ("two poses", &[Pose::Mean, Pose::Triangle]),
    ("two near poses", &[Pose::Mean, Pose::Both]),
    ("three poses", &[Pose::Mean, Pose::Triangle, Pose::Both]),
];

/// All ways, with and without learning; neighbours among so many answers.
///
/// # Errors
/// If a parameter is not allowed.
pub fn ways(segments: usize, neighbours: &[u64]) -> Result<Vec<StarWay>, ParamsError> {
    let mut ways = Vec::new();
    let stars = |sites: &[Site], poses: &[Pose], shapes: &[Shape], classes| Stars {
        sites: sites.to_vec(),
        poses: poses.to_vec(),
        shapes: shapes.to_vec(),
        classes,
    };
    for (name, poses) in POSES {
        for classes in [1, 2, 3, CLASSES] {
            for levels in [&[5][..], &[6], &[7], &[8], &[10]] {
                let name = format!("even turns, {name}, classes: {classes}");
                ways.push(StarWay::new(name, levels, stars(&[Site::Middle], poses, &[Shape::Even], classes)));
            }
        }
    }
    for (shape, name) in [(Shape::Hermite, "cubics"), (Shape::Sagging, "with sag")] {
        for (site, place) in [(Site::Middle, "middle"), (Site::Low, "low")] {
            for (name_of_pose, poses) in &POSES[..2] {
                let name = format!("{name}, {place}, {name_of_pose}, classes: 4");
                ways.push(StarWay::new(name, &[7], stars(&[site], poses, &[shape], CLASSES)));
            }
        }
    }
    for (name, poses) in [POSES[0], POSES[3]] {
        let name = format!("even turns and with sag, {name}, classes: 4");
        let shapes = [Shape::Even, Shape::Sagging];
        for levels in [&[5][..], &[6], &[7], &[8]] {
            ways.push(StarWay::new(&name, levels, stars(&[Site::Middle], poses, &shapes, CLASSES)));
        }
        let name = format!("{name}, low");
        ways.push(StarWay::new(name, &[7], stars(&[Site::Middle, Site::Low], poses, &shapes, CLASSES)));
    }
    for levels in [&[][..], &[5, 10]] {
        let name = "even turns, mean pose, classes: 4";
        ways.push(StarWay::new(name, levels, stars(&[Site::Middle], &[Pose::Mean], &[Shape::Even], CLASSES)));
    }
    for count in [8, 16] {
        let name = format!("{count} random starts");
        ways.push(StarWay::new(name, &[7], RandomStars { count, seed: NEIGHBOURS_SEED + 1 }));
    }
    for proposals in [1, 2, CLASSES] {
        for levels in [&[][..], &[5], &[7], &[10]] {
            let mut starts = LearnedStar::default();
            starts.proposals = proposals;
            ways.push(StarWay::new(format!("learned, proposals: {proposals}"), levels, starts));
        }
    }
    let most = neighbours.iter().copied().max().unwrap_or(0);
    let distribution = BranchedDistribution::default();
    let queries: Vec<BranchedQuery> = (0..most).map(|k| distribution.query(NEIGHBOURS_SEED, k)).collect();
    let answers = solve_from(&queries, &Params { segments, ..default_params() }, &Stars::default())?;
    let known: Vec<(BranchedQuery, KnownStar)> = queries
        .into_iter()
        .zip(answers)
        .filter_map(|(query, answer)| Some((query, KnownStar::of(&query, &answer.ok()?)?)))
        .collect();
    for &count in neighbours {
        let known = &known[..known.len().min(count as usize)];
        for (with_tree, how) in [(false, "one by one"), (true, "k-d tree")] {
            let name = format!("nearest of {}, {how}", known.len());
            ways.push(StarWay::new(name, &[], StarNeighbours::new(known, with_tree)));
        }
    }
    Ok(ways)
}

type Answers = Vec<Result<BranchedAnswer, BranchedError>>;
/// Times of the parts; of each query the solves, if it was answered, and the energy.
type Seen = (Vec<f64>, Vec<Option<[u32; 2]>>, Vec<f64>);

/// Measures ways on queries, which take turns, `rounds` times each, on one thread. `go_on` is asked after each way's turn. The
/// lowest is the lowest of all ways and of 30 random starts, each on the arms' own segments, to 1e-6 of its energy or of B / L.
///
/// # Errors
/// If a parameter is not allowed.
pub fn measure(
    queries: &[BranchedQuery],
    ways: &[StarWay],
    segments: usize,
    rounds: usize,
    mut go_on: impl FnMut() -> bool,
) -> Result<Option<Vec<Measured>>, ParamsError> {
    let energy = |answer: &Result<BranchedAnswer, BranchedError>| {
        answer.as_ref().ok().and_then(|own| own.equilibria.first()).map_or(f64::INFINITY, |own| own.energy)
    };
    let mut all: Vec<Seen> = Vec::new();
    for round in 0..rounds {
        for (k, way) in ways.iter().enumerate() {
            let params = Params { segments, levels: way.levels.clone(), again: false, ..default_params() };
            let (times, answers) = timed(queries, &params, way.starts.as_ref())?;
            if round == 0 {
                let solves = |own: &Result<BranchedAnswer, BranchedError>| {
                    own.as_ref().ok().map(|own| [own.solves, own.coarse_solves])
                };
                all.push((times, answers.iter().map(solves).collect(), answers.iter().map(energy).collect()));
            } else {
                all[k].0.iter_mut().zip(times).for_each(|(best, own)| *best = best.min(own));
            }
            if !go_on() {
                return Ok(None);
            }
        }
    }
    let params = Params { segments, branches: true, ..default_params() };
    let random = solve_from(queries, &params, &RandomStars { count: RANDOM, seed: NEIGHBOURS_SEED })?;
    let lowest: Vec<f64> = (0..queries.len())
        .map(|k| all.iter().map(|(.., energies)| energies[k]).fold(energy(&random[k]), f64::min))
        .collect();
    let units: Vec<f64> = queries.iter().map(|query| Star::new(query).units).map(|[length, b]| b / length).collect();
    let summed = all.iter().map(|(times, solves, energies)| {
        let is_lowest = |k: usize| energies[k] <= lowest[k] + SAME * lowest[k].abs().max(units[k]);
        let count = queries.len() as f64;
        let found: Vec<[f64; 2]> = solves.iter().flatten().map(|own| own.map(f64::from)).collect();
        let fine: Vec<f64> = found.iter().map(|own| own[0]).collect();
        Measured {
            query_us: mean(times).map(|seconds| 1e6 * seconds),
            solves: mean(&fine),
            coarse_solves: found.iter().map(|own| own[1]).sum::<f64>() / found.len().max(1) as f64,
            failed: 1.0 - found.len() as f64 / count,
            lowest: (0..queries.len()).filter(|&k| is_lowest(k)).count() as f64 / count,
        }
    });
    Ok(Some(summed.collect()))
}

/// Answers, and the time a query of each part of them.
fn timed(
    queries: &[BranchedQuery],
    params: &Params,
    starts: &dyn StarStarts,
) -> Result<(Vec<f64>, Answers), ParamsError> {
    let (mut times, mut answers) = (Vec::new(), Vec::new());
    for (k, part) in queries.chunks(CHUNK).enumerate() {
        let starts = Later { first: k * CHUNK, starts };
        // The thread that answers is the one that is timed.
        let (own, seconds) = rayon::scope(|_| {
            let begin = now();
            let own = solve_from(part, params, &starts);
            (own, now() - begin)
        });
        answers.extend(own?);
        times.push(seconds / part.len() as f64);
    }
    Ok((times, answers))
}

/// Starts of queries of which the first is not the first of all.
struct Later<'a> {
    first: usize,
    starts: &'a dyn StarStarts,
}

impl StarStarts for Later<'_> {
    fn count(&self) -> usize {
        self.starts.count()
    }

    fn fill(
        &self,
        index: usize,
        star: &Star,
        cut: &Cut,
        begins: &mut [Begin],
        turns: &mut [UnitQuaternion<f64>],
    ) -> usize {
        self.starts.fill(self.first + index, star, cut, begins, turns)
    }
}
