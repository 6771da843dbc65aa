//! Halves side by side come to the solution, with the same bits on any number of threads.

use kernels::math::Vec3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::super::cone::Coulomb;
use super::super::delassus::Part;
use super::super::partition::{self, Pushed};
use super::*;

/// Sets in a row, each of which four contacts press against the next, and one against the ground. `is_halved`: by halves of
/// the row, else all as one.
fn row(sets: u32, friction: f64, is_halved: bool) -> Problem {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut contacts: Vec<Vec<u32>> = Vec::new();
    for set in 0..sets {
        let next = |_| if set + 1 < sets { vec![set, set + 1] } else { vec![set] };
        contacts.extend((0..4).map(next).chain([vec![set]]));
    }
    let mut gaps: Vec<f64> = contacts.iter().map(|_| random.random_range(-1.0..-0.5)).collect();
    // Contacts by their places in the order of the row.
    let mut first: Vec<u32> = (0..contacts.len() as u32).collect();
    let mut problem = Problem::default();
    let mut pushed: Vec<Pushed> = (0..sets)
        .map(|component| {
            let own = contacts.iter().filter(|sets| sets.contains(&component)).count();
            Pushed { component, centre: Vec3([f64::from(component), 0.0, 0.0]), contacts: own, leaf: 0 }
        })
        .collect();
    if is_halved {
        problem.partition.deal(contacts.len(), &mut pushed);
        let leaves: Vec<_> = contacts
            .iter()
            .map(|sets| sets.iter().map(|&set| [pushed[set as usize].leaf; 2]).reduce(partition::join).unwrap())
            .collect();
        let mut order = Vec::new();
        problem.partition.sort(&leaves, &mut order);
        contacts = order.iter().map(|&k| contacts[k as usize].clone()).collect();
        gaps = order.iter().map(|&k| gaps[k as usize]).collect();
        first.sort_by_key(|&k| order[k as usize]);
    }
    for gap in gaps {
        let friction = Coulomb(friction);
        let free = [gap, 0.1, -0.2];
        problem.push(Unknown { force: [0.0; 3], before: [0.0; 3], free, friction, scale: 1.0 });
    }
    let (mut start, mut members) = (vec![0], Vec::new());
    for set in 0..sets {
        members.extend((0..contacts.len() as u32).filter(|&k| contacts[k as usize].contains(&set)));
        start.push(members.len());
    }
    let each: Vec<usize> = (0..=sets as usize).collect();
    problem.operator.reset(contacts.len(), &start, &members, &each);
    let (values, cuts) = problem.operator.values();
    for group in 0..sets as usize {
        let own = &members[start[group]..start[group + 1]];
        let count = own.len();
        // The same entries in any order of the contacts.
        let in_row: Vec<&u32> = first.iter().filter(|&k| own.contains(k)).collect();
        let place = |index: usize| in_row.iter().position(|&&k| k == own[index]).unwrap();
        let factor: Vec<f64> = (0..9 * count * count).map(|_| random.random_range(-1.0..1.0)).collect();
        let (mut part, _) = Part::new(count, false, &mut values[cuts[group]..cuts[group + 1]]);
        let size = 3 * count;
        for (r, c) in (0..count).flat_map(|r| (0..=r).map(move |c| (r, c))) {
            let entry = |i: usize, j: usize| {
                let dot: f64 = (0..size).map(|k| factor[i * size + k] * factor[j * size + k]).sum();
                dot / size as f64 + if i == j { 0.5 } else { 0.0 }
            };
            let block = [0, 1, 2].map(|x| [0, 1, 2].map(|y| entry(3 * place(r) + x, 3 * place(c) + y)));
            part.add((r, c), &block, false);
        }
    }
    problem.close();
    problem
}

/// Solves by rounds alone on so many threads; the impulses and the sweeps.
fn solved(mut problem: Problem, threads: usize) -> (Vec<Row>, usize) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let mut rounds = GaussSeidel::default();
    rounds.begin(&problem);
    let goal = Goal { tolerance: 1e-12, pause: usize::MAX, most: 10_000 };
    let end = pool.install(|| rounds.go(&mut problem, goal));
    assert_eq!(end, End::Done);
    let count = problem.unknowns().len();
    assert!(problem.view().residual(0..count) < 1e-11);
    (problem.unknowns().iter().map(|unknown| unknown.force).collect(), rounds.sweeps())
}

#[test]
fn threads_do_not_change_a_bit_of_the_impulses() {
    let problem = row(420, 0.4, true);
    assert_eq!(problem.partition.depth(), 3);
    let one = solved(problem, 1);
    for threads in [2, 3] {
        for _ in 0..5 {
            assert_eq!(one, solved(row(420, 0.4, true), threads), "{threads} threads");
        }
    }
}

/// Without friction the solution is unique: sums over all contacts do not depend on their order.
#[test]
fn halves_come_to_the_solution_of_the_whole_in_as_many_sweeps() {
    let sums = |(forces, sweeps): (Vec<Row>, usize)| (forces.iter().map(|force| force[0]).sum::<f64>(), sweeps);
    let (halved, sweeps) = sums(solved(row(420, 0.0, true), 2));
    let (whole, sweeps_of_the_whole) = sums(solved(row(420, 0.0, false), 1));
    assert!((halved / whole - 1.0).abs() < 1e-9, "{halved} {whole}");
    assert!(2 * sweeps < 3 * sweeps_of_the_whole, "{sweeps} {sweeps_of_the_whole}");
}
