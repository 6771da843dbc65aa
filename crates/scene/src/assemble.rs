//! From the file's words to a checked model: every value is checked before anything large is allocated.

use std::collections::HashMap;
use std::ops::Range;

use nalgebra::{UnitQuaternion, Vector3};
use rod::{Air, Assembly, Body, Damping, Gusts, Load, ModelError, RodSpec, Segment, Wind};
use toml::Spanned;

use crate::error::{Result, Source, short};
use crate::net::Net;
use crate::refine::{Refinement, mean};
use crate::shape::number_or;
use crate::strands::Strands;
use crate::tree::Growth;
use crate::{MAX_SEGMENTS, RodInfo, RunDefaults, Scene, contact, defaults, format, net, properties};

/// How far apart two joined places may lie, in units of the shorter segment.
const JOIN_TOLERANCE: f64 = 0.01;

/// Rods and their names so far.
pub(crate) struct Builder {
    refinement: Refinement,
    assembly: Assembly,
    rods: Vec<RodInfo>,
    by_name: HashMap<String, usize>,
}

/// The scene that `file` describes, its segments cut into parts.
pub(crate) fn scene(source: &Source, file: &format::File, refinement: Refinement) -> Result<Scene> {
    let vector = |value: &format::Vector| source.vector(value, "m/s^2");
    let gravity = file.gravity_m_s2.as_ref().map_or(Ok(Vector3::new(0.0, 0.0, -defaults::GRAVITY)), vector)?;
    let rate = |value: &Option<format::Number>| number_or(value, 0.0, |v| source.not_negative(v, "1/s"));
    let damping = Damping { linear: rate(&file.damping.linear_per_s)?, angular: rate(&file.damping.angular_per_s)? };
    let run = RunDefaults {
        dt: number_or(&file.run.dt_s, defaults::DT, |v| source.positive(v, "s"))?,
        steps: file.run.steps.as_ref().map_or(Ok(defaults::STEPS), |v| source.count(v, 1, 1_000_000_000))?,
    };
    if file.rods.is_empty() && file.nets.is_empty() {
        return Err(source.invalid(0, "there must be at least one rod (`rods`) or net (`nets`)".to_owned()));
    }
    check_size(source, file, refinement)?;
    let (contacts, obstacles) = contact::contacts(source, file)?;

    let mut assembly = Assembly::new(gravity);
    assembly.damping(damping);
    if let Some(air) = &file.air {
        assembly.air(self::air(source, air)?);
    }
    let mut builder = Builder { refinement, assembly, rods: Vec::new(), by_name: HashMap::new() };
    builder.assembly.model_mut().contacts = contacts;
    // Place in the text of the entry that each rod comes from.
    let mut entry_of = Vec::new();
    for (i, rod) in file.rods.iter().enumerate() {
        builder.declare(source, i, rod)?;
        entry_of.resize(builder.rods.len(), rod.span());
    }
    for (i, entry) in file.nets.iter().enumerate() {
        let name = builder.new_name(source, &entry.get_ref().name, format!("net-{i}"), entry.span())?;
        Net::new(source, entry, refinement)?.build(&mut builder, &name);
        entry_of.resize(builder.rods.len(), entry.span());
    }
    for join in &file.joins {
        builder.join(source, join)?;
    }

    let Builder { assembly, rods, .. } = builder;
    let (model, state) = assembly.finish();
    if model.segments.len() > MAX_SEGMENTS {
        let message = format!("rods: {} segments in all, but {MAX_SEGMENTS} are the most", model.segments.len());
        return Err(source.invalid(0, message));
    }
    if let Err(error) = model.validate(&state) {
        let span = entry_at_fault(&model, &error).map_or(0..0, |rod| entry_of[rod].clone());
        return source.wrong(span, &format!("this gives a model that cannot be simulated: {error}"));
    }
    Ok(Scene { name: stem(source.file), description: file.description.clone(), model, state, run, rods, obstacles })
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
    let mut total: usize = 0;
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
        add("rod", entry.span(), segments.saturating_mul(strands))?;
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

impl Builder {
    pub(crate) fn segment(&mut self, i: usize) -> Segment {
        self.assembly.model_mut().segments[i]
    }

    pub(crate) fn orientation(&mut self, i: usize) -> UnitQuaternion<f64> {
        self.assembly.state_mut().orientations[i]
    }

    /// Place [m] at a fraction of a segment's length.
    pub(crate) fn point(&mut self, i: usize, fraction: f64) -> Vector3<f64> {
        let length = self.segment(i).length;
        let state = self.assembly.state_mut();
        state.positions[i] + state.axis(i) * ((fraction - 0.5) * length)
    }

    /// Adds a rod, grown on a segment at a fraction of its length if it is a branch, and returns its segments.
    pub(crate) fn add_rod(&mut self, name: String, spec: &RodSpec, branch_of: Option<(usize, f64)>) -> Range<usize> {
        let segments = self.assembly.rod(spec);
        if let Some((segment, fraction)) = branch_of {
            self.assembly.branch(segment, fraction, &segments);
        }
        self.by_name.insert(name.clone(), self.rods.len());
        self.rods.push(RodInfo { name, segments: segments.clone(), closed: spec.closed });
        segments
    }

    /// `given` or `default`, if no rod has that name yet; `span` is the entry's place in the text.
    fn new_name(
        &self,
        source: &Source,
        given: &Option<Spanned<String>>,
        default: String,
        span: Range<usize>,
    ) -> Result<String> {
        let name = given.as_ref().map_or(default, |name| name.get_ref().clone());
        match self.by_name.contains_key(&name) {
            true => source.must_be(given.as_ref().map_or(span, Spanned::span), "a name that no other rod has"),
            false => Ok(name),
        }
    }

    /// Builds entry `index` of the file's rods with all that belongs to it.
    fn declare(&mut self, source: &Source, index: usize, entry: &Spanned<format::Rod>) -> Result<()> {
        let rod = entry.get_ref();
        let name = self.new_name(source, &rod.name, format!("rod-{index}"), entry.span())?;
        let branch_of = rod.branch_of.as_ref().map(|place| self.place(source, place)).transpose()?;
        let spec = self.spec(source, rod, branch_of)?;
        let Some(strands) = &rod.strands else { return self.build(source, entry, name, &spec, branch_of) };
        let strands = Strands::new(source, strands, rod, &spec, self.refinement)?;
        for (k, nodes) in strands.nodes().enumerate() {
            self.build(source, entry, format!("{name}/{k}"), &RodSpec { nodes, ..spec.clone() }, None)?;
        }
        Ok(())
    }

    /// Builds a rod with what the keys of its entry hang on it.
    fn build(
        &mut self,
        source: &Source,
        entry: &Spanned<format::Rod>,
        name: String,
        spec: &RodSpec,
        branch_of: Option<(usize, f64)>,
    ) -> Result<()> {
        let rod = entry.get_ref();
        let segments = self.add_rod(name, spec, branch_of);
        let count = self.refinement.count(&segments);
        if spec.closed && !rod.clamp.is_empty() {
            return source.wrong(rod.clamp[0].span(), "a closed rod has no ends; name `fixed_segments` instead");
        }
        for (i, clamp) in rod.clamp.iter().enumerate() {
            if rod.clamp[..i].iter().any(|earlier| earlier.get_ref() == clamp.get_ref()) {
                return source.wrong(clamp.span(), "named twice");
            }
            match clamp.get_ref() {
                format::Clamp::StartSegment => self.fix(&segments, 0),
                format::Clamp::EndSegment => self.fix(&segments, count - 1),
                format::Clamp::StartFace => _ = self.assembly.clamp_start(&segments),
                format::Clamp::EndFace => _ = self.assembly.clamp_end(&segments),
            };
        }
        for segment in &rod.fixed_segments {
            self.fix(&segments, source.index(segment, count)?);
        }
        for mass in &rod.masses {
            let parts = self.refinement.parts(&segments, source.index(&mass.segment, count)?);
            let share = source.not_negative(&mass.mass_kg, "kg")? / parts.len() as f64;
            for part in parts {
                self.assembly.add_mass(part, share);
            }
        }
        for load in &rod.loads {
            self.load(source, load, &segments, spec.closed)?;
        }
        self.velocities(source, rod, &segments)?;
        if let Some(tree) = &rod.tree {
            if spec.closed {
                return source.wrong(rod.shape.span(), "a tree's trunk must not be closed");
            }
            let length = segments.map(|i| self.segment(i).length).sum();
            let trunk = self.rods[self.rods.len() - 1].clone();
            let growth = Growth::new(source, tree)?;
            if !growth.grow(self, &trunk, length, spec, self.refinement) {
                let message = format!("with this tree the scene has more than {MAX_SEGMENTS} segments");
                return source.wrong(entry.span(), &message);
            }
        }
        Ok(())
    }

    /// Fixes all parts of the file's segment `index` of a rod.
    fn fix(&mut self, rod: &Range<usize>, index: usize) {
        for part in self.refinement.parts(rod, index) {
            self.assembly.fix(part);
        }
    }

    fn spec(&mut self, source: &Source, rod: &format::Rod, branch_of: Option<(usize, f64)>) -> Result<RodSpec> {
        let shape = rod.shape.get_ref();
        let closed = shape.closed();
        if let (Some(_), Some(start)) = (branch_of, shape.start()) {
            return source.wrong(start.span(), "a branch starts on its parent; leave `start_m` out");
        }
        if let (true, Some(place)) = (closed, &rod.branch_of) {
            return source.wrong(place.rod.span(), "a closed rod cannot be a branch; use `joins`");
        }
        let at = branch_of.map(|(segment, fraction)| self.point(segment, fraction));
        let material =
            properties::material(source, &rod.youngs_modulus_pa, &rod.torsion_modulus_pa, &rod.density_kg_m3)?;
        let nodes = shape.nodes(source, rod.shape.span(), at, self.refinement)?;
        let parts = if closed { nodes.len() } else { nodes.len() - 1 };
        let segments = self.refinement.count(&(0..parts));
        let twist = properties::twist(source, &rod.twist_deg, closed, segments)?;
        let longest = nodes.windows(2).map(|pair| (pair[1] - pair[0]).norm()).fold(0.0, f64::max);
        Ok(RodSpec {
            closed,
            radii: properties::radii(source, &rod.radius_m, parts)?,
            stretch: properties::stretch(source, &rod.stretch, self.refinement)?,
            twist: self.refinement.twist(twist, segments),
            rest: properties::rest(source, &rod.rest, longest)?,
            ..RodSpec::new(nodes, 0.0, material)
        })
    }

    fn load(
        &mut self,
        source: &Source,
        load: &Spanned<format::Load>,
        segments: &Range<usize>,
        closed: bool,
    ) -> Result<()> {
        let format::Load { at, segment, fraction, force_n, torque_n_m } = load.get_ref();
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
                let index = source.index(segment, self.refinement.count(segments))?;
                let fraction = number_or(fraction, 0.5, |v| check_fraction(source, v))?;
                self.refinement.place(segments, index, fraction)
            }
            _ => return source.wrong(load.span(), "give either `at` or `segment`"),
        };
        if force_n.is_none() && torque_n_m.is_none() {
            return source.wrong(load.span(), "give `force_n` or `torque_n_m` or both");
        }
        let vector = |value: &Option<format::Vector>, unit| {
            value.as_ref().map_or(Ok(Vector3::zeros()), |v| source.vector(v, unit))
        };
        let offset = (fraction - 0.5) * self.segment(segment).length;
        let (force, torque) = (vector(force_n, "N")?, vector(torque_n_m, "N m")?);
        self.assembly.load(Load { segment, offset, force, torque });
        Ok(())
    }

    /// Joins two segments at fractions of their lengths, as [`Assembly::join`].
    pub(crate) fn join_at(&mut self, a: (usize, f64), b: (usize, f64)) {
        self.assembly.join(a.0, a.1, b.0, b.1);
    }

    /// Gives the rod's free segments the velocities of a rigid body, then single segments their own.
    fn velocities(&mut self, source: &Source, rod: &format::Rod, segments: &Range<usize>) -> Result<()> {
        let vector = |value: &Option<format::Vector>, unit| value.as_ref().map(|v| source.vector(v, unit)).transpose();
        let of_all = vector(&rod.velocity_m_s, "m/s")?.unwrap_or_default();
        let spin = vector(&rod.angular_velocity_rad_s, "rad/s")?.unwrap_or_default();
        let masses: Vec<f64> = segments.clone().map(|i| self.segment(i).mass()).collect();
        let fixed: Vec<bool> = segments.clone().map(|i| self.segment(i).fixed).collect();
        let state = self.assembly.state_mut();
        let weighted: Vector3<f64> = segments.clone().zip(&masses).map(|(i, mass)| state.positions[i] * *mass).sum();
        let centre = weighted / masses.iter().sum::<f64>();
        for i in segments.clone().filter(|i| !fixed[i - segments.start]) {
            state.velocities[i] = of_all + spin.cross(&(state.positions[i] - centre));
            state.angular_velocities[i] = spin;
        }
        for own in &rod.velocities {
            let parts = self.refinement.parts(segments, source.index(&own.segment, self.refinement.count(segments))?);
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

    fn join(&mut self, source: &Source, join: &Spanned<format::Join>) -> Result<()> {
        let format::Join { a, b } = join.get_ref();
        let ((a, fraction_a), (b, fraction_b)) = (self.place(source, a)?, self.place(source, b)?);
        if a == b {
            return source.wrong(join.span(), "`a` and `b` are the same segment");
        }
        let gap = (self.point(a, fraction_a) - self.point(b, fraction_b)).norm();
        let whole = self.refinement.0 as f64;
        let most = JOIN_TOLERANCE * whole * self.segment(a).length.min(self.segment(b).length);
        if gap > most {
            let (gap, most) = (short(gap), short(most));
            let message = format!("`a` and `b` are {gap} m apart, but places to be joined must meet within {most} m");
            return source.wrong(join.span(), &message);
        }
        self.join_at((a, fraction_a), (b, fraction_b));
        Ok(())
    }

    /// Segment of the model and fraction of its length.
    fn place(&self, source: &Source, place: &format::Place) -> Result<(usize, f64)> {
        let Some(&rod) = self.by_name.get(place.rod.get_ref()) else {
            const SHOWN: usize = 8;
            let mut known: Vec<_> = self.rods.iter().take(SHOWN).map(|rod| format!("`{}`", rod.name)).collect();
            if self.rods.len() > SHOWN {
                known.push("...".to_owned());
            }
            let allowed = match known.is_empty() {
                true => "the name of a rod that comes before it, and there is none".to_owned(),
                false => format!("the name of a rod that comes before it: {}", known.join(", ")),
            };
            return source.must_be(place.rod.span(), &allowed);
        };
        let segments = &self.rods[rod].segments;
        let count = self.refinement.count(segments);
        let index = place.segment.as_ref().map_or(Ok(count - 1), |segment| source.index(segment, count))?;
        let fraction = number_or(&place.fraction, 1.0, |v| check_fraction(source, v))?;
        Ok(self.refinement.place(segments, index, fraction))
    }
}

fn check_fraction(source: &Source, value: &format::Number) -> Result<f64> {
    source.number(value, |v| (0.0..=1.0).contains(&v), "0 (the segment's start) to 1 (its end)")
}
