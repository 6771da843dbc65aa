//! The operator of free segments in closed form.

use std::collections::BTreeSet;

use contact::key::{Feature, Partner};
use contact::shape::Poses;
use friction::delassus::{Block3, Moved};
use kernels::lane::Real;
use rod::Friction;

use super::super::testing::Rods;
use super::*;

const STILL: [f64; 3] = [0.0; 3];

/// Segments of these radii one below the other, each across the one above it, the contacts between them, and the operator's
/// blocks with their columns, row by row.
struct Stack {
    rods: Rods,
    contacts: Vec<Contact>,
    blocks: Vec<Vec<(u32, Block3)>>,
}

fn stack(radii: &[f64], max_blocks: usize) -> Result<Stack, TooManyContacts> {
    let depth = |k: usize| radii[..k].iter().map(|radius| 2.0 * radius).sum::<f64>() + radii[k];
    let along = |k: usize| if k.is_multiple_of(2) { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let rod = |k: usize| ([0.0, 0.0, -depth(k)], along(k), 1, radii[k], STILL);
    let mut rods = Rods::new(&(0..radii.len()).map(rod).collect::<Vec<_>>());
    rods.predict(0.01);
    let (detector, search, mut contacts) = rods.find();
    let Rods { sets, seats, shapes, .. } = &mut rods;
    let mut sets = Sets::new(sets, seats);
    contacts.iter_mut().for_each(|contact| contact.evaluate(&detector.world(&search), &sets, Poses::Now));
    let mut active: Vec<u32> = (0..contacts.len() as u32).collect();
    let (own, mut problem) = ((&*contacts, &mut active), Problem::default());
    Assembly::default().assemble(own, shapes, &mut sets, &mut problem, max_blocks)?;
    let row = |row: usize| {
        let mut columns = BTreeSet::new();
        problem.operator.each_product(row, &[[1.0; 3]; 3], &mut Vec::new(), |column, _| _ = columns.insert(column));
        columns.into_iter().map(|column| (column as u32, problem.operator.block(row, column))).collect()
    };
    let blocks = (0..contacts.len()).map(row).collect();
    Ok(Stack { rods, contacts, blocks })
}

#[test]
fn two_free_segments_answer_with_their_inverse_masses() {
    let radii = [0.02, 0.03];
    let Stack { rods, contacts, blocks } = stack(&radii, 100).unwrap();
    assert_eq!((contacts.len(), blocks[0].len()), (1, 1));
    let w = blocks[0][0].1;
    let segments = &rods.model.segments;
    let masses: f64 = segments.iter().map(|segment| 1.0 / segment.mass()).sum();
    assert!((w[0][0] / masses - 1.0).abs() < 1e-12, "{} {masses}", w[0][0]);
    // Along both tangents: twice the inverse mass, and what the arm r turns across and about the axis.
    let turned = |(k, segment): (usize, &rod::Segment)| {
        radii[k].powi(2) * (1.0 / segment.transverse_inertia() + 1.0 / segment.axial_inertia())
    };
    let across = 2.0 * masses + segments.iter().enumerate().map(turned).sum::<f64>();
    assert!(((w[1][1] + w[2][2]) / across - 1.0).abs() < 1e-12, "{} {across}", w[1][1] + w[2][2]);
    for (r, c) in [(0, 1), (0, 2), (1, 2)] {
        assert!((w[r][c] - w[c][r]).abs() < 1e-12 * across && (r > 0 || w[r][c].abs() < 1e-12 * across), "{w:?}");
    }
}

#[test]
fn contacts_are_coupled_by_the_segment_that_both_push() {
    let Stack { rods, contacts, blocks } = stack(&[0.02, 0.03, 0.02, 0.02], 100).unwrap();
    assert_eq!(contacts.len(), 3);
    let columns: Vec<Vec<u32>> = blocks.iter().map(|row| row.iter().map(|block| block.0).collect()).collect();
    assert_eq!(columns, [vec![0, 1], vec![0, 1, 2], vec![1, 2]]);
    // A push between two drives the middle one towards the third.
    for (k, (upper, lower)) in
        [(blocks[0][1].1, blocks[1][0].1), (blocks[1][2].1, blocks[2][0].1)].into_iter().enumerate()
    {
        let inverse = 1.0 / rods.model.segments[k + 1].mass();
        assert!((upper[0][0] / inverse + 1.0).abs() < 1e-12, "{} {inverse}", upper[0][0]);
        assert!((0..9).all(|at| (upper[at / 3][at % 3] - lower[at % 3][at / 3]).abs() < 1e-9 * inverse), "symmetric");
    }
    // Each of the four segments has its contacts, 1, 2, 2 and 1, coupled with each other.
    assert!(stack(&[0.02, 0.03, 0.02, 0.02], 10).is_ok() && stack(&[0.02, 0.03, 0.02, 0.02], 9).is_err());
}

/// A long rod across 134 short ones, in five groups, that also touches itself within a group and between two: W is what transfers say of
/// all pairs.
#[test]
fn a_long_chain_answers_in_blocks_as_it_does_in_one() {
    let count = LONG + 6;
    let across = |k: usize| ([0.05 * k as f64 - 3.34, 0.0, -0.03], [0.0, 0.3, 0.0], 1, 0.01, STILL);
    let long = ([0.0; 3], [7.0, 0.2, 0.0], 35, 0.02, STILL);
    let mut rods = Rods::new(&(0..count).map(across).chain([long]).collect::<Vec<_>>());
    rods.predict(0.01);
    let (detector, search, mut contacts) = rods.find();
    let Rods { sets, seats, shapes, .. } = &mut rods;
    let first = count as u32;
    contacts.extend([[1, 4], [2, 15], [20, 3], [16, 17], [0, 34]].map(|[one, other]| {
        Contact::new((first + one, Partner::Segment(first + other), Feature::Nearest), Friction::default(), 0.02)
    }));
    let mut sets = Sets::new(sets, seats);
    contacts.iter_mut().for_each(|contact| contact.evaluate(&detector.world(&search), &sets, Poses::Now));
    // In another order than along the rod.
    let mut active: Vec<u32> = (0..contacts.len() as u32).rev().collect();
    active.sort_by_key(|k| k % 5);
    let (mut coupling, mut problem) = (Assembly::default(), Problem::default());
    coupling.assemble((&contacts, &mut active), shapes, &mut sets, &mut problem, 10_000).unwrap();
    let size = active.len();
    assert!(size >= count && coupling.groups.len() > count + 3, "{size} contacts");
    let mut expected = vec![vec![[[0.0; 3]; 3]; size]; size];
    for set in sets.iter_mut() {
        let ConnectedSet { component, touch: Some(touch), .. } = set else { continue };
        let of = |(k, &index): (usize, &u32)| sides(&contacts[index as usize], k as u32, shapes, touch.number);
        let own: Vec<Side> = active.iter().enumerate().flat_map(of).collect();
        touch.response.couple(&component.system, None, &own, |s, t, block| {
            let [row, column] = [s, t].map(|side| own[side].contact as usize);
            for (r, c) in (0..9).map(|k| (k / 3, k % 3)) {
                expected[row][column][r][c] += block[r][c];
                if s != t {
                    expected[column][row][c][r] += block[r][c];
                }
            }
        });
    }
    let operator = &problem.operator;
    let most = expected.iter().flatten().flatten().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
    let (by, mut products) = ([[1.0, 0.0, 0.0], [0.5, 2.0, 0.0], [0.0, -1.0, 3.0]], Vec::new());
    let mut listed = 0;
    for column in 0..size {
        let mut blocks = vec![[[0.0; 3]; 3]; size];
        operator.each_product(column, &by, &mut products, |row, block| {
            for (sum, x) in blocks[row].iter_mut().flatten().zip(block.iter().flatten()) {
                *sum += x;
            }
        });
        for row in 0..size {
            let block = operator.block(row, column);
            let along = operator.normals(row).find(|&(other, _)| other == column);
            // Those of other groups of a long chain are not listed.
            assert!(along.is_none_or(|(_, normal)| (normal - block[0][0]).abs() < 1e-12 * most));
            listed += usize::from(along.is_some());
            for (r, c) in (0..9).map(|k| (k / 3, k % 3)) {
                let (block, expected) = (block[r][c], expected[row][column][r][c]);
                assert!((block - expected).abs() < 1e-11 * most, "{row} {column}: {block} {expected}");
            }
        }
        assert!((operator.diagonal(column)[2][0] - expected[column][column][2][0]).abs() < 1e-11 * most);
        for c in 0..3 {
            let mut chunks = vec![Chunk::zero(); operator.moved_len()];
            operator.change(&mut Moved { chunks: &mut chunks, first: 0 }, column, [0, 1, 2].map(|k| f64::from(k == c)));
            for row in 0..size {
                let moved = operator.moved(row, &chunks, 0);
                for r in 0..3 {
                    let (moved, listed) = (moved[r], blocks[row][c][r]);
                    let product: f64 = (0..3).map(|k| by[c][k] * expected[column][row][k][r]).sum();
                    let expected = expected[row][column][r][c];
                    assert!((moved - expected).abs() < 1e-11 * most, "{row} {column}: {moved} {expected}");
                    assert!((listed - product).abs() < 1e-11 * most, "{row} {column}: {listed} {product}");
                }
            }
        }
    }
    // Each but the last of a group has one after it there.
    assert!(listed >= size / 2, "{listed} of {size}");
}
