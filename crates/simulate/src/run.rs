//! `simulate [SCENE]`: one run.

use std::borrow::Cow;
use std::time::{Duration, Instant};

use anyhow::{Context, Error, Result, bail};
use catalogue::{Guess, GuessName, Training, plane};
use chart::Conditions;
use cosserat::guess::{Choice, GuessFactory, GuessKind, Members, Topology};
use cosserat::live::{Rebuild, Replay};
use cosserat::scene::Scene;
use cosserat::simulation::{Settings, Simulation, SimulationError, Snapshot, Status, StepParams};
use cosserat::state::{Model, State};
use graph::{Normal, planar_normal};
use terminal::{Progress, say};

use crate::apart::Apart;
use crate::choice::{Way, way};
use crate::cli::{RunArgs, SceneArgs};
use crate::held::hold_snapshot;
use crate::keep::{Keep, Rhythm};
use crate::measured::Measured;
use crate::numbers::number;
use crate::outcome::Outcome;
use crate::rate::Rate;
use crate::reached::Reached;
use crate::rods;
use crate::scenes::{self, Begun, From, left_out, origin, overlapping, settings, use_threads};
use crate::shown::{handled, read_recording, replay, show};
use crate::summary::{Start, Summary};
use crate::watch::Watch;

/// Runs a scene, writes what was asked for, and prints the summary.
pub(crate) fn run(scene_args: &SceneArgs, args: &RunArgs) -> Result<Outcome> {
    if let (Some(file), None) = (&args.replay, &args.recording) {
        let recording = Some(read_recording(file)?);
        return run(scene_args, &RunArgs { recording, ..args.clone() });
    }
    let mut begun = scenes::scene(scene_args)?;
    if let Some(recording) = &args.recording {
        begun.scene.run.steps = usize::try_from(recording.steps)?;
    }
    begun.scene.run.every = args.every.unwrap_or(begun.scene.run.every);
    for (flag, is_given) in [("--every", args.every.is_some()), ("--fps", args.fps.is_some())] {
        if is_given && !args.writes() {
            bail!("{flag} says which frames are kept in files, but no file is asked for: give --out, for example");
        }
    }
    let rate = args.fps.map(|fps| Rate::new(fps, &begun.scene.run)).transpose()?;
    if let Some(rate) = &rate {
        begun.scene.run = rate.run;
    }
    let mut label = begun.label(args.wants_snapshot());
    let Begun { mut scene, snapshot: from, .. } = begun;
    let rods = rods::named(&scene, args)?;
    use_threads(scene_args)?;
    let mut settings = settings(scene_args, args.guess, &scene.run);
    scene.model = settings.step.formulation.measured(&scene.model).into_owned();
    let Way { solver, guess: name, choice, chosen } = way((scene_args, args), &scene, &settings.step)?;
    settings.solver = solver;
    let quiet = scene_args.quiet || scene_args.json;
    let training = Training::for_scene(&args.learned, args.guess.as_slice(), args.scenario, &scene, quiet)?;
    // Before the data set is generated, which takes a while.
    let asked_plane = if args.planar { Some(plane(&scene)?) } else { None };
    let guess = Guess::load(name, &training)?;
    let own_plane = || planar_normal(&scene.model, &scene.state).filter(|_| guess.knows_planes());
    let plane = asked_plane.or_else(own_plane);
    training.say_foreign(&[name], &scene)?;
    training.say_time_steps(name, &guess, scene.run.dt)?;
    let handled = handled(&scene, args);
    let model = handled.as_ref().unwrap_or(&scene.model);
    if let (Some(From { what, .. }), Some(_)) = (&from, &handled) {
        bail!("{what}: a live view begins with a frame, not with a snapshot: give FOLDER@K");
    }
    let simulation = match (args.end_to_end, guess.projection(plane)) {
        (Some(predictions), Some(project)) => {
            let params = StepParams { max_iterations: predictions, ..settings.step };
            Simulation::end_to_end(&scene.model, &scene.state, &params, &project).map_err(Error::from)
        }
        _ => solved((model, &scene.state), &settings, &guess, choice.as_ref(), plane),
    };
    let mut simulation = simulation.map_err(|error| match error.downcast_ref() {
        Some(SimulationError::Overlap(overlap)) => overlapping(&scene, scene_args, overlap),
        _ => error,
    })?;
    let start = scene.state.clone();
    let rebuild: Rebuild<'_> = Box::new(|model| {
        let solved = solved((model, &start), &settings, &guess, choice.as_ref(), plane);
        solved.map_err(|error| format!("{error:#}"))
    });
    if args.live {
        return show(&scene, model, &mut simulation, rebuild, (scene_args, args), run);
    }
    let mut again = match &args.recording {
        Some(recording) => Some(replay(recording, model, &mut simulation, scene.run.dt, rebuild)?),
        None => None,
    };
    if let Some(From { snapshot, what, .. }) = &from {
        if simulation.restore(snapshot).is_err() {
            bail!(
                "{what}: the snapshot is of a run with another formulation, integrator, solver or guess; with the same flags a run \
                 goes on from it, with FOLDER@K it begins anew with frame K"
            );
        }
        label.holds.extend(hold_snapshot(&mut scene, &mut simulation, what)?);
        simulation.store(&mut scene.state);
    }
    let (scene, time) = (scene, simulation.time());
    let mut model = Cow::Borrowed(&scene.model);
    if time > 0.0 {
        set_time(&mut model, time);
    }
    if from.is_some() && model.varies() {
        // Where grips took hold, and what has broken.
        simulation.store_model(model.to_mut());
    }
    // Listens to Ctrl-C before the first temporary file is made.
    let progress = Progress::with_lines(scene.run.steps, "steps", quiet)?;
    let title = title(&scene, &settings, name, args);
    let wanted =
        args.wanted(&scene, origin(&scene, &scene_args.begin).map(|(_, origin)| origin.folder.as_path()), rods);
    let keep = wanted.map(|wanted| Keep::open(wanted, &scene, &model, &title, time));
    let mut keep = keep.transpose().context("--out")?;
    if let (Some(keep), Some(every)) = (&mut keep, args.snapshot_every) {
        let label = label.clone();
        keep.write_snapshots(Rhythm { every, label }, &mut simulation).context("--out")?;
    }
    if !quiet {
        say!(
            "{}: {} segments, {} joints, {} steps of {:?} s",
            scene.name,
            scene.model.segments.len(),
            scene.model.joints.len(),
            scene.run.steps,
            scene.run.dt
        )?;
        if let Some(From { what, is_unfinished, .. }) = &from {
            let end = if *is_unfinished { ", the last snapshot of a run that did not come to its end" } else { "" };
            say!("goes on at {} s{end} ({what})", number(time))?;
        }
        if let Some(rate) = &rate {
            say!("{rate}")?;
        }
    }
    let mut state = scene.state.clone();
    let mut measured = Measured::new(&model, &state, scene.run.steps);
    let is_told = args.writes() || scene_args.json;
    let told = if is_told { (scene.probes.as_slice(), scene.eyelets.as_slice()) } else { (&[][..], &[][..]) };
    let mut watch = Watch::new(&model, &state, time, told, args.envelope);
    let stops_apart = !args.keep_going && args.end_to_end.is_none();
    let beside = (&mut keep, &mut watch);
    let mut reached =
        go(&scene, &mut simulation, &mut state, &mut measured, beside, &progress, (stops_apart, again.as_mut()))?;
    if args.end_to_end.is_some() {
        // Predictions in the place of solves leave errors, of whatever size.
        reached.apart = None;
    }
    let mut told = Cow::Borrowed(&scene);
    if scene.model.has_timed_grips() || !scene.model.breakable.is_empty() {
        // Where grips have taken hold and what has broken, which the files need, is known now.
        let mut model = scene.model.clone();
        simulation.store_model(&mut model);
        let own = &mut told.to_mut().model;
        (own.motions, own.breakable) = (model.motions, model.breakable);
    }
    let is_finite = reached.status != Status::NonFinite;
    let snapshot = (args.wants_snapshot() && is_finite).then(|| simulation.snapshot());
    let summary = Summary::new(
        &told,
        &settings,
        &Start {
            name,
            network: guess.origin().cloned(),
            end_to_end: args.end_to_end.unwrap_or(0),
            planar: plane.is_some(),
            chosen,
            set: scene_args.of.set.clone(),
            left_out: left_out(&scene, scene_args),
            fps: args.fps,
            holds: label.holds.clone(),
            time,
        },
        &simulation,
        &state,
        &measured,
        &reached,
    )
    .with_probes(watch.as_ref().and_then(|watch| watch.probes().cloned()))
    .with_eyelets(watch.as_ref().and_then(|watch| watch.eyelets().cloned()));
    let conditions = Conditions::new("run", title)
        .with("machine", export::machine())
        .with("time step", format!("{:?} s", scene.run.dt));
    let refused = reached.refused.take();
    let envelope = watch.as_ref().and_then(|watch| watch.envelope.as_ref());
    let written = keep
        .map(|mut keep| {
            // The snapshot first: it takes the least room and is worth the most.
            let unsaved = snapshot.as_ref().and_then(|snapshot| keep.write_snapshot(&label, snapshot).err());
            keep.close(&told, &summary, &conditions, (envelope, summary.breaks()), refused.or(unsaved), &progress)
        })
        .transpose()
        .context("--out");
    progress.finish();
    if scene_args.json {
        say!("{}", serde_json::to_string_pretty(&summary)?)?;
    } else if !quiet {
        summary.print(written.as_ref().ok().and_then(Option::as_ref), args.times)?;
    }
    written?;
    let apart = reached.apart.as_ref();
    Ok(match (reached.interrupted, reached.status) {
        (_, Status::NonFinite) => Outcome::Stuck(format!(
            "numbers are not finite: {} stopped after step {}, with the last finite state; {}",
            scene.name,
            reached.steps,
            apart.map_or_else(|| "a smaller --dt may help".to_owned(), Apart::to_string)
        )),
        (_, Status::TooManyContacts) => Outcome::Stuck(format!(
            "more contacts press at once than memory is allowed for: {} stopped before step {}",
            scene.name, reached.steps
        )),
        (interrupted, _) => match apart {
            Some(apart) if stops_apart => Outcome::Stuck(format!(
                "{}: stopped after step {} of {}: {apart}; --keep-going goes on",
                scene.name, reached.steps, scene.run.steps
            )),
            Some(apart) => Outcome::Stuck(format!("{}: {apart}", scene.name)),
            None if interrupted => Outcome::Interrupted,
            // Predictions in the place of solves have no tolerance to meet.
            None if reached.status == Status::OutOfIterations && args.end_to_end.is_none() => {
                let unsolved = simulation.counters().not_converged;
                let steps =
                    if unsolved == 1 { "1 step or substep was" } else { &format!("{unsolved} steps or substeps were") };
                Outcome::Inaccurate(format!(
                    "{}: {steps} not solved to the tolerance, the results may be wrong; try a smaller --dt",
                    scene.name
                ))
            }
            None if reached.status == Status::PastHalfTurn && args.end_to_end.is_none() => {
                let steps =
                    if reached.past_half_turn == 1 { "1 step" } else { &format!("{} steps", reached.past_half_turn) };
                Outcome::Inaccurate(format!(
                    "{}: in {steps} a joint turned past half a turn, where it loses a turn of its twist, or its energy jumps: the results may be \
                     wrong; try more segments",
                    scene.name
                ))
            }
            None => Outcome::Done,
        },
    })
}

/// The run in a few words, for pictures.
fn title(scene: &Scene, settings: &Settings, guess: GuessName, args: &RunArgs) -> String {
    let Settings { step, solver } = settings;
    let way = format!("{}, {}", step.formulation, step.integrator);
    match args.end_to_end {
        Some(predictions) => format!("{}: {guess} end to end, {predictions} predictions a step", scene.name),
        None if matches!(guess, GuessName::Plain(GuessKind::Zero)) => {
            format!("{}: {way}, {solver}", scene.name)
        }
        None => format!("{}: {way}, {solver}, {guess}", scene.name),
    }
}

/// A simulation whose solves or steps begin where the guess says.
fn solved(
    (model, state): (&Model, &State),
    settings: &Settings,
    guess: &Guess,
    choice: Option<&Choice>,
    plane: Option<Normal>,
) -> Result<Simulation> {
    let own = guess.factory(plane);
    let build = |model: &Model, members: &Members, topology: &Topology| match choice {
        Some(choice) => choice.build_guess(model, members, topology),
        None => own(model, members, topology),
    };
    let is_zero = matches!(guess, Guess::Plain(GuessKind::Zero));
    let factory: Option<GuessFactory<'_>> = if is_zero { None } else { Some(&build) };
    Ok(Simulation::new(model, state, settings, factory)?)
}

/// Steps until all are done, with what is done `again`, joints are apart (if it `stops_apart`), numbers are not finite, the disk takes no more, or Ctrl-C.
/// `state` is the last finite one in the end.
fn go(
    scene: &Scene,
    simulation: &mut Simulation,
    state: &mut State,
    measured: &mut Measured,
    (keep, watch): (&mut Option<Keep<'_>>, &mut Option<Watch<'_>>),
    progress: &Progress,
    (stops_apart, mut again): (bool, Option<&mut Replay<'_>>),
) -> Result<Reached> {
    let (mut status, mut steps, mut wall, mut refused) = (Status::Converged, 0, Duration::ZERO, None);
    let (mut apart, mut past_half_turn, mut snapshot) = (None, 0, Snapshot::default());
    let (mut next, mut model) = (state.clone(), Cow::Borrowed(&scene.model));
    let mut last = scene.run.steps == 0 || progress.stopped();
    while !last {
        if let Some(again) = &mut again {
            again.before_step(simulation)?;
            if let Some(changed) = again.changed() {
                *model.to_mut() = Model { loads: scene.model.loads.clone(), ..changed.clone() };
            }
        }
        let begin = Instant::now();
        let now = simulation.step(scene.run.dt)?.status;
        if let Some(again) = &mut again {
            again.stepped(simulation);
        }
        status = status.max(now);
        wall += begin.elapsed();
        steps += 1;
        past_half_turn += usize::from(now == Status::PastHalfTurn);
        last = !progress.advance() || steps == scene.run.steps || status.is_stuck();
        if matches!(now, Status::OutOfIterations | Status::Apart) {
            simulation.store(&mut next);
            if model.varies() {
                simulation.store_model(model.to_mut());
            }
            Apart::note(&mut apart, (steps, simulation.time(), now), scene, &model, &next);
            if stops_apart && apart.is_some() {
                (status, last) = (status.max(Status::Apart), true);
            }
        }
        if keep.as_ref().is_some_and(|keep| keep.wants_snapshot(steps, scene.run.dt)) && !last {
            simulation.store(&mut next);
            // What is not finite is nothing to go on from.
            if let (Some(keep), true) = (keep.as_mut(), is_finite(&next)) {
                simulation.snapshot_into(&mut snapshot);
                refused = keep.push_snapshot(&snapshot).err();
                last |= refused.is_some();
            }
        }
        let measure = last || measured.wants(steps);
        let keeps = keep.as_ref().is_some_and(|keep| keep.wants(steps, last));
        let before = !last && measured.wants_before(steps);
        if !measure && !keeps && !before && watch.is_none() {
            continue;
        }
        simulation.store(&mut next);
        if model.varies() {
            simulation.store_model(model.to_mut());
        }
        if let Some(watch) = watch.as_mut().filter(|_| is_finite(&next)) {
            watch.observe(&model, &next, simulation);
        }
        if !measure && !keeps {
            if before {
                measured.braking.note(&next);
            }
            continue;
        }
        if !is_finite(&next) || (measure && !measured.observe(&model, &next)) {
            status = Status::NonFinite;
            break;
        }
        if before {
            measured.braking.note(&next);
        }
        std::mem::swap(state, &mut next);
        if let Some(keep) = keep.as_mut().filter(|_| keeps) {
            refused = refused.or(keep.push(&model, simulation, state, steps, last).err());
            last |= refused.is_some();
        }
    }
    Ok(Reached { steps, status, apart, past_half_turn, interrupted: progress.stopped(), refused, wall })
}

/// Makes what of a model changes over time that of a time [s].
fn set_time(model: &mut Cow<'_, Model>, time: f64) {
    if model.varies() {
        model.to_mut().set_time(time);
    }
}

fn is_finite(state: &State) -> bool {
    let vectors = [&state.positions, &state.velocities, &state.angular_velocities];
    vectors.into_iter().flatten().flatten().all(|x| x.is_finite())
        && state.orientations.iter().flat_map(|q| &q.coords).all(|x| x.is_finite())
}
