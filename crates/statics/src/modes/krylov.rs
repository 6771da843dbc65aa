//! The largest eigenvalues of a positive operator, in a block Krylov space that is started again when it is full.
//!
//! The operator is symmetric in the inner product `x . M y` of a mass matrix M: `A = (M + h^2 K)^-1 M`. Each round adds what the
//! best pairs leave, `A x - theta x`, and solves the small problem in the space anew (Rayleigh and Ritz; thick restart after
//! Wu and Simon 2000).

use nalgebra::{DMatrix, Matrix3, SymmetricEigen, Vector6};

/// One entry a body: shift and turn.
pub(super) type Field = Vec<Vector6<f64>>;

/// Mass and inertia in world axes of a body; `None` where it is held.
pub(super) type Masses = [Option<(f64, Matrix3<f64>)>];

/// An eigenvalue and its vector, of norm 1.
pub(super) struct Pair {
    pub(super) value: f64,
    pub(super) vector: Field,
    /// Norm of what it leaves, over the eigenvalue.
    pub(super) residual: f64,
}

/// Vectors that a round adds.
const BLOCK: usize = 4;
/// Residual at which a pair is found: its eigenvalue is off by the square.
const TOLERANCE: f64 = 1e-8;
/// Most rounds.
const ROUNDS: usize = 300;
/// What is left of a new vector in the space's complement, below which it is rounding.
const NOTHING: f64 = 1e-10;

/// `M x`.
pub(super) fn times(masses: &Masses, x: &Field) -> Field {
    let of = |(mass, x): (&Option<(f64, Matrix3<f64>)>, &Vector6<f64>)| match mass {
        None => Vector6::zeros(),
        Some((mass, inertia)) => {
            let (linear, angular) = (x.fixed_rows::<3>(0) * *mass, inertia * x.fixed_rows::<3>(3));
            Vector6::new(linear[0], linear[1], linear[2], angular[0], angular[1], angular[2])
        }
    };
    masses.iter().zip(x).map(of).collect()
}

fn dot(x: &Field, y: &Field) -> f64 {
    x.iter().zip(y).map(|(x, y)| x.dot(y)).sum()
}

fn add(x: &mut Field, share: f64, y: &Field) {
    x.iter_mut().zip(y).for_each(|(x, y)| *x += y * share);
}

/// An orthonormal basis, and what the operator makes of it.
struct Space<'a> {
    masses: &'a Masses,
    basis: Vec<Field>,
    images: Vec<Field>,
}

impl Space<'_> {
    /// Adds the part of a vector that lies outside, unless there is none.
    fn add(&mut self, mut x: Field, operator: &mut dyn FnMut(&Field) -> Field) {
        let mut size = dot(&x, &times(self.masses, &x)).sqrt();
        for _ in 0..2 {
            let mx = times(self.masses, &x);
            for own in &self.basis {
                let share = dot(own, &mx);
                add(&mut x, -share, own);
            }
        }
        let left = dot(&x, &times(self.masses, &x)).sqrt();
        size *= NOTHING;
        if left.is_nan() || left <= size {
            return;
        }
        x.iter_mut().for_each(|x| *x /= left);
        self.images.push(operator(&times(self.masses, &x)));
        self.basis.push(x);
    }

    /// Eigenvalues and coordinates of the best pairs, the largest first.
    fn pairs(&self) -> Vec<(f64, Vec<f64>)> {
        let weighed: Vec<Field> = self.images.iter().map(|image| times(self.masses, image)).collect();
        let n = self.basis.len();
        let mut matrix = DMatrix::from_fn(n, n, |r, c| if r <= c { dot(&self.basis[r], &weighed[c]) } else { 0.0 });
        matrix.fill_lower_triangle_with_upper_triangle();
        let SymmetricEigen { eigenvalues, eigenvectors } = matrix.symmetric_eigen();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&a, &b| eigenvalues[b].total_cmp(&eigenvalues[a]));
        order.into_iter().map(|k| (eigenvalues[k], eigenvectors.column(k).iter().copied().collect())).collect()
    }

    fn combined(&self, of: &[Field], shares: &[f64]) -> Field {
        let mut out = vec![Vector6::zeros(); self.masses.len()];
        shares.iter().zip(of).for_each(|(&share, x)| add(&mut out, share, x));
        out
    }

    /// `A x - theta x` of a pair.
    fn rest(&self, (value, shares): &(f64, Vec<f64>)) -> Field {
        let mut out = self.combined(&self.images, shares);
        add(&mut out, -value, &self.combined(&self.basis, shares));
        out
    }
}

/// The `count` largest eigenvalues, the largest first; `operator` gives `A x` for `M x`. An eigenvalue is found as often as it
/// is there if that is not more often than a round adds vectors, or if the vectors `known` span its own. Each round tells how many
/// are found; where it is not to go on, only these come back.
pub(super) fn largest(
    operator: &mut dyn FnMut(&Field) -> Field,
    masses: &Masses,
    count: usize,
    known: Vec<Field>,
    tell: &mut dyn FnMut(usize) -> bool,
) -> Vec<Pair> {
    let mut space = Space { masses, basis: Vec::new(), images: Vec::new() };
    let room = 3 * count + 4 * BLOCK + known.len();
    let mut next: Vec<Field> = known.into_iter().chain((0..BLOCK).map(|k| start(k, masses))).collect();
    for round in 0..ROUNDS {
        let before = space.basis.len();
        next.drain(..).for_each(|x| space.add(x, operator));
        let pairs = space.pairs();
        let rests: Vec<(f64, Field)> = pairs
            .iter()
            .take(count)
            .map(|pair| {
                let rest = space.rest(pair);
                (dot(&rest, &times(masses, &rest)).sqrt() / pair.0, rest)
            })
            .collect();
        let is_full = space.basis.len() == before;
        let is_found = rests.len() == count && rests.iter().all(|(residual, _)| *residual <= TOLERANCE);
        let exact = rests.iter().filter(|(residual, _)| *residual <= TOLERANCE).count();
        let goes_on = tell(exact);
        if is_found || is_full || round + 1 == ROUNDS || !goes_on {
            let pair = |((value, shares), (residual, _)): (&(f64, Vec<f64>), &(f64, Field))| Pair {
                value: *value,
                vector: space.combined(&space.basis, shares),
                residual: *residual,
            };
            let kept = |pair: &Pair| goes_on || pair.residual <= TOLERANCE;
            return pairs.iter().zip(&rests).map(pair).filter(kept).collect();
        }
        if space.basis.len() + BLOCK > room {
            let kept = &pairs[..pairs.len().min(count + 2 * BLOCK)];
            let of = |fields: &[Field]| kept.iter().map(|(_, shares)| space.combined(fields, shares)).collect();
            (space.basis, space.images) = (of(&space.basis), of(&space.images));
        }
        let open = rests.into_iter().filter(|(residual, _)| *residual > TOLERANCE);
        next = open.map(|(_, rest)| rest).take(BLOCK).collect();
        // Fewer pairs than asked for, all of them exact: what they do not span is still to come.
        if next.is_empty() {
            next = (0..BLOCK).map(|k| start(k + BLOCK * (round + 1), masses)).collect();
        }
    }
    Vec::new()
}

/// A vector without any symmetry, the same in every run.
fn start(k: usize, masses: &Masses) -> Field {
    let rate = 0.754_877_666 + 0.1 * (k as f64 + 1.0).sqrt();
    let of = |(i, mass): (usize, &Option<(f64, Matrix3<f64>)>)| match mass {
        None => Vector6::zeros(),
        Some(_) => Vector6::from_fn(|row, _| (rate * (6 * i + row + 1) as f64).sin() + 0.1 * (row as f64 - 2.2)),
    };
    masses.iter().enumerate().map(of).collect()
}
