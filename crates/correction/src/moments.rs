//! Moments of joints: a perceptron that reads how a joint is bent, and how it was.

use cosserat::state::darboux::darboux;
use cosserat::state::{Joint, Model, State};
use nalgebra::Vector2;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Times over which a joint forgets how it was bent [s].
const FORGOTTEN: [f64; 2] = [0.1, 1.5];
/// A curvature that the perceptron reads as 1 [1/m].
const UNIT: f64 = 5.0;
/// Largest value of what the perceptron says [1/m].
const LARGEST: f64 = 1.5;
/// Numbers that the perceptron reads of how a joint is bent.
const BENT: usize = 2 * (1 + FORGOTTEN.len());
/// All that it reads: where the joint is, beside, and 1.
const READ: usize = BENT + 3;

/// What a joint remembers: curvatures that follow its own.
#[derive(Clone, Debug)]
pub(crate) struct Memory(Vec<[Vector2<f64>; FORGOTTEN.len()]>);

impl Memory {
    /// Of all joints between segments, which have been bent so for long.
    pub(crate) fn new(model: &Model, state: &State) -> Self {
        let now = |(k, joint): (usize, &Joint)| {
            [darboux(&state.orientations[k], &state.orientations[k + 1], joint.length).xy(); FORGOTTEN.len()]
        };
        Self(model.joints[..model.segments.len() - 1].iter().enumerate().map(now).collect())
    }

    /// By how much a joint that is bent so is bent otherwise than it remembers [1/m]; it then forgets for `dt` [s].
    pub(crate) fn look(&mut self, joint: usize, now: Vector2<f64>, dt: f64) -> [Vector2<f64>; FORGOTTEN.len()] {
        let mut out = [Vector2::zeros(); FORGOTTEN.len()];
        for ((own, out), time) in self.0[joint].iter_mut().zip(&mut out).zip(FORGOTTEN) {
            *out = now - *own;
            *own += *out * (1.0 - (-dt / time).exp());
        }
        out
    }
}

/// The perceptron: one layer of tanh. What it says is a change of the curvature at rest, which vanishes where a joint is as at rest and as it
/// was, and is bounded.
#[derive(Clone, Debug, PartialEq)]
pub struct Moments {
    hidden: usize,
    /// Into each hidden number, then out of all.
    numbers: Vec<f64>,
}

impl Moments {
    /// A perceptron with so many hidden numbers that says nothing yet; what it reads by is random, the same for a seed on every
    /// machine.
    pub fn new(hidden: usize, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let read = (0..hidden * READ).map(|_| random.random_range(-1.0..=1.0));
        let numbers = read.chain(std::iter::repeat_n(0.0, 2 * hidden)).collect();
        Self { hidden, numbers }
    }

    /// All its numbers.
    pub fn numbers(&self) -> &[f64] {
        &self.numbers
    }

    /// All its numbers, to be changed.
    pub fn numbers_mut(&mut self) -> &mut [f64] {
        &mut self.numbers
    }

    /// The change [1/m] of a joint at a place along the cable, 0 to 1, by how it is bent beyond its rest and beyond what it remembers
    /// [1/m].
    pub(crate) fn change(
        &self,
        bent: Vector2<f64>,
        otherwise: [Vector2<f64>; FORGOTTEN.len()],
        place: f64,
    ) -> Vector2<f64> {
        let mut read = [0.0; READ];
        for (to, from) in read.chunks_exact_mut(2).zip(std::iter::once(bent).chain(otherwise)) {
            to.copy_from_slice(&[from.x / UNIT, from.y / UNIT]);
        }
        read[BENT..].copy_from_slice(&[2.0 * place - 1.0, 4.0 * place * (1.0 - place), 1.0]);
        let (into, out) = self.numbers.split_at(self.hidden * READ);
        let mut sums = [Vector2::zeros(); 2];
        for (into, out) in into.chunks_exact(READ).zip(out.chunks_exact(2)) {
            let dot = |from: usize| into[from..].iter().zip(&read[from..]).map(|(a, b)| a * b).sum::<f64>();
            // As it is, and as it would be at rest.
            for (sum, from) in sums.iter_mut().zip([0, BENT]) {
                *sum += Vector2::new(out[0], out[1]) * dot(from).tanh();
            }
        }
        let [here, rest] = sums.map(|sum| sum.map(f64::tanh));
        (here - rest) * (0.5 * LARGEST)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_as_at_rest_bears_nothing_and_what_is_not_no_more_than_the_largest() {
        let mut moments = Moments::new(3, 1);
        moments.numbers_mut().iter_mut().for_each(|x| *x += 0.7);
        let zero = Vector2::zeros();
        assert_eq!(moments.change(zero, [zero; 2], 0.3), zero);
        let bent = Vector2::new(4.0, -1.0);
        assert!(moments.change(bent, [zero; 2], 0.3).norm() > 1e-3);
        moments.numbers_mut().iter_mut().for_each(|x| *x *= 1e3);
        assert!(moments.change(bent * 1e3, [bent; 2], 0.3).amax() <= LARGEST);
        // It begins with nothing.
        assert_eq!(Moments::new(3, 1).change(bent, [bent; 2], 0.3), zero);
    }
}
