//! Answers along a chain in blocks of neighbouring sides: between two blocks they go through one body, by six numbers.
//!
//! With r the last body of a block on which forces act, T(b, a) the transfer from a body a to a later one b, and J, P as before:
//!
//! ```text
//! E_s = T(r, b) P_b J_s^T             what the forces of side s, on body b, do to the last body of its block
//! R_s = J_s T(b, r')                  what s sees of the last body r' of the block before
//! M = T(r, r')                        how a block's last body follows that of the block before
//! J_t P J_s^T = R_t M .. M E_s        of sides in two blocks, with M of each block between them
//! ```
//!
//! So the answers of n sides take memory in proportion to n, not to its square.

use std::ops::Range;

use super::{Articulated, LANES, NONE, Side};
use crate::system::System;
use crate::transfer::{Row, Rows};
use kernels::dispatch::vectorized;
use kernels::lane::Real;

/// Takes the answers of a chain, block by block.
pub trait Blocks {
    /// The work that the forces of two sides of the block do on each other's answers, as [`Transfers::couple`] has it.
    fn pair(&mut self, sides: [usize; 2], work: [[f64; 3]; 3]);
    /// The columns of E and the rows of R of a side.
    fn side(&mut self, side: usize, to_last: [Row; 3], from_before: [Row; 3]);
    /// M of the block, which ends; the next one begins.
    fn end(&mut self, passage: &Rows);
}

impl Articulated {
    /// Whether the bodies that move form chains: each follows the one visited before it, or none.
    pub fn are_chains(&self) -> bool {
        (0..).zip(&self.visits).all(|(place, visit)| visit.before == NONE || visit.before + 1 == place)
    }

    /// The place of a body, which must move, on the way along the chains.
    pub fn place(&self, body: u32) -> u32 {
        self.places[body as usize]
    }

    /// The answers of `sides`, in the order of their places, in blocks that begin at the `cuts`, counted from the first one; the last one is
    /// their end. The bodies that move must form chains.
    pub fn couple_blocks(
        &mut self,
        system: &System<f64>,
        (sides, cuts): (&[Side], &[usize]),
        blocks: &mut impl Blocks,
    ) {
        self.mark(sides);
        vectorized(
            #[inline(always)]
            || {
                self.eliminate(system);
                self.walk_blocks(sides, cuts, blocks);
            },
        );
    }

    #[inline(always)]
    fn walk_blocks(&mut self, sides: &[Side], cuts: &[usize], blocks: &mut impl Blocks) {
        self.answers.clear();
        self.answers.resize((3 * sides.len()).div_ceil(LANES), Rows::zero());
        self.forces.clone_from(&self.answers);
        let mut place = sides.first().map_or(0, |side| self.places[side.body as usize]);
        for ends in cuts.windows(2) {
            let block = ends[0] - cuts[0]..ends[1] - cuts[0];
            let begin = 3 * block.start;
            // T from the last body of the block before.
            let mut passage = unit();
            self.nears.clear();
            for side in block.clone() {
                while place < self.places[sides[side].body as usize] {
                    place += 1;
                    self.step(place as usize, &mut passage, begin..3 * side);
                }
                for (d, force) in sides[side].forces.iter().enumerate() {
                    self.append(place as usize, 3 * side + d, force);
                }
                self.nears.push(sides[side].forces.map(|force| row_times(&force.to_array(), &passage)));
                self.read(begin, side, sides, &mut |s, t, work| blocks.pair([s, t], work));
            }
            for (side, &from_before) in block.zip(&self.nears) {
                let to_last = [0, 1, 2].map(|d| self.answer(3 * side + d));
                blocks.side(side, to_last, from_before);
            }
            blocks.end(&passage);
        }
    }

    /// Goes on to the body at `place`, with the passage and the answers in some columns.
    #[inline(always)]
    fn step(&mut self, place: usize, passage: &mut Rows, columns: Range<usize>) {
        let is_root = self.visits[place].before == NONE;
        let transfer = &self.transfers[place].transposed;
        let follow = |answers: &Rows| if is_root { Rows::zero() } else { transfer.transposed_times(answers) };
        *passage = follow(passage);
        for answers in &mut self.answers[columns.start / LANES..columns.end.div_ceil(LANES)] {
            *answers = follow(answers);
        }
    }

    /// A column of answers.
    #[inline(always)]
    fn answer(&self, column: usize) -> Row {
        let mut out = Row::zero();
        for (out, row) in out.0.iter_mut().zip(&self.answers[column / LANES].0) {
            *out = row.0[column % LANES];
        }
        out
    }
}

/// The unit matrix.
fn unit() -> Rows {
    let mut out = Rows::zero();
    for (k, row) in out.0.iter_mut().enumerate() {
        row.0[k] = 1.0;
    }
    out
}

/// `x M`.
#[inline(always)]
fn row_times(x: &[f64; 6], m: &Rows) -> Row {
    let mut sum = Row::zero();
    for (&row, &x) in m.0.iter().zip(x) {
        sum += row * Row::splat(x);
    }
    sum
}
