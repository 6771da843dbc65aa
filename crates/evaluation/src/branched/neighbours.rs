//! The nearest of many answers as a start.

use equilibria::Cut;
use equilibria::branched::canonical::{CanonicalStar, INPUTS, StarCanonical};
use equilibria::branched::start::Begin;
use equilibria::branched::{BranchedQuery, Star};
use equilibria::known::Known;
use equilibria::start::Starts;
use knn::tree::{Nearest, Tree};
use nalgebra::UnitQuaternion;

/// Answers in the canonical frame, of which the nearest is taken.
pub struct StarNeighbours {
    numbers: Vec<[f32; INPUTS]>,
    known: Vec<CanonicalStar>,
    tree: Option<Tree<INPUTS>>,
}

impl StarNeighbours {
    /// Of queries and what is known of them; with a k-d tree, or searched through one by one, which does not mind the signs of
    /// quaternions.
    pub fn new(all: &[(BranchedQuery, Known<Star>)], with_tree: bool) -> Self {
        let (mut numbers, mut known) = (Vec::new(), Vec::new());
        for (query, own) in all {
            let canonical = StarCanonical::new(&Star::new(query));
            known.push(canonical.known(own));
            numbers.push(canonical.inputs(0));
        }
        let tree = with_tree.then(|| Tree::new(&numbers));
        Self { numbers, known, tree }
    }

    fn nearest(&self, numbers: &[f32; INPUTS]) -> usize {
        if let Some(tree) = &self.tree {
            let mut found = Nearest::new();
            tree.nearest(numbers, 1, &mut found);
            return found[0].1 as usize;
        }
        let mut best = (f32::INFINITY, 0);
        for (k, own) in self.numbers.iter().enumerate() {
            let own = StarCanonical::distance(numbers, own);
            if own < best.0 {
                best = (own, k);
            }
        }
        best.1
    }
}

impl Starts<Star> for StarNeighbours {
    fn count(&self) -> usize {
        1
    }

    fn fill(&self, _: usize, star: &Star, cut: &Cut, turns: &mut [UnitQuaternion<f64>], begins: &mut [Begin]) -> usize {
        let canonical = StarCanonical::new(star);
        let known = &self.known[self.nearest(&canonical.inputs(0))];
        begins[0] = canonical.begin(known, cut, turns);
        1
    }
}
