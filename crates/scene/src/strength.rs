//! From a rod's keys to what its joints bear.

use nalgebra::Vector3;
use rod::Strength;
use toml::Spanned;

use crate::error::{Result, Source};
use crate::format;
use crate::section::{centres, ends};
use crate::shape::number_or;

/// What the joints of a rod along `nodes` [m] bear: nothing said, one for all, or one a segment.
pub(crate) fn strengths(
    source: &Source,
    rod: &format::Rod,
    nodes: &[Vector3<f64>],
    closed: bool,
) -> Result<Vec<Strength>> {
    let pieces = rod.pieces.as_ref().map_or(&[][..], |pieces| pieces.get_ref());
    let of_pieces = pieces.iter().map(|piece| piece.strength.as_ref());
    let Some(given) = rod.strength.as_ref().or(of_pieces.clone().flatten().next()) else { return Ok(Vec::new()) };
    if rod.tree.is_some() {
        return source.wrong(given.span(), "the joints of trees do not break; leave it out");
    }
    let whole = rod.strength.as_ref().map_or(Ok(Strength::UNLIMITED), |own| strength(source, own))?;
    let (Some(given), false) = (&rod.pieces, of_pieces.clone().all(|own| own.is_none())) else {
        return Ok(vec![whole]);
    };
    let own = of_pieces.map(|own| own.map_or(Ok(whole), |own| strength(source, own))).collect::<Result<Vec<_>>>()?;
    let ends = ends(source, given)?;
    Ok(centres(nodes, closed).map(|at| own[ends.partition_point(|&end| end <= at)]).collect())
}

fn strength(source: &Source, given: &Spanned<format::Strength>) -> Result<Strength> {
    let format::Strength { tension_n, moment_n_m, curvature_per_m } = given.get_ref();
    if [tension_n, moment_n_m, curvature_per_m].into_iter().all(Option::is_none) {
        return source.wrong(given.span(), "give `tension_n`, `moment_n_m` or `curvature_per_m`");
    }
    let most = |value, unit| number_or(value, f64::INFINITY, |v| source.positive(v, unit));
    Ok(Strength {
        tension: most(tension_n, "N")?,
        moment: most(moment_n_m, "N m")?,
        curvature: most(curvature_per_m, "1/m")?,
    })
}
