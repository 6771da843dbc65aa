//! A recorded cable with branches as a scene that `simulate` runs.

use std::path::{Path, PathBuf};

use cosserat::state::darboux::rotation_of;
use export::ExportError;
use nalgebra::Vector3;

use super::{BranchedCable, Numbers};
use crate::parameter::Parameter;
use crate::scene::{Clock, MadeOf, grip_files, head, list, parent, polyline, rest, rod, velocities, written};
use crate::specimen::Specimen;

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
    let (model, state) = cable.assembled(numbers);
    let what = format!("The cable with branches of the recording {name}, driven by its grips");
    let (_, drawn) = cable.parent.assembly(&numbers.parent).finish();
    let mut text = head(&what, &model, clock, "");
    text += &parent(&cable.parent, &model, &drawn, &numbers.parent, &cable.turns(numbers, &drawn));
    let (mut segment, mut joint) = (cable.segments(), cable.segments() + 1);
    for (index, twig) in cable.twigs.iter().enumerate() {
        let segments = twig.nodes[0].len() - 1;
        let material = twig.material(numbers);
        let made_of = MadeOf {
            moduli: [material.youngs_modulus, material.torsion_modulus],
            factors: [1.0; 2],
            density: material.density,
            tau: numbers.parent[Parameter::InnerDamping],
        };
        let root = &model.joints[joint + segments - 1];
        let [bend, twist] =
            [root.bend_compliance, root.twist_compliance].map(|soft| 1.0 / (soft * root.length.powi(2)));
        let at_rest = rotation_of(&root.rest_darboux, root.length).scaled_axis().map(f64::to_degrees);
        // Asked for, so that the frames of which the rest shape is told do not turn to the parent's.
        let d1 = list(&(state.orientations[segment] * Vector3::x()));
        let keys = format!(
            "frame = {{ d1 = {d1} }}
branch_of = {{ rod = \"cable\", segment = {}, fraction = 0.5 }}
branch_stiffness_n_m_rad = [{bend:?}, {twist:?}]
branch_rest_deg = {}
{}",
            twig.junction,
            list(&at_rest),
            rest(&model, joint..joint + segments - 1),
        );
        text += &rod(&format!("branch-{}", index + 1), &made_of, &keys);
        text += &polyline(&twig.nodes[0]);
        text += &velocities(&state, segment..segment + segments);
        segment += segments;
        joint += segments;
    }
    written(&folder.join("cable.toml"), &text, &grip_files(&cable.parent, &numbers.parent), clock)
}
