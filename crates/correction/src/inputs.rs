//! What a network reads of a frame: the guess and its last motion in the frame of the grips.
//!
//! The frame of the grips lies between their inner markers; its x axis is the horizontal direction from the first to the
//! second, its z axis is up. What is read in it is the same in every place and heading about gravity.

use nalgebra::{Matrix3, Vector3};
use names::names;
use serde::{Deserialize, Serialize};

use crate::film::Film;

/// How a network reads a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Kind {
    /// COPINGNet's graph network on the chain of markers.
    Graph,
    /// A perceptron that reads all markers at once.
    Perceptron,
    /// A recurrent network, which reads of each frame what the perceptron does, and remembers the frames before.
    Recurrent,
}

names!(Kind {
    Graph = "graph",
    Perceptron = "perceptron",
    Recurrent = "recurrent",
});

/// Of so many frames one is looked at in an epoch of training, in the next epoch the next one. A recurrent network goes from one
/// frame to that so many later, in training and in use.
pub(crate) const STRIDE: usize = 5;

impl Kind {
    /// Every so many frames from `first` on, of `count`, as they go through a network: each by itself, or all in a row.
    pub(crate) fn rows(self, first: usize, count: usize) -> Vec<Vec<usize>> {
        let frames = (first..count).step_by(STRIDE);
        match self {
            Self::Recurrent if first < count => vec![frames.collect()],
            _ => frames.map(|frame| vec![frame]).collect(),
        }
    }
}

/// Frames over which displacements are read.
const LAGS: [usize; 5] = [2, 5, 10, 20, 40];
/// Numbers of a marker: position, displacements, position in the first frame.
const OF_MARKER: usize = 3 * (2 + LAGS.len());
/// Numbers of a frame: inner markers and directions of the grips, time.
const OF_FRAME: usize = 14;
/// Numbers of a place along the cable.
const OF_PLACE: usize = 3;
/// A correction grows from zero as time passes [s].
const RISE: f64 = 0.1;
/// Times that a network can tell apart [s].
const TIMES: [f64; 2] = [0.3, 2.0];

/// Inputs of one frame, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Inputs {
    /// Of nodes: markers of a graph, or all at once.
    pub nodes: Vec<f32>,
    /// Of edges: from each marker to the next; none of a perceptron.
    pub edges: Vec<f32>,
    /// Axes of the grips' frame as rows.
    pub axes: Matrix3<f64>,
    /// How much of a correction counts.
    pub share: f64,
}

/// Rows and columns of nodes and edges for so many markers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sizes {
    /// Nodes.
    pub nodes: usize,
    /// Numbers of a node.
    pub node: usize,
    /// Numbers of an edge.
    pub edge: usize,
}

impl Sizes {
    /// For so many markers.
    pub fn of(kind: Kind, markers: usize) -> Self {
        match kind {
            Kind::Graph => Self { nodes: markers, node: OF_MARKER + OF_FRAME + OF_PLACE, edge: 3 },
            // There are no edges to read.
            Kind::Perceptron | Kind::Recurrent => Self { nodes: 1, node: markers * OF_MARKER + OF_FRAME, edge: 1 },
        }
    }
}

/// Horizontal direction from one point to another; x where there is none.
fn heading(way: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(way.x, way.y, 0.0).try_normalize(1e-6).unwrap_or_else(Vector3::x)
}

impl Inputs {
    /// Of a frame of a film.
    pub fn of(kind: Kind, film: &Film, frame: usize) -> Self {
        let [[start, _], [end, _]] = film.markers.grips;
        let axes_at = |frame: usize| {
            let x = heading(&(film.guess[frame][end] - film.guess[frame][start]));
            Matrix3::from_rows(&[x.transpose(), Vector3::z().cross(&x).transpose(), Vector3::z().transpose()])
        };
        let middle = |frame: usize| (film.guess[frame][start] + film.guess[frame][end]) * 0.5;
        let (now, axes, axes_0) = (&film.guess[frame], axes_at(frame), axes_at(0));
        let first = &film.guess[0];
        let length: f64 = first[..film.markers.parent].windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
        let push = |to: &mut Vec<f32>, x: Vector3<f64>| to.extend(x.iter().map(|x| *x as f32));
        let mut common = Vec::with_capacity(OF_FRAME);
        for [inner, outer] in film.markers.grips {
            push(&mut common, axes * (now[inner] - middle(frame)) / length);
            push(&mut common, axes * (now[outer] - now[inner]).try_normalize(1e-9).unwrap_or_else(Vector3::zeros));
        }
        let time = film.time[frame];
        common.extend(TIMES.map(|rise| (1.0 - (-time / rise).exp()) as f32));
        let of_marker = |to: &mut Vec<f32>, k: usize| {
            push(to, axes * (now[k] - middle(frame)) / length);
            for lag in LAGS {
                push(to, axes * (now[k] - film.guess[frame.saturating_sub(lag)][k]) / length);
            }
            push(to, axes_0 * (first[k] - middle(0)) / length);
        };
        let sizes = Sizes::of(kind, now.len());
        let mut nodes = Vec::with_capacity(sizes.nodes * sizes.node);
        let mut edges = Vec::new();
        match kind {
            Kind::Graph => {
                for k in 0..now.len() {
                    of_marker(&mut nodes, k);
                    nodes.extend_from_slice(&common);
                    let s = k as f32 / (now.len() - 1) as f32;
                    nodes.extend([s, 4.0 * s * (1.0 - s), f32::from(film.markers.free.contains(&k))]);
                }
                now.windows(2)
                    .for_each(|pair| push(&mut edges, axes * (pair[1] - pair[0]) * now.len() as f64 / length));
            }
            Kind::Perceptron | Kind::Recurrent => {
                (0..now.len()).for_each(|k| of_marker(&mut nodes, k));
                nodes.extend_from_slice(&common);
            }
        }
        Self { nodes, edges, axes, share: 1.0 - (-time / RISE).exp() }
    }
}
