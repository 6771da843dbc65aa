//! The learned start: the same shape whatever the frame, the same answers as from the curves, and nothing where it knows nothing.

use equilibria::learned::{Learned, distribution};
use equilibria::start::Curves;
use equilibria::{Answer, Cable, Grip, Params, Query, QueryError, Scaled, solve, solve_from};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

fn queries(count: u64) -> Vec<Query> {
    (0..count).map(|k| distribution().query(21, k)).collect()
}

/// Mirrored at the plane of x and z, with d2 turned round.
fn mirrored(grip: Grip) -> Grip {
    let Grip { position: p, orientation: q } = grip;
    let orientation = UnitQuaternion::new_unchecked(Quaternion::new(q.w, -q.i, q.j, -q.k));
    Grip { position: Vector3::new(p.x, -p.y, p.z), orientation }
}

/// Moves a query in a way that no answer depends on: positions are where `of` takes them.
type Move = (&'static str, fn(&Query) -> Query, fn(Vector3<f64>) -> Vector3<f64>, bool);

const ANGLE: f64 = 2.1;

fn about() -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), ANGLE)
}

fn both(query: &Query, change: impl Fn(Grip) -> Grip) -> Query {
    Query { start: change(query.start), end: query.end.map(change), ..*query }
}

/// The same cable with another Darboux vector at rest.
fn bent(query: Query, rest: impl Fn(Vector3<f64>) -> Vector3<f64>) -> Query {
    Query { cable: Cable { rest: rest(query.cable.rest), ..query.cable }, ..query }
}

const MOVES: [Move; 4] = [
    (
        "turned about the vertical",
        |query| both(query, |own| Grip { position: about() * own.position, orientation: about() * own.orientation }),
        |p| about() * p,
        false,
    ),
    (
        "mirrored",
        |query| bent(both(query, mirrored), |k| Vector3::new(-k.x, k.y, -k.z)),
        |p| Vector3::new(p.x, -p.y, p.z),
        false,
    ),
    (
        "turned about its own axis",
        |query| {
            let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -0.7);
            let own = both(query, |own| Grip { orientation: own.orientation * roll, ..own });
            bent(own, |k| roll.inverse() * k)
        },
        |p| p,
        false,
    ),
    (
        "reversed",
        |query| {
            let half = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
            let own = both(query, |own| Grip { orientation: own.orientation * half, ..own });
            let mut own = bent(own, |k| Vector3::new(-k.x, k.y, k.z));
            own.cable.carried.place = own.cable.length - own.cable.carried.place;
            Query { start: own.end.unwrap(), end: Some(own.start), ..own }
        },
        |p| p,
        true,
    ),
];

#[test]
fn a_moved_query_has_the_moved_answer() {
    let queries = queries(200);
    let params = Params { segments: 30, again: false, ..Params::default() };
    let own = solve_from(&queries, &params, &Learned::default()).unwrap();
    for (name, change, of, is_reversed) in MOVES {
        let moved: Vec<Query> = queries.iter().map(change).collect();
        let others = solve_from(&moved, &params, &Learned::default()).unwrap();
        let is_moved = |(own, other): (&Result<Answer, QueryError>, &Result<Answer, QueryError>)| {
            let [a, b] = [own, other].map(|answer| &answer.as_ref().unwrap().equilibria[0].positions);
            let pairs = a.iter().enumerate().map(|(i, p)| (of(*p), if is_reversed { b[29 - i] } else { b[i] }));
            pairs.map(|(p, q)| (p - q).norm()).fold(0.0, f64::max) <= 1e-7
        };
        // Where a search comes near to an unstable equilibrium, rounding may lead it to another branch.
        let count = own.iter().zip(&others).filter(|pair| is_moved(*pair)).count();
        assert!(count >= 198, "{name}: {count} of 200");
    }
}

#[test]
fn answers_are_those_of_the_curves_and_come_in_fewer_solves() {
    let queries = queries(1000);
    for segments in [30, 50, 100] {
        // A residual of 1e-8 leaves more than that of a shape that hardly resists.
        let params = Params { segments, tolerance: 1e-10, ..Params::default() };
        let [curves, learned] =
            [solve(&queries, &params), solve_from(&queries, &params, &Learned::default())].map(Result::unwrap);
        let (mut same, mut lowest, mut coarse) = (0, 0, [0; 2]);
        for (k, (a, b)) in curves.iter().zip(&learned).enumerate() {
            let (a, b) = (a.as_ref().unwrap(), b.as_ref().unwrap());
            coarse = [coarse[0] + a.coarse_solves, coarse[1] + b.coarse_solves];
            let (a, b) = (&a.equilibria[0], &b.equilibria[0]);
            assert!(b.residual <= 1e-10);
            let error = 1e-6 * a.energy.abs().max(1.0);
            lowest += usize::from(b.energy <= a.energy + error);
            if (a.energy - b.energy).abs() <= 1e-9 * a.energy.abs().max(1.0) {
                same += 1;
                let off = a.positions.iter().zip(&b.positions).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
                assert!(off <= 1e-8, "query {k}: {off} m");
            }
        }
        println!("{segments} segments: {same} the same, {lowest} as low, coarse solves {coarse:?}");
        assert!(same >= 900 && lowest >= 985, "{same}, {lowest}");
        assert!(2 * coarse[1] < coarse[0], "{coarse:?}");
    }
}

#[test]
fn unknown_queries_begin_at_the_curves() {
    let mut queries = queries(11);
    queries[0].end = None;
    queries[1].cable.bending[1] *= 0.9;
    queries[2].cable.rest.z = 0.5;
    queries[3].cable.weight = 200.0;
    queries[9].cable.rest.x = 4.5;
    queries[10].cable.carried.weight = 60.0;
    queries[4].cable.weight = 0.0;
    queries[5].cable.torsion = 2.2;
    queries[6].cable.stretch_compliance = 1e-3;
    let far = queries[7].end.unwrap();
    let across = UnitQuaternion::rotation_between(&(far.orientation * Vector3::z()), &-far.position).unwrap();
    queries[7].end = Some(Grip { orientation: across * far.orientation, ..far });
    queries[8].end = Some(Grip { position: far.position.normalize() * 0.05, ..far });
    assert!(queries.iter().all(|query| !Learned::knows(&Scaled::new(query))));
    let params = Params { segments: 30, ..Params::default() };
    let own = solve_from(&queries, &params, &Learned::default()).unwrap();
    assert_eq!(own, solve_from(&queries, &params, &Curves::all()).unwrap());
}

#[test]
fn any_number_of_threads_has_the_same_bits() {
    let queries = queries(300);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| solve_from(&queries, &Params::default(), &Learned::default())).unwrap()
    };
    assert_eq!(with(1), with(3));
}
