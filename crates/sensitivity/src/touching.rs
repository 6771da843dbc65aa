//! Contacts that press in a step, as a border of its equations.
//!
//! With r and s what the step's and the contacts' equations are to change by, and z the impulses of contacts,
//!
//! ```text
//! [ A  -U ] [ x ]   [ r ]
//! [ V   D ] [ z ] = [ s ]      (D + V A^-1 U) z = s - V A^-1 r,   x = A^-1 (r + U z)
//! ```
//!
//! U are the pushes of impulses, V and D the contacts' equations ([`Touching`]). How a push changes as its own bodies move goes into
//! their blocks of A. Where two bodies push each other each also changes the other's push: those changes are further unknowns
//! of the border, twelve a contact.

use dynamics::substep::Touching;
use jointed::tangent::jacobian::{Factor, Field, Jacobian, of_six, six};
use kernels::lane::Real;
use nalgebra::{DMatrix, DVector, Dyn, LU, Matrix6, SMatrix, Vector6};

/// Compliance that all contacts are given, as a share of that of their bodies: where more contacts hold a body than are needed, their
/// impulses alone could not be told.
const GIVES: f64 = 1e-10;

/// A contact in the border.
#[derive(Clone, Debug)]
struct Entry {
    /// Bodies that are free.
    bodies: [Option<usize>; 2],
    /// Its first unknown, and how many there are.
    first: usize,
    count: usize,
    u: SMatrix<f64, 12, 15>,
    v: SMatrix<f64, 15, 12>,
}

/// The border of a step's equations.
#[derive(Clone, Debug, Default)]
pub(super) struct Border {
    entries: Vec<Entry>,
    /// Of `D + V A^-1 U`, and of its transpose.
    factors: Option<[LU<f64, Dyn, Dyn>; 2]>,
}

impl Entry {
    fn new(of: &Touching, first: usize, is_free: &dyn Fn(usize) -> bool) -> Self {
        let (own, other) = of.segments;
        let bodies = [Some(own), other].map(|body| body.filter(|&body| is_free(body)));
        let mut u = SMatrix::<f64, 12, 15>::zeros();
        let mut v = SMatrix::<f64, 15, 12>::zeros();
        u.fixed_columns_mut::<3>(0).copy_from(&of.push_by_impulse);
        v.fixed_rows_mut::<3>(0).copy_from(&of.by_pose);
        let couples = bodies.iter().all(Option::is_some);
        if couples {
            u.fixed_columns_mut::<12>(3).fill_with_identity();
            for (rows, columns) in [(0, 6), (6, 0)] {
                let block = of.push_by_pose.fixed_view::<6, 6>(rows, columns);
                v.fixed_view_mut::<6, 6>(3 + rows, columns).copy_from(&block);
            }
        }
        Self { bodies, first, count: if couples { 15 } else { 3 }, u, v }
    }

    fn sides(&self) -> impl Iterator<Item = (usize, usize)> {
        self.bodies.into_iter().enumerate().filter_map(|(side, body)| Some((side, body?)))
    }

    /// `V x` or `U^T x`.
    fn taken<T: Real>(&self, x: &Field<T>, transposed: bool) -> SMatrix<f64, 15, 1> {
        let mut out = SMatrix::zeros();
        for (side, body) in self.sides() {
            out += match transposed {
                true => self.u.fixed_rows::<6>(6 * side).tr_mul(&six(x.bodies[body])),
                false => self.v.fixed_columns::<6>(6 * side) * six(x.bodies[body]),
            };
        }
        out
    }

    /// Adds `U z` or `V^T z` times a sign.
    fn add<T: Real>(&self, z: &SMatrix<f64, 15, 1>, transposed: bool, sign: f64, x: &mut Field<T>) {
        for (side, body) in self.sides() {
            let of: Vector6<f64> = match transposed {
                true => self.v.fixed_columns::<6>(6 * side).tr_mul(z),
                false => self.u.fixed_rows::<6>(6 * side) * z,
            };
            x.bodies[body] = x.bodies[body].plus(of_six(&of), T::splat(sign));
        }
    }
}

impl Border {
    /// Adds to the bodies' blocks how pushes change as their own bodies move, and factors; the border that is left. `None` where
    /// the equations are singular in one of the lanes, of which there is one where there are contacts.
    pub(super) fn new<T: Real>(
        touching: &[Touching],
        (jacobian, factor, lanes): (&mut Jacobian<T>, &mut Factor<T>, usize),
        is_free: &dyn Fn(usize) -> bool,
        work: &mut Field<T>,
    ) -> Option<Self> {
        let mut entries: Vec<Entry> = Vec::with_capacity(touching.len());
        let mut size = 0;
        for of in touching {
            let entry = Entry::new(of, size, is_free);
            for (side, body) in entry.sides() {
                let block: Matrix6<f64> = of.push_by_pose.fixed_view::<6, 6>(6 * side, 6 * side).into();
                jacobian.add(body, &-block);
            }
            size += entry.count;
            entries.push(entry);
        }
        if !factor.factor(jacobian, lanes) {
            return None;
        }
        if entries.is_empty() {
            return Some(Self::default());
        }
        let mut schur = DMatrix::zeros(size, size);
        for column in &entries {
            for k in 0..column.count {
                work.clear();
                let mut unit = SMatrix::zeros();
                unit[k] = 1.0;
                column.add(&unit, false, 1.0, work);
                factor.solve(jacobian, work, false);
                for row in &entries {
                    let taken = row.taken(work, false);
                    for r in 0..row.count {
                        schur[(row.first + r, column.first + k)] += taken[r];
                    }
                }
            }
        }
        for (entry, of) in entries.iter().zip(touching) {
            let first = entry.first;
            for k in 0..3 {
                schur[(first + k, first + k)] *= 1.0 + GIVES;
            }
            let mut own = schur.fixed_view_mut::<3, 3>(first, first);
            own += of.by_impulse;
            for k in 3..entry.count {
                schur[(first + k, first + k)] -= 1.0;
            }
        }
        let factors = [schur.transpose().lu(), schur.lu()];
        let is_regular = factors[1].u().diagonal().iter().all(|x| x.is_finite() && *x != 0.0);
        let [transposed, plain] = factors;
        is_regular.then_some(Self { entries, factors: Some([plain, transposed]) })
    }

    /// Number of unknowns.
    pub(super) fn size(&self) -> usize {
        self.entries.last().map_or(0, |entry| entry.first + entry.count)
    }

    /// Place of a contact's three equations among the unknowns.
    pub(super) fn first(&self, contact: usize) -> usize {
        self.entries[contact].first
    }

    /// Solves for x and z, in the places of r and s; transposed likewise.
    pub(super) fn solve<T: Real>(
        &self,
        jacobian: &Jacobian<T>,
        factor: &mut Factor<T>,
        (field, z): (&mut Field<T>, &mut DVector<f64>),
        transposed: bool,
    ) {
        let Some([plain, of_transposed]) = &self.factors else { return factor.solve(jacobian, field, transposed) };
        let right = field.clone();
        factor.solve(jacobian, field, transposed);
        for entry in &self.entries {
            let taken = entry.taken(field, transposed);
            for r in 0..entry.count {
                z[entry.first + r] += if transposed { taken[r] } else { -taken[r] };
            }
        }
        (if transposed { of_transposed } else { plain }).solve_mut(z);
        field.clone_from(&right);
        for entry in &self.entries {
            let mut own = SMatrix::zeros();
            (0..entry.count).for_each(|r| own[r] = z[entry.first + r]);
            entry.add(&own, transposed, if transposed { -1.0 } else { 1.0 }, field);
        }
        factor.solve(jacobian, field, transposed);
    }
}
