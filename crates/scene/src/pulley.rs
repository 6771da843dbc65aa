//! Pulleys: wheels over which rods run.

use nalgebra::{Unit, UnitQuaternion, Vector3};
use rod::{Body, BodyShape, Driven, Freedom, InnerDamping, Joint, Pose, Pulley, RigidBody, Wheel};
use toml::Spanned;

use crate::builder::{Builder, Spot};
use crate::error::{Result, Source};
use crate::format;
use crate::measures::length;
use crate::motion::{Prepared, ascending, one_a_time};
use crate::probe::add_named;
use crate::shape::number_or;

/// Adds the scene's pulleys to the model; returns their names.
pub(crate) fn pulleys(
    builder: &mut Builder,
    source: &Source,
    entries: &[Spanned<format::Pulley>],
) -> Result<Vec<String>> {
    add_named(source, "pulley", entries, |own| own.name.as_ref(), |entry, name| add(builder, source, entry, name))
}

fn add(builder: &mut Builder, source: &Source, entry: &Spanned<format::Pulley>, name: &str) -> Result<()> {
    let own = entry.get_ref();
    let rod = builder.rod(source, &own.rod)?;
    if rod.closed {
        return source.wrong(own.rod.span(), "is closed, but rods on pulleys have ends");
    }
    let segments = rod.segments.clone();
    if builder.assembly.model_mut().can_break(&segments) {
        return source.wrong(own.rod.span(), "must be a rod that does not break, without `strength`");
    }
    let middle = source.vector(&own.centre_m, "m")?;
    let axis = Unit::new_normalize(source.direction(&own.axis)?);
    let radius = length(source, &own.radius_m)?;
    let wheel = wheel(source, own)?;
    check_fit(builder, source, entry, (segments.clone(), middle, axis, radius))?;
    let mut pulley = Pulley { segments, holder: Body::Anchor(0), centre: Vector3::zeros(), axis, radius, wheel };
    let holder = match &own.on {
        None => {
            let pose = Pose { position: middle, orientation: UnitQuaternion::identity() };
            let model = builder.assembly.model_mut();
            let holder = Body::Anchor(model.anchors.len());
            model.anchors.push(pose);
            if let Some(entry) = &own.motion {
                let span = entry.get_ref().at.as_ref().map(Spanned::span);
                let span = span.or(entry.get_ref().segment.as_ref().map(Spanned::span)).or(entry.get_ref().of_grips());
                if let Some(span) = span {
                    return source.wrong(span, "goes with grips of rods, not with a pulley");
                }
                let motion = Prepared::new(source, entry)?.motion(source, entry, &pose)?;
                builder.assembly.model_mut().motions.push(Driven::new(holder, motion));
            }
            holder
        }
        Some(on) => {
            if let Some(motion) = &own.motion {
                return source.wrong(motion.span(), "does not go with `on`; leave one of them out");
            }
            let holder = match builder.spot(source, on)? {
                Spot::Body(body, None) | Spot::Rod(body, _) => body,
                Spot::Body(..) => return source.wrong(on.span(), "the axle is at `centre_m`; leave `at_m` out"),
            };
            if pulley.segments.contains(&holder) {
                return source.wrong(on.span(), "is the rod that runs over the pulley");
            }
            let state = builder.assembly.state_mut();
            let turn = state.orientations[holder].inverse();
            pulley.centre = turn * (middle - state.positions[holder]);
            pulley.axis = turn * axis;
            Body::Segment(holder)
        }
    };
    pulley.holder = holder;
    if let Some(inertia) = &own.inertia_kg_m2 {
        if own.drive.is_some() || own.motion.is_some() || own.on.is_some() {
            let which =
                "does not go with `on`, `drive` and `motion`; a body on a hinge may be the wheel: name it in `on`";
            return source.wrong(inertia.span(), which);
        }
        let inertia = source.positive(inertia, "kg m^2")?;
        turning(builder, source, entry, (name, inertia, middle, axis), &mut pulley)?;
    }
    builder.assembly.model_mut().pulleys.push(pulley);
    Ok(())
}

/// How the wheel of an entry turns.
fn wheel(source: &Source, own: &format::Pulley) -> Result<Wheel> {
    let friction = own.friction.as_ref().map(|value| source.not_negative(value, "")).transpose()?;
    let Some(entry) = &own.drive else {
        return match friction {
            Some(friction) => Ok(Wheel::Held { friction }),
            None => match &own.inertia_kg_m2 {
                Some(inertia) => source.wrong(inertia.span(), "needs `friction`, by which the rod turns the wheel"),
                None => Ok(Wheel::Free),
            },
        };
    };
    let Some(friction) = friction else {
        return source.wrong(entry.span(), "needs `friction`, by which the wheel takes the rod along");
    };
    let format::Drive { rate_rad_s, times_s, rates_rad_s, max_torque_n_m } = entry.get_ref();
    let rates = match (rate_rad_s, times_s, rates_rad_s) {
        (Some(rate), None, None) => vec![[0.0, source.finite(rate, "rad/s")?]],
        (None, Some(times), Some(rates)) => {
            let seconds = ascending(source, times)?;
            one_a_time(source, rates, seconds.len())?;
            let rate = |(time, value): (f64, &format::Number)| Ok([time, source.finite(value, "rad/s")?]);
            seconds.into_iter().zip(rates.get_ref()).map(rate).collect::<Result<Vec<_>>>()?
        }
        _ => return source.wrong(entry.span(), "must have `rate_rad_s`, or `times_s` and `rates_rad_s`"),
    };
    let max_torque = number_or(max_torque_n_m, f64::INFINITY, |v| source.not_negative(v, "N m"))?;
    Ok(Wheel::Driven { friction, rates, max_torque })
}

/// Refuses a rod that is not on the wheel as it is drawn, or whose segments are too long for it.
fn check_fit(
    builder: &mut Builder,
    source: &Source,
    entry: &Spanned<format::Pulley>,
    (segments, middle, axis, radius): (std::ops::Range<usize>, Vector3<f64>, Unit<Vector3<f64>>, f64),
) -> Result<()> {
    let own = entry.get_ref();
    let longest = segments.clone().map(|i| builder.segment(i).length).fold(0.0, f64::max);
    if longest > radius {
        let message = format!("must be at least the length of the rod's longest segment, {} m", rounded(longest));
        return source.wrong(own.radius_m.span(), &message);
    }
    let state = builder.assembly.state_mut();
    let off = segments.map(|i| {
        let offset = state.positions[i] - middle;
        let along = offset.dot(&axis);
        let away = (offset - *axis * along).norm() - radius;
        away.hypot(along)
    });
    let nearest = off.fold(f64::INFINITY, f64::min);
    if nearest > longest {
        let message =
            format!("the rod is {} m off the pulley's groove at best; draw it along the groove", rounded(nearest));
        return source.wrong(own.rod.span(), &message);
    }
    Ok(())
}

/// Gives a pulley in the ground a wheel that turns: a disc on a hinge.
fn turning(
    builder: &mut Builder,
    source: &Source,
    entry: &Spanned<format::Pulley>,
    (name, inertia, middle, axis): (&str, f64, Vector3<f64>, Unit<Vector3<f64>>),
    pulley: &mut Pulley,
) -> Result<()> {
    let radius = pulley.radius;
    let orientation = UnitQuaternion::rotation_between(&Vector3::z(), &axis)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    let shape = BodyShape::Cylinder { radius: 0.95 * radius, length: 0.2 * radius };
    let mass = 2.0 * inertia / (radius * radius);
    let across = mass * radius * radius * (0.25 + 0.04 / 12.0);
    let disc =
        RigidBody { inertia: Vector3::new(across, across, inertia), touches: false, ..RigidBody::new(shape, mass) };
    let name = builder.new_name(source, &None, name.to_owned(), entry.span())?;
    let segment = builder.add_body(name, disc, Pose { position: middle, orientation });
    let model = builder.assembly.model_mut();
    if let Body::Anchor(k) = pulley.holder {
        model.anchors[k].orientation = orientation;
    }
    let rigid = Joint::RIGID / radius.powi(4);
    let joint = Joint {
        a: Body::Segment(segment),
        b: pulley.holder,
        offset_a: 0.0,
        offset_b: 0.0,
        length: radius,
        rest_darboux: Vector3::zeros(),
        rest_frames: [UnitQuaternion::identity(); 2],
        stretch_compliance: Joint::RIGID,
        shear_compliance: Joint::RIGID,
        shear_extra: 0.0,
        bend_compliance: rigid,
        bend_extra: 0.0,
        twist_compliance: rigid,
        inner_damping: InnerDamping::default(),
        youngs_modulus: 1.0,
        torsion_modulus: 1.0,
        mount: None,
        freedom: Freedom::None,
    };
    model.joints.push(joint);
    model.hinge(model.joints.len() - 1, &axis);
    (pulley.holder, pulley.centre, pulley.axis) = (Body::Segment(segment), Vector3::zeros(), Vector3::z_axis());
    Ok(())
}

/// A length without what rounding has made of its last digits [m].
fn rounded(length: f64) -> f64 {
    (length * 1e6).round() / 1e6
}
