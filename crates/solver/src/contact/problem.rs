//! The contacts' linear complementarity problem with friction, over all contacts that may press.
//!
//! With z the impulses of the contacts in their own frames (normal, two tangents), W = J P J^T the Delassus operator of
//! what their impulses do to their gaps and slips, and c gap and slip without any change of z:
//!
//! ```text
//! w = c + W dz,   0 <= w_n  perpendicular to  z_n >= 0,   |z_t| <= mu z_n,   z_t against w_t where it slides
//! ```
//!
//! A sweep solves each contact in turn: projected block Gauss-Seidel (Daviet, Bertails-Descoubes and Boissieux 2011 solve
//! hair so; the friction cone at the level of positions is that of Macklin et al. 2014, section 6.1).

use rod::Friction;

use crate::kernel::dispatch::vectorized;

pub(crate) type Row = [f64; 3];
pub(crate) type Block3 = [Row; 3];

/// What friction is at most.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Bound {
    /// Coulomb's law: a share of the normal impulse, whatever it comes to.
    Coulomb(Friction),
    /// So much [N s^2], at rest and sliding: a share of an earlier normal impulse. The problem is that of a minimum then.
    Lagged([f64; 2]),
}

impl Bound {
    /// Whether there is friction at such a normal impulse.
    pub(crate) fn exists(self, normal: f64) -> bool {
        match self {
            Bound::Coulomb(friction) => friction.at_rest > 0.0 && normal > 0.0,
            Bound::Lagged([at_rest, _]) => at_rest > 0.0,
        }
    }

    /// At rest, at such a normal impulse.
    pub(crate) fn at_rest(self, normal: f64) -> f64 {
        match self {
            Bound::Coulomb(friction) => friction.at_rest * normal,
            Bound::Lagged([at_rest, _]) => at_rest,
        }
    }

    /// While the surfaces slide, at such a normal impulse.
    pub(crate) fn sliding(self, normal: f64) -> f64 {
        match self {
            Bound::Coulomb(friction) => friction.sliding * normal,
            Bound::Lagged([_, sliding]) => sliding,
        }
    }

    /// An impulse with no more friction than there may be.
    pub(crate) fn within(self, [normal, x, y]: Row) -> Row {
        let (size, most) = (length([x, y]), self.sliding(normal));
        let share = if size > most { most / size } else { 1.0 };
        [normal, x * share, y * share]
    }

    /// An impulse with no more friction than there may be at rest.
    pub(crate) fn within_rest(self, [normal, x, y]: Row) -> Row {
        let (size, most) = (length([x, y]), self.at_rest(normal));
        let share = if size > most { most / size } else { 1.0 };
        [normal, x * share, y * share]
    }

    /// The derivative of [`Bound::sliding`].
    pub(crate) fn slope(self) -> f64 {
        match self {
            Bound::Coulomb(friction) => friction.sliding,
            Bound::Lagged(_) => 0.0,
        }
    }
}

/// What a sweep knows of a contact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unknown {
    /// Impulse times dt [N s^2]: normal, then two tangents.
    pub(crate) force: Row,
    /// Its value before the solve.
    pub(crate) before: Row,
    /// Gap less its target, and slip, if the impulse stays as it was before [m].
    pub(crate) free: Row,
    /// What friction is at most.
    pub(crate) friction: Bound,
    /// Length by which errors are measured [m].
    pub(crate) scale: f64,
}

/// The problem's matrix by block rows, and its unknowns.
#[derive(Default)]
pub(crate) struct Problem {
    unknowns: Vec<Unknown>,
    /// Impulses less those before the solve.
    changes: Vec<Row>,
    /// Where each block row begins among the blocks, and the end.
    start: Vec<usize>,
    /// Block columns of each block row, ascending.
    columns: Vec<u32>,
    /// Each block row as three rows of numbers, one after the other.
    values: Vec<f64>,
    /// Changes of the contacts in a block row.
    gathered: Vec<Row>,
    diagonal: Vec<Block3>,
}

/// Contacts of one group, in ascending order: all that push one component.
pub(crate) struct Pattern<'a> {
    /// Where each group's contacts begin in `members`, and the end.
    pub(crate) start: &'a [usize],
    /// Contacts by group.
    pub(crate) members: &'a [u32],
}

impl Problem {
    /// Prepares a matrix of zeros in which contacts of one group are coupled. `groups_of` lists each contact's groups.
    pub(crate) fn reset(&mut self, pattern: &Pattern<'_>, groups_of: &[[u32; 2]]) {
        self.start.clear();
        self.columns.clear();
        self.start.push(0);
        for groups in groups_of {
            let of = |group: u32| -> &[u32] {
                match group {
                    u32::MAX => &[],
                    group => &pattern.members[pattern.start[group as usize]..pattern.start[group as usize + 1]],
                }
            };
            let (a, b) = (of(groups[0]), if groups[0] == groups[1] { &[] } else { of(groups[1]) });
            merge(a, b, &mut self.columns);
            self.start.push(self.columns.len());
        }
        self.values.clear();
        self.values.resize(9 * self.columns.len(), 0.0);
    }

    /// Place of the block of `column` in block row `row`, which must be there.
    pub(crate) fn place(&self, row: u32, column: u32) -> usize {
        let columns = &self.columns[self.start[row as usize]..self.start[row as usize + 1]];
        // Where all contacts are of one group, a row holds them all.
        if columns.len() == self.start.len() - 1 { column as usize } else { columns.partition_point(|&k| k < column) }
    }

    /// Adds to a `direction` of the block at `place` in block row `row`.
    pub(crate) fn add(&mut self, row: u32, place: usize, direction: usize, values: Row) {
        let place = 3 * place + direction;
        let range = self.start[row as usize]..self.start[row as usize + 1];
        for (r, value) in values.into_iter().enumerate() {
            self.values[9 * range.start + 3 * r * range.len() + place] += value;
        }
    }

    /// A block by its place in its block row.
    #[inline]
    pub(crate) fn block(&self, row: usize, place: usize) -> Block3 {
        let range = self.start[row]..self.start[row + 1];
        let at = |r: usize| {
            let first = 9 * range.start + 3 * r * range.len() + 3 * place;
            let values = &self.values[first..first + 3];
            [values[0], values[1], values[2]]
        };
        [at(0), at(1), at(2)]
    }

    /// The diagonal blocks, after all entries are there.
    pub(crate) fn close(&mut self) {
        self.diagonal.clear();
        for row in 0..self.start.len() - 1 {
            self.diagonal.push(self.block(row, self.place(row as u32, row as u32)));
        }
    }

    /// The block of a contact's own impulse.
    pub(crate) fn diagonal(&self, contact: usize) -> &Block3 {
        &self.diagonal[contact]
    }

    /// The blocks of a block row right of its diagonal: column, response along both normals, place.
    pub(crate) fn after(&self, row: usize) -> impl Iterator<Item = (usize, f64, usize)> {
        let range = self.start[row]..self.start[row + 1];
        let normals = &self.values[9 * range.start..9 * range.start + 3 * range.len()];
        let first = self.place(row as u32, row as u32) + 1;
        (first..range.len()).map(move |place| (self.columns[range.start + place] as usize, normals[3 * place], place))
    }

    /// Compliances of a contact to its own impulse: along the normal, and the larger one across [1/kg].
    pub(crate) fn compliance(&self, contact: usize) -> [f64; 2] {
        let d = &self.diagonal[contact];
        [d[0][0], largest_eigenvalue(d)]
    }

    /// Solves each contact in turn with all others held; returns the largest change.
    pub(crate) fn sweep(&mut self, backwards: bool) -> f64 {
        let count = self.unknowns.len();
        let mut change = 0.0_f64;
        for k in 0..count {
            change = change.max(self.relax(if backwards { count - 1 - k } else { k }));
        }
        change
    }

    /// Blocks of a block row with their columns.
    pub(crate) fn row(&self, row: usize) -> impl Iterator<Item = (u32, Block3)> {
        let columns = &self.columns[self.start[row]..self.start[row + 1]];
        columns.iter().enumerate().map(move |(place, &column)| (column, self.block(row, place)))
    }

    /// Gap less its target and slip of a contact with all impulses as they are [m].
    pub(crate) fn gap_and_slip(&mut self, row: usize) -> Row {
        let range = self.start[row]..self.start[row + 1];
        let values = &self.values[9 * range.start..9 * range.end];
        let [n, t1, t2] = [0, 1, 2].map(|r| &values[3 * r * range.len()..3 * (r + 1) * range.len()]);
        let changes = self.changes.as_flattened();
        let d = if 3 * range.len() == changes.len() {
            changes
        } else {
            self.gathered.clear();
            self.gathered.extend(self.columns[range].iter().map(|&column| self.changes[column as usize]));
            self.gathered.as_flattened()
        };
        let w = self.unknowns[row].free;
        vectorized(
            #[inline(always)]
            || [w[0] + dot(n, d), w[1] + dot(t1, d), w[2] + dot(t2, d)],
        )
    }

    /// Adds a contact, whose impulse will start at `force`.
    pub(crate) fn push(&mut self, unknown: Unknown) {
        self.changes.push([0, 1, 2].map(|k| unknown.force[k] - unknown.before[k]));
        self.unknowns.push(unknown);
    }

    /// Forgets all contacts.
    pub(crate) fn clear(&mut self) {
        self.unknowns.clear();
        self.changes.clear();
    }

    /// The contacts.
    pub(crate) fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    /// Sets the impulse of a contact.
    pub(crate) fn set_force(&mut self, contact: usize, force: Row) {
        let unknown = &mut self.unknowns[contact];
        unknown.force = force;
        self.changes[contact] = [0, 1, 2].map(|k| force[k] - unknown.before[k]);
    }

    /// Solves one contact with all others held; returns by how much it moved.
    fn relax(&mut self, row: usize) -> f64 {
        let w = self.gap_and_slip(row);
        let Unknown { force: old, friction, scale, .. } = self.unknowns[row];
        let d = &self.diagonal[row];
        if d[0][0] <= 0.0 {
            return 0.0;
        }
        let force = local(d, old, w, friction);
        let moved = [0, 1, 2].map(|k| ((force[k] - old[k]) * d[k][k]).abs());
        self.set_force(row, force);
        moved.into_iter().fold(0.0, f64::max) / scale
    }
}

/// The impulse of one contact whose gap and slip are `w` at `old`.
fn local(d: &Block3, old: Row, w: Row, friction: Bound) -> Row {
    let normal = (old[0] - w[0] / d[0][0]).max(0.0);
    if !friction.exists(normal) {
        return [normal, 0.0, 0.0];
    }
    let dn = normal - old[0];
    let slip = [w[1] + d[1][0] * dn, w[2] + d[2][0] * dn];
    // Without any slip, if the cone allows.
    let determinant = d[1][1] * d[2][2] - d[1][2] * d[2][1];
    let stuck = [
        old[1] - (d[2][2] * slip[0] - d[1][2] * slip[1]) / determinant,
        old[2] - (d[1][1] * slip[1] - d[2][1] * slip[0]) / determinant,
    ];
    if length(stuck) <= friction.at_rest(normal) {
        return [normal, stuck[0], stuck[1]];
    }
    let step = 1.0 / largest_eigenvalue(d);
    let [x, y] = [old[1] - slip[0] * step, old[2] - slip[1] * step];
    let (size, most) = (length([x, y]), friction.sliding(normal));
    // Smaller than the cone of sliding: it is about to stick.
    let k = if size > most { most / size } else { 1.0 };
    [normal, x * k, y * k]
}

/// Scalar product, in eight sums side by side.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (mut left, mut right) = (a.chunks_exact(8), b.chunks_exact(8));
    for (a, b) in (&mut left).zip(&mut right) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    let rest: f64 = left.remainder().iter().zip(right.remainder()).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

/// Length of a vector across the normal.
pub(crate) fn length([x, y]: [f64; 2]) -> f64 {
    (x * x + y * y).sqrt()
}

/// Largest eigenvalue of the tangential 2x2 block.
fn largest_eigenvalue(d: &Block3) -> f64 {
    let (a, b, c) = (d[1][1], d[2][2], 0.5 * (d[1][2] + d[2][1]));
    0.5 * (a + b) + length([0.5 * (a - b), c])
}

/// How far an impulse is from answering gap and slip `w`, as lengths along the normal and across.
pub(crate) fn natural_residual(compliance: [f64; 2], force: Row, w: Row, friction: Bound) -> [f64; 2] {
    let [cn, ct] = compliance;
    if cn <= 0.0 {
        return [0.0; 2];
    }
    let normal = (force[0] - w[0] / cn).max(0.0);
    let across = if ct > 0.0 && friction.exists(f64::INFINITY) {
        let [x, y] = [force[1] - w[1] / ct, force[2] - w[2] / ct];
        let size = length([x, y]);
        let most = if size <= friction.at_rest(normal) { size } else { friction.sliding(normal).min(size) };
        let k = if size > most { most / size } else { 1.0 };
        length([x * k - force[1], y * k - force[2]]) * ct
    } else {
        0.0
    };
    [((normal - force[0]) * cn).abs(), across]
}

/// Union of two ascending lists.
fn merge(a: &[u32], b: &[u32], out: &mut Vec<u32>) {
    let (mut i, mut j) = (0, 0);
    while i < a.len() || j < b.len() {
        let next = match (a.get(i), b.get(j)) {
            (Some(&x), Some(&y)) => x.min(y),
            (Some(&x), None) | (None, Some(&x)) => x,
            (None, None) => break,
        };
        i += usize::from(a.get(i) == Some(&next));
        j += usize::from(b.get(j) == Some(&next));
        out.push(next);
    }
}

#[cfg(test)]
mod tests;
