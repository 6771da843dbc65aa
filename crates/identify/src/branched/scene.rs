//! A recorded cable with branches as a scene that `simulate` runs.

use std::ops::Range;
use std::path::{Path, PathBuf};

use cosserat::motion::Carried;
use cosserat::state::darboux::{darboux, rotation_of};
use cosserat::state::{Body, Model, Springs, State};
use export::ExportError;
use nalgebra::Vector3;

use super::twig::{At, Twig};
use super::{BranchedCable, Numbers};
use crate::cable::springs;
use crate::parameter::Parameter;
use crate::scene::{Clock, MadeOf, grip_files, head, list, parent, polyline, rest, rod, velocities, written};
use crate::specimen::Specimen;

/// The file of what holds the free end of a parent that a grip holds in the middle.
const FREE_END: &str = "grip-free-end.csv";

/// Writes `folder/cable.toml` and the tables of its grips, as [`crate::scene::write`] does for a single cable.
///
/// # Errors
/// If the system refuses.
pub fn write(
    folder: &Path,
    cable: &BranchedCable,
    name: &str,
    numbers: &Numbers,
    steps: usize,
) -> Result<PathBuf, ExportError> {
    let clock = Clock::new(cable.time(), steps);
    let shape = cable.shape(numbers);
    let (model, state) = shape.assembled(numbers);
    let what = format!("The cable with branches of the recording {name}, driven by its grips");
    let (_, drawn) = shape.parent.assembly(&numbers.parent).finish();
    let mut text = head(&what, &model, clock, "");
    text += &parent(&shape.parent, &model, &drawn, &numbers.parent, &shape.turns(numbers, &drawn));
    let mut tables = grip_files(&shape.parent, &numbers.parent);
    let (mut segment, mut joint) = (shape.segments(), shape.segments() + 1);
    for twig in &shape.twigs {
        let segments = twig.segments();
        let material = twig.material(numbers);
        let made_of = MadeOf {
            moduli: [material.youngs_modulus, material.torsion_modulus],
            factors: [1.0; 2],
            density: material.density,
            tau: numbers.parent[Parameter::InnerDamping],
        };
        // Asked for, so that the frames of which the rest shape is told do not turn to the parent's.
        let d1 = list(&(state.orientations[segment] * Vector3::x()));
        let root = joint + segments - 1;
        let at_rest = rest(&model, joint..root);
        let hangs = hangs(twig, &shape.twigs, &model, root);
        text += &rod(&title(twig), &made_of, &format!("frame = {{ d1 = {d1} }}\n{hangs}{at_rest}"));
        text += &polyline(&twig.nodes[0]);
        if let Some((carried, turn)) = held(&model, &state, joint..root + 1, segment) {
            tables.push((FREE_END, carried));
            let Springs { moment: [first, second, twist], .. } = springs(&numbers.parent);
            text += &format!(
                "
[[rods.grips]]
at = \"start-face\"
stiffness_n_m_rad = [{first:?}, {second:?}, {twist:?}]
turn_deg = {}

[[rods.motions]]
at = \"start-face\"
file = \"{FREE_END}\"
",
                list(&turn)
            );
        }
        text += &velocities(&state, segment..segment + segments);
        segment += segments;
        joint += segments;
    }
    written(&folder.join("cable.toml"), &text, &tables, clock)
}

/// The name of a twig.
fn title(twig: &Twig) -> String {
    twig.branch.map_or_else(|| "free-end".to_owned(), |branch| format!("branch-{}", branch + 1))
}

/// The keys that say what a branch hangs on, by its joint `root`.
fn hangs(twig: &Twig, twigs: &[Twig], model: &Model, root: usize) -> String {
    let (on, segment, fraction) = match twig.at {
        At::Grip => return String::new(),
        At::Parent { segment } => ("cable".to_owned(), segment, 0.5),
        At::Twig { index, place } => (title(&twigs[index]), place.segment, place.share),
    };
    let root = &model.joints[root];
    let [bend, twist] = [root.bend_compliance, root.twist_compliance].map(|soft| 1.0 / (soft * root.length.powi(2)));
    let at_rest = rotation_of(&root.rest_darboux, root.length).scaled_axis().map(f64::to_degrees);
    format!(
        "branch_of = {{ rod = \"{on}\", segment = {segment}, fraction = {fraction:?} }}
branch_stiffness_n_m_rad = [{bend:?}, {twist:?}]
branch_rest_deg = {}
",
        list(&at_rest)
    )
}

/// What holds a twig in a grip by the last of its joints, and by what the face of its first segment is turned in it [degrees].
fn held(model: &Model, state: &State, joints: Range<usize>, segment: usize) -> Option<(Carried, Vector3<f64>)> {
    let root = &model.joints[joints.end - 1];
    let Body::Anchor(anchor) = root.a else { return None };
    let driven = model.motions.iter().find(|driven| driven.body == root.a)?;
    // The face as it is drawn goes on with the curvature of the joint beside it.
    let [own, next] = [0, 1].map(|k| state.orientations[(segment + k).min(segment + joints.len() - 1)]);
    let bent = darboux(&own, &next, model.joints[joints.start].length);
    let face = own * rotation_of(&bent, root.length).inverse();
    let turn = face.inverse() * model.anchors[anchor].orientation;
    Some((driven.carried.clone(), turn.scaled_axis().map(f64::to_degrees)))
}
