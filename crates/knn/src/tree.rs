//! Exact nearest neighbours: a k-d tree that splits where the points are spread widest.
//!
//! Most of the 19 inputs of a rod hardly vary, so that a tree which takes the dimensions in turn wastes its splits.

/// Points in a leaf.
const LEAF: usize = 16;

/// Points and the splits between them.
#[derive(Clone, Debug)]
pub struct Tree<const D: usize> {
    /// In the order of the leaves.
    points: Vec<[f32; D]>,
    /// Which point each was.
    ids: Vec<u32>,
    nodes: Vec<Node>,
}

#[derive(Clone, Copy, Debug)]
enum Node {
    /// Points of a leaf.
    Leaf { start: u32, end: u32 },
    /// The first half, whose values in `axis` are at most `value`, comes next in the list; the other half is at `right`.
    Split { axis: u32, value: f32, right: u32 },
}

/// The nearest points found so far: squared distance and which point, the nearest first.
pub type Nearest = Vec<(f32, u32)>;

impl<const D: usize> Tree<D> {
    /// A tree of these points.
    pub fn new(points: &[[f32; D]]) -> Self {
        let mut ids: Vec<u32> = (0..points.len() as u32).collect();
        let mut nodes = Vec::new();
        split(points, &mut ids, 0, &mut nodes);
        Self { points: ids.iter().map(|&i| points[i as usize]).collect(), ids, nodes }
    }

    /// Puts the `k` points nearest to `query` into `nearest`, fewer where there are fewer.
    pub fn nearest(&self, query: &[f32; D], k: usize, nearest: &mut Nearest) {
        nearest.clear();
        self.search(0, query, k, 0.0, &mut [0.0; D], nearest);
    }

    /// Searches a node whose box is at least `distance` (squared) away, by `apart` in each dimension.
    fn search(
        &self,
        node: u32,
        query: &[f32; D],
        k: usize,
        distance: f32,
        apart: &mut [f32; D],
        nearest: &mut Nearest,
    ) {
        match self.nodes[node as usize] {
            Node::Leaf { start, end } => {
                let range = start as usize..end as usize;
                for (point, &id) in self.points[range.clone()].iter().zip(&self.ids[range]) {
                    insert(nearest, k, squared_distance(point, query), id);
                }
            }
            Node::Split { axis, value, right } => {
                let axis = axis as usize;
                let offset = query[axis] - value;
                let (near, far) = if offset <= 0.0 { (node + 1, right) } else { (right, node + 1) };
                self.search(near, query, k, distance, apart, nearest);
                let before = apart[axis];
                let beyond = distance - before * before + offset * offset;
                // Rounding must not hide a point: a little nearer than computed.
                if nearest.len() < k || nearest.last().is_some_and(|&(worst, _)| beyond * (1.0 - 1e-5) <= worst) {
                    apart[axis] = offset;
                    self.search(far, query, k, beyond, apart, nearest);
                    apart[axis] = before;
                }
            }
        }
    }
}

fn squared_distance<const D: usize>(a: &[f32; D], b: &[f32; D]) -> f32 {
    let mut sum = 0.0;
    for k in 0..D {
        sum += (a[k] - b[k]) * (a[k] - b[k]);
    }
    sum
}

/// Keeps a point if it is among the `k` nearest; of equally near ones that of the lowest number.
fn insert(nearest: &mut Nearest, k: usize, distance: f32, id: u32) {
    let is_before = |&(other, other_id): &(f32, u32)| (other, other_id) < (distance, id);
    let place = nearest.iter().rposition(is_before).map_or(0, |i| i + 1);
    if place < k {
        nearest.truncate(k - 1);
        nearest.insert(place, (distance, id));
    }
}

fn split<const D: usize>(points: &[[f32; D]], ids: &mut [u32], start: usize, nodes: &mut Vec<Node>) {
    let (axis, spread) = widest(points, ids);
    if ids.len() <= LEAF || spread <= 0.0 {
        nodes.push(Node::Leaf { start: start as u32, end: (start + ids.len()) as u32 });
        return;
    }
    let middle = ids.len() / 2;
    let by_axis = |&i: &u32, &j: &u32| points[i as usize][axis].total_cmp(&points[j as usize][axis]);
    let value = {
        let (_, &mut median, _) = ids.select_nth_unstable_by(middle - 1, by_axis);
        points[median as usize][axis]
    };
    let own = nodes.len();
    nodes.push(Node::Split { axis: axis as u32, value, right: 0 });
    let (low, high) = ids.split_at_mut(middle);
    split(points, low, start, nodes);
    let right = nodes.len() as u32;
    nodes[own] = Node::Split { axis: axis as u32, value, right };
    split(points, high, start + middle, nodes);
}

/// The dimension in which points are spread widest, and by how much.
fn widest<const D: usize>(points: &[[f32; D]], ids: &[u32]) -> (usize, f32) {
    let (mut low, mut high) = ([f32::INFINITY; D], [f32::NEG_INFINITY; D]);
    for &i in ids {
        for (k, &x) in points[i as usize].iter().enumerate() {
            low[k] = low[k].min(x);
            high[k] = high[k].max(x);
        }
    }
    let spread = |k: &usize| high[*k] - low[*k];
    let axis = (0..D).max_by(|a, b| spread(a).total_cmp(&spread(b))).unwrap_or(0);
    (axis, spread(&axis))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in [-1, 1) that look random.
    fn noise(state: &mut u64) -> f32 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 40) as f32 / (1_u64 << 23) as f32 - 1.0
    }

    #[test]
    fn the_nearest_are_those_of_a_search_through_all_points() {
        let mut state = 1;
        // Dimensions of very different spread, one without any, and points that coincide.
        let scales = [1.0, 0.1, 0.0, 3.0, 0.01];
        let mut points: Vec<[f32; 5]> = (0..2000).map(|_| scales.map(|s| s * noise(&mut state))).collect();
        points.extend_from_within(..100);
        let tree = Tree::new(&points);
        let mut found = Nearest::new();
        for _ in 0..300 {
            let query = scales.map(|s| 1.2 * s * noise(&mut state));
            for k in [1, 3, 20] {
                tree.nearest(&query, k, &mut found);
                let mut all: Nearest =
                    points.iter().enumerate().map(|(i, p)| (squared_distance(p, &query), i as u32)).collect();
                all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                assert_eq!(found, all[..k]);
            }
        }
    }

    #[test]
    fn few_points_and_equal_points_are_fine() {
        let mut found = Nearest::new();
        Tree::<2>::new(&[]).nearest(&[0.0; 2], 3, &mut found);
        assert!(found.is_empty());
        Tree::new(&[[1.0, 0.0]]).nearest(&[0.0; 2], 3, &mut found);
        assert_eq!(found, [(1.0, 0)]);
        Tree::new(&[[1.0, 0.0]; 1000]).nearest(&[0.0; 2], 3, &mut found);
        assert_eq!(found, [(1.0, 0), (1.0, 1), (1.0, 2)]);
    }
}
