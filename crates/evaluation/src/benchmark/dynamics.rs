//! Rods that swing, whip and collide.

use std::f64::consts::TAU;

use cosserat::scene;
use cosserat::state::{State, measure};

use super::quantity::{Measured, Quantity};
use super::runs::Runs;

/// A stiff rod swings about a pin at its end: period and energy.
pub(super) fn pendulum(runs: &mut Runs<'_>) -> Measured {
    let scene = scene::builtin("pendulum")?;
    let model = &scene.model;
    let last = model.segments.len() - 1;
    let first = measure::energy(model, &scene.state).total();
    // Energy above that of the rod at rest, which hangs with its centre half a length below the pin.
    let (mass, length) = model.segments.iter().fold((0.0, 0.0), |(m, l), s| (m + s.mass(), l + s.length));
    let g = model.gravity.norm();
    let at_stake = first + 0.5 * mass * g * length;
    let angle = |axis: nalgebra::Vector3<f64>| axis.x.atan2(-axis.z);
    let amplitude = angle(scene.state.axis(0));
    let (mut before, mut crossings, mut energy) = ((0.0, amplitude), Vec::new(), first);
    runs.play(&scene, |now| {
        let middle = now.state.positions[last];
        let here = angle(middle);
        if before.1 * here < 0.0 {
            crossings.push(before.0 + (now.time - before.0) * before.1 / (before.1 - here));
        }
        before = (now.time, here);
        energy = measure::energy(model, now.state).total();
    })?;
    let swings = crossings.len().saturating_sub(1) as f64;
    let period = crossings.last().zip(crossings.first()).map_or(f64::NAN, |(end, start)| 2.0 * (end - start) / swings);
    // Of a cylinder about the middle of its end face; the series of the complete elliptic integral.
    let radius = model.segments[0].radius;
    let inertia = length * length / 3.0 + radius * radius / 4.0;
    let series = 1.0 + amplitude.powi(2) / 16.0 + 11.0 * amplitude.powi(4) / 3072.0;
    let right = TAU * (inertia / (0.5 * g * length)).sqrt() * series;
    Ok(vec![
        Quantity::new("period [s]", [period, right], 5e-4, "physical pendulum, with its amplitude")
            .beside("PyElastica, dismech 0.014 % (of a cable that swings)"),
        Quantity::new(
            "energy lost in 5 s, share of that above rest",
            [1.0 - (energy - first + at_stake) / at_stake, 0.0],
            1e-2,
            "kept",
        ),
    ])
}

/// A folded rope falls: the time until it is stretched, and how far its free end is after half of it.
///
/// Of an ideal chain of length L, whose free end has fallen by x, energy says `v^2 = g x (2 L - x) / (L - x)`.
pub(super) fn whip(runs: &mut Runs<'_>) -> Measured {
    let scene = scene::builtin("folded-rope")?;
    let model = &scene.model;
    let last = model.segments.len() - 1;
    let (g, length) = (model.gravity.norm(), measure::rod_lengths(model, &scene.state)[0]);
    let first = measure::energy(model, &scene.state).total();
    let end = |state: &State| (state.positions[last] + state.axis(last) * (0.5 * model.segments[last].length)).z;
    let mut ways = Vec::new();
    let (mut stretched, mut energy) = (0.0, f64::NAN);
    let (mut deepest, mut furthest) = (f64::INFINITY, 0.0_f64);
    runs.play(&scene, |now| {
        let way = -end(now.state);
        let speed = -now.state.velocities[last].z;
        furthest = furthest.max(way);
        ways.push((way, speed));
        if way < 0.7 * length && furthest < 0.7 * length {
            energy = measure::energy(model, now.state).total();
        }
        if -way < deepest {
            (deepest, stretched) = (-way, now.time);
        }
    })?;
    let speed_at = |share: f64| {
        let after = ways.iter().position(|(way, _)| *way > share * length).filter(|&k| k > 0);
        after.map_or(f64::NAN, |k| {
            let [(x, v), (y, w)] = [ways[k - 1], ways[k]];
            v + (w - v) * (share * length - x) / (y - x)
        })
    };
    let ideal = |share: f64| (g * length * share * (2.0 - share) / (1.0 - share)).sqrt();
    // Kinetic energy of an ideal chain at 0.7 L.
    let line = model.segments[0].mass() / model.segments[0].length;
    let turned = line * g * length * length * (0.7 / 2.0 - 0.49 / 4.0);
    let source = "folded chain that keeps its energy (Calkin and March 1989)";
    Ok(vec![
        Quantity::new(
            "time until it is stretched [s]",
            [stretched, 0.847_213 * (2.0 * length / g).sqrt()],
            0.01,
            source,
        ),
        Quantity::new("speed of the end after 0.5 L [m/s]", [speed_at(0.5), ideal(0.5)], 0.01, source),
        Quantity::new("speed of the end after 0.7 L [m/s]", [speed_at(0.7), ideal(0.7)], 0.01, source),
        Quantity::new("energy lost until 0.7 L, share of kinetic", [(first - energy) / turned, 0.0], 0.02, "kept"),
    ])
}

/// Two free ropes collide and stay wrapped: momenta, energy, overlap.
pub(super) fn two_ropes(runs: &mut Runs<'_>) -> Measured {
    let scene = scene::builtin("collision")?;
    let model = &scene.model;
    let of = |state: &State| {
        (
            measure::linear_momentum(model, state),
            measure::angular_momentum(model, state),
            measure::energy(model, state).total(),
        )
    };
    let (linear, angular, energy) = of(&scene.state);
    let (mut worst, mut highest, mut touched) = ([0.0_f64; 2], 0.0_f64, 0_usize);
    let counters = runs.play(&scene, |now| {
        let (p, l, e) = of(now.state);
        worst = [worst[0].max((p - linear).norm()), worst[1].max((l - angular).norm())];
        highest = highest.max(e / energy - 1.0);
        touched += usize::from(!now.contacts.is_empty());
    })?;
    // Scales: the momentum of one rope, and that about the other's middle at the ropes' half length.
    let one = model.segments[..model.segments.len() / 2].iter().map(|s| s.mass()).sum::<f64>();
    let (speed, half) = (scene.state.velocities[0].norm(), 0.5);
    let worst = if touched == 0 { [f64::NAN; 2] } else { worst };
    let tolerance = runs.settings().step.contact_tolerance;
    Ok(vec![
        Quantity::new("change of momentum, of a rope's", [worst[0] / (one * speed), 0.0], 1e-4, "kept"),
        Quantity::new("change of angular momentum, of a rope's", [worst[1] / (one * speed * half), 0.0], 1e-2, "kept"),
        Quantity::new("rise of energy", [highest, 0.0], 1e-3, "contacts take energy alone"),
        Quantity::new("deepest overlap [radii]", [counters.deepest_penetration, 0.0], tolerance, "contact tolerance"),
    ])
}
