//! Finds the motion of two grips that lays a hanging cable along a curve: least squares over the poses of both grips, with
//! the derivative of the equilibrium with respect to them. Writes a scene that `simulate` runs to `target/lay-a-cable.toml`.

use std::error::Error;
use std::f64::consts::{PI, TAU};
use std::fmt::Write;

use optimise::{Params, least_squares};
use rods::derivative::{Equilibrium, HeldVariation, Variation};
use rods::nalgebra::{DMatrix, DVector};
use rods::prelude::*;

/// A cable of 1 m between two grips.
const CABLE: &str = r#"
run = { dt_s = 0.01, steps = 3000 }
damping = { linear_per_s = 5 }

[[rods]]
name = "cable"
shape.hung = { to_m = [0.85, 0, 0], length_m = 1, segments = 40 }
radius_m = 0.004
youngs_modulus_pa = 2e9
density_kg_m3 = 1100
clamp = ["start-face", "end-face"]
"#;
/// Waypoints of the motion.
const STAGES: usize = 24;
/// Turns are penalised by so much of the residuals, in metres a radian, so that a twist that moves nothing stays zero.
const TURNING: f64 = 1e-3;

/// Where the centres of so many segments lie on a level wave of length 1 m.
fn curve(count: usize) -> Vec<Vector3<f64>> {
    let length = 1.0 / count as f64;
    let mut end = Vector3::zeros();
    let segment = |i: usize| {
        let angle = 0.8 * (TAU * (i as f64 + 0.5) * length).cos();
        let way = Vector3::new(angle.cos(), angle.sin(), 0.0) * length;
        end += way;
        end - way * 0.5
    };
    (0..count).map(segment).collect()
}

/// Shifts [m] and turns [rad] of both grips.
type Grips = DVector<f64>;

/// A model whose grips are moved.
fn gripped(model: &Model, grips: &Grips) -> Model {
    let mut model = model.clone();
    for (anchor, pose) in model.anchors.iter_mut().enumerate() {
        let [shift, turn] = [0, 3].map(|k| grips.fixed_rows::<3>(6 * anchor + k).into_owned());
        pose.position += shift;
        pose.orientation = UnitQuaternion::from_scaled_axis(turn) * pose.orientation;
    }
    model
}

/// The derivative of a rotation by a rotation vector: what it turns by further as the vector changes (Rodrigues).
fn turn_of(vector: &Vector3<f64>, change: &Vector3<f64>) -> Vector3<f64> {
    let angle = vector.norm();
    if angle < 1e-6 {
        return change + vector.cross(change) * 0.5;
    }
    let (first, second) = ((1.0 - angle.cos()) / angle.powi(2), (angle - angle.sin()) / angle.powi(3));
    change + vector.cross(change) * first + vector.cross(&vector.cross(change)) * second
}

/// The grips with which the cable hangs along a curve, from those of the stage before; the state is brought there. Returns the
/// mean distance from the curve [m], too.
fn lay(model: &Model, state: &mut State, from: &Grips, target: &[Vector3<f64>]) -> Option<(Grips, f64)> {
    let count = target.len();
    let params = Params { evaluations: 40, tolerance: 1e-6, ..Params::default() };
    let mut last = state.clone();
    let fit = least_squares(from.clone(), &params, |grips| {
        let model = gripped(model, grips);
        let mut equilibrium = Equilibrium::new(&model, &last, &StaticParams::default()).ok()?;
        last = equilibrium.state().clone();
        let mut residuals = DVector::zeros(3 * count + 12);
        let mut jacobian = DMatrix::zeros(3 * count + 12, 12);
        for (i, (x, wanted)) in last.positions.iter().zip(target).enumerate() {
            residuals.fixed_rows_mut::<3>(3 * i).copy_from(&(x - wanted));
        }
        for k in 0..12 {
            let (anchor, part) = (k / 6, k % 6);
            let unit = Vector3::from_fn(|axis, _| if axis == part % 3 { 1.0 } else { 0.0 });
            let vector = grips.fixed_rows::<3>(6 * anchor + 3).into_owned();
            let pose = if part < 3 { [unit, Vector3::zeros()] } else { [Vector3::zeros(), turn_of(&vector, &unit)] };
            let mut variation = Variation::zero(&model);
            variation.held.push(HeldVariation { body: Body::Anchor(anchor), poses: vec![pose] });
            let change = equilibrium.forward(&variation).ok()?;
            for (i, moved) in change.positions.iter().enumerate() {
                jacobian.fixed_view_mut::<3, 1>(3 * i, k).copy_from(moved);
            }
            let weight = if part < 3 { 0.0 } else { TURNING };
            residuals[3 * count + k] = weight * grips[k];
            jacobian[(3 * count + k, k)] = weight;
        }
        Some((residuals, jacobian))
    })?;
    *state = last;
    let squares = fit.residuals.rows(0, 3 * count).norm_squared();
    Some((fit.x, (squares / count as f64).sqrt()))
}

/// The scene with the motion in it.
fn scene_of(stages: &[Grips]) -> Result<String, std::fmt::Error> {
    let mut text = CABLE.to_owned();
    for (anchor, at) in ["start-face", "end-face"].into_iter().enumerate() {
        let of = |grips: &Grips, part: usize| grips.fixed_rows::<3>(6 * anchor + part).into_owned();
        let (mut shifts, mut turns) = (String::new(), String::new());
        for (k, grips) in stages.iter().enumerate() {
            // Motions are told by turns from each time to the next.
            let [now, before] = [grips, &stages[k.saturating_sub(1)]].map(|x| of(x, 3));
            let turned = UnitQuaternion::from_scaled_axis(now) * UnitQuaternion::from_scaled_axis(before).inverse();
            for (list, x) in [(&mut shifts, of(grips, 0)), (&mut turns, turned.scaled_axis() * 180.0 / PI)] {
                writeln!(list, "    [{:.7}, {:.7}, {:.7}],", x.x, x.y, x.z)?;
            }
        }
        let times: Vec<String> = (0..stages.len()).map(|k| format!("{k}")).collect();
        write!(text, "\n[[rods.motions]]\nat = \"{at}\"\ntimes_s = [{}]\n", times.join(", "))?;
        write!(text, "shifts_m = [\n{shifts}]\nturns_deg = [\n{turns}]\ninterpolation = \"smooth\"\n")?;
    }
    Ok(text)
}

/// The motion, stage by stage on the way from where it hangs at first, and the mean distance from the curve at its end [m].
fn motion() -> Result<(Vec<Grips>, f64), Box<dyn Error>> {
    let Scene { model, mut state, .. } = scene::parse(CABLE, "cable.toml")?;
    statics::equilibrium(&model, &mut state, &StaticParams::default())?;
    let (count, first) = (state.positions.len(), state.positions.clone());
    let mut stages = vec![Grips::zeros(12)];
    let mut distance = f64::INFINITY;
    for stage in 1..=STAGES {
        let share = stage as f64 / STAGES as f64;
        let from = stages[stage - 1].clone();
        let target: Vec<_> = first.iter().zip(curve(count)).map(|(x, wanted)| x.lerp(&wanted, share)).collect();
        let (grips, left) = lay(&model, &mut state, &from, &target).ok_or("the cable has no equilibrium there")?;
        println!("stage {stage}: {:.1} mm from the curve", 1e3 * left);
        stages.push(grips);
        distance = left;
    }
    Ok((stages, distance))
}

fn main() -> Result<(), Box<dyn Error>> {
    let (stages, distance) = motion()?;
    std::fs::create_dir_all("target")?;
    std::fs::write("target/lay-a-cable.toml", scene_of(&stages)?)?;
    println!("At the end the cable is {:.1} mm from the curve (root mean square).", 1e3 * distance);
    println!("cargo run -p simulate -- target/lay-a-cable.toml --view");
    Ok(())
}

#[test]
fn the_motion_lays_the_cable_along_the_curve() -> Result<(), Box<dyn Error>> {
    let (stages, distance) = motion()?;
    // Gravity pulls the cable out of the plane of the curve; no grips can do better than the fit.
    assert!(distance < 0.04, "{distance} m");
    // A run of the scene comes to rest there.
    let Scene { model, mut state, .. } = scene::parse(&scene_of(&stages)?, "lay-a-cable.toml")?;
    let mut simulation = Simulation::new(&model, &state, &Settings::default(), None)?;
    for _ in 0..3000 {
        simulation.step(0.01)?;
    }
    simulation.store(&mut state);
    let count = state.positions.len();
    let squares = state.positions.iter().zip(curve(count)).map(|(x, wanted)| (x - wanted).norm_squared());
    let run = (squares.sum::<f64>() / count as f64).sqrt();
    assert!((run - distance).abs() < 1e-3, "{run} m, not {distance} m");
    Ok(())
}
