//! A recorded cable as a scene that `simulate` runs: the rod of the first frame, and its grips in tables.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use export::{ExportError, write_atomically};
use nalgebra::Vector3;
use rod::Carried;

use crate::cable::{AIR_DENSITY, Cable, DENSITY, RADIUS};
use crate::parameter::{Parameter, Parameters};

/// Files of the grips.
const GRIPS: [(&str, &str); 2] = [("start-face", "grip-start.csv"), ("end-face", "grip-end.csv")];

/// Writes `folder/cable.toml` and the tables of its grips, and returns the scene's path. Run with `--formulation newton
/// --integrator bdf2` it moves as the prediction with so many `steps` a frame does, if the frames come at even times.
///
/// # Errors
/// If the system refuses.
pub fn write(
    folder: &Path,
    cable: &Cable,
    name: &str,
    parameters: &Parameters,
    steps: usize,
) -> Result<PathBuf, ExportError> {
    std::fs::create_dir_all(folder).map_err(ExportError::io("create the directory", folder))?;
    for ((_, file), grip) in GRIPS.iter().zip(cable.grips(parameters)) {
        write_atomically(&folder.join(file), |out| out.write_all(table(&grip, &cable.time).as_bytes()))?;
    }
    let path = folder.join("cable.toml");
    let text = text(cable, name, parameters, steps);
    write_atomically(&path, |out| out.write_all(text.as_bytes()))?;
    Ok(path)
}

/// The way of a grip as a table.
fn table(grip: &Carried, time: &[f64]) -> String {
    let mut text = "time_s,x_m,y_m,z_m,qw,qx,qy,qz\n".to_owned();
    for &time in time {
        let pose = grip.at(time).pose;
        let (x, q) = (pose.position, pose.orientation);
        let _ = writeln!(text, "{time},{},{},{},{},{},{},{}", x.x, x.y, x.z, q.w, q.i, q.j, q.k);
    }
    text
}

/// The scene.
fn text(cable: &Cable, name: &str, parameters: &Parameters, per_frame: usize) -> String {
    let (model, state) = cable.assembly(parameters).finish();
    let (first, steps) = (&model.joints[0], per_frame * (cable.time.len() - 1));
    let dt = cable.time[cable.time.len() - 1] / steps as f64;
    let nodes: Vec<_> = cable.first_nodes().iter().map(list).collect();
    let d1 = state.orientations[0] * Vector3::x();
    let [bend, twist] = moduli(parameters);
    let tau = first.inner_damping.bending;
    // The joints of the grips come last, and are at rest as those beside them.
    let rests: Vec<Vector3<f64>> =
        model.joints[..model.joints.len() - 2].iter().map(|joint| joint.rest_darboux).collect();
    let rest = match rests.iter().all(|rest| *rest == first.rest_darboux) {
        true => format!("darboux_per_m = {}", list(&first.rest_darboux)),
        false => format!("darboux_of_joints_per_m = [{}]", rests.iter().map(list).collect::<Vec<_>>().join(", ")),
    };
    let mut text = String::new();
    let _ = write!(
        text,
        "description = {}
gravity_m_s2 = {}

[run]
dt_s = {dt:?}
steps = {steps}

[damping]
linear_per_s = {:?}

",
        toml::Value::String(format!(
            "The cable of the recording {name}, driven by its grips: run it with --formulation newton --integrator bdf2."
        )),
        list(&model.gravity),
        model.damping.linear,
    );
    if let Some(air) = &model.air {
        let (across, along) = (air.normal_drag, air.tangential_drag);
        let _ = write!(
            text,
            "[air]\ndensity_kg_m3 = {AIR_DENSITY:?}\nnormal_drag = {across:?}\ntangential_drag = {along:?}\n\n"
        );
    }
    let _ = write!(
        text,
        "# Radius and density are not the cable's: a recording tells ratios to its mass alone.
[[rods]]
name = \"cable\"
radius_m = {RADIUS:?}
density_kg_m3 = {DENSITY:?}
youngs_modulus_pa = {bend:?}
torsion_modulus_pa = {twist:?}
inner_damping = {{ bending_s = {tau:?}, twist_s = {tau:?} }}
frame = {{ d1 = {} }}
rest = {{ {rest} }}

[rods.shape.polyline]
nodes_m = [
    {},
]
",
        list(&d1),
        nodes.join(",\n    "),
    );
    let springs = springs(parameters);
    for ((at, file), roll) in GRIPS.into_iter().zip([0.0, cable.twisted(parameters)]) {
        let _ = write!(
            text,
            "
[[rods.grips]]
at = \"{at}\"
stiffness_n_m_rad = [{:?}, {:?}]
roll_deg = {:?}

[[rods.motions]]
at = \"{at}\"
file = \"{file}\"
",
            springs[0],
            springs[1],
            roll.to_degrees(),
        );
    }
    for (segment, (v, w)) in state.velocities.iter().zip(&state.angular_velocities).enumerate() {
        let _ = write!(
            text,
            "
[[rods.velocities]]
segment = {segment}
velocity_m_s = {}
angular_velocity_rad_s = {}
",
            list(v),
            list(w),
        );
    }
    text
}

/// Young's and the torsion modulus [Pa] of a rod of the nominal radius and density.
fn moduli(parameters: &Parameters) -> [f64; 2] {
    let bend = crate::cable::youngs_modulus(parameters);
    [bend, 0.5 * parameters[Parameter::Twist] * bend]
}

/// Springs of the grips against bending and twist [N m/rad].
fn springs(parameters: &Parameters) -> [f64; 2] {
    let [bend, _, twist] = crate::cable::springs(parameters).moment;
    [bend, twist]
}

fn list(vector: &Vector3<f64>) -> String {
    format!("[{:?}, {:?}, {:?}]", vector.x, vector.y, vector.z)
}
