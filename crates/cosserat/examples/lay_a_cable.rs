//! Finds the motion of two grips that lays a hanging cable along a curve: least squares over the poses of both grips, with
//! the derivative of the equilibrium with respect to them. Writes a scene that `simulate` runs to `target/lay-a-cable.toml`.

use std::error::Error;
use std::f64::consts::PI;
use std::fmt::Write;

use cosserat::derivative::{DerivativeError, Equilibrium, HeldVariation, Variation};
use cosserat::nalgebra::{DMatrix, DVector};
use cosserat::optimise::{LeastSquares, Normal, Residuals};
use cosserat::prelude::*;

/// A cable of 1 m, held at both ends.
const CABLE: &str = r#"
run = { dt_s = 0.01, steps = 1500 }
damping = { linear_per_s = 5 }

[[rods]]
name = "cable"
shape.straight = { length_m = 1, segments = 40 }
radius_m = 0.004
youngs_modulus_pa = 2e9
density_kg_m3 = 1100
clamp = ["start-face", "end-face"]
"#;
/// Waypoints of the motion.
const STAGES: usize = 12;
/// Turns are penalised by so much of the residuals, in metres a radian, so that a twist that moves nothing stays zero.
const TURNING: f64 = 1e-3;

/// Shifts [m] and turns [rad] of both grips from where they are at first.
type Grips = DVector<f64>;

/// Where the centres of so many segments lie on a level curve of length 1 m, straight at first, with a share of 1 an S; and
/// grips that are as its ends are.
fn curve(count: usize, share: f64) -> (Vec<Vector3<f64>>, Grips) {
    let length = 1.0 / count as f64;
    let angle = |s: f64| 1.2 * share * (1.5 * PI * s).cos();
    let mut end = Vector3::zeros();
    let segment = |i: usize| {
        let angle = angle((i as f64 + 0.5) * length);
        let way = Vector3::new(angle.cos(), angle.sin(), 0.0) * length;
        end += way;
        end - way * 0.5
    };
    let centres = (0..count).map(segment).collect();
    let mut grips = Grips::zeros(12);
    grips[5] = angle(0.0);
    grips.fixed_rows_mut::<3>(6).copy_from(&(end - Vector3::x()));
    grips[11] = angle(1.0);
    (centres, grips)
}

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

/// The cable's distances from a curve, one residual a coordinate of each segment, and the turns of both grips.
struct Laying<'a> {
    model: &'a Model,
    /// Where the cable hangs as the grips were last differentiated.
    state: State,
    target: &'a [Vector3<f64>],
}

impl Laying<'_> {
    fn residuals(&self, grips: &Grips, state: &State) -> DVector<f64> {
        let apart = state.positions.iter().zip(self.target).flat_map(|(x, wanted)| (x - wanted).data.0[0]);
        let turns = [3, 9].into_iter().flat_map(|k| (TURNING * grips.fixed_rows::<3>(k)).data.0[0]);
        DVector::from_vec(apart.chain(turns).collect())
    }
}

impl Residuals for Laying<'_> {
    type Error = DerivativeError;

    /// Infinite where no equilibrium was found.
    fn loss(&mut self, grips: &Grips) -> Result<f64, DerivativeError> {
        let mut state = self.state.clone();
        let report = statics::equilibrium(&gripped(self.model, grips), &mut state, &StaticParams::default())?;
        let loss = 0.5 * self.residuals(grips, &state).norm_squared();
        Ok(if report.converged { loss } else { f64::INFINITY })
    }

    fn normal(&mut self, grips: &Grips) -> Result<Normal, DerivativeError> {
        let model = gripped(self.model, grips);
        let mut equilibrium = Equilibrium::new(&model, &self.state, &StaticParams::default())?;
        self.state = equilibrium.state().clone();
        let residuals = self.residuals(grips, &self.state);
        let mut jacobian = DMatrix::zeros(residuals.len(), 12);
        for k in 0..12 {
            let (anchor, part) = (k / 6, k % 6);
            let unit = Vector3::ith(part % 3, 1.0);
            let turns = grips.fixed_rows::<3>(6 * anchor + 3).into_owned();
            let pose = if part < 3 { [unit, Vector3::zeros()] } else { [Vector3::zeros(), turn_of(&turns, &unit)] };
            let mut variation = Variation::zero(&model);
            variation.held.push(HeldVariation { body: Body::Anchor(anchor), poses: vec![pose] });
            for (i, moved) in equilibrium.forward(&variation)?.positions.iter().enumerate() {
                jacobian.fixed_view_mut::<3, 1>(3 * i, k).copy_from(moved);
            }
            if part >= 3 {
                jacobian[(3 * self.target.len() + 3 * anchor + part - 3, k)] = TURNING;
            }
        }
        Ok(Normal::new(&residuals, &jacobian))
    }
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

/// The motion, stage by stage on the way from where the cable hangs at first; and how far it is from the curve at the end [m]
/// where the grips go the way of the curve's ends, and where they go the way that is found.
fn motion() -> Result<(Vec<Grips>, [f64; 2]), Box<dyn Error>> {
    let Scene { model, mut state, .. } = scene::parse(CABLE, "cable.toml")?;
    statics::equilibrium(&model, &mut state, &StaticParams::default())?;
    let (count, mut drawn) = (state.positions.len(), state.clone());
    let mut stages = vec![Grips::zeros(12)];
    let mut search = LeastSquares::new(Grips::zeros(12));
    search.tolerance = 1e-6;
    let mut before = Grips::zeros(12);
    let mut apart = [0.0; 2];
    for stage in 1..=STAGES {
        let (target, ends) = curve(count, stage as f64 / STAGES as f64);
        statics::equilibrium(&gripped(&model, &ends), &mut drawn, &StaticParams::default())?;
        // It begins where the ends of the curve went to.
        search.x += &ends - before;
        let mut laying = Laying { model: &model, state, target: &target };
        let fit = search.run(&mut laying, 40)?;
        state = laying.state;
        apart = [&drawn, &state].map(|state| distance(state, &target));
        println!("stage {stage}: {:.2} mm from the curve, {} steps", 1e3 * apart[1], fit.steps);
        stages.push(search.x.clone());
        before = ends;
    }
    Ok((stages, apart))
}

/// Root mean square of the segments' distances from a curve [m].
fn distance(state: &State, curve: &[Vector3<f64>]) -> f64 {
    let squares = state.positions.iter().zip(curve).map(|(x, wanted)| (x - wanted).norm_squared());
    (squares.sum::<f64>() / curve.len() as f64).sqrt()
}

fn main() -> Result<(), Box<dyn Error>> {
    let (stages, apart) = motion()?;
    std::fs::create_dir_all("target")?;
    std::fs::write("target/lay-a-cable.toml", scene_of(&stages)?)?;
    let [drawn, found] = apart.map(|apart| 1e3 * apart);
    println!(
        "At the end the cable is {found:.2} mm from the curve (root mean square); {drawn:.2} mm where the grips go"
    );
    println!("the way of its ends.");
    println!("cargo run -p simulate -- target/lay-a-cable.toml --view");
    Ok(())
}

#[test]
fn the_motion_lays_the_cable_along_the_curve() -> Result<(), Box<dyn Error>> {
    let (stages, apart) = motion()?;
    assert!(apart[1] < 1e-3 && apart[1] < 0.2 * apart[0], "{apart:?} m");
    // A run of the scene comes to rest there.
    let Scene { model, mut state, .. } = scene::parse(&scene_of(&stages)?, "lay-a-cable.toml")?;
    let mut simulation = Simulation::new(&model, &state, &Settings::default(), None)?;
    for _ in 0..1500 {
        simulation.step(0.01)?;
    }
    simulation.store(&mut state);
    let run = distance(&state, &curve(state.positions.len(), 1.0).0);
    assert!((run - apart[1]).abs() < 1e-4, "{run} m, not {} m", apart[1]);
    Ok(())
}
