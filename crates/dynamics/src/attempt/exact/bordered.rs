//! The border of eyelets beside the rods' equations: its memory, and small dense systems.

use component::Border;
use jointed::tangent::Equations;
use kernels::Spatial;

/// Right-hand sides of bodies and joints.
pub(super) type Sides = (Vec<Spatial<f64>>, Vec<Spatial<f64>>);

/// Memory for the border.
#[derive(Default)]
pub(super) struct Bordered {
    pub(super) borders: Vec<Border>,
    /// Of which border each unknown is, and which one there.
    pub(super) unknowns: Vec<(usize, usize)>,
    /// Answers of bodies to each unknown.
    pub(super) columns: Vec<Vec<Spatial<f64>>>,
    /// Those to what the rods miss.
    pub(super) own: Vec<Spatial<f64>>,
    /// Right-hand sides of bodies and joints.
    pub(super) sides: Sides,
    /// The border's matrix, row by row, and its right-hand side, which the solution replaces.
    pub(super) matrix: Vec<f64>,
    pub(super) solution: Vec<f64>,
    /// What unit forces of contacts do to the unknowns: a row an unknown.
    pub(super) answers: Vec<f64>,
    /// Memory of a solve.
    pub(super) scratch: Vec<f64>,
}

impl Bordered {
    /// Whether there are eyelets.
    pub(super) fn is_there(&self) -> bool {
        !self.borders.is_empty()
    }
}

/// Puts the right-hand sides of equations down.
pub(super) fn take_bodies(equations: &Equations<f64>, sides: &mut Vec<Spatial<f64>>) {
    sides.clear();
    sides.extend(equations.bodies.iter().map(|body| body.defect));
}

/// Takes the right-hand sides off equations.
pub(super) fn take_sides(equations: &mut Equations<f64>, (bodies, joints): &mut Sides) {
    take_bodies(equations, bodies);
    joints.clear();
    joints.extend(equations.joints.iter().map(|joint| joint.rhs));
    equations.bodies.iter_mut().for_each(|body| body.defect = Spatial::zero());
    equations.joints.iter_mut().for_each(|joint| joint.rhs = Spatial::zero());
}

/// Gives them back.
pub(super) fn give_sides(equations: &mut Equations<f64>, (bodies, joints): &Sides) {
    equations.bodies.iter_mut().zip(bodies).for_each(|(body, side)| body.defect = *side);
    equations.joints.iter_mut().zip(joints).for_each(|(joint, side)| joint.rhs = *side);
}

/// What the bodies' corrections do to a row of a border.
pub(super) fn along(border: &Border, row: usize, corrections: &[Spatial<f64>]) -> f64 {
    times(&border.bodies, &border.rows, row, corrections)
}

/// What an unknown's forces do along the bodies' corrections.
pub(super) fn along_column(border: &Border, column: usize, corrections: &[Spatial<f64>]) -> f64 {
    times(&border.bodies, &border.columns, column, corrections)
}

fn times(bodies: &[usize], rows: &[Spatial<f64>], row: usize, corrections: &[Spatial<f64>]) -> f64 {
    let rows = &rows[row * bodies.len()..][..bodies.len()];
    bodies.iter().zip(rows).map(|(&body, row)| row.dot(corrections[body])).sum()
}

/// Adds a share of an unknown's forces to the right-hand sides.
pub(super) fn add_column(border: &Border, column: usize, share: f64, equations: &mut Equations<f64>) {
    let columns = &border.columns[column * border.bodies.len()..][..border.bodies.len()];
    for (&body, column) in border.bodies.iter().zip(columns) {
        let defect = &mut equations.bodies[body].defect;
        *defect = defect.plus(*column, share);
    }
}

/// Solves with a small matrix, given row by row, in the place of the right-hand sides, `count` numbers a row: Gauss's elimination with
/// partial pivoting. Returns whether the solution is finite.
pub(super) fn solve_dense(matrix: &mut [f64], rhs: &mut [f64], count: usize) -> bool {
    let size = rhs.len() / count.max(1);
    for k in 0..size {
        let pivot = (k..size).max_by(|&a, &b| matrix[a * size + k].abs().total_cmp(&matrix[b * size + k].abs()));
        let pivot = pivot.unwrap_or(k);
        if pivot != k {
            (0..size).for_each(|column| matrix.swap(k * size + column, pivot * size + column));
            (0..count).for_each(|column| rhs.swap(k * count + column, pivot * count + column));
        }
        for row in k + 1..size {
            let share = matrix[row * size + k] / matrix[k * size + k];
            if share != 0.0 {
                (k + 1..size).for_each(|column| matrix[row * size + column] -= share * matrix[k * size + column]);
                (0..count).for_each(|column| rhs[row * count + column] -= share * rhs[k * count + column]);
            }
        }
    }
    for column in 0..count {
        for k in (0..size).rev() {
            let later: f64 = (k + 1..size).map(|row| matrix[k * size + row] * rhs[row * count + column]).sum();
            rhs[k * count + column] = (rhs[k * count + column] - later) / matrix[k * size + k];
        }
    }
    rhs.iter().all(|x| x.is_finite())
}
