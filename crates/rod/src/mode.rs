//! How fast rods swing: the first modes of what is between two places that are held, in closed form.

use std::collections::{BTreeMap, HashMap};
use std::f64::consts::PI;

use crate::measure::stretch_gap;
use crate::supports::Give;
use crate::{Body, Freedom, Joint, Model, State, end_of};

/// What pulls a swinging rod back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Restoring {
    /// Its bending stiffness.
    Bending,
    /// Gravity: it swings as a pendulum or as a cable that sags.
    Gravity,
    /// Its tension.
    Tension,
}

/// The first mode of a rod, or of a part of it between places that are held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    /// Index of the rod.
    pub rod: usize,
    /// What most of its stiffness is of.
    pub restoring: Restoring,
    /// Angular frequency w [rad/s].
    pub frequency: f64,
    /// Mass that swings, with that of rigid bodies at its ends [kg].
    pub mass: f64,
}

/// How an end is held.
#[derive(Clone, Copy, PartialEq)]
enum End {
    Free,
    Pinned(Give),
    Clamped(Give),
}

impl End {
    /// Held in all directions.
    const RIGID: Self = Self::Clamped(Give { across: 0.0, turn: 0.0 });

    /// What springs give way there.
    fn give(self) -> Give {
        match self {
            Self::Free => Give { across: 0.0, turn: 0.0 },
            Self::Pinned(give) | Self::Clamped(give) => give,
        }
    }
}

impl Model {
    /// The first mode of each rod as if it swung alone: in `state`, about a straight line or one that sags. Squares of the
    /// frequencies by bending, gravity and tension are added, which is never more than the truth (Southwell). Bending modes
    /// are those of beams (Blevins, Formulas for Natural Frequency and Mode Shape, 1979, table 8-1): `k^2 / L^2 sqrt(EI / m)`
    /// with m per length. A rod that starts at another one is clamped there; rigid bodies that move freely are masses at its
    /// ends. Springs of a grip are in series with the rod (Dunkerley), and an end that they let turn more easily than the rod
    /// bends is pinned. What cannot swing has no mode; of shapes that are bent at rest these are estimates.
    pub fn first_modes(&self, state: &State) -> Vec<Mode> {
        let is_free_body = |i: usize| self.segments[i].body.is_some() && !self.segments[i].fixed;
        let springs = self.grip_springs();
        let (mut ends, mut tips) = (HashMap::<(usize, usize), End>::new(), HashMap::<usize, f64>::new());
        // Of each segment, the joints that end in it: their lengths, what they give to L / EI, and their tension.
        let mut along = vec![[0.0; 3]; self.segments.len()];
        for (k, joint) in self.joints.iter().enumerate().filter(|(_, joint)| !self.is_open(joint)) {
            let give = springs.get(&k).copied().unwrap_or(Give { across: 0.0, turn: 0.0 });
            let held = if joint.freedom == Freedom::None { End::Clamped(give) } else { End::Pinned(give) };
            match (joint.a, joint.b) {
                (Body::Segment(a), Body::Segment(b)) if self.segments[a].rod == self.segments[b].rod => {
                    let own = [joint.length, joint.length.powi(2) * joint.bend_compliance, tension(self, state, joint)];
                    along[b].iter_mut().zip(own).for_each(|(sum, own)| *sum += own);
                }
                (Body::Segment(a), Body::Segment(b)) if is_free_body(a) || is_free_body(b) => {
                    let (body, rod) = if is_free_body(a) { (a, b) } else { (b, a) };
                    *tips.entry(rod).or_default() += self.segments[body].mass();
                }
                (a, b) => {
                    let is_of_rod = |body| matches!(body, Body::Segment(i) if self.segments[i].body.is_none());
                    let of_b = end_of(self, b, joint.offset_b);
                    // Of two rods the second starts at the first.
                    let place = if is_of_rod(b) { of_b } else { end_of(self, a, joint.offset_a) };
                    ends.extend(place.map(|place| (place, held)));
                }
            }
        }
        let mut rods = BTreeMap::<usize, Vec<usize>>::new();
        for (i, segment) in self.segments.iter().enumerate().filter(|(_, segment)| segment.body.is_none()) {
            rods.entry(segment.rod).or_default().push(i);
        }
        let mut modes = Vec::new();
        for (rod, segments) in rods {
            let mut parts = segments.split(|&i| self.segments[i].fixed).peekable();
            let mut start = ends.get(&(segments[0], 0)).copied().unwrap_or(End::Free);
            while let Some(part) = parts.next() {
                let end = match (parts.peek(), part.last()) {
                    (Some(_), _) => End::RIGID,
                    (None, last) => last.and_then(|&i| ends.get(&(i, 1))).copied().unwrap_or(End::Free),
                };
                // Segments that are fixed side by side, or at an end, have nothing between them.
                if !part.is_empty() {
                    let mode = Span { model: self, state, part, ends: [start, end], along: &along, tips: &tips }.mode();
                    modes.extend(mode.map(|(restoring, frequency, mass)| Mode { rod, restoring, frequency, mass }));
                }
                start = End::RIGID;
            }
        }
        modes
    }
}

/// Pull of a joint as it is drawn [N]; 0 where it does not stretch.
fn tension(model: &Model, state: &State, joint: &Joint) -> f64 {
    let axis = model.pose(joint.a, state).orientation * nalgebra::Vector3::z();
    // A compliance of the paper's is none in effect, and its gaps are errors.
    let stretches = joint.stretch_compliance > 1e-9;
    if stretches { -stretch_gap(model, state, joint).dot(&axis) / joint.stretch_compliance } else { 0.0 }
}

/// Segments in a row that swing between two ends.
struct Span<'a> {
    model: &'a Model,
    state: &'a State,
    part: &'a [usize],
    ends: [End; 2],
    along: &'a [[f64; 3]],
    tips: &'a HashMap<usize, f64>,
}

impl Span<'_> {
    /// What pulls it back, how fast it swings [rad/s], and its mass [kg].
    fn mode(&self) -> Option<(Restoring, f64, f64)> {
        let sum = |of: &dyn Fn(usize) -> f64| self.part.iter().map(|&i| of(i)).sum::<f64>();
        let [length, mass] = [sum(&|i| self.model.segments[i].length), sum(&|i| self.model.segments[i].mass())];
        let tip = sum(&|i| self.tips.get(&i).copied().unwrap_or(0.0));
        let [bends, softness, pulls] = [0, 1, 2].map(|k| sum(&|i| self.along[i][k]));
        let gravity = self.model.gravity.norm();
        let held = self.ends.iter().filter(|end| **end != End::Free).count();
        // Between two ends that are held, one that turns more easily than the rod bends is a pin.
        let bends_by = if bends > 0.0 { 0.25 * length * softness / bends } else { f64::INFINITY };
        let ends = self.ends.map(|end| match end {
            End::Clamped(give) if held == 2 && give.turn > bends_by => End::Pinned(give),
            end => end,
        });
        // k^2 of the beam, squared.
        let shape = match ends {
            [End::Free, End::Free] | [End::Clamped(_), End::Clamped(_)] => 22.373,
            [End::Pinned(_), End::Pinned(_)] => 9.8696,
            [End::Free, End::Clamped(_)] | [End::Clamped(_), End::Free] => 3.5160,
            // It turns about its pin as a whole.
            [End::Free, End::Pinned(_)] | [End::Pinned(_), End::Free] if gravity > 0.0 => 0.0,
            _ => 15.418,
        };
        // A mass at the end of a cantilever counts 4.12 times one that is spread along it.
        let heavy = if held == 1 { mass + tip * 12.362 / 3.0 } else { mass };
        let bending = if bends > 0.0 { shape * shape * (bends / softness) / (heavy * length.powi(3)) } else { 0.0 };
        // 1 / w^2 of a rod that is stiff, on the springs of its ends alone.
        let gives = ends.map(End::give);
        let across = gives[0].across + gives[1].across;
        let on_springs = match held {
            1 => (mass + tip) * across + (mass / 3.0 + tip) * length.powi(2) * (gives[0].turn + gives[1].turn),
            2 => mass * across / 3.0,
            _ => 0.0,
        };
        let bending = bending / (1.0 + on_springs * bending);
        let swinging = match held {
            1 => gravity * (0.5 * mass + tip) / (length * (mass / 3.0 + tip)),
            2 => self.sag().map_or(0.0, |sag| PI * PI / 8.0 * gravity / sag),
            _ => 0.0,
        };
        let mean = pulls / self.part.len() as f64;
        let taut = if held == 2 { PI * PI * mean.max(0.0) / (length * mass) } else { 0.0 };
        let squares = [(Restoring::Bending, bending), (Restoring::Gravity, swinging), (Restoring::Tension, taut)];
        let total: f64 = squares.iter().map(|(_, square)| square).sum();
        let (restoring, _) = squares.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        (total > 0.0 && total.is_finite()).then(|| (restoring, total.sqrt(), mass + tip))
    }

    /// How far it hangs below the line between its ends [m], if by more than a hundredth of that.
    fn sag(&self) -> Option<f64> {
        let down = self.model.gravity.try_normalize(0.0)?;
        let place = |k: usize| self.state.positions[self.part[k]];
        let last = self.part.len() - 1;
        let below = |k: usize| (place(k) - place(0).lerp(&place(last), k as f64 / last.max(1) as f64)).dot(&down);
        let sag = (0..=last).map(below).fold(0.0, f64::max);
        (sag > 0.01 * (place(last) - place(0)).norm()).then_some(sag)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::{Assembly, Material, RodSpec, Stretch, shape};

    const LENGTH: f64 = 2.0;
    const RADIUS: f64 = 0.01;
    const MATERIAL: Material = Material { youngs_modulus: 1e8, torsion_modulus: 1e8, density: 1000.0 };

    /// The only mode of a rod that `hold` holds.
    fn mode(
        gravity: Vector3<f64>,
        direction: Vector3<f64>,
        hold: impl Fn(&mut Assembly, &std::ops::Range<usize>),
    ) -> (Restoring, f64) {
        let mut assembly = Assembly::new(gravity);
        let nodes = shape::straight(Vector3::zeros(), direction, LENGTH, 50);
        let rod = assembly.rod(&RodSpec::new(nodes, RADIUS, MATERIAL));
        hold(&mut assembly, &rod);
        let (model, state) = assembly.finish();
        let [mode] = model.first_modes(&state)[..] else { panic!("{:?}", model.first_modes(&state)) };
        (mode.restoring, mode.frequency)
    }

    #[test]
    fn beams_and_pendulums_swing_as_theory_says() {
        // sqrt(EI / m) of a round section is r / 2 sqrt(E / rho).
        let speed = 0.5 * RADIUS * (1e8_f64 / 1000.0).sqrt();
        let beam = |k2: f64| k2 / LENGTH.powi(2) * speed;
        let none = Vector3::zeros();
        let near = |(restoring, found): (Restoring, f64), expected: f64, kind| {
            assert!(restoring == kind && (found / expected - 1.0).abs() < 1e-3, "{restoring:?} {found} {expected}");
        };
        let clamp = |a: &mut Assembly, rod: &std::ops::Range<usize>| {
            a.clamp_start(rod);
        };
        let clamps = |a: &mut Assembly, rod: &std::ops::Range<usize>| {
            a.clamp_start(rod).clamp_end(rod);
        };
        near(mode(none, Vector3::x(), clamp), beam(3.516), Restoring::Bending);
        near(mode(none, Vector3::x(), clamps), beam(22.373), Restoring::Bending);
        near(mode(none, Vector3::x(), |_, _| ()), beam(22.373), Restoring::Bending);
        let pin = |a: &mut Assembly, rod: &std::ops::Range<usize>| {
            a.clamp_start(rod);
            let joint = a.model_mut().joints.len() - 1;
            a.model_mut().pin(joint);
        };
        // A slender bar on a pin.
        let down = Vector3::z() * -9.81;
        near(mode(down, -Vector3::z(), pin), (1.5 * 9.81 / LENGTH).sqrt(), Restoring::Gravity);
        let both = (1.5 * 9.81 / LENGTH + beam(3.516).powi(2)).sqrt();
        near(mode(down, -Vector3::z(), clamp), both, Restoring::Gravity);
        // A segment that is fixed in the middle leaves two cantilevers.
        let mut assembly = Assembly::new(none);
        let nodes = shape::straight(Vector3::zeros(), Vector3::x(), LENGTH, 51);
        let rod = assembly.rod(&RodSpec::new(nodes, RADIUS, MATERIAL));
        assembly.fix(rod.start + 25);
        let (model, state) = assembly.finish();
        let modes = model.first_modes(&state);
        let half: f64 = 25.0 * LENGTH / 51.0;
        assert_eq!(modes.len(), 2);
        assert!(modes.iter().all(|mode| (mode.frequency / (3.516 / half.powi(2) * speed) - 1.0).abs() < 0.02));
        // Those that are fixed at its ends, too, leave two beams between clamps, and a rod that is all fixed has no mode.
        let mut model = model;
        [0, 49, 50].into_iter().for_each(|i| model.segments[i].fixed = true);
        let modes = model.first_modes(&state);
        assert_eq!(modes.len(), 2);
        let part: f64 = 24.0 * LENGTH / 51.0;
        assert!((modes[0].frequency / (22.373 / part.powi(2) * speed) - 1.0).abs() < 0.02, "{modes:?}");
        model.segments.iter_mut().for_each(|segment| segment.fixed = true);
        assert_eq!(model.first_modes(&state), []);
    }

    #[test]
    fn springs_of_a_grip_make_a_rod_swing_slower() {
        use crate::Springs;
        let bending = 1e8 * PI / 4.0 * RADIUS.powi(4);
        let softened = |stiffness: f64, across: f64, both: bool| {
            let (restoring, frequency) = mode(Vector3::zeros(), Vector3::x(), |assembly, rod| {
                assembly.clamp_start(rod);
                if both {
                    assembly.clamp_end(rod);
                }
                let joint = assembly.model_mut().joints.len() - 1;
                let springs = Springs { force: [across, across, f64::INFINITY], moment: [stiffness; 3] };
                assembly.model_mut().soften(joint, &springs);
            });
            assert_eq!(restoring, Restoring::Bending);
            frequency / (0.5 * RADIUS * (1e8_f64 / 1000.0).sqrt() / LENGTH.powi(2))
        };
        // A cantilever whose clamp turns by K = EI / L: 1 + cos x cosh x = x (sin x cosh x - cos x sinh x) EI / (K L), of which the
        // root is 1.2479 (Blevins, table 8-1). Dunkerley's sum is a little less.
        let [k2, soft] =
            [softened(bending / LENGTH, f64::INFINITY, false), softened(1e-3 * bending / LENGTH, f64::INFINITY, false)];
        assert!((0.98..=1.0).contains(&(k2 / 1.2479_f64.powi(2))), "{k2}");
        // A stiff rod on a spring: w^2 = K / (m L^2 / 3).
        assert!((soft / 3e-3_f64.sqrt() - 1.0).abs() < 0.01, "{soft}");
        // On a soft spring across: w^2 = k / m; with its other end held, a stiff rod turns about that: 3 k / m.
        let across = 1e-3 * bending / LENGTH.powi(3);
        let aside = softened(f64::INFINITY, across, false);
        assert!((aside / 1e-3_f64.sqrt() - 1.0).abs() < 0.01, "{aside}");
        // Between a clamp and a spring that hardly resists turning, the rod is pinned there; between two clamps it is not.
        let [pinned, clamped] = [1e-3, 1e6].map(|k| softened(k * bending / LENGTH, f64::INFINITY, true));
        assert!((pinned / 15.418 - 1.0).abs() < 1e-3 && (clamped / 22.373 - 1.0).abs() < 1e-3, "{pinned} {clamped}");
    }

    #[test]
    fn strings_and_cables_swing_as_theory_says() {
        // A string that is stretched by 2 %: T = E A strain, pi / L sqrt(T / m), beside its bending.
        let mut assembly = Assembly::new(Vector3::zeros());
        let nodes = shape::straight(Vector3::zeros(), Vector3::x(), LENGTH, 50);
        let spec = RodSpec { stretch: Stretch::Physical, strains: vec![0.02], ..RodSpec::new(nodes, 0.001, MATERIAL) };
        let rod = assembly.rod(&spec);
        assembly.clamp_start(&rod).clamp_end(&rod);
        let (model, state) = assembly.finish();
        let mode = model.first_modes(&state)[0];
        let expected = PI / LENGTH * (1e8 * 0.02 / 1000.0_f64).sqrt();
        assert!(mode.restoring == Restoring::Tension && (mode.frequency / expected - 1.0).abs() < 0.05, "{mode:?}");
        // A cable that sags by a tenth swings sideways about its ends: H = m g L^2 / (8 d).
        let mut assembly = Assembly::new(Vector3::z() * -9.81);
        let parabola = |k: i32| {
            let x = 0.1 * f64::from(k);
            Vector3::new(x, 0.0, -0.2 * (1.0 - (x - 1.0).powi(2)))
        };
        let rod = assembly.rod(&RodSpec::new((0..=20).map(parabola).collect(), 0.001, MATERIAL));
        assembly.clamp_start(&rod).clamp_end(&rod);
        let (model, state) = assembly.finish();
        let mode = model.first_modes(&state)[0];
        let expected = PI / LENGTH * (9.81 * LENGTH.powi(2) / (8.0 * 0.2)).sqrt();
        assert!(mode.restoring == Restoring::Gravity && (mode.frequency / expected - 1.0).abs() < 0.15, "{mode:?}");
    }
}
