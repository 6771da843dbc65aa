//! Answers against solves in the usual way.

use std::sync::Arc;

use jointed::linear::LinearSolver;
use jointed::linear::articulated::Blocks;
use jointed::linear::articulated::*;
use jointed::linear::compliance::*;
use jointed::linear::direct::Direct;
use jointed::linear::looped::Looped;
use jointed::system::System;
use jointed::transfer::{Row, Rows};
use kernels::Spatial;
use kernels::math::Vec3;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rod::{Assembly, InnerDamping, Material, RodSpec, Section, Springs, shape};

use crate::formulation::Formulation;
use crate::{Component, split};

const MATERIAL: Material = Material { youngs_modulus: 1e5, torsion_modulus: 3e4, density: 300.0 };

/// The system of a model's first connected set that has been set in motion a little.
fn component(mut assembly: Assembly, change: impl FnOnce(&mut rod::Model)) -> Component<f64> {
    let count = assembly.model_mut().segments.len();
    assembly.state_mut().velocities[count / 2] = Vector3::new(1.0, 2.0, -1.0);
    let (mut model, state) = assembly.finish();
    change(&mut model);
    let (members, topology) = split(&model).swap_remove(0);
    let mut component = Component::new(&model, &state, Arc::new(topology), &[&members]);
    component.predict(0.0, 0.02, Formulation::Newton);
    component.evaluate(Formulation::Newton);
    component
}

/// What all bodies do under a force on one of them, joint by joint.
fn solved(system: &mut System<f64>, body: usize, force: Spatial<f64>) -> Vec<Spatial<f64>> {
    let mut impulses = vec![Spatial::zero(); system.bodies.len()];
    impulses[body] = force;
    let free: Vec<_> = impulses.iter().enumerate().map(|(i, &impulse)| system.correction(i, impulse)).collect();
    for j in 0..system.joints.len() {
        let change = system.joints[j].from_world(system.constraint_change(j, &free), system.frame(j));
        system.joints[j].rhs = Spatial::zero().plus(change, -1.0);
    }
    let mut dlambda = vec![Spatial::zero(); system.joints.len()];
    match Direct::new(&system.topology) {
        Some(mut direct) => direct.solve(system, false, &mut dlambda),
        None => Looped::new(&system.topology).unwrap().solve(system, false, &mut dlambda),
    };
    for (j, &dlambda) in dlambda.iter().enumerate() {
        system.add_impulse(j, system.joints[j].multipliers_to_world(dlambda, system.frame(j)), &mut impulses);
    }
    impulses.iter().enumerate().map(|(i, &impulse)| system.correction(i, impulse)).collect()
}

/// Random sides on some of the bodies that move, several on some, two of them of one contact.
fn sides(system: &System<f64>, count: usize, seed: u64) -> Vec<Side> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let moves: Vec<_> = (0..system.bodies.len()).filter(|&body| !system.topology.fixed[body]).collect();
    let side = |k: usize| {
        let body = moves[random.random_range(0..moves.len())] as u32;
        let mut number = || random.random_range(-1.0..1.0);
        let mut force = || Spatial::from_array([0; 6].map(|_| number()));
        let contact = if k == 1 { 0 } else { k };
        Side { contact: contact as u32, body, forces: [force(), force(), force()] }
    };
    (0..count).map(side).collect()
}

/// Holds all blocks between random sides to solves.
fn check(component: &mut Component<f64>, kind: fn(&Compliance) -> bool, what: &str) {
    for seed in 0..20 {
        let system = &mut component.system;
        let sides = sides(system, 1 + seed as usize, seed);
        let contacts = sides.last().map_or(0, |side| side.contact as usize) + 1;
        let mut found = vec![vec![[[0.0; 3]; 3]; contacts]; contacts];
        let mut add = |row: usize, column: usize, entry: &dyn Fn(usize, usize) -> f64| {
            for (r, c) in (0..9).map(|k| (k / 3, k % 3)) {
                found[row][column][r][c] += entry(r, c);
            }
        };
        let mut response = Compliance::new(system, true).unwrap();
        assert!(kind(&response) && response.is_of(&system.topology), "{what}");
        response.couple(system, None, &sides, |s, t, block| {
            let (row, column) = (sides[s].contact as usize, sides[t].contact as usize);
            add(row, column, &|r, c| block[r][c]);
            if s != t {
                add(column, row, &|r, c| block[c][r]);
            }
        });
        let mut expected = vec![vec![[[0.0; 3]; 3]; contacts]; contacts];
        for side in &sides {
            for (c, &force) in side.forces.iter().enumerate() {
                let answer = solved(system, side.body as usize, force);
                for other in &sides {
                    for (r, force) in other.forces.iter().enumerate() {
                        let work = force.dot(answer[other.body as usize]);
                        expected[other.contact as usize][side.contact as usize][r][c] += work;
                    }
                }
            }
        }
        let all = |blocks: &[Vec<[[f64; 3]; 3]>]| blocks.concat().concat().concat();
        let (found, expected) = (all(&found), all(&expected));
        let size = expected.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        for (k, (found, expected)) in found.iter().zip(&expected).enumerate() {
            assert!((found - expected).abs() < 1e-11 * size, "{what}, seed {seed}, {k}: {found} {expected}");
        }
    }
}

/// A rod of so many segments.
fn helix(segments: usize) -> RodSpec {
    RodSpec::new(shape::helix(Vector3::zeros(), 0.3, 0.5, 1.0, segments), 0.02, MATERIAL)
}

fn is_tree(response: &Compliance) -> bool {
    matches!(response, Compliance::Tree(_))
}

#[test]
fn transfers_along_a_chain_are_what_solves_say() {
    for segments in [1, 2, 9] {
        let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
        assembly.rod(&helix(segments));
        check(&mut component(assembly, |_| {}), is_tree, "a free rod");
    }
}

/// Joints have sections with sides, rest rotations and damping, and a grip has springs.
#[test]
fn answers_know_all_of_the_joints() {
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let rod = assembly.rod(&RodSpec {
        sections: vec![Section::Rectangle { width: 0.05, height: 0.02 }],
        inner_damping: InnerDamping { bending: 0.01, twist: 0.02, stretch: 0.0 },
        ..helix(9)
    });
    assembly.clamp_start(&rod);
    let mut component = component(assembly, |model| {
        model.measure_from_rest();
        let clamp = model.joints.len() - 1;
        model.soften(clamp, &Springs { force: [300.0, 20.0, 100.0], ..Springs::RIGID });
    });
    let system = &component.system;
    assert!(!system.frames.is_empty() && !system.bend_extra.is_empty() && !system.shear_extra.is_empty());
    check(&mut component, is_tree, "a clamped rod");
}

/// What [`Transfers::couple_blocks`] gives, for one block after another.
#[derive(Default)]
struct Found {
    block: usize,
    /// Of sides: their block, pairs within it, E's columns and R's rows; M of each block.
    blocks: Vec<usize>,
    pairs: Vec<([usize; 2], [[f64; 3]; 3])>,
    ends: Vec<[[Row; 3]; 2]>,
    passages: Vec<Rows>,
}

impl Blocks for Found {
    fn pair(&mut self, sides: [usize; 2], work: [[f64; 3]; 3]) {
        self.pairs.push((sides, work));
    }

    fn side(&mut self, side: usize, to_last: [Row; 3], from_before: [Row; 3]) {
        assert_eq!(side, self.ends.len());
        self.blocks.push(self.block);
        self.ends.push([to_last, from_before]);
    }

    fn end(&mut self, passage: &Rows) {
        self.passages.push(*passage);
        self.block += 1;
    }
}

/// A chain that a fixed segment may cut, in blocks: what sides of one and of two blocks do to each other.
#[test]
fn blocks_of_a_chain_are_what_solves_say() {
    for (is_cut, seed) in [(false, 0), (false, 1), (true, 2), (true, 3)] {
        let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
        let rod = assembly.rod(&helix(14));
        assembly.clamp_start(&rod);
        if is_cut {
            assembly.fix(rod.start + 6);
        }
        let mut component = component(assembly, |_| {});
        let system = &mut component.system;
        let Compliance::Tree(mut transfers) = Compliance::new(system, true).unwrap() else {
            panic!("a chain is a tree")
        };
        assert!(transfers.are_chains());
        let mut sides = sides(system, 11, seed);
        sides.sort_by_key(|side| transfers.place(side.body));
        let mut found = Found::default();
        transfers.couple_blocks(system, (&sides, &[5, 8, 9, 13, 16]), &mut found);
        assert_eq!(found.blocks, [0, 0, 0, 1, 2, 2, 2, 2, 3, 3, 3]);
        let times = |m: &Rows, x: [f64; 6]| [0, 1, 2, 3, 4, 5].map(|r| dot(&m.0[r], x));
        let work = |s: usize, t: usize, c: usize| -> [f64; 3] {
            let (first, last) = (found.blocks[t], found.blocks[s]);
            let six = |row: &Row| [0, 1, 2, 3, 4, 5].map(|k| row.0[k]);
            let at_last = (first + 1..last).fold(six(&found.ends[t][0][c]), |x, b| times(&found.passages[b], x));
            [0, 1, 2].map(|r| dot(&found.ends[s][1][r], at_last))
        };
        let mut pairs = 0;
        for t in 0..sides.len() {
            for c in 0..3 {
                let answer = solved(system, sides[t].body as usize, sides[t].forces[c]);
                let size = sides[t].forces[c].dot(answer[sides[t].body as usize]).abs();
                for s in t..sides.len() {
                    let found = if found.blocks[s] == found.blocks[t] {
                        let own = found.pairs.iter().find(|(sides, _)| *sides == [s, t]).expect("a pair");
                        pairs += 1;
                        [0, 1, 2].map(|r| own.1[r][c])
                    } else {
                        work(s, t, c)
                    };
                    for (found, force) in found.into_iter().zip(sides[s].forces) {
                        let expected = force.dot(answer[sides[s].body as usize]);
                        assert!((found - expected).abs() < 1e-10 * size, "{s} {t}: {found} {expected}");
                    }
                }
            }
        }
        assert_eq!(pairs, 3 * (6 + 1 + 10 + 6));
        assert_eq!(found.pairs.len(), 6 + 1 + 10 + 6);
    }
}

fn dot(row: &Row, x: [f64; 6]) -> f64 {
    (0..6).map(|k| row.0[k] * x[k]).sum()
}

/// Branches off the middle of other branches, a clamp, and a fixed segment that cuts the tree.
#[test]
fn transfers_in_a_tree_are_what_solves_say() {
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let trunk = assembly.rod(&helix(8));
    let mut branch = |parent: usize, segments: usize| {
        let start = Vector3::new(0.1 * parent as f64, 0.5, 0.0);
        let nodes = shape::straight(start, Vector3::new(0.3, 1.0, 0.2).normalize(), 0.4, segments);
        let branch = assembly.rod(&RodSpec::new(nodes, 0.02, MATERIAL));
        assembly.branch(parent, 0.5, &branch);
        branch
    };
    let first = branch(trunk.start + 2, 4);
    branch(trunk.start + 2, 1);
    branch(first.start + 1, 3);
    let third = branch(first.start + 1, 2);
    branch(trunk.start + 5, 5);
    check(&mut component(assembly.clone(), |_| {}), is_tree, "a free tree");
    assembly.clamp_start(&trunk);
    assembly.fix(third.start);
    assembly.fix(trunk.start + 4);
    check(&mut component(assembly, |_| {}), is_tree, "a tree that is cut");
}

#[test]
fn columns_of_a_ring_are_what_solves_say() {
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let rod = assembly.rod(&helix(7));
    assembly.join(rod.start, 0.0, rod.end - 1, 1.0);
    let is_looped = |response: &Compliance| matches!(response, Compliance::Looped(_));
    check(&mut component(assembly, |_| {}), is_looped, "a ring");
}

/// Without joints each body answers for itself.
#[test]
fn bodies_without_joints_answer_for_themselves() {
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    assembly.rod(&helix(5));
    let component = component(assembly, |_| {});
    let system = &component.system;
    let force = Spatial { linear: Vec3([1.0, -2.0, 0.5]), angular: Vec3([0.1, 0.2, -0.3]) };
    let sides = [1, 3, 3].map(|body| Side { contact: body, body, forces: [force; 3] });
    let mut pairs = Vec::new();
    Compliance::new(system, false).unwrap().couple(system, None, &sides, |s, t, block| {
        let expected = force.dot(system.correction(sides[s].body as usize, force));
        assert!(block.iter().flatten().all(|x| (x - expected).abs() < 1e-12 * expected.abs()), "{block:?} {expected}");
        pairs.push((s, t));
    });
    assert_eq!(pairs, [(0, 0), (1, 1), (2, 1), (2, 2)]);
}
