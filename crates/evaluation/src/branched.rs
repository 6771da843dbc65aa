//! Starts for the equilibria of cables with three arms: time, solves, and how often they lead to the lowest equilibrium.

mod neighbours;

use equilibria::branched::learned::LearnedStar;
use equilibria::branched::sample::BranchedDistribution;
use equilibria::branched::start::{CLASSES, Pose, RandomStars, Shape, Site, Stars};
use equilibria::branched::{BranchedQuery, Star, default_params, solve_from};
use equilibria::known::Known;
use equilibria::{Params, ParamsError};

use crate::cables::{NEIGHBOURS_SEED, RANDOM, Way};

pub use neighbours::StarNeighbours;

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
pub fn ways(segments: usize, neighbours: &[u64]) -> Result<Vec<Way<Star>>, ParamsError> {
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
                ways.push(Way::new(name, levels, stars(&[Site::Middle], poses, &[Shape::Even], classes)));
            }
        }
    }
    for (shape, name) in [(Shape::Hermite, "cubics"), (Shape::Sagging, "with sag")] {
        for (site, place) in [(Site::Middle, "middle"), (Site::Low, "low")] {
            for (name_of_pose, poses) in &POSES[..2] {
                let name = format!("{name}, {place}, {name_of_pose}, classes: 4");
                ways.push(Way::new(name, &[7], stars(&[site], poses, &[shape], CLASSES)));
            }
        }
    }
    for (name, poses) in [POSES[0], POSES[3]] {
        let name = format!("even turns and with sag, {name}, classes: 4");
        let shapes = [Shape::Even, Shape::Sagging];
        for levels in [&[5][..], &[6], &[7], &[8]] {
            ways.push(Way::new(&name, levels, stars(&[Site::Middle], poses, &shapes, CLASSES)));
        }
        let name = format!("{name}, low");
        ways.push(Way::new(name, &[7], stars(&[Site::Middle, Site::Low], poses, &shapes, CLASSES)));
    }
    for levels in [&[][..], &[5, 10]] {
        let name = "even turns, mean pose, classes: 4";
        ways.push(Way::new(name, levels, stars(&[Site::Middle], &[Pose::Mean], &[Shape::Even], CLASSES)));
    }
    for count in [8, 16] {
        let name = format!("{count} random starts");
        ways.push(Way::new(name, &[7], RandomStars { count, seed: NEIGHBOURS_SEED + 1 }));
    }
    for proposals in [1, 2, CLASSES] {
        for levels in [&[][..], &[5], &[7], &[10]] {
            let mut starts = LearnedStar::default();
            starts.proposals = proposals;
            ways.push(Way::new(format!("learned, proposals: {proposals}"), levels, starts));
        }
    }
    let most = neighbours.iter().copied().max().unwrap_or(0);
    let distribution = BranchedDistribution::default();
    let queries: Vec<BranchedQuery> = (0..most).map(|k| distribution.query(NEIGHBOURS_SEED, k)).collect();
    let answers = solve_from(&queries, &Params { segments, ..default_params() }, &Stars::default())?;
    let known: Vec<(BranchedQuery, Known<Star>)> = queries
        .into_iter()
        .zip(answers)
        .filter_map(|(query, answer)| Some((query, Known::of(&query, &answer.ok()?)?)))
        .collect();
    for &count in neighbours {
        let known = &known[..known.len().min(count as usize)];
        for (with_tree, how) in [(false, "one by one"), (true, "k-d tree")] {
            let name = format!("nearest of {}, {how}", known.len());
            ways.push(Way::new(name, &[], StarNeighbours::new(known, with_tree)));
        }
    }
    Ok(ways)
}

/// The random starts among which the lowest equilibrium is looked for, too.
pub fn random() -> RandomStars {
    RandomStars { count: RANDOM, seed: NEIGHBOURS_SEED }
}
