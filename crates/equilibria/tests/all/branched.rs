//! Cables with three arms: answers are equilibria of the solver's own statics, balanced at the junction, and mirrored and turned as
//! their queries are.

use std::f64::consts::TAU;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use cosserat::assembly::{
    Assembly, LineInertia, Material, RestShape, RigidBody, RodSpec, Section, Stiffness, Stretch, shape,
};
use cosserat::state::{Model, Pose, State, measure};
use cosserat::statics::{StaticParams, equilibrium};
use equilibria::branched::learned::LearnedStar;
use equilibria::branched::sample::BranchedDistribution;
use equilibria::branched::start::{RandomStars, Stars};
use equilibria::branched::{
    ARMS, BranchedAnswer, BranchedEquilibrium, BranchedError, BranchedQuery, Junction, Star, default_params, solve,
    solve_from,
};
use equilibria::file::{bytes, read};
use equilibria::start::Starts;
use equilibria::{Cable, Carried, Grip, Params};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use safetensors::SafeTensors;

const GRAVITY: f64 = 9.81;
/// Of a junction that weighs next to nothing [kg].
const MASS: f64 = 1e-11;

fn queries(seed: u64, count: u64) -> Vec<BranchedQuery> {
    (0..count).map(|k| BranchedDistribution::default().query(seed, k)).collect()
}

/// The query's cable as a tree, in the shape of an answer whose segments are turned a little. The junction is a body that weighs
/// next to nothing.
fn model(query: &BranchedQuery, found: &BranchedEquilibrium, off: f64) -> (Model, State) {
    let mut assembly = Assembly::new(-Vector3::z() * GRAVITY);
    let segments = found.arms[0].positions.len();
    let rods: Vec<_> = (0..ARMS)
        .map(|k| {
            let Cable { length, bending, torsion, weight, rest, stretch_compliance, .. } = query.arms[k];
            let section = Section::Known {
                stiffness: Stiffness { stretch: 1.0, shear: 1.0, bending, torsion },
                inertia: LineInertia { mass: weight / GRAVITY, polar: 1e-4 * weight },
            };
            let start = query.grips[k].position;
            assembly.rod(&RodSpec {
                sections: vec![section],
                stretch: Stretch::Compliance(stretch_compliance),
                rest: RestShape::Uniform(rest),
                ..RodSpec::new(
                    shape::straight(start, Vector3::z(), length, segments),
                    1e-2,
                    Material { youngs_modulus: 1.0, torsion_modulus: 1.0, density: 1.0 },
                )
            })
        })
        .collect();
    let Junction { position, orientation } = found.junction;
    let junction = assembly.body(RigidBody::hidden(MASS, Vector3::repeat(1e-15)), Pose { position, orientation });
    for rod in &rods {
        assembly.clamp_start(rod);
        assembly.join_body(rod.end - 1, 1.0, junction, &Vector3::zeros());
    }
    assembly.model_mut().measure_as_in_paper();
    let (mut model, mut state) = assembly.finish();
    for (anchor, grip) in model.anchors.iter_mut().zip(&query.grips) {
        (anchor.position, anchor.orientation) = (grip.position, grip.orientation);
    }
    let directions = equilibria::branched::query::directions();
    let mut arm = 0;
    for joint in &mut model.joints {
        if joint.mount.is_some() {
            joint.rest_frames = [UnitQuaternion::identity(), directions[arm]];
            joint.rest_darboux = query.arms[arm].rest;
            arm += 1;
        }
    }
    for (rod, arm) in rods.iter().zip(&found.arms) {
        for (k, i) in rod.clone().enumerate() {
            let place = i as f64;
            let turn = Vector3::new(place.sin(), (1.7 * place).cos(), (0.3 * place).sin()) * off;
            state.positions[i] = arm.positions[k];
            state.orientations[i] = UnitQuaternion::from_scaled_axis(turn) * arm.orientations[k];
        }
    }
    (model, state)
}

#[test]
fn statics_stays_where_the_answers_are() {
    let mut queries = queries(7, 24);
    for (k, query) in queries.iter_mut().enumerate() {
        // Other units, unlike axes, arms that are bent at rest, and ones that stretch.
        if k % 2 == 1 {
            let (length, bending) = (2.5, 3e-3);
            let shift = Vector3::new(1.0, -2.0, 3.0);
            for (arm, grip) in query.arms.iter_mut().zip(&mut query.grips) {
                arm.length *= length;
                arm.bending = [arm.bending[0] * bending, 0.4 * arm.bending[0] * bending];
                arm.torsion *= bending;
                arm.weight *= bending / length.powi(3);
                arm.rest = Vector3::new(0.3, -0.8, 0.5);
                grip.position = grip.position * length + shift;
            }
        }
        if k % 4 == 2 {
            query.arms.iter_mut().for_each(|arm| arm.stretch_compliance = 1e-4);
        }
    }
    for segments in [10, 20] {
        let params = Params { segments, ..default_params() };
        for (k, (query, answer)) in queries.iter().zip(solve(&queries, &params).unwrap()).enumerate() {
            let answer = answer.unwrap_or_else(|error| panic!("query {k}: {error}"));
            let found = &answer.equilibria[0];
            let (model, mut state) = model(query, found, 1e-3);
            let report = equilibrium(&model, &mut state, &StaticParams::default()).unwrap();
            assert!(report.converged && report.stable == Some(true), "query {k}: {report:?}");
            let length = query.arms[0].length;
            let own = found.arms.iter().flat_map(|arm| &arm.positions).chain([&found.junction.position]);
            let off = state.positions.iter().zip(own).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(off <= 1e-8 * length, "query {k}, {segments} segments: {off} m");
            let own = found.arms.iter().flat_map(|arm| &arm.orientations).chain([&found.junction.orientation]);
            let turned = state.orientations.iter().zip(own).map(|(a, b)| a.angle_to(b)).fold(0.0, f64::max);
            assert!(turned <= 1e-7, "query {k}, {segments} segments: {turned} rad");
            let body = MASS * GRAVITY * found.junction.position.z;
            let own = measure::energy(&model, &state).total() - body;
            assert!((own - found.energy).abs() <= 1e-8 * own.abs().max(1e-3), "query {k}: {own} J, {} J", found.energy);
        }
    }
}

fn lowest(answers: &[Result<BranchedAnswer, BranchedError>], k: usize) -> &BranchedEquilibrium {
    &answers[k].as_ref().unwrap_or_else(|error| panic!("query {k}: {error}")).equilibria[0]
}

#[test]
fn forces_and_moments_balance_at_the_junction() {
    let queries = queries(8, 200);
    let answers = solve(&queries, &default_params()).unwrap();
    for (k, query) in queries.iter().enumerate() {
        let found = lowest(&answers, k);
        let forces = found.arms.iter().map(|arm| arm.grips[1].force).sum::<Vector3<f64>>();
        let moments = found.arms.iter().map(|arm| arm.grips[1].moment).sum::<Vector3<f64>>();
        let size = 1.0 + found.arms.iter().map(|arm| arm.grips[1].force.norm()).fold(0.0, f64::max);
        assert!(forces.norm() <= 1e-6 * size && moments.norm() <= 1e-6 * size, "query {k}: {forces} {moments}");
        let weight: f64 = query.arms.iter().map(|arm| arm.weight * arm.length).sum();
        let held = found.arms.iter().map(|arm| arm.grips[0].force).sum::<Vector3<f64>>();
        assert!((held - Vector3::z() * weight).norm() <= 1e-6 * size, "query {k}: {held}");
        for (arm, cable) in found.arms.iter().zip(&query.arms) {
            let (last, q) = (arm.positions[19], arm.orientations[19]);
            let end = last + q * Vector3::z() * (cable.length / 40.0);
            assert!((end - found.junction.position).norm() <= 1e-7, "query {k}");
        }
    }
}

/// A query turned about the vertical and moved, or mirrored at the plane of x and z, its arms in another order. Frames of mirrored
/// arms are turned by half a turn about their axes, as the junction's z is turned round.
fn changed(query: &BranchedQuery, is_mirrored: bool, order: [usize; ARMS]) -> BranchedQuery {
    let about = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 2.1);
    let half = |axis: Vector3<f64>| UnitQuaternion::from_quaternion(Quaternion::from_parts(0.0, axis));
    let is_odd = (order[1] + ARMS - order[0]) % ARMS != 1;
    let grip = |own: Grip| {
        let Grip { mut position, mut orientation } = own;
        if is_mirrored {
            // At the plane of x and z, d1 turned round: half a turn about y before and about d1 after.
            position.y = -position.y;
            orientation = half(Vector3::y()) * orientation * half(Vector3::x());
        }
        if is_odd {
            orientation *= half(Vector3::z());
        }
        Grip { position: about * position + Vector3::new(0.3, -0.2, 0.0), orientation: about * orientation }
    };
    BranchedQuery { arms: order.map(|k| query.arms[k]), grips: order.map(|k| grip(query.grips[k])) }
}

/// Mirrored, turned and with their arms in another order, queries have answers of the same energies at mirrored and turned places,
/// from both starts, which begin alike.
#[test]
fn changed_queries_have_changed_answers() {
    let queries = queries(10, 100);
    for (is_mirrored, order) in
        [(false, [0, 1, 2]), (true, [0, 1, 2]), (false, [1, 2, 0]), (false, [0, 2, 1]), (true, [2, 1, 0])]
    {
        let others: Vec<BranchedQuery> = queries.iter().map(|query| changed(query, is_mirrored, order)).collect();
        let starts: [&dyn Starts<Star>; 2] = [&LearnedStar::default(), &Stars::default()];
        for (which, starts) in starts.into_iter().enumerate() {
            let [own, other] = [&queries, &others].map(|own| solve_from(own, &default_params(), starts).unwrap());
            let mut alike = 0;
            for (k, query) in queries.iter().enumerate() {
                let (a, b) = (lowest(&own, k), lowest(&other, k));
                if (a.energy - b.energy).abs() > 1e-6 * a.energy.abs().max(1.0) {
                    continue;
                }
                let moved = Grip { position: a.junction.position, orientation: UnitQuaternion::identity() };
                let as_query = BranchedQuery { arms: query.arms, grips: [moved; ARMS] };
                let expected = changed(&as_query, is_mirrored, order).grips[0].position;
                alike += usize::from((b.junction.position - expected).norm() < 1e-5);
            }
            // Where the class is on the edge, rounding may decide.
            assert!(alike >= 98, "{which}, {is_mirrored} {order:?}: {alike} of 100");
        }
    }
}

/// Of queries that it has not seen, the learned start finds the lowest equilibrium that many ways find, and no likelihood is out
/// of its range.
#[test]
fn the_learned_start_finds_the_lowest() {
    let queries = queries(1 << 30, 1000);
    let params = Params { again: false, ..default_params() };
    let all = Params { branches: true, ..params.clone() };
    let learned = solve_from(&queries, &params, &LearnedStar::default()).unwrap();
    let others: [&dyn Starts<Star>; 2] = [&Stars::default(), &RandomStars { count: 30, seed: 5 }];
    let others = others.map(|starts| solve_from(&queries, &all, starts).unwrap());
    let mut found = 0;
    for (k, query) in queries.iter().enumerate() {
        assert!(LearnedStar::knows(&Star::new(query)), "query {k}");
        let likely = LearnedStar::default().likelihoods(&Star::new(query)).unwrap();
        assert!((likely.iter().sum::<f64>() - 1.0).abs() < 1e-12 && likely.iter().all(|&x| x >= 0.0));
        let energy = |answers: &[Result<BranchedAnswer, BranchedError>]| {
            answers[k].as_ref().map_or(f64::INFINITY, |own| own.equilibria[0].energy)
        };
        let own = energy(&learned);
        let lowest = others.iter().map(|answers| energy(answers)).fold(own, f64::min);
        found += usize::from(own <= lowest + 1e-6 * lowest.abs().max(1.0));
    }
    println!("the learned start finds the lowest of {found} of 1000");
    assert!(found >= 960, "{found} of 1000");
}

/// What the network does not know begins elsewhere, and is answered.
#[test]
fn what_is_unlike_the_training_is_answered_too() {
    let mut queries = queries(11, 40);
    for query in &mut queries {
        query.arms[1].rest = Vector3::new(1.0, 0.0, 0.0);
        assert!(!LearnedStar::knows(&Star::new(query)));
    }
    let [a, b] = [&LearnedStar::default() as &dyn Starts<Star>, &Stars::default()]
        .map(|starts| solve_from(&queries, &default_params(), starts).unwrap());
    assert_eq!(a, b);
}

#[test]
fn a_query_that_cannot_be_has_its_own_error() {
    let mut queries = queries(12, 5);
    queries[0].grips[1].position += Vector3::x() * 9.0;
    queries[1].arms[2].length = -1.0;
    queries[2].grips[0].position.x = f64::NAN;
    queries[3].arms.iter_mut().for_each(|arm| arm.length = 0.52);
    queries[3].grips = [0.0, TAU / 3.0, TAU / 1.5].map(|angle| Grip {
        position: Vector3::new(angle.cos(), angle.sin(), 0.0) * 0.55,
        orientation: UnitQuaternion::identity(),
    });
    let answers = solve(&queries, &default_params()).unwrap();
    for (k, words) in [
        (0, "grips 1 and 2 are"),
        (1, "arm 3: length = -1, but it must be from 1e-12 to 1e12"),
        (2, "arm 1: position of the start = NaN"),
        (3, "there is no place that all three arms reach"),
    ] {
        let error = answers[k].as_ref().unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
    assert!(answers[4].is_ok());
    // The same bits alone as among others.
    let alone = solve(&queries[4..], &default_params()).unwrap();
    assert_eq!(alone[0], answers[4]);
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_equilibria")).current_dir(folder).args(arguments).output().unwrap()
}

#[test]
fn files_are_answered_row_by_row() {
    let folder = tempfile::tempdir().unwrap();
    let sampled = run(folder.path(), &["sample", "--branched", "--count", "12", "--out", "queries.csv"]);
    assert!(sampled.status.success(), "{sampled:?}");
    let path = folder.path().join("queries.csv");
    let text = fs::read_to_string(&path).unwrap();
    let mut rows: Vec<Vec<String>> = text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect();
    let column = |name: &str| rows[0].iter().position(|own| own == name).unwrap();
    let [length, turn, far] = ["arm1_length_m", "grip3_qw", "grip2_x_m"].map(column);
    rows[2][length] = "long".to_owned();
    rows[3][turn] = "7".to_owned();
    rows[4][far] = "70".to_owned();
    let changed: Vec<String> = rows.iter().map(|row| row.join(",")).collect();
    fs::write(&path, changed.join("\n")).unwrap();
    for (start, threads) in [("poses", "1"), ("poses", "2"), ("learned", "2")] {
        let out = format!("{start}-{threads}");
        let said =
            run(folder.path(), &["branched", "queries.csv", "--out", &out, "--start", start, "--threads", threads]);
        assert!(said.status.success(), "{said:?}");
        assert!(String::from_utf8_lossy(&said.stdout).contains("9 of 12 queries answered"), "{said:?}");
        let mut reader = csv::Reader::from_path(folder.path().join(&out).join("answers.csv")).unwrap();
        let answers: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
        assert_eq!((answers.len(), answers[0].len()), (12, 51));
        for (row, words) in [
            (1, "arm1_length_m = `long`, but it must be a number"),
            (2, "arm 3: orientation of the start"),
            (3, "but their arms are"),
        ] {
            assert!(answers[row][1].contains(words), "{:?}", answers[row]);
        }
        assert!(answers[5][1] == *"found" && answers[5][5].parse::<f64>().unwrap() <= 1e-8);
        let bytes = fs::read(folder.path().join(&out).join("shapes.safetensors")).unwrap();
        let shapes = SafeTensors::deserialize(&bytes).unwrap();
        assert_eq!(shapes.tensor("positions").unwrap().shape(), [9, 3, 20, 3]);
        assert_eq!(shapes.tensor("orientations").unwrap().shape(), [9, 3, 20, 4]);
    }
    let read = |out: &str| fs::read(folder.path().join(out).join("answers.csv")).unwrap();
    assert!(read("poses-1") == read("poses-2"));
    for (content, words) in [
        (text.replace("arm1_length_m", "lenght"), "wrong.csv: line 1: column `lenght` is not known"),
        (text.replace("grip1_x_m,", ""), "wrong.csv: line 1: column `grip1_x_m` is missing"),
        (text.replace("grip1_x_m", "grip1_y_m"), "wrong.csv: line 1: column `grip1_x_m` is missing"),
        (text.lines().next().unwrap().to_owned(), "there are no rows"),
    ] {
        fs::write(folder.path().join("wrong.csv"), content).unwrap();
        let output = run(folder.path(), &["branched", "wrong.csv", "--out", "none"]);
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && error.contains(words), "{error}");
    }
    let output = run(folder.path(), &["branched", "queries.csv", "--segments", "3"]);
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(2) && error.contains("--segments = 3, but it must be from 8"), "{error}");
}

/// Tensors of the same numbers are answered as a table is, all columns and a row that cannot be included; shards have the rows of
/// the whole.
#[test]
fn tensors_and_shards_have_the_same_answers() {
    let folder = tempfile::tempdir().unwrap();
    let mut queries = queries(13, 10);
    for query in &mut queries {
        query.arms[1].bending[1] *= 0.7;
        query.arms[2].rest = Vector3::new(0.4, -0.2, 0.1);
        query.arms[0].carried = Carried { weight: 2.0, place: 0.3 };
    }
    queries[4].arms[0].length = f64::NAN;
    for name in ["queries.csv", "queries.safetensors"] {
        let path = folder.path().join(name);
        fs::write(&path, bytes::<Star>(&queries, &path).unwrap()).unwrap();
        let said = run(folder.path(), &["branched", name, "--out", name.split('.').nth(1).unwrap()]);
        assert!(String::from_utf8_lossy(&said.stdout).contains("9 of 10 queries answered"), "{said:?}");
        let read = read::<Star>(&path).unwrap();
        assert!(
            read.iter()
                .zip(&queries)
                .all(|(own, query)| own.as_ref().map_or(query.validate().is_err(), |own| own == query))
        );
    }
    let file = |out: &str, name: &str| fs::read(folder.path().join(out).join(name)).unwrap();
    assert!(file("csv", "shapes.safetensors") == file("safetensors", "shapes.safetensors"));
    let lines = |out: &str, name: &str| -> Vec<String> {
        String::from_utf8(file(out, name)).unwrap().lines().skip(1).map(str::to_owned).collect()
    };
    let whole = lines("csv", "answers.csv");
    // The row that cannot be says what stands in its file.
    let others = |all: &[String]| all.iter().filter(|line| !line.starts_with("4,")).cloned().collect::<Vec<_>>();
    assert_eq!(others(&whole), others(&lines("safetensors", "answers.csv")));
    let mut rows = Vec::new();
    for part in 0..2 {
        let shard = format!("{part}/2");
        let said = run(folder.path(), &["branched", "queries.csv", "--out", "parts", "--shard", &shard]);
        assert!(said.status.success(), "{said:?}");
        rows.extend(lines("parts", &format!("answers-{part}-of-2.csv")));
    }
    rows.sort_by_key(|row| row.split(',').next().unwrap().parse::<usize>().unwrap());
    assert_eq!(rows, whole);
    let sampled = run(folder.path(), &["sample", "--branched", "--count", "3", "--out", "sampled.safetensors"]);
    assert!(sampled.status.success() && read::<Star>(&folder.path().join("sampled.safetensors")).unwrap().len() == 3);
}
