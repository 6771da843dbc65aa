//! Exact references: the continuous Kirchhoff rod by shooting, apart from any code under test.
//!
//! With the force `n(s) = F + w (L - s)` in the section at s, `m' = -r' x n`, `r' = d3` and
//! `q' = kappa q / 2`, where kappa = m_across / B + m_along / C + kappa_0. Integration by RK4 goes back from the free
//! end, whose orientation is found by Newton's method so that the clamp's comes out right.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// A rod clamped at its start, with a dead force at its end and a dead load along it.
#[derive(Clone, Copy, Debug)]
pub struct KirchhoffRod {
    /// Length L [m].
    pub length: f64,
    /// Bending stiffness B [N m^2].
    pub bending: f64,
    /// Torsional stiffness C [N m^2].
    pub torsion: f64,
    /// Curvature without load, in the frame of the section [1/m].
    pub curvature: Vector3<f64>,
    /// Orientation of the clamp; local z is the rod's axis.
    pub clamp: UnitQuaternion<f64>,
    /// Force F at the end [N].
    pub force: Vector3<f64>,
    /// Force w per length [N/m].
    pub line_load: Vector3<f64>,
}

/// The end of a rod.
#[derive(Clone, Copy, Debug)]
pub struct Tip {
    /// Place from the clamp [m].
    pub position: Vector3<f64>,
    /// Axis d3.
    pub axis: Vector3<f64>,
}

#[derive(Clone, Copy)]
struct Section {
    place: Vector3<f64>,
    moment: Vector3<f64>,
    q: Quaternion<f64>,
}

impl Section {
    fn plus(&self, slope: &Section, step: f64) -> Section {
        Section {
            place: self.place + slope.place * step,
            moment: self.moment + slope.moment * step,
            q: self.q + slope.q * step,
        }
    }
}

impl KirchhoffRod {
    /// Steps of the integration, of the load from zero, and Newton iterations for each.
    const STEPS: usize = 400;
    const LOADS: usize = 40;
    const ITERATIONS: usize = 30;

    /// A rod along x, straight without load.
    pub fn straight(length: f64, bending: f64, torsion: f64) -> Self {
        let clamp = UnitQuaternion::rotation_between(&Vector3::z(), &Vector3::x()).expect("not opposite");
        let zero = Vector3::zeros();
        Self { length, bending, torsion, curvature: zero, clamp, force: zero, line_load: zero }
    }

    /// The end under load.
    pub fn tip(&self) -> Tip {
        let unloaded = Self { force: Vector3::zeros(), line_load: Vector3::zeros(), ..*self };
        let mut end = self.clamp * unloaded.shoot(&UnitQuaternion::identity()).1.inverse();
        for load in 1..=Self::LOADS {
            let share = load as f64 / Self::LOADS as f64;
            Self { force: self.force * share, line_load: self.line_load * share, ..*self }.hit_clamp(&mut end);
        }
        Tip { position: -self.shoot(&end).0, axis: end * Vector3::z() }
    }

    fn hit_clamp(&self, end: &mut UnitQuaternion<f64>) {
        let miss = |end: &UnitQuaternion<f64>| (self.shoot(end).1 * self.clamp.inverse()).scaled_axis();
        for _ in 0..Self::ITERATIONS {
            let error = miss(end);
            if error.norm() < 1e-11 {
                return;
            }
            const SMALL: f64 = 1e-6;
            let column = |axis: Vector3<f64>| {
                let turn = |angle: f64| UnitQuaternion::from_scaled_axis(axis * angle) * *end;
                (miss(&turn(SMALL)) - miss(&turn(-SMALL))) / (2.0 * SMALL)
            };
            let slope = Matrix3::from_columns(&[column(Vector3::x()), column(Vector3::y()), column(Vector3::z())]);
            let step = slope.lu().solve(&-error).expect("a regular problem");
            *end = UnitQuaternion::from_scaled_axis(step * (0.5 / step.norm()).min(1.0)) * *end;
        }
        panic!("the shooting misses the clamp by {}", miss(end).norm());
    }

    /// Place of the clamp from the end, and its orientation, for an orientation of the end.
    fn shoot(&self, end: &UnitQuaternion<f64>) -> (Vector3<f64>, UnitQuaternion<f64>) {
        let h = -self.length / Self::STEPS as f64;
        let mut at = Section { place: Vector3::zeros(), moment: Vector3::zeros(), q: end.into_inner() };
        for k in 0..Self::STEPS {
            let from_end = -h * k as f64;
            let a = self.slope(&at, from_end);
            let b = self.slope(&at.plus(&a, 0.5 * h), from_end - 0.5 * h);
            let c = self.slope(&at.plus(&b, 0.5 * h), from_end - 0.5 * h);
            let d = self.slope(&at.plus(&c, h), from_end - h);
            at = at.plus(&a, h / 6.0).plus(&b, h / 3.0).plus(&c, h / 3.0).plus(&d, h / 6.0);
        }
        (at.place, UnitQuaternion::from_quaternion(at.q))
    }

    fn slope(&self, at: &Section, from_end: f64) -> Section {
        let q = UnitQuaternion::from_quaternion(at.q);
        let axis = q * Vector3::z();
        let force = self.force + self.line_load * from_end;
        let along = axis * axis.dot(&at.moment);
        let curvature = (at.moment - along) / self.bending + along / self.torsion + q * self.curvature;
        Section { place: axis, moment: -axis.cross(&force), q: Quaternion::from_imag(curvature) * at.q * 0.5 }
    }
}
