//! Random queries.

use std::f64::consts::{FRAC_PI_3, PI, TAU};

use nalgebra::{Unit, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::query::{Cable, Carried, Grip, Query};

/// Which queries are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distribution {
    /// Distances of the grips over the length, the smallest and the largest.
    pub distance: [f64; 2],
    /// The largest curvature at rest times the length.
    pub curvature: f64,
    /// The largest weight that is carried, over B / L^2.
    pub carried: f64,
    /// GJ / EI, the smallest and the largest.
    pub torsion: [f64; 2],
    /// The largest angle between a grip's axis and the chord [rad].
    pub angle: f64,
    /// Share of the queries that have the default's curvature, weight, torsion and angle.
    pub plain: f64,
}

impl Default for Distribution {
    fn default() -> Self {
        Self { distance: [0.3, 0.95], curvature: 0.0, carried: 0.0, torsion: [0.7, 1.0], angle: FRAC_PI_3, plain: 0.0 }
    }
}

impl Distribution {
    /// Query `index` of a seed: a cable of 1 m with E I = 1 N m^2, weight `w L^3 / EI` log-uniform from 1 to 100, GJ / EI uniform;
    /// grips at a uniform distance in all directions, their axes the chord turned by a uniform angle about random axes,
    /// twist up to half a turn either way. Curvature at rest and the weight that is carried are uniform from 0, and so is its place.
    pub fn query(&self, seed: u64, index: u64) -> Query {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(index);
        let is_plain = self.plain > 0.0 && rng.random_range(0.0..1.0) < self.plain;
        let Self { curvature, carried, torsion, angle, .. } = if is_plain { Self::default() } else { *self };
        let mut unit = || rng.random_range(0.0..1.0);
        let mut direction = || {
            let (z, angle) = (2.0 * unit() - 1.0, TAU * unit());
            Vector3::new(angle.cos(), angle.sin(), 0.0) * f64::sqrt(1.0 - z * z) + Vector3::z() * z
        };
        let (chord, axes, bent) = (direction(), [direction(), direction()], direction());
        let [low, high] = self.distance;
        let distance = low + (high - low) * unit();
        let tangents =
            axes.map(|axis| UnitQuaternion::from_axis_angle(&Unit::new_normalize(axis), angle * unit()) * chord);
        let between = |a: &Vector3<f64>, b: &Vector3<f64>| {
            UnitQuaternion::rotation_between(a, b).unwrap_or_else(UnitQuaternion::identity)
        };
        let first = between(&Vector3::z(), &tangents[0]);
        let twist = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), PI * (2.0 * unit() - 1.0));
        let last = between(&tangents[0], &tangents[1]) * first * twist;
        let mut cable = Cable::new(1.0, 1.0, torsion[0] + (torsion[1] - torsion[0]) * unit(), 100f64.powf(unit()));
        cable.rest = Vector3::new(bent.x, bent.y, 0.0) * (curvature * unit());
        cable.carried = Carried { weight: carried * unit(), place: unit() };
        let start = Grip { position: Vector3::zeros(), orientation: first };
        let end = Grip { position: chord * distance, orientation: last };
        Query { cable, start, end: Some(end) }
    }
}
