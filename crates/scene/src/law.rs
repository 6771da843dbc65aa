//! From a rod's keys to the law of its joints: plasticity, friction between strands, relaxation.

use std::ops::Range;

use nalgebra::Vector3;
use rod::{JointLaw, MaxwellBranch, Plasticity, RodSpec, StrandFriction};
use toml::Spanned;

use crate::error::{Result, Source, short};
use crate::format;
use crate::shape::number_or;

/// Laws of the joints of a rod whose sections are known: none, one, or one a segment.
pub(crate) fn laws(source: &Source, rod: &format::Rod, spec: &RodSpec, segments: usize) -> Result<Vec<JointLaw>> {
    let given = [
        rod.r#yield.as_ref().map(Spanned::span),
        rod.strand_friction.as_ref().map(Spanned::span),
        rod.relaxation.as_ref().map(Spanned::span),
    ];
    let mut given = given.into_iter().flatten();
    let Some(span) = given.next() else { return Ok(Vec::new()) };
    if let Some(second) = given.next() {
        return source.wrong(second, "give one of `yield`, `strand_friction` and `relaxation`");
    }
    if rod.tree.is_some() {
        return source.wrong(span, "the joints of trees are elastic; leave it out");
    }
    if let Some(own) = &rod.r#yield {
        return plastic(source, own, spec, segments);
    }
    if let Some(own) = &rod.strand_friction {
        let format::StrandFriction { moment_n_m, stiffness_n_m2 } = own.get_ref();
        let moment = source.positive(moment_n_m, "N m")?;
        let stiffness = source.positive(stiffness_n_m2, "N m^2")?;
        return Ok(vec![JointLaw::Friction(StrandFriction { moment, stiffness })]);
    }
    rod.relaxation.as_ref().map_or(Ok(Vec::new()), |own| relaxation(source, own))
}

fn plastic(source: &Source, given: &Spanned<format::Yield>, spec: &RodSpec, segments: usize) -> Result<Vec<JointLaw>> {
    let format::Yield { moment_n_m, torque_n_m, stress_pa, hardening_isotropic, hardening_kinematic } = given.get_ref();
    let ratio = |value| number_or(value, 0.0, |v| source.not_negative(v, ""));
    let (isotropic, kinematic) = (ratio(hardening_isotropic)?, ratio(hardening_kinematic)?);
    let law = |moments| JointLaw::Plastic(Plasticity { moments, isotropic, kinematic });
    match (moment_n_m, torque_n_m, stress_pa) {
        (Some(moment), Some(torque), None) => {
            let (moment, torque) = (source.positive(moment, "N m")?, source.positive(torque, "N m")?);
            Ok(vec![law(Vector3::new(moment, moment, torque))])
        }
        (None, None, Some(stress)) => {
            let stress_at = source.positive(stress, "Pa")?;
            let count = if spec.radii.len().max(spec.sections.len()) > 1 { segments } else { 1 };
            let of = |i: usize| Plasticity::fully_plastic(spec.section(i).1, stress_at);
            match (0..count).map(of).collect::<Option<Vec<_>>>() {
                Some(moments) => Ok(moments.into_iter().map(law).collect()),
                None => of_no_section(source, stress.span()),
            }
        }
        (_, _, Some(stress)) => {
            source.wrong(stress.span(), "goes without `moment_n_m` and `torque_n_m`; leave it out, or both of them")
        }
        _ => source.wrong(given.span(), "give `moment_n_m` and `torque_n_m`, or `stress_pa`"),
    }
}

fn of_no_section<T>(source: &Source, span: Range<usize>) -> Result<T> {
    let message = "is known of circles, tubes and rectangles; give `moment_n_m` and `torque_n_m` instead";
    source.wrong(span, message)
}

fn relaxation(source: &Source, given: &format::Relaxation) -> Result<Vec<JointLaw>> {
    if given.get_ref().is_empty() {
        return source.wrong(given.span(), "there must be at least one branch");
    }
    let mut sum = 0.0;
    let branches = given.get_ref().iter().map(|branch| {
        let share = source.number(&branch.share, |v| v > 0.0 && v < 1.0, "> 0 and < 1")?;
        if sum + share >= 1.0 {
            let allowed = format!("less than {}: with it the shares add up to 1 or more", short(1.0 - sum));
            return source.must_be(branch.share.span(), &allowed);
        }
        sum += share;
        Ok(MaxwellBranch { share, time: source.positive(&branch.time_s, "s")? })
    });
    Ok(vec![JointLaw::Viscoelastic(branches.collect::<Result<Vec<_>>>()?)])
}
