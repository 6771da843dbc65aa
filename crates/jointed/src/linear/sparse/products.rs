//! Products `B^T A^-1 B` of columns with few entries each, by the forward half of the solves alone.
//!
//! With `A = L L^T` they are `Y^T Y`, where `Y = L^-1 B`. A column fills Y from its own block rows up the elimination tree to the root and
//! nowhere else (Liu 1990, "The role of elimination trees in sparse factorization"), so that a supernode holds rows of Y for the columns
//! that come through it and for no others. Columns come in groups of three.

use faer::sparse::linalg::cholesky::SymbolicCholeskyRaw;
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;

use super::{B, C, Entries, SparseCholesky};
use kernels::dispatch::vectorized;

/// What comes through a supernode.
#[derive(Clone, Debug, Default)]
struct Node {
    /// Its first row and the first one after it, in the order of elimination.
    rows: [usize; 2],
    /// The supernode above it; itself at a root.
    parent: usize,
    /// Groups whose columns come through it, ascending.
    groups: Vec<u32>,
    /// Its rows of Y, one after the other.
    y: Vec<f64>,
}

impl Node {
    /// Numbers of a row of Y.
    fn width(&self) -> usize {
        C * self.groups.len()
    }
}

/// The products, with the memory to find them.
#[derive(Clone, Debug, Default)]
pub struct Products {
    nodes: Vec<Node>,
    /// Supernode of each block row, in the order of elimination.
    node_of: Vec<u32>,
    /// Place of each block row in the order of elimination.
    place_of: Vec<u32>,
    /// The last group that has come through each supernode.
    last: Vec<u32>,
    /// Rows of the products that are found together, or what rows of Y take from one above them.
    row: Vec<f64>,
    /// Where the groups of one supernode are among those of another.
    seats: Vec<usize>,
    /// Lower triangle, row by row.
    values: Vec<f64>,
}

impl Products {
    /// Memory for columns of a matrix with this factor.
    pub(crate) fn new(cholesky: &SparseCholesky) -> Self {
        let SymbolicCholeskyRaw::Supernodal(symbolic) = cholesky.symbolic.raw() else { return Self::default() };
        let bounds = symbolic.supernode_begin().iter().zip(symbolic.supernode_end());
        let mut nodes: Vec<Node> =
            bounds.map(|(&first, &end)| Node { rows: [first as usize, end as usize], ..Node::default() }).collect();
        let blocks = |node: (u32, &Node)| vec![node.0; (node.1.rows[1] - node.1.rows[0]) / B];
        let node_of: Vec<u32> = (0..).zip(&nodes).flat_map(blocks).collect();
        for (k, node) in nodes.iter_mut().enumerate() {
            node.parent = symbolic.supernode(k).pattern().first().map_or(k, |&row| node_of[row as usize / B] as usize);
        }
        let mut place_of = vec![0; cholesky.order.len()];
        (0..).zip(&cholesky.order).for_each(|(place, &block)| place_of[block as usize] = place);
        Self { last: vec![u32::MAX; nodes.len()], nodes, node_of, place_of, ..Self::default() }
    }

    /// Finds the products of `groups` groups of columns, whose `entries` come group by group, ascending, with the factor made
    /// last; without one they are not numbers.
    pub(crate) fn find(&mut self, cholesky: &SparseCholesky, groups: usize, entries: &[Entries]) {
        self.values.clear();
        self.values.resize(start(groups, 0), 0.0);
        let SymbolicCholeskyRaw::Supernodal(symbolic) = cholesky.symbolic.raw() else { return };
        self.begin(entries);
        for k in 0..self.nodes.len() {
            if self.nodes[k].groups.is_empty() {
                continue;
            }
            vectorized(
                #[inline(always)]
                || {
                    self.solve(k, symbolic, &cholesky.factor);
                    self.multiply(k, groups);
                },
            );
        }
    }

    /// The product of two groups: rows by the columns of `group`, of which `other` must be no later one.
    pub(crate) fn block(&self, group: usize, other: usize) -> [[f64; C]; C] {
        [0, 1, 2].map(|r| {
            let first = start(group, r) + C * other;
            [0, 1, 2].map(|c| self.values[first + c])
        })
    }

    /// Finds what comes through which supernode, and puts the entries there.
    fn begin(&mut self, entries: &[Entries]) {
        let Self { nodes, node_of, place_of, last, .. } = self;
        nodes.iter_mut().for_each(|node| node.groups.clear());
        last.fill(u32::MAX);
        for &Entries { group, block, .. } in entries {
            let mut k = node_of[place_of[block as usize] as usize] as usize;
            while last[k] != group {
                last[k] = group;
                nodes[k].groups.push(group);
                k = nodes[k].parent;
            }
        }
        for node in nodes.iter_mut() {
            let size = (node.rows[1] - node.rows[0]) * node.width();
            node.y.clear();
            node.y.resize(size, 0.0);
        }
        for Entries { group, block, columns } in entries {
            let place = place_of[*block as usize] as usize;
            let node = &mut nodes[node_of[place] as usize];
            let width = node.width();
            let first = (B * place - node.rows[0]) * width + C * node.groups.partition_point(|own| own < group);
            for (c, column) in columns.iter().enumerate() {
                for (r, x) in column.iter().enumerate() {
                    node.y[first + r * width + c] += x;
                }
            }
        }
    }

    /// Solves for the rows of Y of a supernode, and takes what they do to those above it from these.
    #[inline(always)]
    fn solve(&mut self, k: usize, symbolic: &SymbolicSupernodalCholesky<u32>, factor: &[f64]) {
        let Self { nodes, node_of, row, seats, .. } = self;
        let (below, above) = nodes.split_at_mut(k + 1);
        let node = &mut below[k];
        let (size, width) = (node.rows[1] - node.rows[0], node.width());
        let pattern = symbolic.supernode(k).pattern();
        let height = size + pattern.len();
        let l = &factor[symbolic.col_ptr_for_val()[k] as usize..];
        for i in 0..size {
            let (before, own) = node.y.split_at_mut(i * width);
            let own = &mut own[..width];
            for (j, rows) in before.chunks_exact(B * width).enumerate() {
                subtract(own, [0, 1, 2, 3, 4, 5].map(|c| l[(B * j + c) * height + i]), rows, width);
            }
            for j in i / B * B..i {
                let x = l[j * height + i];
                own.iter_mut().zip(&before[j * width..]).for_each(|(own, y)| *own -= x * y);
            }
            let inverse = 1.0 / l[i * height + i];
            own.iter_mut().for_each(|own| *own *= inverse);
        }
        row.resize(width, 0.0);
        let mut at = usize::MAX;
        for (i, &target_row) in (size..).zip(pattern) {
            let target = node_of[target_row as usize / B] as usize;
            let other = &mut above[target - k - 1];
            if target != at {
                at = target;
                seats.clear();
                seats.extend(node.groups.iter().map(|group| other.groups.partition_point(|own| own < group)));
            }
            row.fill(0.0);
            for (j, rows) in node.y.chunks_exact(B * width).enumerate() {
                subtract(row, [0, 1, 2, 3, 4, 5].map(|c| l[(B * j + c) * height + i]), rows, width);
            }
            let other_width = other.width();
            let out = &mut other.y[(target_row as usize - other.rows[0]) * other_width..][..other_width];
            for (&seat, x) in seats.iter().zip(row.chunks_exact(C)) {
                out[C * seat..C * seat + C].iter_mut().zip(x).for_each(|(out, x)| *out += x);
            }
        }
    }

    /// Adds the products of a supernode's rows of Y.
    #[inline(always)]
    fn multiply(&mut self, k: usize, groups: usize) {
        let Self { nodes, row, values, .. } = self;
        let (Node { groups: own, y, .. }, width) = (&nodes[k], nodes[k].width());
        for i in 0..width {
            let length = (i / C + 1) * C;
            row.clear();
            row.resize(length, 0.0);
            for rows in y.chunks_exact(B * width) {
                subtract(row, [0, 1, 2, 3, 4, 5].map(|r| -rows[r * width + i]), rows, width);
            }
            let out = &mut values[start(own[i / C] as usize, i % C)..];
            // Where all groups come through, as at a root.
            if own.len() == groups {
                out.iter_mut().zip(&*row).for_each(|(out, x)| *out += x);
                continue;
            }
            for (&group, x) in own.iter().zip(row.chunks_exact(C)) {
                let first = C * group as usize;
                out[first..first + C].iter_mut().zip(x).for_each(|(out, x)| *out += x);
            }
        }
    }
}

/// Where a row of the lower triangle begins, by its group and its place there: with all columns up to those of its own group.
fn start(group: usize, row: usize) -> usize {
    C * C * group * (group + 1) / 2 + C * (group + 1) * row
}

/// Subtracts the first numbers of six rows, `width` numbers each, times a number each.
#[inline(always)]
fn subtract(from: &mut [f64], by: [f64; B], rows: &[f64], width: usize) {
    let length = from.len();
    let [a, b, c, d, e, f] = [0, 1, 2, 3, 4, 5].map(|r| &rows[r * width..r * width + length]);
    for (k, from) in from.iter_mut().enumerate() {
        *from -= (by[0] * a[k] + by[1] * b[k]) + (by[2] * c[k] + by[3] * d[k]) + (by[4] * e[k] + by[5] * f[k]);
    }
}

#[cfg(test)]
mod tests;
