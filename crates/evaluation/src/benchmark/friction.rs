//! Ropes over drums and past pegs: Euler and Eytelwein's law, and Atwood's machine.

use std::f64::consts::PI;

use cosserat::scene::{self, Scene};
use nalgebra::Vector3;

use super::quantity::{Measured, Quantity, median};
use super::runs::Runs;

/// What friction at a drum's surface holds, as a ratio of pulls: its lever arm is the `drum`'s radius, that of the pulls is larger by
/// the `rope`'s.
fn held(friction: f64, angle: f64, [drum, rope]: [f64; 2]) -> f64 {
    (friction * angle * drum / (drum + rope)).exp()
}

/// Half of a turn around a drum: the ratio of pulls at which the rope begins to slide.
///
/// The pull grows steadily, and with it from there on the acceleration, so that the cube root of the way grows as the time since.
pub(super) fn capstan(runs: &mut Runs<'_>) -> Measured {
    let scene = scene::builtin("capstan")?;
    let inwards = scene.state.axis(0);
    let mut ways = Vec::new();
    runs.play(&scene, |now| {
        ways.push((now.time, (now.state.positions[0] - scene.state.positions[0]).dot(&inwards)));
    })?;
    let (slack, [first, last, until]) = (0.002, [0.004, 0.0065, 2.0]);
    let right = held(0.3, PI, [0.1, 0.001]);
    let onset = (right * slack - first) / (last - first) * until;
    let way = |time: f64| ways.iter().find(|(t, _)| *t >= time).map_or(f64::NAN, |(_, way)| *way);
    // Two moments of sliding, in which the rope is still so slow that its mass per length times v^2 is below half a per cent of
    // the pulls.
    let [t1, t2] = [0.15, 0.4].map(|share| onset + share * (until - onset));
    let [s1, s2] = [t1, t2].map(|time| (way(time) - way(0.9 * onset)).cbrt());
    let begins = t1 - s1 * (t2 - t1) / (s2 - s1);
    let ratio = (first + (last - first) * begins / until) / slack;
    let creep = way(0.9 * onset) - way(0.3 * onset);
    Ok(vec![
        Quantity::new("ratio of pulls at which it slides", [ratio, right], 0.01, "exp(mu theta R / (R + r))")
            .beside("MuJoCo holds at 95 %, slides at 110 %; PyElastica slides at 70 % (of the overhang)"),
        Quantity::new("way until 0.9 of that time [m]", [creep, 0.0], 1e-4, "sticks, to the contact tolerance"),
    ])
}

/// Atwood's machine with the rope's own weight: `x'' = (m1 - m2 + 2 rho (x + x0)) g / m`, as long as all of it hangs.
pub(crate) struct Atwood {
    /// Acceleration at the start [m/s^2].
    begins: f64,
    /// By which it grows: `sqrt(2 rho g / m)` [1/s].
    rate: f64,
}

impl Atwood {
    /// Of the scene `atwood`.
    pub(crate) fn of(Scene { model, state, .. }: &Scene) -> Self {
        let segments = &model.segments;
        let g = model.gravity.norm();
        let mass: f64 = segments.iter().map(|s| s.mass()).sum();
        let line = segments[1].mass() / segments[1].length;
        // The driving force at the start is that of all weights along the rope.
        let along = |i: usize| state.axis(i).dot(&Vector3::z());
        let drive: f64 = (0..segments.len()).map(|i| segments[i].mass() * g * along(i)).sum();
        Self { begins: drive / mass, rate: (2.0 * line * g / mass).sqrt() }
    }

    /// How far the heavier weight falls in `t` seconds [m].
    pub(crate) fn fallen(&self, t: f64) -> f64 {
        self.begins / (self.rate * self.rate) * ((self.rate * t).cosh() - 1.0)
    }
}

/// A rope over a smooth drum with two weights: how far they go, and the pull at the heavier one.
pub(super) fn pulley(runs: &mut Runs<'_>) -> Measured {
    let scene = scene::builtin("atwood")?;
    let atwood = Atwood::of(&scene);
    let Scene { model, state, .. } = &scene;
    let segments = &model.segments;
    let (g, last) = (model.gravity.norm(), segments.len() - 1);
    let (mut way, mut time, mut pulls) = ([0.0; 2], 0.0, Vec::new());
    let joints = model.joints_of(&scene.rods[0].segments);
    runs.play(&scene, |now| {
        time = now.time;
        way = [0, last].map(|i| (now.state.positions[i].z - state.positions[i].z).abs());
        pulls.push(now.forces[joints[0]].force.norm());
    })?;
    let right = atwood.fallen(time);
    // Over the second half, in which the acceleration grows by half a thousandth.
    let pull = median(pulls.split_off(pulls.len() / 2));
    let acceleration = atwood.begins * (atwood.rate * 0.75 * time).cosh();
    let source = "Atwood's machine, with the rope's weight";
    Ok(vec![
        Quantity::new("way of the heavier weight [m]", [way[0], right], 5e-3, source),
        Quantity::new("way of the lighter weight [m]", [way[1], right], 5e-3, source),
        Quantity::new("pull at the heavier weight [N]", [pull, segments[0].mass() * (g - acceleration)], 0.01, source),
    ])
}

/// A rope drawn past four pegs, above and below in turns: the pull that draws it, over the one that holds it back.
pub(super) fn obstacle_course(runs: &mut Runs<'_>) -> Measured {
    let scene = scene::builtin("slalom")?;
    let joints = scene.model.joints_of(&scene.rods[0].segments);
    let (mut pulls, until) = (Vec::new(), scene.run.steps as f64 * scene.run.dt);
    let counters = runs.play(&scene, |now| {
        if now.time > 0.5 * until {
            pulls.push(joints.last().map_or(f64::NAN, |&k| now.forces[k].force.norm()));
        }
    })?;
    let (peg, rope) = (0.05, 0.001);
    let phi = (2.0 * (peg + rope) / 0.2_f64).asin();
    let right = held(0.2, 6.0 * phi, [peg, rope]);
    let tolerance = runs.settings().step.contact_tolerance;
    Ok(vec![
        Quantity::new(
            "ratio of pulls, drawn steadily",
            [median(pulls) / 0.002, right],
            0.01,
            "exp(mu theta R / (R + r)), all pegs",
        ),
        Quantity::new("deepest overlap [radii]", [counters.deepest_penetration, 0.0], tolerance, "contact tolerance"),
    ])
}
