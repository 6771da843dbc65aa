//! From an entry of `[[rods]]` to a rod with all that belongs to it: clamps, masses, loads, velocities, branches, copies.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};
use rod::{Body, Change, Changing, Load, RodSpec};
use toml::Spanned;

use crate::builder::{Builder, Spot, check_fraction};
use crate::error::{Result, Source};
use crate::grips::Grips;
use crate::heap::Heap;
use crate::law::laws;
use crate::motion::{Prepared, track};
use crate::refine::mean;
use crate::shape::number_or;
use crate::strain::strains;
use crate::strands::Strands;
use crate::strength::strengths;
use crate::tree::Growth;
use crate::{MAX_SEGMENTS, branch, format, foundation, properties, rest, section};

/// Builds entry `index` of the file's rods: one rod, many strands, or a heap.
pub(crate) fn add(builder: &mut Builder, source: &Source, index: usize, entry: &Spanned<format::Rod>) -> Result<()> {
    let rod = entry.get_ref();
    let name = builder.new_name(source, &rod.name, format!("rod-{index}"), entry.span())?;
    let branch_of = rod.branch_of.as_ref().map(|place| builder.spot(source, place)).transpose()?;
    let spec = spec(builder, source, rod, branch_of)?;
    let motions = rod.motions.iter().map(|motion| Prepared::new(source, motion)).collect::<Result<Vec<_>>>()?;
    let copies: Vec<Vec<Vector3<f64>>> = match (&rod.strands, &rod.heap) {
        (None, None) => return build(builder, source, entry, name, &spec, branch_of, &motions),
        (Some(strands), None) => Strands::new(source, strands, rod, &spec, builder.refinement)?.nodes().collect(),
        (None, Some(heap)) => Heap::new(source, heap, rod, &spec)?.nodes().collect(),
        (Some(strands), Some(_)) => return source.wrong(strands.count.span(), "give either `strands` or `heap`"),
    };
    for (k, nodes) in copies.into_iter().enumerate() {
        let own = format!("{name}/{k}");
        if builder.has(&own) {
            return source.wrong(entry.span(), &format!("one of its rods is called `{own}`, as another rod is"));
        }
        build(builder, source, entry, own, &RodSpec { nodes, ..spec.clone() }, None, &motions)?;
    }
    Ok(())
}

/// Builds one rod of an entry, with its clamps, masses, loads, velocities and branches.
fn build(
    builder: &mut Builder,
    source: &Source,
    entry: &Spanned<format::Rod>,
    name: String,
    spec: &RodSpec,
    branch_of: Option<Spot>,
    motions: &[Prepared],
) -> Result<()> {
    let rod = entry.get_ref();
    let segments = match branch_of {
        Some(Spot::Rod(segment, fraction)) => builder.add_rod(name, spec, Some((segment, fraction))),
        _ => builder.add_rod(name, spec, None),
    };
    if let Some(Spot::Body(body, at)) = branch_of {
        builder.assembly.join_body(segments.start, 0.0, body, &at.unwrap_or_default());
    }
    branch::shape_joint(builder, source, rod, branch_of)?;
    let count = builder.refinement.count(&segments);
    if spec.closed && !rod.clamp.is_empty() {
        return source.wrong(rod.clamp[0].span(), "a closed rod has no ends; name `fixed_segments` instead");
    }
    let mut grips = Grips::new(&segments);
    for (i, clamp) in rod.clamp.iter().enumerate() {
        if rod.clamp[..i].iter().any(|earlier| earlier.get_ref() == clamp.get_ref()) {
            return source.wrong(clamp.span(), "named twice");
        }
        grips.clamp(builder, *clamp.get_ref());
    }
    let mut fixed = HashMap::new();
    for (i, segment) in rod.fixed_segments.iter().enumerate() {
        let index = source.index(segment, count)?;
        if let Some(earlier) = fixed.insert(index, i) {
            let names = [earlier, i].map(|i| rod.fixed_segments[i].get_ref());
            let message = format!("entries {earlier} ({}) and {i} ({}) are both segment {index}", names[0], names[1]);
            return source.wrong(segment.span(), &message);
        }
        grips.fix(builder, index);
    }
    for grip in &rod.grips {
        grips.hold(builder, source, grip, spec.closed)?;
    }
    for (motion, prepared) in rod.motions.iter().zip(motions) {
        grips.drive(builder, source, (motion, prepared), spec.closed)?;
    }
    for mass in &rod.masses {
        let parts = builder.refinement.parts(&segments, source.index(&mass.segment, count)?);
        let share = source.not_negative(&mass.mass_kg, "kg")? / parts.len() as f64;
        for part in parts {
            builder.assembly.add_mass(part, share);
        }
    }
    for load in &rod.loads {
        add_load(builder, source, load, &segments, spec.closed)?;
    }
    for springs in &rod.foundations {
        foundation::add(builder, source, springs, &segments)?;
    }
    if let Some(turns) = &rod.first_turns_deg {
        turn(builder, source, turns, &segments, spec.closed)?;
    }
    set_velocities(builder, source, rod, &segments, &grips)?;
    grips.check_reach(builder, source, spec.closed)?;
    if let Some(tree) = &rod.tree {
        if spec.closed {
            return source.wrong(rod.shape.span(), "a tree's trunk must not be closed");
        }
        let length = segments.map(|i| builder.segment(i).length).sum();
        let trunk = builder.rods[builder.rods.len() - 1].clone();
        let growth = Growth::new(source, tree)?;
        if !growth.grow(builder, &trunk, length, spec, builder.refinement) {
            let message = format!("with this tree the scene has more than {MAX_SEGMENTS} segments");
            return source.wrong(entry.span(), &message);
        }
    }
    Ok(())
}

fn spec(builder: &mut Builder, source: &Source, rod: &format::Rod, branch_of: Option<Spot>) -> Result<RodSpec> {
    let shape = rod.shape.get_ref();
    let closed = shape.closed();
    if let (Some(_), Some(start)) = (branch_of, shape.start()) {
        return source.wrong(start.span(), "a branch starts on its parent; leave it out");
    }
    if let (true, Some(place)) = (closed, &rod.branch_of) {
        return source.wrong(place.get_ref().named(), "a closed rod cannot be a branch; use `joins`");
    }
    let at = branch_of.map(|spot| builder.place_of(spot));
    let material = properties::material(source, &rod.youngs_modulus_pa, &rod.torsion_modulus_pa, &rod.density_kg_m3)?;
    let gravity = builder.assembly.model_mut().gravity;
    let nodes = shape.nodes(source, rod.shape.span(), at, gravity, builder.refinement)?;
    let parts = if closed { nodes.len() } else { nodes.len() - 1 };
    let segments = builder.refinement.count(&(0..parts));
    let twist = properties::twist(source, &rod.twist_deg, closed, segments)?;
    let longest = nodes.windows(2).map(|pair| (pair[1] - pair[0]).norm()).fold(0.0, f64::max);
    let (sections, radii) = section::sections(source, rod, &nodes, closed)?;
    let mut spec = RodSpec {
        closed,
        radii,
        sections,
        stretch: properties::stretch(source, &rod.stretch, builder.refinement)?,
        inner_damping: section::inner_damping(source, &rod.inner_damping)?,
        d1: section::d1(source, rod, &nodes)?,
        twist: builder.refinement.twist(twist, segments),
        rest: properties::rest(
            source,
            rod.rest.as_ref().unwrap_or(shape.rest()),
            longest,
            (segments, closed),
            builder.refinement,
        )?,
        ..RodSpec::new(nodes, 0.0, material)
    };
    if let Some(course) = &rod.rest_over_time {
        if rod.rest.is_some() {
            return source.wrong(course.span(), "does not go with `rest`; leave one of them out");
        }
        spec.rests = rest::tracks(source, course, longest, (segments, closed), builder.refinement)?;
    }
    spec.strains = strains(source, rod, &spec)?;
    spec.laws = laws(source, rod, &spec, parts)?;
    spec.strengths = strengths(source, rod, &spec.nodes, closed)?;
    Ok(spec)
}

fn add_load(
    builder: &mut Builder,
    source: &Source,
    load: &Spanned<format::Load>,
    segments: &Range<usize>,
    closed: bool,
) -> Result<()> {
    let format::Load { at, segment, fraction, .. } = load.get_ref();
    let (segment, fraction) = match (at, segment) {
        (Some(at), None) if closed => return source.wrong(at.span(), "a closed rod has no end faces"),
        (Some(at), None) => {
            if let Some(fraction) = fraction {
                return source.wrong(fraction.span(), "goes with `segment`, not with `at`");
            }
            match at.get_ref() {
                format::Face::StartFace => (segments.start, 0.0),
                format::Face::EndFace => (segments.end - 1, 1.0),
            }
        }
        (None, Some(segment)) => {
            let index = source.index(segment, builder.refinement.count(segments))?;
            let fraction = number_or(fraction, 0.5, |v| check_fraction(source, v))?;
            builder.refinement.place(segments, index, fraction)
        }
        _ => return source.wrong(load.span(), "give either `at` or `segment`"),
    };
    let offset = (fraction - 0.5) * builder.segment(segment).length;
    add_forces(builder, source, load, segment, offset)
}

/// Lets an entry's forces and torques act on a segment, at a place along its axis [m].
pub(crate) fn add_forces(
    builder: &mut Builder,
    source: &Source,
    load: &Spanned<format::Load>,
    segment: usize,
    offset: f64,
) -> Result<()> {
    let format::Load { force_n, torque_n_m, times_s, forces_n, torques_n_m, interpolation, follows, repeats, .. } =
        load.get_ref();
    // The axes in which it is given turn with the segment from its first orientation on.
    let own = if *follows {
        builder.assembly.state_mut().orientations[segment].inverse()
    } else {
        UnitQuaternion::identity()
    };
    let changes = [forces_n, torques_n_m].into_iter().flatten().next();
    match (times_s, changes) {
        (Some(times), None) => return source.wrong(times.span(), "goes with `forces_n` or `torques_n_m`"),
        (None, Some(values)) => return source.wrong(values.span(), "goes with `times_s`"),
        (None, None) if force_n.is_none() && torque_n_m.is_none() => {
            return source.wrong(load.span(), "give `force_n` or `torque_n_m` or both, or `times_s` and lists");
        }
        _ => {}
    }
    for (constant, list) in [(force_n, forces_n), (torque_n_m, torques_n_m)] {
        if let (Some(constant), Some(_)) = (constant, list) {
            return source.wrong(constant.span(), "is given over time, too; leave one of them out");
        }
    }
    if *repeats && times_s.is_none() {
        return source.wrong(load.span(), "`repeats` goes with `times_s`");
    }
    if let (Some(interpolation), None) = (interpolation, times_s) {
        return source.wrong(interpolation.span(), "goes with `times_s`");
    }
    let vector =
        |value: &Option<format::Vector>, unit| value.as_ref().map_or(Ok(Vector3::zeros()), |v| source.vector(v, unit));
    let given = (vector(force_n, "N")?, vector(torque_n_m, "N m")?);
    let (mut force, mut torque) = if *follows { (own * given.0, own * given.1) } else { given };
    let index = builder.assembly.model_mut().loads.len();
    if let Some(times) = times_s {
        let of = [
            (forces_n, "N", Changing::Force(index), &mut force),
            (torques_n_m, "N m", Changing::Torque(index), &mut torque),
        ];
        for (list, unit, of, first) in of {
            let Some(list) = list else { continue };
            let mut track = track(source, times, list, interpolation, *repeats, unit)?;
            if *follows {
                track = Arc::new(track.turned(&own));
            }
            *first = track.at(0.0);
            builder.assembly.model_mut().changes.push(Change { of, track });
        }
    }
    builder.assembly.load(Load { segment, offset, force, torque, follows: *follows });
    Ok(())
}

/// Turns the rod's segments about their own axes; its rest shape and what holds it stay as they are.
fn turn(
    builder: &mut Builder,
    source: &Source,
    turns: &Spanned<Vec<format::Number>>,
    segments: &Range<usize>,
    closed: bool,
) -> Result<()> {
    let (count, found) = (builder.refinement.count(segments), turns.get_ref().len());
    if closed {
        return source.wrong(turns.span(), "a closed rod has no first turns");
    }
    if found != count {
        return source.wrong(turns.span(), &format!("{found} numbers, but there must be one a segment ({count})"));
    }
    let mut before = None;
    for (index, value) in turns.get_ref().iter().enumerate() {
        let degrees = source.finite(value, "degrees")?;
        let last = before.replace(degrees).unwrap_or(degrees);
        if (degrees - last).abs() >= 180.0 {
            let allowed = format!("less than half a turn from the segment's before, {last} [degrees]");
            return source.must_be(value.span(), &allowed);
        }
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), degrees.to_radians());
        for part in builder.refinement.parts(segments, index) {
            if degrees != 0.0 && builder.segment(part).fixed {
                return source.must_be(value.span(), "0 [degrees]: this segment is held");
            }
            builder.assembly.state_mut().orientations[part] *= turn;
        }
    }
    Ok(())
}

/// Gives the rod's free segments the velocities of a rigid body, then single segments their own.
fn set_velocities(
    builder: &mut Builder,
    source: &Source,
    rod: &format::Rod,
    segments: &Range<usize>,
    grips: &Grips,
) -> Result<()> {
    let vector = |value: &Option<format::Vector>, unit| value.as_ref().map(|v| source.vector(v, unit)).transpose();
    let of_all = vector(&rod.velocity_m_s, "m/s")?.unwrap_or_default();
    let spin = vector(&rod.angular_velocity_rad_s, "rad/s")?.unwrap_or_default();
    let masses: Vec<f64> = segments.clone().map(|i| builder.segment(i).mass()).collect();
    let fixed: Vec<bool> = segments.clone().map(|i| builder.segment(i).fixed).collect();
    let state = builder.assembly.state_mut();
    let weighted: Vector3<f64> = segments.clone().zip(&masses).map(|(i, mass)| state.positions[i] * *mass).sum();
    let centre = weighted / masses.iter().sum::<f64>();
    for i in segments.clone().filter(|i| !fixed[i - segments.start]) {
        state.velocities[i] = of_all + spin.cross(&(state.positions[i] - centre));
        state.angular_velocities[i] = spin;
    }
    for own in &rod.velocities {
        let parts = builder.refinement.parts(segments, source.index(&own.segment, builder.refinement.count(segments))?);
        if grips.drives(Body::Segment(parts.start)) {
            return source.wrong(own.segment.span(), "a motion drives this segment; leave its velocity out");
        }
        let centre = mean(&state.positions[parts.clone()]);
        let velocity = vector(&own.velocity_m_s, "m/s")?;
        let velocity = velocity.unwrap_or_else(|| mean(&state.velocities[parts.clone()]));
        let spin = vector(&own.angular_velocity_rad_s, "rad/s")?;
        let spin = spin.unwrap_or(state.angular_velocities[parts.start]);
        for i in parts {
            state.velocities[i] = velocity + spin.cross(&(state.positions[i] - centre));
            state.angular_velocities[i] = spin;
        }
    }
    Ok(())
}
