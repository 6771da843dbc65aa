//! `simulate static`: the equilibrium that a scene relaxes to.

use std::collections::BTreeMap;
use std::time::Instant;

use anyhow::{Context, Error, Result, anyhow};
use cosserat::scene::Scene;
use cosserat::simulation::{ContactForce, Touched};
use cosserat::state::measure;
use cosserat::statics::{StaticError, equilibrium};
use serde::Serialize;
use terminal::{Progress, say};

use crate::at_rest::AtRest;
use crate::cli::StaticArgs;
use crate::held::place;
use crate::inelastic::Inelastic;
use crate::learned_start::{self, Begin};
use crate::numbers::{energy_scale, number, share, unless_noise};
use crate::outcome::Outcome;
use crate::sharp::{SharpJoint, Sharpest};
use crate::sought::{Sought, begun, params, still, tell};
use crate::{along, branches, scenes};

#[derive(Serialize)]
struct Report {
    #[serde(flatten)]
    sought: Sought,
    /// Linear solves of the search from the learned start, before all others; missing where the search began as drawn.
    #[serde(skip_serializing_if = "Option::is_none")]
    learned_start_solves: Option<u32>,
    /// Loops in which a wind's drag stays as it is, and the most linear solves of one; missing without wind.
    #[serde(skip_serializing_if = "Option::is_none")]
    wind_loops: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    most_solves_in_loop: Option<usize>,
    /// Whether the energy is at a minimum; missing where that is not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    stable: Option<bool>,
    /// Largest movement in the last step: segment lengths or radians.
    last_movement: f64,
    tolerance: f64,
    /// none, steady, or frozen: a wind that changes in time, as it is at time 0.
    wind: &'static str,
    /// What presses on segments at rest; missing without obstacles.
    #[serde(skip_serializing_if = "Option::is_none")]
    contacts: Option<Vec<Press>>,
    /// Whether obstacles have friction, which is left out.
    #[serde(skip)]
    left_out_friction: bool,
    energy_start_j: f64,
    energy_end_j: f64,
    #[serde(skip)]
    energy_scale_j: f64,
    /// What joints have lost and kept; missing where all are elastic.
    #[serde(skip_serializing_if = "Option::is_none")]
    inelastic: Option<Inelastic>,
    /// The joint that turned furthest, if it is too soft there.
    #[serde(skip_serializing_if = "Option::is_none")]
    sharp_joint: Option<SharpJoint>,
    /// Of what is driven, loads and gravity, in all frames.
    stands_at_s: f64,
    /// End face of the last segment of each rod [m].
    tips_m: Vec<[f64; 3]>,
}

/// A segment that an obstacle bears.
#[derive(Serialize)]
struct Press {
    segment: usize,
    rod: usize,
    obstacle: usize,
    place_m: [f64; 3],
    force_n: [f64; 3],
}

/// Finds the equilibrium, or several, as the arguments ask.
pub(crate) fn find(args: &StaticArgs) -> Result<Outcome> {
    match (args.along, args.branches) {
        (true, _) => along::follow(args),
        (_, true) => branches::find(args),
        _ => relax(args),
    }
}

/// Relaxes the scene, writes what was asked for (the start and the equilibrium as two frames), and prints a report.
fn relax(args: &StaticArgs) -> Result<Outcome> {
    args.start.check()?;
    let (scene, held) = begun(&args.rest)?;
    // What is driven and changes stays as it is at time 0; the equilibrium is the frame at time 1.
    let scene = still(scene);
    let progress = Progress::new(1, "equilibria", true)?;
    let files = AtRest::open(args, &scene, 1.0, None).context("--out")?;
    let params = params(args);
    let mut state = scene.state.clone();
    let begin = Instant::now();
    let is_free = !args.rest.keep_unstable && !scenes::begins_with_frame(&scene, &args.rest.begin);
    let is_learned = args.start == Begin::Learned && is_free;
    let proposed = if is_learned { learned_start::propose(&scene.model, &mut state) } else { None };
    let found = equilibrium(&scene.model, &mut state, &params)
        .map_err(|error| named(&scene, error))
        .with_context(|| scene.name.clone())?;
    let tip = |segments: &std::ops::Range<usize>| {
        let last = segments.end - 1;
        (state.positions[last] + state.axis(last) * (0.5 * scene.model.segments[last].length)).into()
    };
    let press = |contact: &ContactForce| {
        let Touched::Obstacle(obstacle) = contact.other else { return None };
        let (segment, place_m, force_n) = (contact.segment, contact.place.into(), contact.force.into());
        Some(Press { segment, rod: scene.model.segments[segment].rod, obstacle, place_m, force_n })
    };
    let mut sharpest = Sharpest::default();
    if found.converged {
        sharpest.observe(&scene.model, &state);
    }
    let obstacles = &scene.model.contacts.obstacles;
    let in_loops = found.loops > 0 && scene.model.air.is_some();
    let report = Report {
        sought: Sought::new((&scene, held), found.converged, found.steps, begin),
        learned_start_solves: proposed,
        wind_loops: in_loops.then_some(found.loops),
        most_solves_in_loop: in_loops.then_some(found.most_in_loop),
        contacts: (found.converged && !obstacles.is_empty()).then(|| found.contacts.iter().filter_map(press).collect()),
        left_out_friction: obstacles.iter().any(|obstacle| obstacle.surface.friction.at_rest > 0.0),
        stable: found.stable,
        last_movement: found.movement,
        tolerance: args.tolerance,
        wind: match &scene.model.air {
            None => "none",
            Some(air) if air.wind.is_steady() => "steady",
            Some(_) => "frozen",
        },
        energy_start_j: measure::energy(&scene.model, &scene.state).total(),
        energy_end_j: measure::energy(&scene.model, &state).total(),
        energy_scale_j: energy_scale(&scene.model, &state),
        inelastic: Inelastic::of(&scene, &state),
        sharp_joint: SharpJoint::of(&scene, &sharpest),
        stands_at_s: 0.0,
        tips_m: scene.rods.iter().filter(|rod| !rod.segments.is_empty()).map(|rod| tip(&rod.segments)).collect(),
    };
    let mut closed = Ok(None);
    if let Some(mut files) = files {
        let refused = files.push(&scene.model, &state, (&found.forces, &found.contacts), 1.0).err();
        closed = files.close(&scene, &report, refused, &progress, |_| Ok(())).context("--out").map(Some);
    }
    tell(&report, args.rest.json, closed, print)?;
    Ok(match found.converged {
        _ if progress.stopped() => Outcome::Interrupted,
        true => Outcome::Done,
        false => Outcome::NotConverged,
    })
}

/// Why there is no equilibrium, with the places of a joint that breaks.
fn named(scene: &Scene, error: StaticError) -> Error {
    let StaticError::Breaks { joint, of, load, most, unit } = error else { return error.into() };
    let joint = &scene.model.joints[joint];
    let [a, b] = [joint.a, joint.b].map(|body| place(scene, body));
    let [load, most] = [load, most].map(number);
    anyhow!(
        "the joint between {a} and {b} breaks: in equilibrium it would bear {of} of {load} {unit}, and it bears {most} {unit}"
    )
}

fn print(report: &Report) -> Result<()> {
    let status = if report.sought.converged { "equilibrium found" } else { "NO equilibrium found" };
    let last = share(report.last_movement);
    say!(
        "{}: {status} after {} linear solves in {} s\n\
         in the last one no segment moved by more than {last} of its length, or turned by more than {last} rad",
        report.sought.scene,
        report.sought.linear_solves,
        number(report.sought.wall_s)
    )?;
    if let Some(solves) = report.learned_start_solves {
        say!(
            "begun near the lowest equilibrium, which a network proposed and {solves} more solves found; --start drawn begins as \
             the scene is drawn"
        )?;
    }
    if let (Some(loops), Some(most)) = (report.wind_loops, report.most_solves_in_loop) {
        say!("in {loops} loops with the air's force held as it is, of at most {most} linear solves each")?;
    }
    if let Some(stable) = report.stable {
        say!("stable: {}", if stable { "yes" } else { "no" })?;
    }
    if report.wind == "frozen" {
        say!("in the wind as it is at time 0; it changes later, and so nothing stays at rest in it")?;
    }
    if let Some(contacts) = &report.contacts {
        print_contacts(contacts)?;
        if report.left_out_friction {
            say!("without the obstacles' friction")?;
        }
    }
    let scale = report.energy_start_j.abs().max(report.energy_end_j.abs()).max(report.energy_scale_j);
    let [start, end] = [report.energy_start_j, report.energy_end_j].map(|energy| number(unless_noise(energy, scale)));
    let place = if report.sought.converged { "at rest" } else { "where the search ended" };
    say!("energy: {start} J at the start, {end} J {place}")?;
    if let Some(inelastic) = &report.inelastic {
        say!("{inelastic}")?;
    }
    if let Some(joint) = &report.sharp_joint {
        say!("{joint}")?;
    }
    let size = report.tips_m.iter().flatten().fold(0.0, |size: f64, x| size.max(x.abs()));
    for (k, tip) in report.tips_m.iter().enumerate().take(10) {
        let [x, y, z] = tip.map(|x| number(unless_noise(x, size)));
        say!("tip of rod {k}: ({x}, {y}, {z}) m")?;
    }
    Ok(())
}

/// Says what bears what: the sum of the forces of each obstacle on each rod.
fn print_contacts(contacts: &[Press]) -> Result<()> {
    let mut sums: BTreeMap<(usize, usize), (usize, [f64; 3])> = BTreeMap::new();
    for Press { rod, obstacle, force_n, .. } in contacts {
        let (places, sum) = sums.entry((*obstacle, *rod)).or_default();
        *places += 1;
        sum.iter_mut().zip(force_n).for_each(|(sum, force)| *sum += force);
    }
    if sums.is_empty() {
        say!("no obstacle bears anything")?;
    }
    for ((obstacle, rod), (places, sum)) in sums.iter().take(10) {
        let size = sum.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
        let [x, y, z] = sum.map(|x| number(unless_noise(x, size)));
        say!("obstacle {obstacle} presses on rod {rod} at {places} places: ({x}, {y}, {z}) N")?;
    }
    Ok(())
}
