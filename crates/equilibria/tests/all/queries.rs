//! How many queries are answered, in how many solves, by which equilibria; and which are refused.

use equilibria::sample::Distribution;
use equilibria::start::Curves;
use equilibria::{Answer, Cable, Grip, Params, Query, QueryError, solve, solve_from};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

fn sample(count: u64) -> Vec<Query> {
    (0..count).map(|k| Distribution::default().query(1, k)).collect()
}

fn energies(queries: &[Query], params: &Params, curves: &Curves) -> Vec<f64> {
    let answers = solve_from(queries, params, curves).unwrap();
    answers.into_iter().map(|answer| answer.unwrap().equilibria[0].energy).collect()
}

#[test]
fn all_queries_are_answered_in_few_solves() {
    let queries = sample(2000);
    for (segments, most) in [(30, 4.0), (50, 4.0), (100, 4.0)] {
        let one = Curves { hermite: false, both_twists: false, ..Curves::all() };
        let params = Params { segments, ..Params::default() };
        let answers = solve_from(&queries, &params, &one).unwrap();
        assert!(answers.iter().all(Result::is_ok));
        let worst = answers.iter().flatten().map(|answer| answer.equilibria[0].residual).fold(0.0, f64::max);
        assert!(worst <= params.tolerance, "{segments} segments: residual {worst}");
        let mean = |solves: fn(&Answer) -> u32| {
            answers.iter().flatten().map(|own| f64::from(solves(own))).sum::<f64>() / 2000.0
        };
        let (own, coarse) = (mean(|answer| answer.solves), mean(|answer| answer.coarse_solves));
        println!("{segments} segments: {own} solves after {coarse} on 11 segments");
        assert!(own < most && coarse < 10.0, "{segments} segments: {own}, {coarse}");
    }
}

#[test]
fn more_starts_find_lower_equilibria() {
    let queries = sample(1000);
    let params = Params::default();
    let [one, two, four] = [(false, false), (false, true), (true, true)]
        .map(|(hermite, both_twists)| energies(&queries, &params, &Curves { hermite, both_twists, sagging: true }));
    let rate = |own: &[f64]| own.iter().zip(&four).filter(|(own, best)| **own <= **best + 1e-6 * best.abs()).count();
    println!("lowest of four starts: {} by one, {} by two, of 1000", rate(&one), rate(&two));
    assert!((700..900).contains(&rate(&one)) && rate(&two) > 960, "{}, {}", rate(&one), rate(&two));
}

#[test]
fn the_same_bits_alone_and_on_any_number_of_threads() {
    let queries = sample(200);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| solve(&queries, &Params::default()).unwrap())
    };
    let all = run(1);
    assert_eq!(all, run(3));
    for k in [0, 17, 199] {
        assert_eq!(solve(&queries[k..=k], &Params::default()).unwrap()[0], all[k], "query {k} alone");
    }
}

#[test]
fn a_turned_query_has_the_turned_answer() {
    // About the vertical everything turns along.
    let about = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 1.3);
    let turned = |grip: Grip| Grip { position: about * grip.position, orientation: about * grip.orientation };
    let queries = sample(50);
    let others: Vec<Query> = queries
        .iter()
        .map(|query| Query { start: turned(query.start), end: query.end.map(turned), ..*query })
        .collect();
    let curves = Curves::all();
    let [own, other] = [queries, others].map(|queries| energies(&queries, &Params::default(), &curves));
    for (k, (a, b)) in own.iter().zip(&other).enumerate() {
        assert!((a - b).abs() <= 1e-9 * a.abs().max(1.0), "query {k}: {a} J, {b} J");
    }
}

fn upright(height: f64) -> Grip {
    Grip { position: Vector3::z() * height, orientation: UnitQuaternion::identity() }
}

/// Euler's critical load of a clamped column is 4 pi^2 B / L^2.
#[test]
fn a_column_leaves_the_straight_line() {
    let cable = Cable::new(1.0, 1.0, 0.8, 0.0);
    let query = |height: f64| Query { cable, start: upright(0.0), end: Some(upright(height)) };
    let params = Params { segments: 100, ..Params::default() };
    let answers = solve(&[query(0.999), query(0.7)], &params).unwrap();
    let forces = answers.iter().map(|answer| answer.as_ref().unwrap().equilibria[0].grips[0].force.z);
    let ratios: Vec<f64> = forces.map(|force| force / (4.0 * std::f64::consts::PI.powi(2))).collect();
    assert!((ratios[0] - 1.0).abs() < 2e-3, "{ratios:?}");
    let sideways = |k: usize| {
        let positions = &answers[k].as_ref().unwrap().equilibria[0].positions;
        positions.iter().map(|x| x.xy().norm()).fold(0.0, f64::max)
    };
    // A clamped column shortened by e bulges by (2 / pi) sqrt(e).
    assert!((sideways(0) / (2.0 / std::f64::consts::PI * 0.001f64.sqrt()) - 1.0).abs() < 2e-2, "{}", sideways(0));
    assert!(sideways(1) > 0.2);
}

#[test]
fn a_cable_with_a_free_end_stands_or_falls() {
    // Greenhill (1881): a column of the weight w stands up to w L^3 / B = 7.837.
    let query = |weight: f64| Query { cable: Cable::new(1.0, 1.0, 0.8, weight), start: upright(0.0), end: None };
    let answers = solve(&[query(7.6), query(8.1), query(50.0)], &Params::default()).unwrap();
    let top = |k: usize| answers[k].as_ref().unwrap().equilibria[0].positions[49].z;
    assert!(top(0) > 0.989 && top(1) < 0.97 && top(2) < 0.0, "{} {} {}", top(0), top(1), top(2));
    let held = &answers[2].as_ref().unwrap().equilibria[0].grips;
    assert!((held[0].force - Vector3::z() * 50.0).norm() < 1e-12 && held[1].force == Vector3::zeros());
}

#[test]
fn grips_and_weight_are_in_balance() {
    for query in &mut sample(20) {
        query.start.position = Vector3::new(0.3, -0.2, 0.5);
        query.end = query.end.map(|end| Grip { position: end.position + query.start.position, ..end });
        let answer = solve(std::slice::from_ref(query), &Params::default()).unwrap().remove(0).unwrap();
        let own = &answer.equilibria[0];
        let [a, b] = own.grips;
        let weight = -Vector3::z() * (query.cable.weight / 50.0);
        let ends = [query.start.position, query.end.unwrap().position];
        let moment: Vector3<f64> = own.positions.iter().map(|x| x.cross(&weight)).sum();
        let moment = moment + a.moment + b.moment + ends[0].cross(&a.force) + ends[1].cross(&b.force);
        assert!((a.force + b.force + weight * 50.0).norm() < 1e-10, "{own:?}");
        assert!(moment.norm() < 1e-6, "{moment}");
    }
}

#[test]
fn branches_are_different_and_the_lowest_comes_first() {
    let queries = sample(200);
    let lowest = energies(&queries, &Params::default(), &Curves::all());
    let all = solve(&queries, &Params { branches: true, ..Params::default() }).unwrap();
    let mut several = 0;
    for (k, answer) in all.iter().flatten().enumerate() {
        let energies: Vec<f64> = answer.equilibria.iter().map(|own| own.energy).collect();
        assert!(energies.is_sorted(), "query {k}: {energies:?}");
        assert!(energies[0] <= lowest[k] + 1e-6 * lowest[k].abs(), "query {k}: {energies:?}, {}", lowest[k]);
        several += usize::from(energies.len() > 1);
    }
    assert!(several > 180, "{several} of 200 queries with several equilibria");
}

#[test]
fn what_cannot_be_has_its_own_error_and_the_rest_is_answered() {
    let good = sample(1)[0];
    let mut queries = vec![good; 6];
    queries[1].end = good.end.map(|end| Grip { position: end.position * 4.0, ..end });
    queries[2].cable.length = f64::NAN;
    queries[3].start.orientation = UnitQuaternion::new_unchecked(Quaternion::new(1.0, 0.1, 0.0, 0.0));
    queries[4].cable.weight = -1.0;
    let answers = solve(&queries, &Params::default()).unwrap();
    assert!(matches!(&answers[1], Err(QueryError::TooFar { length, .. }) if *length == 1.0), "{:?}", answers[1]);
    for (k, word) in [(2, "length = NaN"), (3, "orientation of the start"), (4, "weight = -1")] {
        let error = answers[k].as_ref().unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
    assert_eq!(answers[0], answers[5]);
    assert!(answers[0].is_ok());
}

/// From the distance zero to the whole length, from weightless to very heavy.
#[test]
fn the_extremes_are_answered() {
    let mut queries = Vec::new();
    for distance in [0.0, 0.05, 0.99, 0.9999, 1.0] {
        for (k, mut query) in
            (0..40).map(|k| Distribution { distance: [distance; 2], ..Distribution::default() }.query(5, k)).enumerate()
        {
            query.cable.weight = [0.0, 1.0, 1e3, 1e5][k % 4];
            if distance > 0.95 {
                // Ends along the chord, or the cable would have to be longer.
                let along = query.end.unwrap().position.normalize();
                let q = UnitQuaternion::rotation_between(&Vector3::z(), &along).unwrap();
                query.start.orientation = q;
                query.end = Some(Grip { position: along * distance, orientation: q });
            }
            queries.push(query);
        }
    }
    let answers = solve(&queries, &Params::default()).unwrap();
    let missing: Vec<usize> = (0..queries.len()).filter(|&k| answers[k].is_err()).collect();
    assert!(missing.is_empty(), "{missing:?}: {:?}", missing.first().map(|&k| &answers[k]));
}

/// A strip that is curved at rest and stiff against twist.
#[test]
fn short_steps_answer_more_of_the_hard_queries() {
    let queries: Vec<Query> = (0..500)
        .map(|k| {
            let mut query =
                Distribution { distance: [0.0, 1.0], curvature: 20.0, ..Distribution::default() }.query(6, k);
            (query.cable.bending[1], query.cable.torsion) = (0.02, 50.0);
            query
        })
        .collect();
    let found = |again: bool| {
        let answers = solve(&queries, &Params { again, ..Params::default() }).unwrap();
        let refused =
            |own: &Result<Answer, QueryError>| matches!(own, Err(QueryError::NotFound { solves }) if *solves > 0);
        assert!(answers.iter().all(|own| own.is_ok() || refused(own)));
        answers.iter().flatten().count()
    };
    let [once, again] = [false, true].map(found);
    println!("of 500 {once} are answered at once, {again} in all");
    assert!(again > once + 50 && again >= 475, "{once}, {again}");
}

/// A cable that is too short for its grips is taut: its tension is what stretches it that far, and it sags as a parabola.
#[test]
fn a_cable_that_is_too_short_is_taut() {
    let (segments, stiffness, strain) = (50, 1e4, 0.02);
    let mut cable = Cable::new(1.0, 1e-3, 1e-3, 3.0);
    // Each joint yields as its length of the cable: the two at the grips, half a segment long, count as one.
    cable.stretch_compliance = 1.0 / (stiffness * (segments as f64 + 1.0));
    let along_x = UnitQuaternion::rotation_between(&Vector3::z(), &Vector3::x()).unwrap();
    let grip = |x: f64| Grip { position: Vector3::x() * x, orientation: along_x };
    let query = Query { cable, start: grip(0.0), end: Some(grip(1.0 + strain)) };
    let answer = solve(&[query], &Params { segments, ..Params::default() }).unwrap().remove(0).unwrap();
    let own = &answer.equilibria[0];
    let tension = own.grips[1].force.x;
    assert!((tension / (strain * stiffness) - 1.0).abs() < 1e-3, "{tension} N");
    // w l^2 / 8 T, less what the stiff ends hold up: the slope there begins within sqrt(B / T) of the grips.
    let sag = -own.positions[segments / 2].z;
    let bare = 3.0 * (1.0 + strain) / (8.0 * tension) * (1.0 - 4.0 * (1e-3 / tension).sqrt());
    assert!((sag / bare - 1.0).abs() < 0.01, "{sag} m, {bare} m");
    let stiff = Query { cable: Cable { stretch_compliance: 1e-10, ..cable }, ..query };
    assert!(matches!(solve(&[stiff], &Params::default()).unwrap()[0], Err(QueryError::TooFar { .. })));
}
