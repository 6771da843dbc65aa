//! Halves of an island, halves of these, and so on: contacts within one half share no connected set with those within the
//! other, so that both are swept side by side, and then those between them.
//!
//! Halves are the nodes of a binary tree, whose leaves hold connected sets. A contact belongs to the lowest node that holds
//! both its sets. Contacts are in the post-order of their nodes: a node's own come after those of all below it, and what its
//! subtree holds lies side by side. A sweep forwards goes level by level from the leaves to the root, one backwards the other
//! way. The tree depends on the contacts alone, never on the number of threads.

use std::ops::Range;

use kernels::math::Vec3;

use super::buckets;
use super::delassus::Delassus;

/// Contacts from which on there are two leaves, and to a leaf where there are more, at least: fewer are not worth a piece of work of
/// their own.
const LEAST: usize = 256;
/// Levels below the root, at most.
const DEEPEST: u32 = 6;

/// The tree of a contacts' problem. Nodes are numbered in post-order.
#[derive(Default)]
pub struct Partition {
    depth: u32,
    /// Where each node's own contacts begin, and the end.
    contacts: Vec<usize>,
    /// The same of `W dz`: of sets, which are all of leaves.
    moved: Vec<usize>,
    /// First set of each leaf, and their number.
    sets: Vec<usize>,
    /// Each node's leaves.
    leaves: Vec<Leaves>,
}

/// A connected set that contacts push: its number, its centre, how many they are, and its leaf.
#[derive(Clone, Copy, Debug)]
pub struct Pushed {
    /// Its number.
    pub component: u32,
    /// Its centre [m].
    pub centre: Vec3<f64>,
    /// How many contacts push it.
    pub contacts: usize,
    /// Its leaf.
    pub leaf: u32,
}

/// The leaves below a node: the first and the last.
pub type Leaves = [u32; 2];

/// The node that holds two others, by their leaves.
pub fn join(a: Leaves, b: Leaves) -> Leaves {
    [a[0].min(b[0]), a[1].max(b[1])]
}

impl Partition {
    /// One node that holds all.
    pub(crate) fn clear(&mut self) {
        self.depth = 0;
    }

    /// Deals sets out to leaves for so many contacts, and puts them in the order of leaves and numbers.
    pub fn deal(&mut self, contacts: usize, pushed: &mut [Pushed]) {
        let most = pushed.len().max(1).ilog2().min(DEEPEST);
        self.depth = if contacts < LEAST { 0 } else { (contacts / LEAST).ilog2().max(1).min(most) };
        halve(pushed, 0, self.depth);
        pushed.sort_unstable_by_key(|set| (set.leaf, set.component));
        self.sets.clear();
        self.sets.extend((0..=1 << self.depth).map(|leaf| pushed.partition_point(|set| set.leaf < leaf)));
    }

    /// Puts contacts in the order of their nodes, where they were in another: `order[k]` is the k-th one's place there, and
    /// `leaves` has their nodes.
    pub fn sort(&mut self, leaves: &[Leaves], order: &mut Vec<u32>) {
        let depth = self.depth;
        let items = (0..).zip(leaves).map(|(k, &leaves)| (node(leaves, depth), k));
        buckets::sort(items, count(depth), &mut self.contacts, order);
    }

    /// Takes over the operator of so many contacts, in the order that it found.
    pub(crate) fn close(&mut self, operator: &Delassus, contacts: usize) {
        self.moved.clear();
        self.leaves.clear();
        if self.depth == 0 {
            self.contacts.clear();
            self.contacts.extend([0, contacts]);
            self.moved.extend([0, operator.moved_len()]);
            return;
        }
        for leaf in 0..1_u32 << self.depth {
            self.moved.push(operator.moved_from(self.sets[leaf as usize]));
            let above = (leaf + 1).trailing_zeros().min(self.depth);
            let end = operator.moved_from(self.sets[leaf as usize + 1]);
            self.moved.extend((0..above).map(|_| end));
            self.leaves.extend((0..=above).map(|level| [leaf + 1 - (1 << level), leaf]));
        }
        self.moved.push(operator.moved_len());
    }

    /// Levels below the root; leaves are level 0.
    pub fn depth(&self) -> u32 {
        self.depth
    }

    /// How many nodes there are.
    pub(crate) fn nodes(&self) -> usize {
        count(self.depth)
    }

    /// How many nodes a level has.
    pub(crate) fn on_level(&self, level: u32) -> u16 {
        1 << (self.depth - level)
    }

    /// The nodes of the subtree of the `index`-th node of a level; the last one is that node.
    #[inline(always)]
    pub(crate) fn subtree(&self, level: u32, index: usize) -> Range<usize> {
        let first = (index as u32) << level;
        let node = node([first, first + (1 << level) - 1], self.depth);
        node + 1 - count(level)..node + 1
    }

    /// The node with these leaves.
    pub(crate) fn node(&self, leaves: Leaves) -> usize {
        node(leaves, self.depth)
    }

    /// The leaves of the node that a contact belongs to.
    pub(crate) fn leaves_of(&self, contact: usize) -> Leaves {
        if self.depth == 0 { [0; 2] } else { self.leaves[self.contacts.partition_point(|&first| first <= contact) - 1] }
    }

    /// A node's own contacts.
    #[inline(always)]
    pub(crate) fn own(&self, node: usize) -> Range<usize> {
        self.contacts[node]..self.contacts[node + 1]
    }

    /// Where each node's own contacts begin, and the end.
    pub(crate) fn contact_cuts(&self) -> &[usize] {
        &self.contacts
    }

    /// The same of `W dz`.
    pub(crate) fn moved_cuts(&self) -> &[usize] {
        &self.moved
    }
}

/// Nodes of a tree with so many levels below its root.
#[inline(always)]
fn count(depth: u32) -> usize {
    (2 << depth) - 1
}

/// The lowest node that holds two leaves.
#[inline(always)]
fn node([first, last]: Leaves, depth: u32) -> usize {
    let level = 32 - (first ^ last).leading_zeros();
    let first = first >> level << level;
    // Nodes all of whose leaves come before it, then those of its own subtree.
    let before: usize = (0..=depth).map(|level| (first >> level) as usize).sum();
    before + count(level) - 1
}

/// Halves sets along the longest extent of their centres, `depth` times, and numbers the leaves from `first` on.
fn halve(sets: &mut [Pushed], first: u32, depth: u32) {
    if depth == 0 {
        sets.iter_mut().for_each(|set| set.leaf = first);
        return;
    }
    let (mut least, mut most) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for set in &*sets {
        for (k, &x) in set.centre.0.iter().enumerate() {
            least[k] = least[k].min(x);
            most[k] = most[k].max(x);
        }
    }
    let extent = |k: usize| most[k] - least[k];
    let along = (1..3).fold(0, |best, k| if extent(k) > extent(best) { k } else { best });
    let place = |set: &Pushed| (set.centre.0[along], set.component);
    sets.sort_unstable_by(|a, b| {
        let ((a, one), (b, other)) = (place(a), place(b));
        a.total_cmp(&b).then(one.cmp(&other))
    });
    let half = sets.iter().map(|set| set.contacts).sum::<usize>() / 2;
    let mut so_far = 0;
    let middle = sets.iter().position(|set| {
        so_far += set.contacts;
        so_far > half
    });
    let (left, right) = sets.split_at_mut(middle.unwrap_or(0));
    halve(left, first, depth - 1);
    halve(right, first + (1 << (depth - 1)), depth - 1);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_are_in_post_order() {
        // Leaves 0 to 3 of a tree with two levels below its root: 0 1 (2) 3 4 (5) (6).
        let nodes = [[0, 0], [1, 1], [0, 1], [2, 2], [3, 3], [2, 3], [0, 3]].map(|leaves| node(leaves, 2));
        assert_eq!(nodes, [0, 1, 2, 3, 4, 5, 6]);
        assert_eq!(node([1, 2], 2), 6);
        let partition = Partition { depth: 2, ..Partition::default() };
        assert_eq!((partition.nodes(), partition.on_level(0), partition.on_level(2)), (7, 4, 1));
        assert_eq!([(0, 3), (1, 0), (1, 1), (2, 0)].map(|(l, k)| partition.subtree(l, k)), [4..5, 0..3, 3..6, 0..7]);
    }

    #[test]
    fn halves_are_as_heavy_as_each_other_and_lie_apart() {
        let set = |component: u32| Pushed {
            component,
            centre: Vec3([0.1 * f64::from(component % 4), f64::from(component / 4), 0.0]),
            contacts: LEAST / 2,
            leaf: 0,
        };
        let mut sets: Vec<Pushed> = (0..16).map(set).collect();
        let mut partition = Partition::default();
        partition.deal(8 * LEAST, &mut sets);
        assert_eq!(partition.depth(), 3);
        for (k, set) in sets.iter().enumerate() {
            assert_eq!((set.leaf, set.component / 2), (k as u32 / 2, k as u32 / 2), "neighbours share a leaf");
        }
        let leaves = [[7, 7], [0, 3], [0, 0], [0, 7], [0, 0]];
        let mut order = Vec::new();
        partition.sort(&leaves, &mut order);
        assert_eq!(order, [2, 4, 1, 0, 3]);
        let own: Vec<usize> = (0..partition.nodes()).map(|node| partition.own(node).len()).collect();
        assert_eq!(own, [2, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 1]);
    }
}
