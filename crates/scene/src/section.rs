//! From a rod's keys to its sections and the radii with which it touches, its frame and its inner damping.

use nalgebra::Vector3;
use rod::{InnerDamping, LineInertia, Section, Stiffness, Stretch};
use toml::Spanned;

use crate::error::{Result, Source};
use crate::format;
use crate::measures::length;
use crate::properties::radii;
use crate::shape::number_or;

/// Sections and radii [m] of a rod along `nodes` [m], one each or one a segment.
pub(crate) fn sections(
    source: &Source,
    rod: &format::Rod,
    nodes: &[Vector3<f64>],
    closed: bool,
) -> Result<(Vec<Section>, Vec<f64>)> {
    let segments = nodes.len() - usize::from(!closed);
    let places: Vec<&Spanned<format::Section>> = match (&rod.section, &rod.pieces) {
        (None, None) => return Ok((Vec::new(), radii(source, &rod.radius_m, segments)?)),
        (Some(section), Some(_)) => return source.wrong(section.span(), "give either `section` or `pieces`, not both"),
        (Some(section), None) => vec![section],
        (None, Some(pieces)) => pieces.get_ref().iter().map(|piece| &piece.section).collect(),
    };
    if let (Some(_), Some(place)) = (&rod.tree, places.first()) {
        return source.wrong(place.span(), "a tree's trunk and branches are full circles; leave it out");
    }
    check_moduli(source, rod, &places)?;
    let own = places.iter().map(|place| section(source, rod, place)).collect::<Result<Vec<_>>>()?;
    let sections = match &rod.pieces {
        None => own,
        Some(pieces) => {
            let ends = ends(source, pieces)?;
            centres(nodes, closed).map(|at| own[ends.partition_point(|&end| end <= at)]).collect()
        }
    };
    let radii = match &rod.radius_m {
        Some(_) => radii(source, &rod.radius_m, segments)?,
        // Without a radius of the rod there is no section that needs it.
        None => sections.iter().map(|section| section.contact_radius().unwrap_or(f64::NAN)).collect(),
    };
    Ok((sections, radii))
}

fn section(source: &Source, rod: &format::Rod, given: &Spanned<format::Section>) -> Result<Section> {
    let size = |value: &format::Number| length(source, value);
    Ok(match given.get_ref() {
        format::Section::Circle(circle) => Section::Circle { radius: size(&circle.radius_m)? },
        format::Section::Tube(tube) => {
            let (outer, inner) = (size(&tube.outer_radius_m)?, size(&tube.inner_radius_m)?);
            if inner >= outer {
                return source.must_be(tube.inner_radius_m.span(), "less than `outer_radius_m`");
            }
            Section::Tube { outer, inner }
        }
        format::Section::Rectangle(sides) => {
            Section::Rectangle { width: size(&sides.width_m)?, height: size(&sides.height_m)? }
        }
        format::Section::Ellipse(sides) => {
            Section::Ellipse { width: size(&sides.width_m)?, height: size(&sides.height_m)? }
        }
        format::Section::Stiffness(known) => self::known(source, rod, given, known)?,
    })
}

/// `k G A` over `E A` of a round rod whose material is isotropic with Poisson's ratio 0.3.
const ISOTROPIC_SHEAR: f64 = Stretch::SHEAR_FACTOR / 2.6;

/// A section that is given by what it resists.
fn known(
    source: &Source,
    rod: &format::Rod,
    given: &Spanned<format::Section>,
    known: &format::Stiffness,
) -> Result<Section> {
    let Some(radius) = &rod.radius_m else {
        return source.wrong(given.span(), "give the rod's `radius_m` with it, for contacts and air");
    };
    let format::Radius { start, end } = *radius.get_ref();
    let radius = 0.5 * (start + end);
    let axial = [("stretch_n", &known.stretch_n), ("shear_n", &known.shear_n)];
    let is_physical = matches!(rod.stretch, format::Stretch::Physical);
    for (name, value) in axial {
        match value {
            None if is_physical && name == "stretch_n" => {
                return source
                    .wrong(given.span(), &format!("missing key `{name}`, which `stretch = \"physical\"` needs"));
            }
            Some(value) if !is_physical => return source.wrong(value.span(), "goes with `stretch = \"physical\"`"),
            _ => {}
        }
    }
    let stretch = number_or(&known.stretch_n, f64::INFINITY, |v| source.positive(v, "N"))?;
    let shear = number_or(&known.shear_n, ISOTROPIC_SHEAR * stretch, |v| source.positive(v, "N"))?;
    let stiffness = |value: &format::Number| source.positive(value, "N m^2");
    let [first, second] = &known.bending_n_m2.0;
    let mass = source.positive(&known.mass_kg_m, "kg/m")?;
    Ok(Section::Known {
        stiffness: Stiffness {
            stretch,
            shear,
            bending: [stiffness(first)?, stiffness(second)?],
            torsion: stiffness(&known.torsion_n_m2)?,
        },
        inertia: LineInertia {
            mass,
            polar: number_or(&known.polar_inertia_kg_m, 0.5 * mass * radius * radius, |v| source.positive(v, "kg m"))?,
        },
    })
}

/// Where all is said by stiffnesses, a material would not be heard.
fn check_moduli(source: &Source, rod: &format::Rod, places: &[&Spanned<format::Section>]) -> Result<()> {
    let all_known = places.iter().all(|place| matches!(place.get_ref(), format::Section::Stiffness(_)));
    let moduli = [&rod.youngs_modulus_pa, &rod.torsion_modulus_pa, &rod.density_kg_m3];
    match moduli.into_iter().flatten().next() {
        Some(value) if all_known => {
            source.wrong(value.span(), "`section.stiffness` says what the rod resists and weighs; leave it out")
        }
        _ => Ok(()),
    }
}

/// Fractions of the rod's length at which pieces end, but for the last.
pub(crate) fn ends(source: &Source, pieces: &Spanned<Vec<format::Piece>>) -> Result<Vec<f64>> {
    let Some((last, others)) = pieces.get_ref().split_last() else {
        return source.wrong(pieces.span(), "there must be at least one piece");
    };
    if let Some(until) = &last.until {
        return source.wrong(until.span(), "the last piece goes on to the rod's end; leave it out");
    }
    let mut ends: Vec<f64> = Vec::new();
    for piece in others {
        let Some(until) = &piece.until else {
            return source.wrong(piece.section.span(), "give `until` with it: only the last piece goes on to the end");
        };
        let end = source.number(until, |v| v > 0.0 && v < 1.0, "> 0 and < 1, a fraction of the rod's length")?;
        if ends.last().is_some_and(|&before| before >= end) {
            return source.must_be(until.span(), "more than that of the piece before");
        }
        ends.push(end);
    }
    Ok(ends)
}

/// Places of the segments' centres, in fractions of the rod's length.
pub(crate) fn centres(nodes: &[Vector3<f64>], closed: bool) -> impl Iterator<Item = f64> {
    let count = nodes.len() - usize::from(!closed);
    let lengths: Vec<f64> = (0..count).map(|i| (nodes[(i + 1) % nodes.len()] - nodes[i]).norm()).collect();
    let whole: f64 = lengths.iter().sum();
    lengths.into_iter().scan(0.0, move |from, length| {
        let centre = *from + 0.5 * length;
        *from += length;
        Some(centre / whole)
    })
}

/// Direction of d1 of a rod along `nodes` [m], where it is given.
pub(crate) fn d1(source: &Source, rod: &format::Rod, nodes: &[Vector3<f64>]) -> Result<Option<Vector3<f64>>> {
    let Some(format::Frame { d1 }) = &rod.frame else { return Ok(None) };
    if rod.strands.is_some() || rod.heap.is_some() {
        return source.wrong(d1.span(), "strands and heaps point to all sides; leave `frame` out");
    }
    let direction = source.direction(d1)?;
    let axis = (nodes[1] - nodes[0]).normalize();
    match direction.cross(&axis).norm() > 1e-5 {
        true => Ok(Some(direction)),
        false => source.must_be(d1.span(), "a direction across the rod's first segment"),
    }
}

/// Relaxation times of the joints.
pub(crate) fn inner_damping(source: &Source, given: &format::InnerDamping) -> Result<InnerDamping> {
    let time = |value: &Option<format::Number>| number_or(value, 0.0, |v| source.not_negative(v, "s"));
    Ok(InnerDamping {
        bending: time(&given.bending_s)?,
        twist: time(&given.twist_s)?,
        stretch: time(&given.stretch_s)?,
    })
}
