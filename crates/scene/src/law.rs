//! From a rod's keys to the law of its joints: plasticity, friction between strands, relaxation, tables.

use std::ops::Range;

use nalgebra::Vector3;
use rod::{JointLaw, MaxwellBranch, MomentTable, Plasticity, RodSpec, StrandFriction, Unloading};
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
        rod.moment_table.as_ref().map(Spanned::span),
    ];
    let mut given = given.into_iter().flatten();
    let Some(span) = given.next() else { return Ok(Vec::new()) };
    if let Some(second) = given.next() {
        return source.wrong(second, "give one of `yield`, `strand_friction`, `relaxation` and `moment_table`");
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
    if let Some(own) = &rod.moment_table {
        return table(source, own);
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

fn table(source: &Source, given: &Spanned<format::MomentTable>) -> Result<Vec<JointLaw>> {
    let format::MomentTable { curvatures_per_m, moments_n_m, unloading } = given.get_ref();
    let (curvatures, moments) = (curvatures_per_m.get_ref(), moments_n_m.get_ref());
    if curvatures.is_empty() {
        return source.wrong(curvatures_per_m.span(), "there must be at least one point beside the origin");
    }
    if curvatures.len() != moments.len() {
        let message = format!("{} moments, but there must be one a curvature ({})", moments.len(), curvatures.len());
        return source.wrong(moments_n_m.span(), &message);
    }
    let unloading = match unloading {
        format::Unloading::Elastic => Unloading::Elastic,
        format::Unloading::Masing => Unloading::Masing,
    };
    let (mut points, mut slopes): (Vec<[f64; 2]>, Vec<f64>) = (Vec::new(), Vec::new());
    for (curvature, moment) in curvatures.iter().zip(moments) {
        let point = [source.positive(curvature, "1/m")?, source.positive(moment, "N m")?];
        let before = points.last().copied().unwrap_or_default();
        if point[0] <= before[0] {
            return source.must_be(curvature.span(), &format!("more than the one before, {} [1/m]", short(before[0])));
        }
        let slope = (point[1] - before[1]) / (point[0] - before[0]);
        let (first, last) = (slopes.first().unwrap_or(&slope), slopes.last().unwrap_or(&slope));
        let at = |slope: f64| short(before[1] + slope * (point[0] - before[0]));
        if slope < 1e-3 * first {
            let least = at(1e-3 * first);
            let allowed = format!("{least} [N m] or more: the curve rises by 0.001 of its first slope at least");
            return source.must_be(moment.span(), &allowed);
        }
        if unloading == Unloading::Masing && slope > last * (1.0 + 1e-9) {
            let allowed = format!("{} [N m] or less: by Masing's rule the curve gets no steeper", at(*last));
            return source.must_be(moment.span(), &allowed);
        }
        points.push(point);
        slopes.push(slope);
    }
    Ok(vec![JointLaw::Tabulated(MomentTable { points, unloading })])
}
