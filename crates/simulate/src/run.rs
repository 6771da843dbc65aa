//! `simulate [SCENE]`: one run.

use std::time::Instant;

use anyhow::Result;
use export::{TrajectoryInfo, TrajectoryReader, TrajectoryWriter, write_centreline, write_json, write_snapshots};
use rod::measure;
use solver::component::Members;
use solver::guess::{GuessKind, InitialGuess};
use solver::simulation::{GuessFactory, Simulation};
use solver::step::Status;
use solver::topology::Topology;

use crate::Outcome;
use crate::cli::{RunArgs, SceneArgs};
use crate::progress::Progress;
use crate::scenes::{linear_solver, scene, settings, use_threads};
use crate::summary::{Drift, Summary};

/// Runs a scene, writes what was asked for, and prints the summary.
pub(crate) fn run(scene_args: &SceneArgs, args: &RunArgs) -> Result<Outcome> {
    let scene = scene(scene_args)?;
    use_threads(scene_args)?;
    let mut settings = settings(scene_args);
    settings.solver = linear_solver(args)?;
    let say = !scene_args.quiet && !scene_args.json;
    if say {
        println!(
            "{}: {} segments, {} joints, {} steps of {} s",
            scene.name,
            scene.model.segments.len(),
            scene.model.joints.len(),
            scene.run.steps,
            scene.run.dt
        );
    }
    let build = |model: &rod::Model, members: &Members, topology: &Topology| -> Option<Box<dyn InitialGuess>> {
        args.guess.build(model, members, topology)
    };
    let guess: Option<GuessFactory<'_>> = if args.guess == GuessKind::Zero { None } else { Some(&build) };
    let mut simulation = Simulation::new(&scene.model, &scene.state, &settings, guess)?;
    let mut state = scene.state.clone();
    let mut writer = match &args.out {
        Some(directory) => {
            let info = TrajectoryInfo { scene: scene.name.clone(), dt: scene.run.dt };
            let mut writer = TrajectoryWriter::create(directory, state.len(), info)?;
            writer.push(&state, 0.0)?;
            Some(writer)
        }
        None => None,
    };
    let progress = Progress::new(scene.run.steps, !say)?;
    let mut drift = Drift::new(&scene.model, &state);
    let (mut status, mut steps) = (Status::Converged, 0);
    let begin = Instant::now();
    while steps < scene.run.steps {
        status = status.max(simulation.step(scene.run.dt)?.status);
        steps += 1;
        if let Some(writer) = &mut writer {
            simulation.store(&mut state);
            writer.push(&state, simulation.time())?;
            drift.observe(&measure::energy(&scene.model, &state));
        }
        if !progress.advance() || status == Status::NonFinite {
            break;
        }
    }
    let wall = begin.elapsed();
    let interrupted = progress.finish();
    simulation.store(&mut state);
    drift.observe(&measure::energy(&scene.model, &state));
    let summary = Summary::new(&scene, &settings, args.guess, &simulation, &state, &drift, (steps, status, wall));
    if let (Some(writer), Some(directory)) = (writer, &args.out) {
        let trajectory = writer.finish()?;
        let mut reader = TrajectoryReader::open(&trajectory)?;
        write_centreline(&directory.join("centreline.csv"), &mut reader, &scene.model.segments)?;
        write_snapshots(&directory.join("snapshots.svg"), &mut reader, &scene.model.segments)?;
        write_json(&directory.join("summary.json"), &summary)?;
    }
    if scene_args.json {
        println!("{}", serde_json::to_string_pretty(&summary)?);
    } else if say {
        summary.print(args.out.as_deref());
    }
    Ok(match (interrupted, status) {
        (_, Status::NonFinite) => Outcome::NotFinite,
        (true, _) => Outcome::Interrupted,
        _ => Outcome::Done,
    })
}
