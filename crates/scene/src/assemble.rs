//! From the file's words to a checked model: every value is checked before anything large is allocated.

use std::ops::Range;

use nalgebra::Vector3;
use rod::{
    Air, Assembly, Body, Change, Changing, Damping, Gusts, Integrator, Lift, Load, Model, ModelError, SlidingJoint,
    StrainMeasure, Wind,
};
use toml::Spanned;

use crate::builder::Builder;
use crate::error::{Result, Source};
use crate::motion::track;
use crate::net::Net;
use crate::origin::origin;
use crate::refine::Refinement;
use crate::shape::number_or;
use crate::tree::Growth;
use crate::{
    MAX_SEGMENTS, RunDefaults, Scene, bodies, contact, copies, defaults, eyelet, format, motor, net, probe, pulley,
    rods, sheath,
};

/// The scene that `file` describes, its segments cut into parts.
pub(crate) fn scene(source: &Source, file: &format::File, refinement: Refinement) -> Result<Scene> {
    let vector = |value: &format::Vector| source.vector(value, "m/s^2");
    let gravity = file.gravity_m_s2.as_ref().map_or(Ok(Vector3::new(0.0, 0.0, -defaults::GRAVITY)), vector)?;
    let rate = |value: &Option<format::Number>| number_or(value, 0.0, |v| source.not_negative(v, "1/s"));
    let damping = Damping { linear: rate(&file.damping.linear_per_s)?, angular: rate(&file.damping.angular_per_s)? };
    let run = RunDefaults {
        dt: number_or(&file.run.dt_s, defaults::DT, |v| source.positive(v, "s"))?,
        steps: file.run.steps.as_ref().map_or(Ok(defaults::STEPS), |v| source.count(v, 1, 1_000_000_000))?,
        every: file.run.every.as_ref().map_or(Ok(1), |v| source.count(v, 1, 1_000_000_000))?,
        integrator: file.run.integrator.map(|named| match named {
            format::Integrator::Euler => Integrator::Euler,
            format::Integrator::Bdf2 => Integrator::Bdf2,
        }),
    };
    let from = file.run.from.as_ref().map(|from| origin(source, from)).transpose()?;
    let begins_at_rest =
        file.run.begin.as_ref().is_some_and(|begin| *begin.get_ref() == format::Beginning::Equilibrium);
    if let (Some(begin), true, Some(_)) = (&file.run.begin, begins_at_rest, &from) {
        return source.wrong(begin.span(), "does not go with `from`; leave one of them out");
    }
    if file.rods.is_empty() && file.nets.is_empty() && file.bodies.is_empty() {
        let message = "there must be at least one rod (`rods`), net (`nets`) or rigid body (`bodies`)";
        return Err(source.invalid(0, message.to_owned()));
    }
    check_size(source, file, refinement)?;
    let (contacts, obstacles) = contact::contacts(source, file)?;

    let mut assembly = Assembly::new(gravity);
    assembly.damping(damping);
    if let Some(air) = &file.air {
        assembly.air(self::air(source, air)?);
    }
    assembly.model_mut().contacts = contacts;
    if let Some(gravity) = &file.gravity_over_time {
        if let Some(constant) = &file.gravity_m_s2 {
            return source.wrong(constant.span(), "does not go with `gravity_over_time`; leave one of them out");
        }
        let format::Gravity { times_s, values_m_s2, interpolation } = gravity.get_ref();
        let track = track(source, times_s, values_m_s2, interpolation, false, "m/s^2")?;
        assembly.model_mut().gravity = track.at(0.0);
        assembly.model_mut().changes.push(Change { of: Changing::Gravity, track });
    }
    let mut builder = Builder::new(refinement, assembly, run.dt * run.steps as f64);
    // Place in the text of the entry that each rod comes from.
    let mut entry_of = Vec::new();
    for (i, body) in file.bodies.iter().enumerate() {
        bodies::add(&mut builder, source, i, body)?;
        entry_of.resize(builder.rods.len(), body.span());
    }
    for (i, rod) in file.rods.iter().enumerate() {
        rods::add(&mut builder, source, i, rod)?;
        entry_of.resize(builder.rods.len(), rod.span());
    }
    for (i, entry) in file.nets.iter().enumerate() {
        let name = builder.new_name(source, &entry.get_ref().name, format!("net-{i}"), entry.span())?;
        Net::new(source, entry, refinement)?.build(&mut builder, &name);
        entry_of.resize(builder.rods.len(), entry.span());
    }
    let is_known = |builder: &Builder, place: &format::Place| {
        place.rod.as_ref().or(place.body.as_ref()).is_none_or(|name| builder.has(name.get_ref()))
    };
    let (joins, of_copies): (Vec<_>, Vec<_>) = file.joins.iter().partition(|join| {
        let format::Join { a, b, .. } = join.get_ref();
        is_known(&builder, a.get_ref()) && is_known(&builder, b.get_ref()) || file.copies.is_empty()
    });
    let join = |builder: &mut Builder, join: &Spanned<format::Join>| {
        builder.join(source, join)?;
        join.get_ref().motor.as_ref().map_or(Ok(()), |own| motor::add(builder, source, own))
    };
    for own in joins {
        join(&mut builder, own)?;
    }
    for entry in &file.copies {
        copies::add(&mut builder, source, entry)?;
        entry_of.resize(builder.rods.len(), entry.span());
    }
    for own in of_copies {
        join(&mut builder, own)?;
    }
    let eyelets = eyelet::eyelets(&mut builder, source, &file.eyelets)?;
    eyelet::feeds(&mut builder, source, &file.eyelets)?;
    let pulleys = pulley::pulleys(&mut builder, source, &file.pulleys)?;
    if let Some(last) = file.pulleys.last() {
        // Wheels with inertia are bodies.
        entry_of.resize(builder.rods.len(), last.span());
    }
    let sheaths = sheath::sheaths(&mut builder, source, &file.sheaths)?;
    let probes = probe::probes(&mut builder, source, &file.probes)?;

    let Builder { assembly, rods, own_rests, .. } = builder;
    let (mut model, state) = assembly.finish();
    if let Some(buoyancy) = file.air.as_ref().and_then(|air| air.buoyancy.as_ref()).filter(|own| *own.get_ref()) {
        if model.sliding_joints.iter().any(SlidingJoint::has_store) {
            return source
                .wrong(buoyancy.span(), "does not go with a feed that has a store, which bears what is in it");
        }
        lift(&mut model);
    }
    match file.bending {
        format::Bending::Angle => model.measure_bent_from_rest(&own_rests),
        format::Bending::Paper => model.strain_measure = StrainMeasure::Sine,
        format::Bending::RestRotation => model.measure_from_rest(),
    }
    if model.segments.len() > MAX_SEGMENTS {
        let message = format!("rods: {} segments in all, but {MAX_SEGMENTS} are the most", model.segments.len());
        return Err(source.invalid(0, message));
    }
    if let Err(error) = model.validate(&state) {
        let span = entry_at_fault(&model, &error).and_then(|rod| entry_of.get(rod).cloned()).unwrap_or(0..0);
        return source.wrong(span, &format!("this gives a model that cannot be simulated: {error}"));
    }
    let (name, description) = (stem(source.file), file.description.clone());
    Ok(Scene {
        name,
        description,
        model,
        state,
        run,
        rods,
        obstacles,
        eyelets,
        pulleys,
        sheaths,
        probes,
        from,
        begins_at_rest,
        text: None,
    })
}

fn air(source: &Source, air: &format::Air) -> Result<Air> {
    let drag = |value: &_| source.not_negative(value, "");
    Ok(Air {
        density: number_or(&air.density_kg_m3, defaults::AIR_DENSITY, |v| source.positive(v, "kg/m^3"))?,
        normal_drag: number_or(&air.normal_drag, defaults::NORMAL_DRAG, drag)?,
        tangential_drag: number_or(&air.tangential_drag, defaults::TANGENTIAL_DRAG, drag)?,
        wind: air.wind.as_ref().map_or(Ok(Wind::steady(Vector3::zeros())), |wind| self::wind(source, wind))?,
    })
}

/// Lets what the air about each segment and body weighs lift it: Archimedes' force, at the centre.
fn lift(model: &mut Model) {
    let Some(density) = model.air.as_ref().map(|air| air.density) else { return };
    for (i, segment) in model.segments.iter().enumerate() {
        let round = std::f64::consts::PI * segment.radius.powi(2) * segment.length;
        let mass = density * segment.body.as_ref().map_or(round, |body| body.shape.volume());
        model.lifts.push(Lift { load: model.loads.len(), mass });
        let (force, zero) = (model.gravity * -mass, Vector3::zeros());
        model.loads.push(Load { segment: i, offset: 0.0, force, torque: zero, follows: false });
    }
}

fn wind(source: &Source, wind: &format::Wind) -> Result<Wind> {
    let mean = source.vector(&wind.velocity_m_s, "m/s")?;
    let gusts = |gusts: &format::Gusts| {
        Ok(Gusts {
            strength: source.not_negative(&gusts.strength, "")?,
            length: number_or(&gusts.length_m, defaults::GUST_LENGTH, |v| source.positive(v, "m"))?,
            time: number_or(&gusts.time_s, defaults::GUST_TIME, |v| source.positive(v, "s"))?,
            seed: gusts.seed,
        })
    };
    let gusts = wind.gusts.as_ref().map(gusts).transpose()?;
    let period = wind.rotation_period_s.as_ref().map(|v| source.positive(v, "s")).transpose()?;
    Ok(Wind::new(mean, gusts, period))
}

/// Checks all counts, so that no later stage allocates more than [`MAX_SEGMENTS`] need.
fn check_size(source: &Source, file: &format::File, refinement: Refinement) -> Result<()> {
    let mut total: usize = file.bodies.len();
    let mut add = |what: &str, span: Range<usize>, segments: usize| {
        total = total.saturating_add(segments.saturating_mul(refinement.0));
        if total > MAX_SEGMENTS {
            let message = format!("with this {what} the scene has {total} segments, but {MAX_SEGMENTS} are the most");
            return source.wrong(span, &message);
        }
        Ok(())
    };
    for entry in &file.rods {
        let rod = entry.get_ref();
        let mut segments = rod.shape.get_ref().segments(source)?;
        if let Some(tree) = &rod.tree {
            segments = segments.saturating_add(Growth::new(source, tree)?.least_segments());
        }
        let strands = rod.strands.as_ref().map_or(Ok(1), |strands| strands.count(source))?;
        let heap = rod.heap.as_ref().map_or(Ok(1), |heap| heap.count(source))?;
        add("rod", entry.span(), segments.saturating_mul(strands).saturating_mul(heap))?;
    }
    for entry in &file.nets {
        add("net", entry.span(), net::segments(source, entry.get_ref())?)?;
    }
    Ok(())
}

/// The rod that the model's error is about.
fn entry_at_fault(model: &rod::Model, error: &ModelError) -> Option<usize> {
    let (ModelError::Value { what, index, .. } | ModelError::Index { what, index, .. }) = error else { return None };
    let segment = match *what {
        "segment" => *index,
        "load" => model.loads.get(*index)?.segment,
        "joint" => [model.joints.get(*index)?.b, model.joints[*index].a].into_iter().find_map(|body| match body {
            Body::Segment(i) => Some(i),
            Body::Anchor(_) => None,
        })?,
        _ => return None,
    };
    model.segments.get(segment).map(|s| s.rod)
}

/// The file's name without folder and extension.
fn stem(file: &str) -> String {
    std::path::Path::new(file).file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}
