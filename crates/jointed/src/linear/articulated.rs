//! How the bodies of a chain or a tree answer forces, by transfers from body to body: `P f` with
//! `P = M^-1 - M^-1 J^T A^-1 J M^-1`, between the few places where forces act.
//!
//! The bodies that move are put in pre-order from a root. Once joints are eliminated from the leaves, each body follows the
//! one before it by a 6 x 6 matrix (`kernel/transfer.rs`), `dp = T dp_before + S f`, so that
//!
//! ```text
//! P_c = T P_before T^T + S                   answer of a body to a force on itself, from the root on
//! U_c = T U_before                           answer to forces on bodies that came earlier
//! U_a = P_a G,  G = T^T G_child ..           the same at a branch, whose children come later: forces move up
//! ```
//!
//! All forces found so far go along side by side, eight columns to a vector register, and where a force acts the work that
//! it does against them is read off: one entry of `G^T P G` for each pair. That is one half of a symmetric matrix; nothing is
//! solved for, and what lies beyond the last force of a branch is never visited. Fixed bodies cut a tree.

mod blocks;

use std::sync::Arc;

use crate::system::System;
use crate::topology::Topology;
use crate::transfer::{Columns, Link, Row, Rows, Transfer, eliminate, transfer};
use kernels::Spatial;
use kernels::dispatch::vectorized;
use kernels::lane::Real;
use kernels::math::Vec3;

pub use blocks::Blocks;

/// No body, no joint.
const NONE: u32 = u32::MAX;
/// Columns in a vector register.
const LANES: usize = Row::LANES;
/// Sides whose columns fill three of them.
const SIDES: usize = LANES;

/// A body in pre-order.
#[derive(Clone, Copy, Debug)]
struct Visit {
    body: u32,
    /// Place of the body before it; `NONE` of a root.
    before: u32,
    /// The joint to it.
    joint: u32,
    /// Place after the last body of its subtree.
    end: u32,
}

/// Three forces at one place of a body: a side of a contact.
#[derive(Clone, Copy, Debug)]
pub struct Side {
    /// Its contact; sides of one contact follow on each other.
    pub contact: u32,
    /// The body, which must move.
    pub body: u32,
    /// The forces, with the torques about the body's centre.
    pub forces: [Spatial<f64>; 3],
}

/// What happens at a body during the walk.
#[derive(Clone, Copy, Debug, Default)]
struct Mark {
    /// Whether forces act on it or beyond it.
    needed: bool,
    /// Children on or beyond which forces act.
    children: u32,
    /// Forces that came before it.
    first: u32,
}

/// Memory for the transfers of one connected set.
pub struct Articulated {
    topology: Arc<Topology>,
    visits: Vec<Visit>,
    /// Place of each body; `NONE` where it is fixed.
    places: Vec<u32>,
    /// Joints to fixed bodies, with the places of the bodies that move.
    grounds: Vec<[u32; 2]>,
    /// What eliminations leave of the bodies' inverse masses; then P, of those that are needed.
    left: Vec<Rows>,
    transfers: Vec<Transfer>,
    marks: Vec<Mark>,
    /// Sides by place.
    order: Vec<u32>,
    /// Answers at the body of the walk, eight columns each.
    answers: Vec<Rows>,
    /// Forces as they act on it, of those beyond a branch.
    forces: Vec<Rows>,
    /// Answers at the branches that the walk comes back to.
    saved: Vec<Rows>,
    /// Those branches, and where their answers begin in `saved`.
    branches: Vec<(u32, usize)>,
    /// What the sides of a block of a chain see of what comes before the block.
    nears: Vec<[Row; 3]>,
}

impl Articulated {
    /// Memory for systems of this connectivity, whose bodies answer `with_joints` or each for itself; `None` where bodies that
    /// move form a loop.
    pub(crate) fn new(topology: &Arc<Topology>, with_joints: bool) -> Option<Self> {
        let mut own = Self::empty(topology);
        if with_joints {
            own.order_tree(|_| true)?;
        } else {
            own.order_alone();
        }
        own.make_room();
        Some(own)
    }

    /// Memory for systems of this connectivity, whose trees have the roots of their elimination; `None` where bodies that move form a
    /// loop.
    pub fn rooted(topology: &Arc<Topology>) -> Option<Self> {
        let mut follows = vec![false; topology.bodies()];
        for node in topology.elimination.as_deref()? {
            follows[node.outer as usize] |= !topology.fixed[node.inner as usize];
        }
        let mut own = Self::empty(topology);
        own.order_tree(|body| !follows[body])?;
        own.make_room();
        Some(own)
    }

    fn empty(topology: &Arc<Topology>) -> Self {
        Self {
            topology: topology.clone(),
            visits: Vec::new(),
            places: vec![NONE; topology.bodies()],
            grounds: Vec::new(),
            left: Vec::new(),
            transfers: Vec::new(),
            marks: Vec::new(),
            order: Vec::new(),
            answers: Vec::new(),
            forces: Vec::new(),
            saved: Vec::new(),
            branches: Vec::new(),
            nears: Vec::new(),
        }
    }

    fn make_room(&mut self) {
        let count = self.visits.len();
        self.left = vec![Rows::zero(); count];
        self.transfers = vec![Transfer { transposed: Rows::zero(), held: Rows::zero() }; count];
        self.marks = vec![Mark::default(); count];
    }

    /// Whether it is of this connectivity.
    pub fn is_of(&self, topology: &Arc<Topology>) -> bool {
        Arc::ptr_eq(&self.topology, topology)
    }

    /// Every body a root.
    fn order_alone(&mut self) {
        for body in (0..self.topology.bodies()).filter(|&body| !self.topology.fixed[body]) {
            let place = self.visits.len() as u32;
            self.places[body] = place;
            self.visits.push(Visit { body: body as u32, before: NONE, joint: NONE, end: place + 1 });
        }
    }

    /// Trees from their ends that may be roots, else from any body that may; `None` if there is a loop.
    fn order_tree(&mut self, is_root: impl Fn(usize) -> bool) -> Option<()> {
        let Topology { joints, fixed, .. } = &*self.topology;
        let mut neighbours: Vec<Vec<(u32, u32)>> = vec![Vec::new(); fixed.len()];
        for (joint, &[a, b]) in joints.iter().enumerate() {
            if !fixed[a as usize] && !fixed[b as usize] {
                neighbours[a as usize].push((b, joint as u32));
                neighbours[b as usize].push((a, joint as u32));
            }
        }
        let ends = (0..fixed.len()).filter(|&body| neighbours[body].len() <= 1);
        let mut open = Vec::new();
        for root in ends.chain(0..fixed.len()).filter(|&root| is_root(root)) {
            if fixed[root] || self.places[root] != NONE {
                continue;
            }
            open.push((root as u32, NONE, NONE));
            while let Some((body, before, joint)) = open.pop() {
                if self.places[body as usize] != NONE {
                    return None;
                }
                let place = self.visits.len() as u32;
                self.places[body as usize] = place;
                self.visits.push(Visit { body, before, joint, end: place + 1 });
                let beyond = neighbours[body as usize].iter().rev().filter(|&&(_, other)| other != joint);
                open.extend(beyond.map(|&(other, joint)| (other, place, joint)));
            }
        }
        for place in (0..self.visits.len()).rev() {
            let Visit { before, end, .. } = self.visits[place];
            if before != NONE {
                let own = &mut self.visits[before as usize].end;
                *own = end.max(*own);
            }
        }
        for (joint, &[a, b]) in joints.iter().enumerate() {
            match [a, b].map(|body| self.places[body as usize]) {
                [NONE, NONE] => {}
                [NONE, place] | [place, NONE] => self.grounds.push([joint as u32, place]),
                _ => {}
            }
        }
        Some(())
    }

    /// The work that unit forces of the `sides` do on each other's answers: for each pair, `block(s, t, b)` gets
    /// `b[r][c] = f_s,r . P f_t,c`, s at the place of t or after it. Pairs that nothing joins are left out.
    pub(crate) fn couple(
        &mut self,
        system: &System<f64>,
        sides: &[Side],
        mut block: impl FnMut(usize, usize, [[f64; 3]; 3]),
    ) {
        self.mark(sides);
        vectorized(
            #[inline(always)]
            || {
                self.eliminate(system);
                self.walk(sides, &mut block);
            },
        );
    }

    /// `Self::couple` where `answers` says how bodies answer, instead of a system: of each body, how it follows the one before it,
    /// if there is one, and its answer where that is held, column by column.
    pub fn couple_following(
        &mut self,
        answers: impl FnOnce(&mut dyn FnMut(u32, Option<&Columns>, &Columns)),
        sides: &[Side],
        mut block: impl FnMut(usize, usize, [[f64; 3]; 3]),
    ) {
        self.mark(sides);
        let Self { places, left, transfers, .. } = self;
        answers(&mut |body, follows, answer| {
            let place = places[body as usize] as usize;
            let Some(follows) = follows else {
                left[place] = rows(answer);
                // The body before it may be held for now, where the connectivity has it free.
                transfers[place] = Transfer { transposed: Rows::zero(), held: rows(answer) };
                return;
            };
            let mut transposed = Rows::zero();
            for (row, column) in transposed.0.iter_mut().zip(follows) {
                row.0[..6].copy_from_slice(&column.to_array());
            }
            transfers[place] = Transfer { transposed, held: rows(answer) };
        });
        vectorized(
            #[inline(always)]
            || {
                for place in 0..self.visits.len() {
                    let before = self.visits[place].before;
                    if before != NONE && self.marks[place].needed {
                        self.left[place] = self.left[before as usize].carried(&self.transfers[place]);
                    }
                }
                self.walk(sides, &mut block);
            },
        );
    }

    /// Sorts the sides by their places, and finds out which bodies the walk visits.
    fn mark(&mut self, sides: &[Side]) {
        let place = |side: u32| self.places[sides[side as usize].body as usize];
        self.order.clear();
        self.order.extend(0..sides.len() as u32);
        self.order.sort_unstable_by_key(|&side| (place(side), side));
        self.marks.fill(Mark::default());
        for &side in &self.order {
            let mut at = self.places[sides[side as usize].body as usize];
            while at != NONE && !self.marks[at as usize].needed {
                self.marks[at as usize].needed = true;
                at = self.visits[at as usize].before;
                if at != NONE {
                    self.marks[at as usize].children += 1;
                }
            }
        }
    }

    /// The joint to the body before `place`.
    #[inline(always)]
    fn link(system: &System<f64>, joint: usize, outer: usize) -> Link {
        let [a, b] = system.topology.joints[joint];
        let [za, zb] = system.joints[joint].offsets;
        let mut arms = [system.bodies[a as usize].axis * za, system.bodies[b as usize].axis * zb];
        if let Some(across) = system.across.get(joint) {
            arms = [arms[0] + across[0], arms[1] + across[1]];
        }
        let [outer, inner] = if a as usize == outer { arms } else { [arms[1], arms[0]] };
        Link { outer, inner, compliance: [system.stretch_compliance(joint), system.bend_compliance(joint)] }
    }

    /// Eliminates the joints of all trees on which forces act, and finds the answers of bodies to forces on themselves.
    #[inline(always)]
    fn eliminate(&mut self, system: &System<f64>) {
        let Self { visits, grounds, left, transfers, marks, .. } = self;
        for (left, visit) in left.iter_mut().zip(visits.iter()) {
            let body = &system.bodies[visit.body as usize];
            *left = Rows::free(body.inverse_mass, body.inverse_inertia);
        }
        for &[joint, place] in grounds.iter() {
            let fixed = system.topology.joints[joint as usize];
            let own = visits[place as usize].body;
            let outer = if fixed[0] == own { fixed[1] } else { fixed[0] };
            let link = Self::link(system, joint as usize, outer as usize);
            eliminate(None, &mut left[place as usize], &link);
        }
        let mut tree = visits.len();
        for root in (0..visits.len()).rev() {
            if visits[root].before != NONE {
                continue;
            }
            if marks[root].needed {
                for place in (root + 1..tree).rev() {
                    let Visit { body, before, joint, .. } = visits[place];
                    let (inner, outer) = left.split_at_mut(place);
                    let link = Self::link(system, joint as usize, body as usize);
                    let joint = eliminate(Some(&outer[0]), &mut inner[before as usize], &link);
                    if marks[place].needed
                        && let Some(joint) = joint
                    {
                        transfers[place] = transfer(&joint, &outer[0], &link);
                    }
                }
                for place in root + 1..tree {
                    if marks[place].needed {
                        left[place] = left[visits[place].before as usize].carried(&transfers[place]);
                    }
                }
            }
            tree = root;
        }
    }

    /// Goes through the bodies on which forces act and those between them.
    #[inline(always)]
    fn walk(&mut self, sides: &[Side], block: &mut impl FnMut(usize, usize, [[f64; 3]; 3])) {
        let chunks = (3 * sides.len()).div_ceil(LANES);
        self.answers.clear();
        self.answers.resize(chunks, Rows::zero());
        self.forces.clear();
        self.forces.resize(chunks, Rows::zero());
        self.saved.clear();
        self.branches.clear();
        // Columns of the tree under way: from `begin` on, `columns` so far.
        let (mut begin, mut columns, mut next) = (0, 0, 0);
        let mut last = NONE;
        let mut place = 0;
        while place < self.visits.len() {
            let Visit { before, end, .. } = self.visits[place];
            if !self.marks[place].needed {
                place = end as usize;
                continue;
            }
            if before == NONE {
                // A new tree.
                begin = columns;
                self.branches.clear();
                self.saved.clear();
            } else {
                if before != last {
                    self.return_to(before, last, begin, columns);
                }
                let transfer = &self.transfers[place].transposed;
                for answers in &mut self.answers[begin / LANES..columns.div_ceil(LANES)] {
                    *answers = transfer.transposed_times(answers);
                }
            }
            self.marks[place].first = columns as u32;
            while let Some(&side) = self.order.get(next) {
                let Side { body, forces, .. } = &sides[side as usize];
                if self.places[*body as usize] != place as u32 {
                    break;
                }
                for force in forces {
                    self.append(place, columns, force);
                    columns += 1;
                }
                self.read(begin, next, sides, block);
                next += 1;
            }
            if self.marks[place].children > 1 {
                self.branches.push((place as u32, self.saved.len()));
                self.saved.extend_from_slice(&self.answers[begin / LANES..columns.div_ceil(LANES)]);
            }
            last = place as u32;
            place += 1;
        }
    }

    /// Adds a force on the body at `place` as a column.
    #[inline(always)]
    fn append(&mut self, place: usize, column: usize, force: &Spatial<f64>) {
        let force = force.to_array();
        let (chunk, lane) = (column / LANES, column % LANES);
        let own = &self.left[place].0;
        for r in 0..6 {
            self.forces[chunk].0[r].0[lane] = force[r];
            self.answers[chunk].0[r].0[lane] = (0..6).map(|k| own[r].0[k] * force[k]).sum();
        }
    }

    /// Reads off what the forces of the side `order[own]`, the last of the columns from `begin` on, do against all of them.
    #[inline(always)]
    fn read(&self, begin: usize, own: usize, sides: &[Side], block: &mut impl FnMut(usize, usize, [[f64; 3]; 3])) {
        let side = self.order[own] as usize;
        let forces = [0, 1, 2].map(|d| sides[side].forces[d].to_array());
        let end = 3 * own + 3;
        let mut rows = [[0.0; SIDES * 3]; 3];
        let mut first = begin - begin % (SIDES * 3);
        while first < end {
            let chunks = first / LANES..(first + SIDES * 3).min(end).div_ceil(LANES);
            for (place, answers) in self.answers[chunks].iter().enumerate() {
                for (row, force) in rows.iter_mut().zip(&forces) {
                    let mut sum = answers.0[0] * Row::splat(force[0]);
                    for (&answer, &force) in answers.0[1..].iter().zip(&force[1..]) {
                        sum += answer * Row::splat(force);
                    }
                    row[place * LANES..(place + 1) * LANES].copy_from_slice(&sum.0);
                }
            }
            for column in (first.max(begin)..end.min(first + SIDES * 3)).step_by(3) {
                let at = column - first;
                let work = rows.each_ref().map(|row| [row[at], row[at + 1], row[at + 2]]);
                block(side, self.order[column / 3] as usize, work);
            }
            first += SIDES * 3;
        }
    }

    /// Takes the walk from the body `last` back to the branch `to`: answers there to what came before it are those that were
    /// saved, and forces beyond it have moved up to it.
    #[inline(always)]
    fn return_to(&mut self, to: u32, last: u32, begin: usize, columns: usize) {
        let mut at = last;
        while at != to {
            let from = self.marks[at as usize].first as usize;
            let transfer = self.transfers[at as usize].transposed;
            update(&mut self.forces, from..columns, |forces, _| transfer.times(forces));
            at = self.visits[at as usize].before;
        }
        while let Some(&(branch, saved)) = self.branches.last() {
            if branch == to {
                let count = self.saved.len() - saved;
                let first = begin / LANES;
                self.answers[first..first + count].copy_from_slice(&self.saved[saved..]);
                // Columns after those that were saved: of bodies beyond the branch.
                let own = self.left[to as usize];
                let from = self.beyond(to, columns);
                let forces = &self.forces;
                update(&mut self.answers, from..columns, |_, chunk| own.times(&forces[chunk]));
                return;
            }
            self.branches.pop();
            self.saved.truncate(saved);
        }
    }

    /// The first column of what lies beyond the body at `place`, whose own come before.
    #[inline(always)]
    fn beyond(&self, place: u32, columns: usize) -> usize {
        let next =
            (place as usize + 1..self.visits[place as usize].end as usize).find(|&place| self.marks[place].needed);
        next.map_or(columns, |next| self.marks[next].first as usize)
    }
}

/// A matrix with these columns.
fn rows(columns: &Columns) -> Rows {
    let mut out = Rows::zero();
    for (c, column) in columns.iter().enumerate() {
        for (row, x) in out.0.iter_mut().zip(column.to_array()) {
            row.0[c] = x;
        }
    }
    out
}

/// Replaces some columns of chunks by `change` of their chunk.
#[inline(always)]
fn update(chunks: &mut [Rows], columns: std::ops::Range<usize>, change: impl Fn(&Rows, usize) -> Rows) {
    let (from, to) = (columns.start / LANES, columns.end.div_ceil(LANES));
    for (chunk, own) in chunks.iter_mut().enumerate().take(to).skip(from) {
        let new = change(own, chunk);
        let first = chunk * LANES;
        if first >= columns.start && first + LANES <= columns.end {
            *own = new;
            continue;
        }
        for lane in (0..LANES).filter(|&lane| columns.contains(&(first + lane))) {
            for (row, new) in own.0.iter_mut().zip(&new.0) {
                row.0[lane] = new.0[lane];
            }
        }
    }
}

/// The forces of a contact's side with these three axes at an arm.
pub fn side(contact: u32, body: u32, arm: Vec3<f64>, axes: &[Vec3<f64>; 3], sign: f64) -> Side {
    let force = |axis: Vec3<f64>| Spatial { linear: axis * sign, angular: arm.cross(axis * sign) };
    Side { contact, body, forces: [force(axes[0]), force(axes[1]), force(axes[2])] }
}
