//! Random branched queries.

use std::f64::consts::{FRAC_PI_3, FRAC_PI_4, PI, TAU};

use nalgebra::{Quaternion, Unit, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::query::{ARMS, BranchedQuery, directions};
use crate::query::{Cable, Grip};

/// Which branched queries are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BranchedDistribution {
    /// Lengths of the arms, the smallest and the largest [m].
    pub length: [f64; 2],
    /// Distances of the grips from a hidden place over the arms' lengths, the smallest and the largest.
    pub distance: [f64; 2],
    /// The largest angle between the way there and an arm's direction in a hidden junction [rad].
    pub spread: f64,
    /// The largest angle between a grip's axis and the way [rad].
    pub angle: f64,
    /// GJ / EI, the smallest and the largest.
    pub torsion: [f64; 2],
    /// EI [N m^2] and weight a metre over that of the cable, of each arm, the smallest and the largest.
    pub unlike: [f64; 2],
}

impl Default for BranchedDistribution {
    fn default() -> Self {
        Self {
            length: [0.6, 1.0],
            distance: [0.3, 0.95],
            spread: FRAC_PI_4,
            angle: FRAC_PI_3,
            torsion: [0.7, 1.0],
            unlike: [0.5, 2.0],
        }
    }
}

impl BranchedDistribution {
    /// Query `index` of a seed. Around a hidden junction in a uniform pose the grips lie at uniform distances, in the arms'
    /// directions turned by uniform angles about random axes; their axes are the ways to it turned in the same way; twists
    /// are up to half a turn. Weights a metre are log-uniform from 1 to 100 N/m times a factor of each arm, log-uniform, as EI is.
    pub fn query(&self, seed: u64, index: u64) -> BranchedQuery {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(index);
        let mut unit = || rng.random_range(0.0..1.0);
        let weight = 100f64.powf(unit());
        // Uniform (Shoemake 1992).
        let (share, first, second) = (unit(), TAU * unit(), TAU * unit());
        let (a, b) = (f64::sqrt(1.0 - share), f64::sqrt(share));
        let pose = Quaternion::new(b * second.cos(), a * first.sin(), a * first.cos(), b * second.sin());
        let pose = UnitQuaternion::from_quaternion(pose);
        let frames = directions();
        let mut arms = [Cable::new(1.0, 1.0, 1.0, 1.0); ARMS];
        let mut grips = [Grip { position: Vector3::zeros(), orientation: UnitQuaternion::identity() }; ARMS];
        let between = |[low, high]: [f64; 2], share: f64| low + (high - low) * share;
        let ratio = |[low, high]: [f64; 2], share: f64| low * f64::powf(high / low, share);
        for k in 0..ARMS {
            let turned = |largest: f64, unit: &mut dyn FnMut() -> f64| {
                let axis = Unit::new_normalize(direction(&mut *unit));
                UnitQuaternion::from_axis_angle(&axis, largest * unit())
            };
            let bending = ratio(self.unlike, unit());
            arms[k] = Cable::new(
                between(self.length, unit()),
                bending,
                bending * between(self.torsion, unit()),
                weight * ratio(self.unlike, unit()),
            );
            let frame = pose * frames[k];
            let way = turned(self.spread, &mut unit) * (frame * Vector3::z());
            let position = -way * (arms[k].length * between(self.distance, unit()));
            let axis = turned(self.angle, &mut unit) * way;
            // The smallest turn from the arm's frame in the junction, and a twist.
            let straight = UnitQuaternion::rotation_between(&(frame * Vector3::z()), &axis);
            let twist = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), PI * (2.0 * unit() - 1.0));
            grips[k] = Grip { position, orientation: straight.unwrap_or_default() * frame * twist };
        }
        BranchedQuery { arms, grips }
    }
}

/// A direction, all alike.
fn direction(unit: &mut dyn FnMut() -> f64) -> Vector3<f64> {
    let (z, angle) = (2.0 * unit() - 1.0, TAU * unit());
    Vector3::new(angle.cos(), angle.sin(), 0.0) * f64::sqrt(1.0 - z * z) + Vector3::z() * z
}
