//! What the last steps turned the segments by, beyond the prediction: the memory of a guess for whole steps, and the
//! scale of what a network adds to it.
//!
//! Of each step are kept the turns from the predicted to the final orientations, in the predicted frames. The newest are
//! continued by a polynomial, of order 2 from the third on. A network's outputs are added to that, in units of the
//! polynomial's last error (root mean square over the nodes), so that they are of order 1 at any time step and stiffness;
//! without a history, in units of s / l ([`crate::body_frame`]).

use component::Component;
use dynamics::snapshot::StateVisitor;
use kernels::dispatch::vectorized;
use kernels::math::Vec3;

use crate::{Channel, Graph, put};

/// Turns that are kept.
const DEPTH: usize = 4;
/// Least unit of what is added, in s / l.
const LEAST_UNIT: f64 = 1e-6;
/// Inputs a node: the continued turn over s / l; its last error and the last change, each over its own root mean square;
/// ln of these two over s / l, the same for all nodes of a rod; and how many turns are known.
pub const NODE_HISTORY: usize = 12;
/// Outputs a node: what is added to the turn, in its predicted frame.
pub const NODE_OUTPUT: usize = 3;

/// Kinds of the inputs.
pub const NODE_HISTORY_CHANNELS: [Channel; NODE_HISTORY] = {
    let ([a, b, c], s) = (Channel::AXIAL, Channel::Scalar);
    [a, b, c, a, b, c, a, b, c, s, s, s]
};
/// Kinds of the outputs.
pub const NODE_OUTPUT_CHANNELS: [Channel; NODE_OUTPUT] = Channel::AXIAL;

/// The turns of one graph's last steps. Calls allocate nothing.
#[derive(Clone, Debug)]
pub struct Turns {
    /// Turns in predicted frames [rad], the newest first.
    kept: [Vec<Vec3<f64>>; DEPTH],
    known: usize,
    /// Time step of those known [s].
    dt: f64,
    /// The polynomial's next value, its last error, and the last change [rad].
    continued: Vec<Vec3<f64>>,
    error: Vec<Vec3<f64>>,
    change: Vec<Vec3<f64>>,
    /// Root mean squares of the error and of the change [rad].
    sizes: [f64; 2],
}

/// Weights of the newest values in the next value of the polynomial through as many of them as there are.
fn weights(count: usize) -> [f64; 3] {
    match count {
        0 => [0.0; 3],
        1 => [1.0, 0.0, 0.0],
        2 => [2.0, -1.0, 0.0],
        _ => [3.0, -3.0, 1.0],
    }
}

impl Turns {
    /// Memory for a graph.
    pub fn new(graph: &Graph) -> Self {
        let zero = vec![Vec3::zero(); graph.nodes().len()];
        Self {
            kept: std::array::from_fn(|_| zero.clone()),
            known: 0,
            dt: 0.0,
            continued: zero.clone(),
            error: zero.clone(),
            change: zero,
            sizes: [0.0; 2],
        }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.known = 0;
    }

    /// Shows a visitor all that is known, for a guess that is asked to.
    pub fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        self.kept.iter_mut().for_each(|kept| visitor.list(kept, StateVisitor::vector));
        visitor.count(&mut self.known);
        visitor.number(&mut self.dt);
    }

    /// Continues the turns by a step of `dt` [s]. What is known of other time steps is forgotten.
    pub fn begin(&mut self, dt: f64) {
        if dt != self.dt {
            (self.known, self.dt) = (0, dt);
        }
        vectorized(
            #[inline(always)]
            || self.continue_all(),
        );
    }

    #[inline(always)]
    fn continue_all(&mut self) {
        let next = weights(self.known);
        let last = if self.known > 0 { weights(self.known - 1) } else { [0.0; 3] };
        let [newest, before] = [f64::from(u8::from(self.known > 0)), f64::from(u8::from(self.known > 1))];
        let mut sums = [0.0; 2];
        for i in 0..self.continued.len() {
            let [a, b, c, d] = [0, 1, 2, 3].map(|age: usize| self.kept[age][i]);
            self.continued[i] = a * next[0] + b * next[1] + c * next[2];
            self.error[i] = a * newest - b * last[0] - c * last[1] - d * last[2];
            self.change[i] = a * newest - b * before;
            sums[0] += self.error[i].norm_squared();
            sums[1] += self.change[i].norm_squared();
        }
        self.sizes = sums.map(|sum| (sum / self.continued.len().max(1) as f64).sqrt());
    }

    /// Unit of what is added to a node's turn [rad], for a right-hand side of the scale s [m].
    #[inline(always)]
    fn unit(&self, graph: &Graph, scale: f64, node: usize) -> f64 {
        let unit = scale / graph.nodes()[node].rod_scale[1];
        if self.known == 0 { unit } else { self.sizes[0].max(LEAST_UNIT * unit) }
    }

    /// Writes the inputs to each node's row, after the `before` numbers that stand there; `scale` is s [m].
    #[inline(always)]
    pub fn fill(&self, graph: &Graph, scale: f64, before: usize, nodes: &mut [f32]) {
        let over = |x: f64| if x > 0.0 { 1.0 / x } else { 0.0 };
        let [error_size, change_size] = self.sizes;
        let [by_error, by_change] = self.sizes.map(over);
        let logarithm = |size: f64| size.max(f64::MIN_POSITIVE).ln();
        let logarithms = self.sizes.map(logarithm);
        let mut by_unit = (f64::NAN, 0.0, 0.0);
        let is_known = [error_size > 0.0, change_size > 0.0];
        for (i, (row, node)) in nodes.chunks_exact_mut(before + NODE_HISTORY).zip(graph.nodes()).enumerate() {
            let unit = scale / node.rod_scale[1];
            // Rods have many nodes of one length.
            if unit != by_unit.0 {
                by_unit = (unit, over(unit), logarithm(unit));
            }
            let row = &mut row[before..];
            put(row, (self.continued[i] * by_unit.1).0);
            put(&mut row[3..], (self.error[i] * by_error).0);
            put(&mut row[6..], (self.change[i] * by_change).0);
            let size = |k: usize| if is_known[k] { (logarithms[k] - by_unit.2).clamp(-20.0, 20.0) } else { -20.0 };
            put(&mut row[9..], [size(0), size(1), self.known as f64]);
        }
    }

    /// The turn that a node's outputs stand for [rad], in its predicted frame.
    #[inline(always)]
    pub fn decode(&self, graph: &Graph, scale: f64, node: usize, outputs: &[f32]) -> Vec3<f64> {
        let added = Vec3([0, 1, 2].map(|k: usize| f64::from(outputs[k])));
        self.continued[node] + added * self.unit(graph, scale, node)
    }

    /// The outputs that stand for the turns of the component's step, just done; zero where a node is fixed. `[nodes, 3]`
    pub fn fill_targets(&self, graph: &Graph, component: &Component<f64>, scale: f64, targets: &mut [f32]) {
        for (i, row) in targets.chunks_exact_mut(NODE_OUTPUT).enumerate() {
            let unit = self.unit(graph, scale, i);
            let is_free = graph.nodes()[i].free[0] && unit > 0.0;
            let inverse = if is_free { 1.0 / unit } else { 0.0 };
            put(row, ((turned(component, i) - self.continued[i]) * inverse).0);
        }
    }

    /// Keeps the turns of the component's step, just done; where they are not finite, nothing is known any more.
    pub fn push(&mut self, component: &Component<f64>) {
        self.kept.rotate_right(1);
        let newest = &mut self.kept[0];
        vectorized(
            #[inline(always)]
            || {
                for (i, turn) in newest.iter_mut().enumerate() {
                    *turn = turned(component, i);
                }
            },
        );
        let sum: f64 = newest.iter().map(|turn| turn.norm_squared()).sum();
        self.known = if sum.is_finite() { (self.known + 1).min(DEPTH) } else { 0 };
    }
}

/// The turn from a body's predicted to its final orientation [rad], in its predicted frame.
#[inline(always)]
fn turned(component: &Component<f64>, body: usize) -> Vec3<f64> {
    let predicted = component.predicted[body].q;
    predicted.rotate_back(component.poses[body].q.turn_since(predicted))
}
