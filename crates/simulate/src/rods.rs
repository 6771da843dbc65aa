//! `--rods`: which rods and bodies of a scene are drawn and tabulated.

use anyhow::{Result, bail};
use cosserat::scene::{self, Scene};
use cosserat::state::Body;
use export::Format;

use crate::cli::RunArgs;
use crate::named::ALIKE;

/// Names that an error lists, at most.
const LISTED: usize = 20;

/// Numbers of the rods that a run's arguments name: see [`numbers`].
///
/// # Errors
/// As [`numbers`], or no file is asked for.
pub(crate) fn named(scene: &Scene, args: &RunArgs) -> Result<Option<Vec<usize>>> {
    if !args.rods.is_empty() && !args.writes() {
        bail!("--rods says what is drawn and tabulated, but no file is asked for: give --out, for example");
    }
    numbers(scene, &args.rods, &args.export)
}

/// Numbers of the rods that are named, ascending; `None` where none are: all of them.
///
/// # Errors
/// There is none of a name, or what is left out would be missing from reactions.
pub(crate) fn numbers(scene: &Scene, names: &[String], formats: &[Format]) -> Result<Option<Vec<usize>>> {
    if names.is_empty() {
        return Ok(None);
    }
    let is =
        |name: &str, asked: &str| name.strip_prefix(asked).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'));
    for asked in names {
        if !scene.rods.iter().any(|rod| is(&rod.name, asked)) {
            return Err(unknown(scene, asked));
        }
    }
    let numbers = (0..scene.rods.len()).filter(|&k| names.iter().any(|asked| is(&scene.rods[k].name, asked)));
    let numbers: Vec<usize> = numbers.collect();
    if formats.contains(&Format::Csv) {
        check_reactions(scene, &numbers)?;
    }
    Ok(Some(numbers))
}

/// What holds a segment also holds what is joined to it.
fn check_reactions(scene: &Scene, numbers: &[usize]) -> Result<()> {
    let model = &scene.model;
    let is_held =
        |i: usize| model.segments[i].fixed || model.motions.iter().any(|driven| driven.body == Body::Segment(i));
    for joint in &model.joints {
        for pair in [[joint.a, joint.b], [joint.b, joint.a]] {
            let [Body::Segment(own), Body::Segment(other)] = pair else { continue };
            let [rod, left_out] = [own, other].map(|i| model.segments[i].rod);
            if is_held(own) && numbers.contains(&rod) && !numbers.contains(&left_out) {
                let [rod, left_out] = [rod, left_out].map(|k| &scene.rods[k].name);
                bail!(
                    "--rods: what holds `{rod}` holds `{left_out}`, too, and reactions.csv would lack its part: name both, or \
                     leave csv out"
                );
            }
        }
    }
    Ok(())
}

/// The error of a name that no rod has: what may have been meant, and what there is.
fn unknown(scene: &Scene, asked: &str) -> anyhow::Error {
    let names = || scene.rods.iter().map(|rod| rod.name.as_str());
    let meant =
        scene::nearest(asked, names(), ALIKE).map(|name| format!("; did you mean `{name}`?")).unwrap_or_default();
    let more = if scene.rods.len() > LISTED { ", ..." } else { "" };
    let known = names().take(LISTED).collect::<Vec<_>>().join(", ");
    anyhow::anyhow!("--rods: the scene {} has no rod or body `{asked}`{meant} (it has {known}{more})", scene.name)
}
