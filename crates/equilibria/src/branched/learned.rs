//! A learned start: a small network says where the junction of a branched cable is, how its arms lie, in which of four classes of
//! twist, and how likely each class is.

use std::f64::consts::PI;
use std::sync::LazyLock;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::BranchedEquilibrium;
use super::canonical::{INPUTS, StarCanonical};
use super::query::{ARMS, BranchedQuery};
use super::star::Star;
use super::start::{Begin, CLASSES, SIGNS, Stars};
use crate::known::Known;
use crate::network::{Perceptron, WeightsError};
use crate::problem::{Starts, places};
use crate::scaled::Cut;

/// Sine modes of each of a quaternion's four parts, of each arm.
pub const MODES: usize = 6;
/// Among the outputs: the arms' modes; the junction's place over L and its quaternion; the means of the forces at both ends of each
/// arm; how likely each class is, beginning with that which was asked about.
pub const JUNCTION: usize = 4 * MODES * ARMS;
/// Where the forces begin.
pub const FORCES: usize = JUNCTION + 7;
/// Where the log-likelihoods begin.
pub const LIKELY: usize = FORCES + 3 * ARMS;
/// Outputs of the network.
pub const OUTPUTS: usize = LIKELY + CLASSES;
/// Likelihood of the classes that are proposed, together.
const COVERED: f64 = 0.99;
/// Unit of forces: this and the arm's weight, over B / L^2.
const FORCE: f64 = 10.0;
/// What the shipped network has learned, see [`super::sample::BranchedDistribution::default`]: lengths of the arms over L and
/// their stiffness over B, their weights over B / L^2, GJ / EI, and distances of the grips from the middle over the arms' lengths.
const LENGTH: [f64; 2] = [0.68, 1.37];
const STIFFNESS: [f64; 2] = [0.25, 1.0];
const WEIGHT: [f64; 2] = [0.08, 400.0];
const TORSION: [f64; 2] = [0.7, 1.0];
const DISTANCE: [f64; 2] = [0.1, 1.1];
/// The least cosine between a grip's axis and the arm's direction in a junction that lies as the grips do, and of the way there.
const COSINES: [f64; 2] = [-0.5, 0.3];
/// What rounding may add to a number within its range.
const ROUNDING: f64 = 1e-9;
/// Largest compliance of a joint that is none in effect.
const COMPLIANCE: f64 = 1e-6;

static SHIPPED: &[u8] = include_bytes!("../../../../checkpoints/branched.safetensors");

/// Starts that a network proposes, one of each class that is not unlikely. Queries unlike those of its training begin at
/// [`Stars::default`].
#[derive(Clone, Debug)]
pub struct LearnedStar {
    network: Perceptron,
    /// Most proposals of a query, 1 to 4.
    pub proposals: usize,
    /// Proposals go on until their likelihoods add up to this.
    pub covered: f64,
    otherwise: Stars,
}

impl Default for LearnedStar {
    fn default() -> Self {
        static NETWORK: LazyLock<Perceptron> =
            LazyLock::new(|| match Perceptron::from_bytes(SHIPPED, INPUTS, OUTPUTS) {
                Ok(network) => network,
                Err(error) => unreachable!("{error}"),
            });
        Self::of(NETWORK.clone())
    }
}

impl LearnedStar {
    /// Of a file that `train equilibrium --cables branched` has written.
    ///
    /// # Errors
    /// If it holds no network of these inputs and outputs.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, WeightsError> {
        Ok(Self::of(Perceptron::from_bytes(bytes, INPUTS, OUTPUTS)?))
    }

    fn of(network: Perceptron) -> Self {
        Self { network, proposals: CLASSES, covered: COVERED, otherwise: Stars::default() }
    }

    /// Whether a query is like those of the training: round arms that are straight at rest, do not stretch and carry nothing, and
    /// numbers within their range.
    pub fn knows(star: &Star) -> bool {
        let within = |[low, high]: [f64; 2], x: f64| (low - ROUNDING..=high + ROUNDING).contains(&x);
        let middle = super::start::reference(star);
        (0..ARMS).all(|k| {
            let own = &star.arms[k];
            let way = middle.position - star.places[k];
            let end = middle.orientation * star.directions[k] * Vector3::z();
            own.stiffness[0] == own.stiffness[1]
                && own.rest == [0.0; 3]
                && own.carried[0] == 0.0
                && own.compliance <= COMPLIANCE
                && within(LENGTH, star.lengths[k])
                && within(STIFFNESS, own.stiffness[0])
                && within(WEIGHT, own.weight)
                && within(TORSION, own.stiffness[2] / own.stiffness[0])
                && within(DISTANCE, way.norm() / star.lengths[k])
                && (own.ends[0] * Vector3::z()).dot(&end) >= COSINES[0]
                && way.dot(&end) >= COSINES[1] * way.norm()
        })
    }

    /// How likely the lowest equilibrium is in each of the four classes of twist, see [`StarCanonical`]; `None` of queries unlike
    /// those of the training.
    pub fn likelihoods(&self, star: &Star) -> Option<[f64; CLASSES]> {
        Self::knows(star).then(|| likelihoods(&self.network.evaluate(&[StarCanonical::new(star).inputs(0)])[0]))
    }

    /// The classes that are proposed where the network says this of the first one.
    fn proposed(&self, outputs: &[f32; OUTPUTS]) -> impl Iterator<Item = usize> + use<> {
        let likely = likelihoods(outputs);
        let mut order = [0, 1, 2, 3];
        order.sort_by(|&a, &b| likely[b].total_cmp(&likely[a]));
        let mut covered = 0.0;
        let most = order[..self.proposals.clamp(1, CLASSES)].iter().take_while(|&&class| {
            let is_wanted = covered < self.covered;
            covered += likely[class];
            is_wanted
        });
        let count = most.count();
        order.into_iter().take(count)
    }
}

/// The likelihoods that a network says: of the class that it was asked about first, then of those one sign away.
pub fn likelihoods(outputs: &[f32; OUTPUTS]) -> [f64; CLASSES] {
    let logs: [f64; CLASSES] = std::array::from_fn(|k| f64::from(outputs[LIKELY + k]));
    let most = logs.into_iter().fold(f64::NEG_INFINITY, f64::max);
    let shares = logs.map(|x| (x - most).exp());
    let sum: f64 = shares.iter().sum();
    shares.map(|x| x / sum)
}

impl Starts<Star> for LearnedStar {
    fn count(&self) -> usize {
        self.otherwise.count().max(CLASSES)
    }

    fn fill(
        &self,
        index: usize,
        star: &Star,
        cut: &Cut,
        turns: &mut [UnitQuaternion<f64>],
        begins: &mut [Begin],
    ) -> usize {
        let mut counts = [0];
        self.fill_all(&[(index, star)], cut, turns, begins, &mut counts);
        counts[0]
    }

    fn fill_all(
        &self,
        stars: &[(usize, &Star)],
        cut: &Cut,
        turns: &mut [UnitQuaternion<f64>],
        begins: &mut [Begin],
        counts: &mut [usize],
    ) {
        let known = |&(_, star): &(usize, &Star)| Self::knows(star).then(|| StarCanonical::new(star));
        let known = self.network.evaluate_each(stars.iter().map(known).collect(), |own| own.inputs(0));
        let others = known.iter().flatten().flat_map(|(own, outputs)| {
            self.proposed(outputs).filter(|&class| class != 0).map(|class| own.inputs(class))
        });
        let others: Vec<_> = others.collect();
        let others = self.network.evaluate(&others);
        let mut others = others.iter();
        let places = places(self.count(), turns, begins, counts);
        for ((&(index, star), known), (turns, begins, count)) in stars.iter().zip(&known).zip(places) {
            let Some((canonical, outputs)) = known else {
                *count = self.otherwise.fill(index, star, cut, turns, begins);
                continue;
            };
            let places = begins.iter_mut().zip(turns.chunks_mut(ARMS * cut.segments));
            for (class, (begin, out)) in self.proposed(outputs).zip(places) {
                let Some(outputs) = (if class == 0 { Some(outputs) } else { others.next() }) else { break };
                *begin = decode(canonical, star, class, outputs, cut, out);
                *count += 1;
            }
        }
    }
}

/// Frames of the segments, and the junction with the forces.
fn decode(
    canonical: &StarCanonical,
    star: &Star,
    class: usize,
    outputs: &[f32; OUTPUTS],
    cut: &Cut,
    out: &mut [UnitQuaternion<f64>],
) -> Begin {
    let at = |k: usize| f64::from(outputs[k]);
    let place = Vector3::from_fn(|k, _| at(JUNCTION + k));
    let mut q = Quaternion::new(at(JUNCTION + 3), at(JUNCTION + 4), at(JUNCTION + 5), at(JUNCTION + 6));
    q = if q.norm() > 1e-6 { q.normalize() } else { Quaternion::identity() };
    let junction = canonical.junction_back(&place, &q);
    let mut forces = [Vector3::zeros(); ARMS];
    for (j, sign) in SIGNS[class].into_iter().enumerate() {
        let arm = canonical.order[j];
        let (start, end) = (canonical.grips[j] * sign, canonical.end(j, &q));
        let back = canonical.back(j);
        let own = &outputs[4 * MODES * j..4 * MODES * (j + 1)];
        for (k, out) in out[arm * cut.segments..(arm + 1) * cut.segments].iter_mut().enumerate() {
            let place = cut.place(k);
            let mut q = start * (1.0 - place) + end * place;
            modes(place, |mode, sine| {
                let own: [f64; 4] = std::array::from_fn(|k| f64::from(own[4 * mode + k]));
                q += Quaternion::new(own[0], own[1], own[2], own[3]) * sine;
            });
            *out = back.frame(q);
        }
        let weight = star.arms[arm].weight;
        let force = Vector3::from_fn(|k, _| at(FORCES + 3 * j + k)) * (FORCE + weight);
        forces[arm] = canonical.vector_back(&force) - Vector3::z() * (0.5 * weight);
    }
    Begin { junction, forces }
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

/// What the network should say of an equilibrium on equal segments: its class, and the outputs but for the likelihoods.
pub fn encode(
    canonical: &StarCanonical,
    star: &Star,
    query: &BranchedQuery,
    found: &BranchedEquilibrium,
) -> (usize, [f32; LIKELY]) {
    let known = Known::<Star>::at(query, found);
    let (place, mut q) = canonical.junction(&known.begin.junction);
    let count = known.turns.len() / ARMS;
    let cut = Cut::even(count);
    let mut sums = [0.0; LIKELY];
    let mut signs = [1.0; ARMS];
    let mut paths = vec![Quaternion::identity(); count * ARMS];
    for (j, path) in paths.chunks_mut(count).enumerate() {
        let mut before = canonical.grips[j];
        let turns = &known.turns[canonical.order[j] * count..];
        for (own, turn) in path.iter_mut().zip(turns) {
            let next = canonical.frame(j, turn);
            *own = if next.dot(&before) < 0.0 { -next } else { next };
            before = *own;
        }
        signs[j] = if before.dot(&canonical.end(j, &q)) < 0.0 { -1.0 } else { 1.0 };
    }
    if signs.iter().sum::<f64>() < 0.0 {
        (signs, q) = (signs.map(|sign: f64| -sign), -q);
    }
    let class = SIGNS.iter().position(|own| *own == signs).unwrap_or(0);
    for (j, path) in paths.chunks(count).enumerate() {
        let (start, end) = (canonical.grips[j] * signs[j], canonical.end(j, &q));
        for (k, own) in path.iter().enumerate() {
            let place = cut.place(k);
            let off = own * signs[j] - start * (1.0 - place) - end * place;
            modes(place, |mode, sine| {
                let share = 2.0 / count as f64 * sine;
                for (sum, own) in sums[4 * (MODES * j + mode)..].iter_mut().zip([off.w, off.i, off.j, off.k]) {
                    *sum += own * share;
                }
            });
        }
        let arm = canonical.order[j];
        let weight = star.arms[arm].weight;
        let middle = known.begin.forces[arm] + Vector3::z() * (0.5 * weight);
        let middle = canonical.vector(&middle) / (FORCE + weight);
        sums[FORCES + 3 * j..FORCES + 3 * (j + 1)].copy_from_slice(middle.as_slice());
    }
    sums[JUNCTION..JUNCTION + 3].copy_from_slice(place.as_slice());
    sums[JUNCTION + 3..FORCES].copy_from_slice(&[q.w, q.i, q.j, q.k]);
    (class, sums.map(|x| x as f32))
}

#[cfg(test)]
mod tests {
    use super::super::sample::BranchedDistribution;
    use super::super::{default_params, solve};
    use super::*;

    /// What is left of an answer when it is written down in modes is small; the class is the one that it is in.
    #[test]
    fn answers_come_back_from_their_modes() {
        let queries: Vec<BranchedQuery> = (0..200).map(|k| BranchedDistribution::default().query(3, k)).collect();
        let (mut errors, mut classes) = (Vec::new(), [0; CLASSES]);
        for (query, answer) in queries.iter().zip(solve(&queries, &default_params()).unwrap()) {
            let own = &answer.unwrap().equilibria[0];
            let star = Star::new(query);
            let canonical = StarCanonical::new(&star);
            let (class, targets) = encode(&canonical, &star, query, own);
            classes[class] += 1;
            let mut outputs = [0.0; OUTPUTS];
            outputs[..LIKELY].copy_from_slice(&targets);
            let known = Known::<Star>::at(query, own);
            let cut = Cut::even(known.turns.len() / ARMS);
            let mut turns = vec![UnitQuaternion::identity(); known.turns.len()];
            let begin = decode(&canonical, &star, class, &outputs, &cut, &mut turns);
            let junction = known.begin.junction;
            assert!((begin.junction.position - junction.position).norm() < 1e-6);
            assert!(begin.junction.orientation.angle_to(&junction.orientation) < 1e-5);
            for (a, b) in begin.forces.iter().zip(&known.begin.forces) {
                assert!((a - b).norm() <= 1e-5 * (1.0 + b.norm()), "{a} {b}");
            }
            let off = turns.iter().zip(&known.turns).map(|(a, b)| a.angle_to(b).powi(2)).sum::<f64>();
            errors.push((off / turns.len() as f64).sqrt());
        }
        errors.sort_by(f64::total_cmp);
        assert!(errors[100] < 0.01 && errors[199] < 0.1, "{} {} rad", errors[100], errors[199]);
        assert!(classes.iter().all(|&count| count > 10), "{classes:?}");
    }
}
