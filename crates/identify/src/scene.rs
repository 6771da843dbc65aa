//! Recordings as scenes that `simulate` runs: the rods of the first frame, and what holds them in tables.

use std::f64::consts::PI;
use std::fmt::Write as _;
use std::io::Write as _;
use std::ops::Range;
use std::path::{Path, PathBuf};

use cosserat::assembly::{JointLaw, MaxwellBranch, StrandFriction};
use cosserat::motion::Carried;
use cosserat::state::{Model, State};
use export::{ExportError, write_atomically};
use nalgebra::Vector3;

use crate::cable::{AIR_DENSITY, Cable, DENSITY, RADIUS, law, sides, springs, youngs_modulus};
use crate::parameter::{Parameter, Parameters};

/// Files of the two grips of a cable.
const GRIPS: [(&str, &str); 2] = [("start-face", "grip-start.csv"), ("end-face", "grip-end.csv")];

/// Even steps through all frames of a recording.
#[derive(Clone, Copy)]
pub(crate) struct Clock {
    /// Time step [s].
    dt: f64,
    steps: usize,
}

impl Clock {
    /// Through frames at these times [s], with so many steps a frame.
    pub(crate) fn new(time: &[f64], per_frame: usize) -> Self {
        let steps = per_frame * (time.len() - 1);
        Self { dt: time[time.len() - 1] / steps as f64, steps }
    }
}

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
    let clock = Clock::new(&cable.time, steps);
    let (model, state) = cable.assembly(parameters).finish();
    let mut text = head(&format!("The cable of the recording {name}, driven by its grips"), &model, clock, "");
    text += &parent(cable, &model, &state, parameters, &cable.turns(parameters));
    let tables = grip_files(cable, parameters);
    written(&folder.join("cable.toml"), &text, &tables, clock)
}

/// Files of what holds a cable.
pub(crate) fn grip_files(cable: &Cable, parameters: &Parameters) -> Vec<(&'static str, Carried)> {
    GRIPS.into_iter().zip(cable.grips(parameters)).map(|((_, file), grip)| (file, grip)).collect()
}

/// Writes a scene, and beside it the ways of what holds it.
pub(crate) fn written(
    path: &Path,
    text: &str,
    tables: &[(&str, Carried)],
    clock: Clock,
) -> Result<PathBuf, ExportError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    std::fs::create_dir_all(folder).map_err(ExportError::io("create the directory", folder))?;
    for (file, grip) in tables {
        write_atomically(&folder.join(file), |out| out.write_all(table(grip, clock).as_bytes()))?;
    }
    write_atomically(path, |out| out.write_all(text.as_bytes()))?;
    Ok(path.to_owned())
}

/// The way of a grip as a table.
fn table(grip: &Carried, clock: Clock) -> String {
    let mut text = "time_s,x_m,y_m,z_m,qw,qx,qy,qz\n".to_owned();
    for step in 0..=clock.steps {
        let time = clock.dt * step as f64;
        let pose = grip.at(time).pose;
        let (x, q) = (pose.position, pose.orientation);
        let _ = writeln!(text, "{time},{},{},{},{},{},{},{}", x.x, x.y, x.z, q.w, q.i, q.j, q.k);
    }
    text
}

/// What stands before the rods of a scene; `run` has further lines of its table `[run]`.
pub(crate) fn head(what: &str, model: &Model, clock: Clock, run: &str) -> String {
    let mut text = format!(
        "description = {}
gravity_m_s2 = {}

[run]
dt_s = {:?}
steps = {}
{run}
[damping]
linear_per_s = {:?}
",
        toml::Value::String(format!("{what}: run it with --formulation newton --integrator bdf2.")),
        list(&model.gravity),
        clock.dt,
        clock.steps,
        model.damping.linear,
    );
    if let Some(air) = &model.air {
        let (across, along) = (air.normal_drag, air.tangential_drag);
        let _ = write!(
            text,
            "\n[air]\ndensity_kg_m3 = {AIR_DENSITY:?}\nnormal_drag = {across:?}\ntangential_drag = {along:?}\n"
        );
    }
    text += "\n# Radius and density are not the real ones: a recording tells ratios to the mass alone.";
    text
}

/// What a rod is made of.
pub(crate) struct MadeOf {
    /// Young's and the torsion modulus [Pa].
    pub(crate) moduli: [f64; 2],
    /// EI about d1 and d2, to that of a circle.
    pub(crate) factors: [f64; 2],
    /// [kg/m^3]
    pub(crate) density: f64,
    /// Relaxation time of bending and twist [s].
    pub(crate) tau: f64,
}

/// A rod's own keys; `keys` has further lines.
pub(crate) fn rod(name: &str, made_of: &MadeOf, keys: &str) -> String {
    let MadeOf { moduli: [bend, twist], factors, density, tau } = made_of;
    let material = if *factors == [1.0; 2] {
        format!("density_kg_m3 = {density:?}\nyoungs_modulus_pa = {bend:?}\ntorsion_modulus_pa = {twist:?}")
    } else {
        let area = PI * RADIUS * RADIUS;
        let [bending, torsion] = [0.25 * bend, 0.5 * twist].map(|modulus| modulus * area * RADIUS * RADIUS);
        let [first, second] = factors.map(|factor| factor * bending);
        format!(
            "section.stiffness = {{ bending_n_m2 = [{first:?}, {second:?}], torsion_n_m2 = {torsion:?}, mass_kg_m = {:?} }}",
            density * area
        )
    };
    format!(
        "
[[rods]]
name = \"{name}\"
radius_m = {RADIUS:?}
{material}
inner_damping = {{ bending_s = {tau:?}, twist_s = {tau:?} }}
{keys}"
    )
}

/// A rod's shape, of which these are the nodes [m].
pub(crate) fn polyline(nodes: &[Vector3<f64>]) -> String {
    format!("\n[rods.shape.polyline]\nnodes_m = [\n    {},\n]\n", lists(nodes, ",\n    "))
}

/// The key of a rod's rest shape, of which these are the joints between segments.
pub(crate) fn rest(model: &Model, joints: Range<usize>) -> String {
    let rests: Vec<Vector3<f64>> = model.joints[joints].iter().map(|joint| joint.rest_darboux).collect();
    match &rests[..] {
        [first, others @ ..] if others.iter().all(|rest| rest == first) => {
            format!("rest = {{ darboux_per_m = {} }}\n", list(first))
        }
        _ => format!("rest = {{ darboux_of_joints_per_m = [{}] }}\n", lists(&rests, ", ")),
    }
}

/// Velocities of a rod, of which these are the segments.
pub(crate) fn velocities(state: &State, segments: Range<usize>) -> String {
    let mut text = String::new();
    for (index, segment) in segments.enumerate() {
        let _ = write!(
            text,
            "
[[rods.velocities]]
segment = {index}
velocity_m_s = {}
angular_velocity_rad_s = {}
",
            list(&state.velocities[segment]),
            list(&state.angular_velocities[segment]),
        );
    }
    text
}

/// The rod `cable` in its grips, whose joints are the first of this model; `state` is its own, as it is drawn. Its segments begin
/// turned about their axes by `turns` [rad].
pub(crate) fn parent(cable: &Cable, model: &Model, state: &State, parameters: &Parameters, turns: &[f64]) -> String {
    let segments = cable.first_nodes().len() - 1;
    let bend = youngs_modulus(parameters);
    let made_of = MadeOf {
        moduli: [bend, 0.5 * parameters[Parameter::Twist] * bend],
        factors: sides(parameters).factors,
        density: DENSITY,
        tau: parameters[Parameter::InnerDamping],
    };
    let d1 = list(&(state.orientations[0] * Vector3::x()));
    let turns: Vec<String> = turns.iter().map(|turn| format!("{:?}", turn.to_degrees())).collect();
    let (rest, turns) = (rest(model, 0..segments - 1), turns.join(", "));
    let law = match law(parameters) {
        Some(JointLaw::Friction(StrandFriction { moment, stiffness })) => {
            format!("strand_friction = {{ moment_n_m = {moment:?}, stiffness_n_m2 = {stiffness:?} }}\n")
        }
        Some(JointLaw::Viscoelastic(branches)) => {
            let branch = |own: &MaxwellBranch| format!("{{ share = {:?}, time_s = {:?} }}", own.share, own.time);
            format!("relaxation = [{}]\n", branches.iter().map(branch).collect::<Vec<_>>().join(", "))
        }
        _ => String::new(),
    };
    let keys = format!("frame = {{ d1 = {d1} }}\n{rest}{law}first_turns_deg = [{turns}]\n");
    let mut text = rod("cable", &made_of, &keys) + &polyline(cable.first_nodes());
    let [first, second, twist] = springs(parameters).moment;
    for ((at, file), held) in GRIPS.into_iter().zip(cable.held(parameters)) {
        let turn = list(&held.map(f64::to_degrees));
        let _ = write!(
            text,
            "
[[rods.grips]]
at = \"{at}\"
stiffness_n_m_rad = [{first:?}, {second:?}, {twist:?}]
turn_deg = {turn}

[[rods.motions]]
at = \"{at}\"
file = \"{file}\"
"
        );
    }
    text + &velocities(state, 0..segments)
}

/// A vector as a list.
pub(crate) fn list(vector: &Vector3<f64>) -> String {
    format!("[{:?}, {:?}, {:?}]", vector.x, vector.y, vector.z)
}

/// Vectors as lists.
fn lists(vectors: &[Vector3<f64>], between: &str) -> String {
    vectors.iter().map(list).collect::<Vec<_>>().join(between)
}
