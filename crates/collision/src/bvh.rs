//! A bounding volume hierarchy over boxes that stand still, asked for those that overlap another box.
//!
//! Nodes lie in the order of a walk through the tree that goes down first, each with the place where the walk goes on if
//! nothing below it matters: a walk needs no stack (Smits 1998, "Efficiency Issues for Ray Tracing").

use nalgebra::Vector3;

use crate::shape::Aabb;

/// Boxes below which a node is not divided.
const LEAF: usize = 4;

#[derive(Clone, Debug)]
struct Node {
    bounds: Aabb,
    /// The node after all that are below this one.
    next: u32,
    /// Where its boxes begin, and how many they are; none in a node that is divided.
    first: u32,
    count: u32,
}

/// The hierarchy.
#[derive(Clone, Debug, Default)]
pub struct Bvh {
    nodes: Vec<Node>,
    /// Indices of the boxes, by leaf.
    items: Vec<u32>,
    /// The boxes, in the order of `items`.
    boxes: Vec<Aabb>,
}

impl Bvh {
    /// The hierarchy over fewer than 2^32 finite boxes, divided at the median along the axis on which their centres are spread most.
    pub fn new(boxes: &[Aabb]) -> Self {
        let mut own = Self { items: (0..boxes.len() as u32).collect(), ..Self::default() };
        if !boxes.is_empty() {
            own.divide(boxes, 0, boxes.len());
            own.boxes.extend(own.items.iter().map(|&i| boxes[i as usize]));
        }
        own
    }

    fn divide(&mut self, boxes: &[Aabb], first: usize, end: usize) {
        let centre = |i: u32| boxes[i as usize].min + boxes[i as usize].max;
        let items = &mut self.items[first..end];
        let bounds = items.iter().map(|&i| boxes[i as usize]).reduce(|a, b| a.union(&b));
        let Some(bounds) = bounds else { return };
        let place = self.nodes.len();
        let is_leaf = end - first <= LEAF;
        let count = if is_leaf { end - first } else { 0 };
        self.nodes.push(Node { bounds, next: 0, first: first as u32, count: count as u32 });
        if !is_leaf {
            let infinite = Vector3::repeat(f64::INFINITY);
            let (low, high) = items
                .iter()
                .map(|&i| centre(i))
                .fold((infinite, -infinite), |(low, high), place| (low.inf(&place), high.sup(&place)));
            let axis = (high - low).imax();
            let half = (end - first) / 2;
            items.select_nth_unstable_by(half, |&a, &b| centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.cmp(&b)));
            self.divide(boxes, first, first + half);
            self.divide(boxes, first + half, end);
        }
        self.nodes[place].next = self.nodes.len() as u32;
    }

    /// The box around all boxes; `None` where there is none.
    pub fn bounds(&self) -> Option<&Aabb> {
        self.nodes.first().map(|node| &node.bounds)
    }

    /// The least of the distances of what the boxes hold from a place, `distance` for the index of a box; infinite where there is
    /// none. A box that is further off than the least so far is not looked into.
    pub fn nearest(&self, place: &Vector3<f64>, mut distance: impl FnMut(u32) -> f64) -> f64 {
        let mut least = f64::INFINITY;
        if !self.nodes.is_empty() {
            self.search(0, place, &mut least, &mut distance);
        }
        least
    }

    fn search(&self, at: usize, place: &Vector3<f64>, least: &mut f64, distance: &mut impl FnMut(u32) -> f64) {
        let node = &self.nodes[at];
        if node.count > 0 {
            for &item in &self.items[node.first as usize..(node.first + node.count) as usize] {
                *least = least.min(distance(item));
            }
            return;
        }
        let off = |at: usize| {
            let Aabb { min, max } = &self.nodes[at].bounds;
            (min - place).sup(&(place - max)).sup(&Vector3::zeros()).norm()
        };
        let halves = [at + 1, self.nodes[at + 1].next as usize];
        let mut halves = halves.map(|half| (off(half), half));
        halves.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (off, half) in halves {
            if off < *least {
                self.search(half, place, least, distance);
            }
        }
    }

    /// Visits the indices of all boxes that overlap `room`, in an order that depends on the hierarchy alone.
    #[inline]
    pub fn overlaps(&self, room: &Aabb, mut visit: impl FnMut(u32)) {
        let mut place = 0;
        while let Some(node) = self.nodes.get(place) {
            if !node.bounds.overlaps(room) {
                place = node.next as usize;
                continue;
            }
            let range = node.first as usize..(node.first + node.count) as usize;
            for (aabb, &item) in self.boxes[range.clone()].iter().zip(&self.items[range]) {
                if aabb.overlaps(room) {
                    visit(item);
                }
            }
            place += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_finds_what_looking_at_all_boxes_finds() {
        let mut seed = 1_u64;
        let mut number = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut aabb = |size: f64| {
            let min = Vector3::new(number(), number(), number());
            Aabb { min, max: min + Vector3::new(number(), number(), number()) * size }
        };
        for count in [0, 1, 3, 4, 5, 700] {
            let boxes: Vec<Aabb> = (0..count).map(|_| aabb(0.1)).collect();
            let tree = Bvh::new(&boxes);
            assert_eq!(tree.bounds().is_some(), count > 0);
            for _ in 0..50 {
                let room = aabb(0.3);
                let mut found = Vec::new();
                tree.overlaps(&room, |i| found.push(i));
                found.sort_unstable();
                let all: Vec<u32> = (0..count).filter(|&i| boxes[i as usize].overlaps(&room)).collect();
                assert_eq!(found, all);
                let off = |aabb: &Aabb| (aabb.min - room.min).norm();
                let least = boxes.iter().map(off).fold(f64::INFINITY, f64::min);
                assert_eq!(tree.nearest(&room.min, |i| off(&boxes[i as usize])), least);
            }
        }
    }
}
