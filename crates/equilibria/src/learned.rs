//! A learned start: a small network says where a cable's lowest equilibrium is, in which of two classes of twist, and how sure
//! it is.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::LazyLock;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::canonical::{Canonical, INPUTS};
use crate::network::{Perceptron, WeightsError};
use crate::problem::{Starts, places};
use crate::sample::Distribution;
use crate::scaled::{Cut, Scaled};
use crate::start::Curves;

/// Sine modes of each of a quaternion's four parts.
pub const MODES: usize = 10;
/// Outputs: the modes, the mean of the forces at both grips, and how likely the class is.
pub const OUTPUTS: usize = 4 * MODES + 4;
/// What the shipped network has learned: distances of the grips over the length, curvatures at rest times the length, weights
/// that are carried over B / L^2; all else as in [`Distribution`].
pub const DISTANCE: [f64; 2] = [0.1, 0.95];
/// The largest of the curvatures.
pub const CURVATURE: f64 = 4.0;
/// The largest of the weights.
pub const CARRIED: f64 = 50.0;
/// GJ / EI.
pub const TORSION: [f64; 2] = [0.6, 2.0];
/// The largest angle between a grip's axis and the chord.
pub const ANGLE: f64 = FRAC_PI_2;
/// Share of its training that is as [`Distribution`] says, but for the distance.
const PLAIN: f64 = 0.5;
/// What rounding may add to a number within its range.
const ROUNDING: f64 = 1e-9;
/// Largest compliance of a joint that is none in effect.
const COMPLIANCE: f64 = 1e-6;
/// Log-odds beyond which one class alone is proposed: 99 in 100.
const SURE: f32 = 4.6;
/// Unit of forces: this and the weight, over B / L^2.
const FORCE: f64 = 20.0;

static SHIPPED: &[u8] = include_bytes!("../../../checkpoints/equilibrium.safetensors");

/// What the network is asked for: the distribution of its training queries.
pub fn distribution() -> Distribution {
    let (distance, torsion) = (DISTANCE, TORSION);
    Distribution { distance, curvature: CURVATURE, carried: CARRIED, torsion, angle: ANGLE, plain: PLAIN }
}

/// Starts that a network proposes. Queries unlike those of its training begin at all [`Curves`].
///
/// The network gives sine modes of quaternions on their way from grip to grip, whose ends are exact; see [`Canonical`] for its
/// inputs and for the two classes. The likelier class is proposed, and the other one where it is not unlikely.
#[derive(Clone, Debug)]
pub struct Learned {
    network: Perceptron,
    /// Most proposals of a query, 1 or 2.
    pub proposals: usize,
}

impl Default for Learned {
    fn default() -> Self {
        static SHIPPED_ONE: LazyLock<Learned> = LazyLock::new(|| match Learned::from_bytes(SHIPPED) {
            Ok(learned) => learned,
            Err(error) => unreachable!("{error}"),
        });
        SHIPPED_ONE.clone()
    }
}

impl Learned {
    /// Of a file that `train equilibrium` has written.
    ///
    /// # Errors
    /// If it holds no network of these inputs and outputs.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, WeightsError> {
        let network = Perceptron::from_bytes(bytes, INPUTS, OUTPUTS)?;
        Ok(Self { network, proposals: 2 })
    }

    /// Whether a query is like those of the training: two grips, a round cable that is not twisted at rest and does not stretch,
    /// and numbers within their range.
    pub fn knows(query: &Scaled) -> bool {
        let distance = query.chord.norm();
        let near =
            |q: &UnitQuaternion<f64>| (q * Vector3::z()).dot(&query.chord) >= (ANGLE.cos() - ROUNDING) * distance;
        query.held
            && query.stiffness[0] == query.stiffness[1]
            && query.rest[2] == 0.0
            && query.rest[0].hypot(query.rest[1]) <= CURVATURE
            && query.carried[0] <= CARRIED
            && query.compliance <= COMPLIANCE
            && (DISTANCE[0]..=DISTANCE[1]).contains(&distance)
            && (1.0..=100.0).contains(&query.weight)
            && (TORSION[0] - ROUNDING..=TORSION[1] + ROUNDING).contains(&query.stiffness[2])
            && query.ends.iter().all(near)
    }
}

impl Learned {
    /// How likely the lowest equilibrium is in each of the two classes of twist, see [`Canonical`]; `None` of queries unlike those
    /// of the training.
    pub fn likelihoods(&self, query: &Scaled) -> Option<[f64; 2]> {
        let own = Self::knows(query).then(|| [Canonical::new(query).inputs(0)])?;
        let outputs: [f32; OUTPUTS] = self.network.evaluate(&own)[0];
        let odds = f64::from(outputs[OUTPUTS - 1]).exp();
        Some([odds / (1.0 + odds), 1.0 / (1.0 + odds)])
    }
}

impl Starts for Learned {
    fn count(&self) -> usize {
        Curves::all().count()
    }

    fn fill(
        &self,
        index: usize,
        query: &Scaled,
        cut: &Cut,
        turns: &mut [UnitQuaternion<f64>],
        forces: &mut [Vector3<f64>],
    ) -> usize {
        let mut counts = [0];
        self.fill_all(&[(index, query)], cut, turns, forces, &mut counts);
        counts[0]
    }

    fn fill_all(
        &self,
        queries: &[(usize, &Scaled)],
        cut: &Cut,
        turns: &mut [UnitQuaternion<f64>],
        forces: &mut [Vector3<f64>],
        counts: &mut [usize],
    ) {
        let known = |&(_, query): &(usize, &Scaled)| Self::knows(query).then(|| Canonical::new(query));
        let known = self.network.evaluate_each(queries.iter().map(known).collect(), |own| own.inputs(0));
        // Which classes are begun with.
        let begun_with = |outputs: &[f32; OUTPUTS]| {
            let odds = outputs[OUTPUTS - 1];
            let is_sure = self.proposals < 2 || odds.abs() > SURE;
            if is_sure { [odds >= 0.0, odds < 0.0] } else { [true, true] }
        };
        let asked = known.iter().flatten().filter(|(_, outputs)| begun_with(outputs)[1]);
        let second: Vec<_> = asked.map(|(own, _)| own.inputs(1)).collect();
        let second = self.network.evaluate(&second);
        let mut second = second.iter();
        let places = places(self.count(), turns, forces, counts);
        for ((&(index, query), known), (turns, forces, count)) in queries.iter().zip(&known).zip(places) {
            let Some((canonical, outputs)) = known else {
                *count = Curves::all().fill(index, query, cut, turns, forces);
                continue;
            };
            let own = begun_with(outputs);
            let classes = [own[0].then_some(outputs), own[1].then(|| second.next()).flatten()];
            let classes = classes.into_iter().enumerate().filter_map(|(class, outputs)| Some((class, outputs?)));
            for ((class, outputs), (out, force)) in classes.zip(turns.chunks_mut(cut.segments).zip(forces)) {
                decode(canonical, class, outputs, cut, out);
                *force = decode_force(canonical, outputs, query);
                *count += 1;
            }
        }
    }
}

/// Frames of the segments.
fn decode(canonical: &Canonical, class: usize, outputs: &[f32; OUTPUTS], cut: &Cut, out: &mut [UnitQuaternion<f64>]) {
    let back = canonical.back();
    let start = canonical.ends[0];
    let end = canonical.ends[1] * if class == 1 { -1.0 } else { 1.0 };
    for (k, out) in out.iter_mut().enumerate() {
        let place = canonical.place(cut.place(k));
        let mut q = start * (1.0 - place) + end * place;
        modes(place, |mode, sine| {
            let own: [f64; 4] = std::array::from_fn(|k| f64::from(outputs[4 * mode + k]));
            q += Quaternion::new(own[0], own[1], own[2], own[3]) * sine;
        });
        *out = back.turn(q);
    }
}

/// The force on the first grip. The network says the mean of those at both grips.
fn decode_force(canonical: &Canonical, outputs: &[f32; OUTPUTS], query: &Scaled) -> Vector3<f64> {
    let weight = query.weight + query.carried[0];
    let own = Vector3::from_fn(|k, _| f64::from(outputs[4 * MODES + k])) * (FORCE + weight);
    canonical.force_back(own) - Vector3::z() * (0.5 * weight)
}

/// Sines of the modes at a place.
fn modes(place: f64, mut each: impl FnMut(usize, f64)) {
    let (sine, cosine) = (PI * place).sin_cos();
    let (mut before, mut own) = (0.0, sine);
    for mode in 0..MODES {
        each(mode, own);
        (before, own) = (own, 2.0 * cosine * own - before);
    }
}

/// What the network should say of an equilibrium on equal segments: its class, and the outputs but for the last one.
///
/// `force` is that on the first grip, over B / L^2, with the sign of the pull along the cable.
pub fn encode(
    canonical: &Canonical,
    query: &Scaled,
    turns: &[UnitQuaternion<f64>],
    force: Vector3<f64>,
) -> (usize, [f32; OUTPUTS - 1]) {
    let count = turns.len();
    let cut = Cut::even(count);
    let mut before = canonical.ends[0];
    let mut path = vec![Quaternion::identity(); count];
    for (k, q) in turns.iter().enumerate() {
        let at = (canonical.place(cut.place(k)) * count as f64) as usize;
        path[at.min(count - 1)] = canonical.turn(q);
    }
    for q in &mut path {
        if q.dot(&before) < 0.0 {
            *q = -*q;
        }
        before = *q;
    }
    let class = usize::from(before.dot(&canonical.ends[1]) < 0.0);
    let end = canonical.ends[1] * if class == 1 { -1.0 } else { 1.0 };
    let mut sums = [0.0; OUTPUTS - 1];
    for (k, q) in path.iter().enumerate() {
        let place = cut.place(k);
        let off = q - canonical.ends[0] * (1.0 - place) - end * place;
        modes(place, |mode, sine| {
            let share = 2.0 / count as f64 * sine;
            for (sum, own) in sums[4 * mode..].iter_mut().zip([off.w, off.i, off.j, off.k]) {
                *sum += own * share;
            }
        });
    }
    let weight = query.weight + query.carried[0];
    let middle = canonical.force(force + Vector3::z() * (0.5 * weight)) / (FORCE + weight);
    sums[4 * MODES..].copy_from_slice(middle.as_slice());
    (class, sums.map(|x| x as f32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Params, Query, solve};

    /// Of other queries than those of the training: errors of the likelier class's turns against the lowest equilibrium, where
    /// that is in this class.
    #[test]
    fn starts_are_near_the_lowest_equilibrium() {
        let plain = Distribution { distance: DISTANCE, ..Distribution::default() };
        let kinds = [
            ("plain", plain, 0.055),
            ("bent at rest", Distribution { curvature: CURVATURE, ..plain }, 0.13),
            ("with a weight", Distribution { carried: CARRIED, ..plain }, 0.08),
            ("of all kinds", Distribution { plain: 0.0, ..distribution() }, 0.13),
        ];
        for (name, distribution, most) in kinds {
            let queries: Vec<Query> = (0..1000).map(|k| distribution.query(33, k)).collect();
            let learned = Learned { proposals: 1, ..Learned::default() };
            let cut = Cut::even(Params::default().segments);
            let mut errors = Vec::new();
            for (k, answer) in solve(&queries, &Params::default()).unwrap().iter().enumerate() {
                let lowest = &answer.as_ref().unwrap().equilibria[0].orientations;
                let mut turns = vec![UnitQuaternion::identity(); learned.count() * cut.segments];
                let mut forces = vec![Vector3::zeros(); learned.count()];
                learned.fill(k, &Scaled::new(&queries[k]), &cut, &mut turns, &mut forces);
                let off = turns.iter().zip(lowest).map(|(a, b)| a.angle_to(b).powi(2)).sum::<f64>();
                errors.push((off / cut.segments as f64).sqrt());
            }
            errors.sort_by(f64::total_cmp);
            println!("{name}: median error {:.4} rad, nine in ten below {:.4} rad", errors[500], errors[900]);
            assert!(errors[500] < most, "{name}: {} rad", errors[500]);
        }
    }

    /// Of the queries with about the same likelihood, that share has its lowest equilibrium in the first class.
    #[test]
    fn likelihoods_are_shares() {
        let queries: Vec<Query> = (0..2000).map(|k| distribution().query(34, k)).collect();
        let mut parts = [[0.0; 3]; 5];
        for (query, answer) in queries.iter().zip(solve(&queries, &Params::default()).unwrap()) {
            let (scaled, own) = (Scaled::new(query), answer.unwrap().equilibria.remove(0));
            let (class, _) = encode(&Canonical::new(&scaled), &scaled, &own.orientations, Vector3::zeros());
            let [first, second] = Learned::default().likelihoods(&scaled).unwrap();
            assert!((first + second - 1.0).abs() < 1e-12);
            let part = &mut parts[((5.0 * first) as usize).min(4)];
            *part = [part[0] + 1.0, part[1] + first, part[2] + f64::from(u8::from(class == 0))];
        }
        for [count, expected, found] in parts {
            let spread = (expected * (1.0 - expected / count)).sqrt();
            assert!(count > 30.0 && (expected - found).abs() < 3.0 * spread + 0.05 * count, "{parts:?}");
        }
    }

    /// What is left of an answer when it is written down in modes is small, and the class is the one that it is in.
    #[test]
    fn answers_come_back_from_their_modes() {
        let queries: Vec<Query> = (0..200).map(|k| distribution().query(3, k)).collect();
        let (mut errors, mut classes) = (Vec::new(), [0; 2]);
        for (query, answer) in queries.iter().zip(solve(&queries, &Params::default()).unwrap()) {
            let own = &answer.unwrap().equilibria[0];
            let scaled = Scaled::new(query);
            assert!(Learned::knows(&scaled));
            let canonical = Canonical::new(&scaled);
            let (class, targets) = encode(&canonical, &scaled, &own.orientations, -own.grips[0].force);
            classes[class] += 1;
            let mut outputs = [0.0; OUTPUTS];
            outputs[..OUTPUTS - 1].copy_from_slice(&targets);
            let cut = Cut::even(own.orientations.len());
            let mut turns = vec![UnitQuaternion::identity(); cut.segments];
            decode(&canonical, class, &outputs, &cut, &mut turns);
            let off = turns.iter().zip(&own.orientations).map(|(a, b)| a.angle_to(b).powi(2)).sum::<f64>();
            errors.push((off / cut.segments as f64).sqrt());
            let force = decode_force(&canonical, &outputs, &scaled);
            assert!((force + own.grips[0].force).norm() <= 1e-5 * (1.0 + force.norm()), "{force}");
        }
        errors.sort_by(f64::total_cmp);
        assert!(errors[100] < 0.01 && errors[199] < 0.1, "{} {} rad", errors[100], errors[199]);
        assert!(classes.iter().all(|&count| count > 10), "{classes:?}");
    }
}
