//! What a run came to, as text and as JSON.

use std::time::Duration;

use anyhow::Result;
use catalogue::{GuessName, Origin};
use comfy_table::Table;
use cosserat::scene::Scene;
use cosserat::simulation::{Counters, Settings, Simulation, SolverKind, StageTimes};
use cosserat::state::State;
use serde::Serialize;
use terminal::say;

use crate::apart::Apart;
use crate::braked::Braked;
use crate::breaks::Breaks;
use crate::coarse::TooCoarse;
use crate::files::Written;
use crate::held::Hold;
use crate::inelastic::Inelastic;
use crate::measured::Measured;
use crate::numbers::{energy_scale, number, share, unless_noise};
use crate::reached::Reached;
use crate::sharp::SharpJoint;
use crate::watch::OfProbes;

/// Wall time per stage [s], summed over threads.
#[derive(Debug, Serialize)]
struct StageSeconds {
    drag: f64,
    predict: f64,
    guess: f64,
    assemble: f64,
    solve: f64,
    update: f64,
    contact: f64,
}

/// Worst residuals of any step, in scaled units.
#[derive(Debug, Serialize)]
struct Worst {
    stretch_per_length: f64,
    bend_rad: f64,
    momentum: f64,
    /// Of contacts: penetration, or slip where they should stick, relative to the smaller radius.
    contact_per_radius: f64,
    /// Deepest penetration alone.
    penetration_per_radius: f64,
}

/// Where solves or steps began.
#[derive(Debug)]
pub(crate) struct Start {
    /// The guess.
    pub(crate) name: GuessName,
    /// The network that it is, if it is one.
    pub(crate) network: Option<Origin>,
    /// Predictions a step that took the place of all solves; 0 where there were solves.
    pub(crate) end_to_end: usize,
    /// Whether it was restricted to a plane.
    pub(crate) planar: bool,
    /// Which solver and start were chosen for the scene, and why; `None` where both were asked for.
    pub(crate) chosen: Option<String>,
    /// What was changed in the scene's file.
    pub(crate) set: Vec<String>,
    /// What the scene's file leaves out of its materials, and what they are then.
    pub(crate) left_out: Vec<String>,
    /// Frames a second, if they were asked for.
    pub(crate) fps: Option<f64>,
    /// What was held otherwise than the scene says when the run began.
    pub(crate) holds: Vec<Hold>,
    /// Time at the start [s].
    pub(crate) time: f64,
}

/// A run's summary.
#[derive(Debug, Serialize)]
pub(crate) struct Summary {
    scene: String,
    /// What was changed in the scene's file.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    set: Vec<String>,
    /// What the scene's file leaves out of its materials, and what they are then.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    defaults: Vec<String>,
    segments: usize,
    joints: usize,
    connected_sets: usize,
    formulation: &'static str,
    tangent: &'static str,
    integrator: &'static str,
    solver: String,
    linear_tolerance: Option<f64>,
    guess: String,
    /// Which of the two were chosen for the scene, and why.
    #[serde(skip_serializing_if = "Option::is_none")]
    chosen: Option<String>,
    /// The guess's network, if it is one.
    #[serde(flatten)]
    network: Option<Origin>,
    /// Predictions a step, at most, in the place of solves; 0 where there were solves.
    end_to_end: usize,
    /// Whether the guess was restricted to a plane.
    planar: bool,
    tolerance: f64,
    /// Error of a contact that is good enough, relative to the smaller radius.
    contact_tolerance: f64,
    /// Time at the start, of a run that goes on [s].
    #[serde(skip_serializing_if = "Option::is_none")]
    begin_s: Option<f64>,
    dt_s: f64,
    steps: usize,
    steps_asked: usize,
    /// Frames a second, if they were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    fps: Option<f64>,
    threads: usize,
    /// Worst status of any step.
    status: &'static str,
    /// Steps that ended with joints apart.
    #[serde(skip_serializing_if = "Option::is_none")]
    joints_apart: Option<Apart>,
    /// Whether Ctrl-C stopped the run.
    interrupted: bool,
    /// Wall time of the steps [s], without measuring and writing.
    wall_s: f64,
    /// Simulated time over `wall_s`; 0 without steps.
    times_real_time: f64,
    stages_s: StageSeconds,
    /// The same, for the table.
    #[serde(skip)]
    times: StageTimes,
    work: Counters,
    worst_residuals: Worst,
    /// Frames whose energy and length were measured: the first, up to 200 evenly spaced ones, and the last.
    frames_measured: usize,
    /// Largest relative change of the rods' length of the frames measured.
    length_drift: f64,
    energy_start_j: f64,
    energy_end_j: f64,
    /// Highest total energy of the frames measured.
    energy_highest_j: f64,
    /// Energies below a small share of this one are rounding errors [J].
    #[serde(skip)]
    energy_scale_j: f64,
    /// A swing for which the time step is too long.
    #[serde(skip_serializing_if = "Option::is_none")]
    too_coarse: Option<TooCoarse>,
    /// A motion that the integrator brakes much, where no swing says so.
    #[serde(skip_serializing_if = "Option::is_none")]
    braked: Option<Braked>,
    /// A joint that turned too far for its stiffness to be right.
    #[serde(skip_serializing_if = "Option::is_none")]
    sharp_joint: Option<SharpJoint>,
    /// What the probes have read, over all steps; missing in scenes without any.
    #[serde(skip_serializing_if = "Option::is_none")]
    probes: Option<OfProbes>,
    /// Where eyelets were along their rods and how they pressed, over all steps; missing in scenes without any.
    #[serde(skip_serializing_if = "Option::is_none")]
    eyelets: Option<OfProbes>,
    /// What joints that are not elastic lost and kept; missing where all are elastic.
    #[serde(skip_serializing_if = "Option::is_none")]
    inelastic: Option<Inelastic>,
    /// The joints that broke; missing where none can.
    #[serde(skip_serializing_if = "Option::is_none")]
    breaks: Option<Breaks>,
    /// What was held otherwise than the scene says, or was taken hold of on the way.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    held: Vec<Hold>,
    /// BLAKE3 of the final positions, orientations, velocities and angular velocities, as little-endian f64.
    final_state_hash: String,
}

impl Summary {
    /// Gathers everything at the end of a run.
    pub(crate) fn new(
        scene: &Scene,
        settings: &Settings,
        start: &Start,
        simulation: &Simulation,
        state: &State,
        measured: &Measured,
        reached: &Reached,
    ) -> Self {
        let counters = simulation.counters();
        let seconds = |d: Duration| d.as_secs_f64();
        let times = &counters.times;
        let wall = seconds(reached.wall);
        let integrator = settings.step.integrator;
        let too_coarse = TooCoarse::of(scene, integrator, reached.steps, measured);
        let grips = simulation.timed_grips();
        let taken = grips.iter().filter_map(|grip| Hold::of_grip(&scene.model, grip));
        let held = start.holds.iter().cloned().chain(taken);
        Self {
            scene: scene.name.clone(),
            set: start.set.clone(),
            defaults: start.left_out.clone(),
            segments: scene.model.segments.len(),
            joints: scene.model.joints.len(),
            connected_sets: simulation.components(),
            formulation: settings.step.formulation.name(),
            tangent: settings.step.tangent.name(),
            integrator: settings.step.integrator.name(),
            solver: if start.end_to_end > 0 { "none".to_owned() } else { settings.solver.to_string() },
            linear_tolerance: match settings.solver {
                SolverKind::Cg(params) => Some(params.tolerance),
                _ => None,
            },
            guess: start.name.to_string(),
            chosen: start.chosen.clone(),
            network: start.network.clone(),
            end_to_end: start.end_to_end,
            planar: start.planar,
            tolerance: match settings.step.formulation.momentum() {
                true => settings.step.motion_tolerance,
                false => settings.step.relative_tolerance,
            },
            contact_tolerance: settings.step.contact_tolerance,
            begin_s: Some(start.time).filter(|time| *time > 0.0),
            dt_s: scene.run.dt,
            steps: reached.steps,
            steps_asked: scene.run.steps,
            fps: start.fps,
            threads: rayon::current_num_threads(),
            status: reached.status.name(),
            joints_apart: reached.apart.clone(),
            interrupted: reached.interrupted,
            wall_s: wall,
            times_real_time: if reached.steps > 0 { scene.run.dt * reached.steps as f64 / wall.max(1e-9) } else { 0.0 },
            stages_s: StageSeconds {
                drag: seconds(times.drag),
                predict: seconds(times.predict),
                guess: seconds(times.guess),
                assemble: seconds(times.assemble),
                solve: seconds(times.solve),
                update: seconds(times.update),
                contact: seconds(times.contact),
            },
            times: *times,
            work: counters,
            worst_residuals: Worst {
                stretch_per_length: counters.worst_stretch,
                bend_rad: counters.worst_bend,
                momentum: counters.worst_momentum,
                contact_per_radius: counters.worst_contact,
                penetration_per_radius: counters.deepest_penetration,
            },
            frames_measured: measured.frames,
            length_drift: measured.length_drift,
            energy_start_j: measured.energy_start,
            energy_end_j: measured.energy_end,
            energy_highest_j: measured.energy_highest,
            energy_scale_j: energy_scale(&scene.model, state),
            braked: too_coarse.is_none().then(|| Braked::of(scene, integrator, reached.steps, measured)).flatten(),
            too_coarse,
            sharp_joint: SharpJoint::of(scene, &measured.sharpest),
            probes: None,
            eyelets: None,
            inelastic: Inelastic::of(scene, state),
            breaks: Breaks::of(scene, &simulation.breaks()),
            held: held.collect(),
            final_state_hash: hash(state),
        }
    }

    /// The joints that broke, where any can.
    pub(crate) fn breaks(&self) -> Option<&Breaks> {
        self.breaks.as_ref()
    }

    /// The same with what the probes have read.
    pub(crate) fn with_probes(self, probes: Option<OfProbes>) -> Self {
        Self { probes, ..self }
    }

    /// The same with what was read of eyelets.
    pub(crate) fn with_eyelets(self, eyelets: Option<OfProbes>) -> Self {
        Self { eyelets, ..self }
    }

    /// Prints it for a person: with what was `written`, and with the time of each stage if that is asked for.
    pub(crate) fn print(&self, written: Option<&Written>, times: bool) -> Result<()> {
        let plane = if self.planar { " in the plane" } else { "" };
        let end = if self.end_to_end > 0 {
            format!(", end to end with at most {} a step", self.end_to_end)
        } else {
            String::new()
        };
        if !self.set.is_empty() {
            say!("set: {}", self.set.join(", "))?;
        }
        if !self.defaults.is_empty() {
            const SHOWN: usize = 5;
            let more = self.defaults.len().saturating_sub(SHOWN);
            let more = if more > 0 { format!("; and of {more} more rods") } else { String::new() };
            let shown = &self.defaults[..self.defaults.len().min(SHOWN)];
            say!("defaults, as the file does not say: {}{more}", shown.join("; "))?;
        }
        let Self { formulation, solver, guess, .. } = self;
        let tangent = match self.tangent {
            "auto" => String::new(),
            other => format!(", tangent {other}"),
        };
        let integrator = self.integrator;
        say!(
            "formulation {formulation}{tangent}, integrator {integrator}, solver {solver}, guess {guess}{plane}{end}"
        )?;
        if let Some(chosen) = &self.chosen {
            say!("chosen: {chosen}")?;
        }
        let of = if self.steps < self.steps_asked { format!(" of {}", self.steps_asked) } else { String::new() };
        let speed = self.times_real_time;
        let speed = if speed < 1e6 { format!("{speed:.1}") } else { format!("{speed:.1e}") };
        say!(
            "{}: {} steps{of}, {} s of motion, in {} s: {speed} times real time",
            self.status,
            self.steps,
            number(self.dt_s * self.steps as f64),
            number(self.wall_s)
        )?;
        say!("{}", self.convergence())?;
        if self.work.contact_searches > 0 {
            say!("{}", self.contacts())?;
        }
        let joules = |energy: f64| number(unless_noise(energy, self.energies().fold(self.energy_scale_j, f64::max)));
        let [start, end, highest] = [self.energy_start_j, self.energy_end_j, self.energy_highest_j].map(joules);
        say!("energy: {start} J at the start, {end} J at the end, {highest} J at its highest")?;
        if let Some(inelastic) = &self.inelastic {
            say!("{inelastic}")?;
        }
        if let Some(breaks) = &self.breaks {
            say!("{breaks}")?;
        }
        if let Some(swing) = &self.too_coarse {
            say!("{swing}")?;
        }
        if let Some(braked) = &self.braked {
            say!("{braked}")?;
        }
        if let Some(joint) = &self.sharp_joint {
            say!("{joint}")?;
        }
        if times {
            say!("{}", self.stage_table())?;
        }
        if let Some(written) = written {
            say!("written to {}: {}", written.directory.display(), written.names.join(", "))?;
            if let Some(page) = written.page() {
                say!("open {}", page.display())?;
            }
        }
        Ok(())
    }

    /// Magnitudes of the energies.
    fn energies(&self) -> impl Iterator<Item = f64> {
        [self.energy_start_j, self.energy_end_j, self.energy_highest_j].into_iter().map(f64::abs)
    }

    /// How well the steps were solved, and with how much work.
    fn convergence(&self) -> String {
        let work = &self.work;
        let per_step = work.iterations as f64 / (self.steps * self.connected_sets).max(1) as f64;
        let mut line = format!("iterations: {per_step:.2} a step");
        if work.linear_iterations > 0 {
            let each = work.linear_iterations as f64 / work.iterations.max(1) as f64;
            line += &format!(", with {each:.1} of the linear solver in each");
        }
        for (count, what) in [
            (work.retries, "steps done again in halves"),
            (work.not_converged, "steps kept though not converged"),
            (work.guesses_dropped, "guesses dropped"),
        ] {
            if count > 0 {
                line += &format!(", {count} {what}");
            }
        }
        let worst = &self.worst_residuals;
        line + &format!(
            "\nerrors at joints: {} of a segment's length and {} rad at most; lengths changed by {} of themselves at most",
            share(worst.stretch_per_length),
            share(worst.bend_rad),
            share(self.length_drift)
        )
    }

    /// How many places were near enough to touch, and what is left of errors there.
    fn contacts(&self) -> String {
        let Counters { contact_candidates, contact_searches, contact_solves, .. } = self.work;
        let worst = &self.worst_residuals;
        if contact_candidates == 0 {
            return "contacts: nothing came near enough to touch".to_owned();
        }
        let near = contact_candidates as f64 / contact_searches as f64;
        let near = if near < 0.1 { "fewer than 0.1".to_owned() } else { format!("{near:.1}") };
        let looked_at = self.work.contact_evaluations + self.work.contacts_left_out;
        let pressing = 100.0 * contact_solves as f64 / looked_at.max(1) as f64;
        let pressing = match contact_solves {
            0 => "none of them press".to_owned(),
            _ if pressing < 1.0 => "less than 1 % of them press".to_owned(),
            _ => format!("{pressing:.0} % of them press"),
        };
        format!(
            "contacts: {near} places near enough to touch, {pressing} (means over all iterations)\n\
             errors of contacts: {} of the smaller radius at most; deepest overlap: {} of it",
            share(worst.contact_per_radius),
            share(worst.penetration_per_radius)
        )
    }

    fn stage_table(&self) -> Table {
        let mut table = Table::new();
        table.load_style(comfy_table::presets::NOTHING);
        table.set_header(["stage", "us a step", "share"]);
        let rows = self.times.by_name().map(|(name, time)| (name, time.as_secs_f64()));
        let total: f64 = rows.iter().map(|(_, s)| s).sum();
        for (name, seconds) in rows {
            let us = seconds * 1e6 / self.steps.max(1) as f64;
            let share = 100.0 * seconds / total.max(1e-12);
            table.add_row([name.to_owned(), format!("{us:.1}"), format!("{share:.0} %")]);
        }
        table
    }
}

/// BLAKE3 of a state's bits.
fn hash(state: &State) -> String {
    let mut hasher = blake3::Hasher::new();
    let vectors = |v: &[f64]| v.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    for i in 0..state.len() {
        hasher.update(&vectors(state.positions[i].as_slice()));
        hasher.update(&vectors(state.orientations[i].as_vector().as_slice()));
        hasher.update(&vectors(state.velocities[i].as_slice()));
        hasher.update(&vectors(state.angular_velocities[i].as_slice()));
    }
    hasher.finalize().to_hex().to_string()
}
