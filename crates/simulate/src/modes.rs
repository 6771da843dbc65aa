//! `simulate modes`: natural frequencies about the equilibrium of a scene, and a trajectory that shows the shapes.

use std::f64::consts::TAU;
use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use cosserat::scene::Scene;
use cosserat::state::State;
use cosserat::statics::{Mode, StaticParams, modes_telling};
use export::TableWriter;
use serde::Serialize;
use terminal::{Progress, say};
use view::{Frame, Recorder};

use crate::cli::ModesArgs;
use crate::curves::recorder;
use crate::files::{Files, MODES, write_player};
use crate::numbers::number;
use crate::outcome::Outcome;
use crate::sought::{Sought, begun, still, tell};

/// Frames in which a shape swings once.
const FRAMES: usize = 24;
/// How far a shape swings, as a share of the scene's size.
const SWING: f64 = 0.05;
/// How far it turns at most [rad].
const TURN: f64 = 0.3;

#[derive(Serialize)]
struct Report {
    #[serde(flatten)]
    sought: Sought,
    /// Whether there is air, whose force stays as it is at rest.
    #[serde(skip)]
    in_air: bool,
    stable: Option<bool>,
    /// Of what is driven, loads and gravity, in all frames.
    stands_at_s: f64,
    modes: Vec<Line>,
}

#[derive(Serialize)]
struct Line {
    /// Natural frequency; 0 where it swings not.
    frequency_hz: f64,
    /// Square of the angular frequency; below zero where the equilibrium is unstable.
    squared_rad2_s2: f64,
    /// Share of critical damping.
    damping_ratio: f64,
    residual: f64,
}

impl Line {
    /// What a mode does: "0.4359 Hz".
    fn frequency(&self) -> String {
        match self.squared_rad2_s2 {
            0.0 => "moves freely".to_owned(),
            squared if squared < 0.0 => format!("grows as exp({} t / s)", number((-squared).sqrt())),
            _ => format!("{} Hz", number(self.frequency_hz)),
        }
    }
}

/// Finds the modes, writes what was asked for, and prints a table.
pub(crate) fn find(args: &ModesArgs) -> Result<Outcome> {
    let (mut scene, held) = begun(&args.rest)?;
    let params = StaticParams { leave_unstable: !args.rest.keep_unstable, ..StaticParams::default() };
    let begin = Instant::now();
    let (progress, mut shown) = (Progress::with_lines(args.count, "modes", args.rest.json)?, 0);
    let mut told = |found: usize| {
        let goes_on = progress.advance_by(found.saturating_sub(shown));
        shown = shown.max(found);
        goes_on
    };
    let found = modes_telling(&scene.model, &mut scene.state, args.count, &params, &mut told);
    let found = found.with_context(|| scene.name.clone())?;
    let interrupted = progress.stopped();
    let line = |mode: &Mode| Line {
        frequency_hz: mode.frequency(),
        squared_rad2_s2: mode.squared,
        damping_ratio: mode.damping,
        residual: mode.residual,
    };
    let report = Report {
        sought: Sought::new((&scene, held), found.equilibrium.converged, found.equilibrium.steps, begin),
        in_air: scene.model.air.is_some(),
        stable: found.equilibrium.stable,
        stands_at_s: 0.0,
        modes: found.modes.iter().map(line).collect(),
    };
    let mut closed = Ok(None);
    if let Some(wanted) = args.wanted(&scene.name) {
        let dt = 1.0 / FRAMES as f64;
        // They swing about the equilibrium of time 0, whatever is driven or changes later.
        let still = still(scene.clone());
        let mut player = wanted.view.then(|| player(&still, dt));
        let mut files = Files::open(wanted, &still, dt, 0, 0.0).context("--out")?;
        files.show_modes(found.modes.iter().map(Mode::frequency).collect(), FRAMES);
        let mut push = |(k, mode): (usize, &Mode)| {
            if let Some(player) = &mut player {
                player.begin_chapter(&format!("mode {k}: {}", report.modes[k].frequency()));
            }
            swing(&scene.state, mode).enumerate().try_for_each(|(i, state)| {
                let time = (k * FRAMES + i + 1) as f64 * dt;
                if let Some(player) = &mut player {
                    player.push(&frame(&state, time));
                }
                files.push(&state, &[], &[], time)
            })
        };
        let refused = found.modes.iter().enumerate().try_for_each(&mut push).err();
        let play = |directory: &Path| {
            write_table(&directory.join(MODES), &report.modes)?;
            player.map_or(Ok(()), |player| write_player(directory, player))
        };
        closed = files.close(&still, &report, refused, &progress, play).context("--out").map(Some);
    }
    progress.finish();
    tell(&report, args.rest.json, closed, print)?;
    Ok(match report.sought.converged {
        _ if interrupted => Outcome::Interrupted,
        true => Outcome::Done,
        false => Outcome::NotConverged,
    })
}

/// Writes a row for each mode: what it is, and which frames show it.
fn write_table(path: &Path, modes: &[Line]) -> Result<()> {
    let header = "mode,frequency_hz,squared_rad2_s2,damping_ratio,residual,first_frame,last_frame";
    let mut table = TableWriter::create(path, header)?;
    for (k, Line { frequency_hz, squared_rad2_s2, damping_ratio, residual }) in modes.iter().enumerate() {
        let [first, last] = [FRAMES * k + 1, FRAMES * (k + 1)];
        table.add(|writer| {
            writeln!(writer, "{k},{frequency_hz:?},{squared_rad2_s2:?},{damping_ratio:?},{residual:?},{first},{last}")
        })?;
    }
    Ok(table.finish()?)
}

/// A player's run that has the equilibrium.
fn player(scene: &Scene, dt: f64) -> Recorder {
    let mut player = recorder(&format!("{}, modes", scene.name), dt, scene, &scene.model);
    player.begin_chapter("at rest");
    player.push(&frame(&scene.state, 0.0));
    player
}

/// What the player is told of a state: shapes have no energy, as they have no size.
fn frame(state: &State, time: f64) -> Frame<'_> {
    Frame { time, state, forces: &[], energy: f64::NAN, length_ratio: f64::NAN, iterations: f64::NAN }
}

/// A shape as it swings once about the state at rest.
fn swing<'a>(rest: &'a State, mode: &'a Mode) -> impl Iterator<Item = State> + 'a {
    let first = rest.positions[0];
    let bounds = |(low, high), place: &_| (first.inf(place).inf(&low), first.sup(place).sup(&high));
    let (low, high) = rest.positions.iter().fold((first, first), bounds);
    let [shift, turn] = mode.largest().map(|size| size.max(f64::MIN_POSITIVE));
    let amplitude = (SWING * (high - low).norm() / shift).min(TURN / turn);
    (1..=FRAMES).map(move |k| mode.displaced(rest, amplitude * (TAU * k as f64 / FRAMES as f64).sin()))
}

fn print(report: &Report) -> Result<()> {
    let at_rest =
        if report.sought.converged { "the equilibrium" } else { "the last state, as NO equilibrium was found" };
    say!(
        "{}: {} modes about {at_rest}, in {} s",
        report.sought.scene,
        report.modes.len(),
        number(report.sought.wall_s)
    )?;
    if report.in_air {
        say!(
            "the wind's force stays as it is at rest, however the rods move: what grows here may be at rest in the wind"
        )?;
    }
    if report.stable == Some(false) {
        say!("the equilibrium is unstable")?;
    }
    for (k, line) in report.modes.iter().enumerate() {
        let damping = match line.damping_ratio {
            ratio if ratio != 0.0 && line.squared_rad2_s2 > 0.0 => format!(", damping ratio {}", number(ratio)),
            _ => String::new(),
        };
        say!("mode {k}: {}{damping}", line.frequency())?;
    }
    Ok(())
}
