//! What all searches for something at rest share: where they begin, and how they report.

use std::time::Instant;

use anyhow::Result;
use cosserat::scene::Scene;
use cosserat::state::State;
use cosserat::statics::StaticParams;
use serde::Serialize;
use terminal::say;

use crate::chosen::chosen;
use crate::cli::{RestArgs, StaticArgs};
use crate::files::Written;
use crate::held::Hold;
use crate::scenes;

/// The scene that is looked at where none is named.
const FIRST: &str = "heavy-cantilever";

/// What every report of something at rest has.
#[derive(Serialize)]
pub(crate) struct Sought {
    pub(crate) scene: String,
    pub(crate) segments: usize,
    /// Whether what was looked for was found.
    pub(crate) converged: bool,
    /// Linear solves, over all connected sets.
    pub(crate) linear_solves: usize,
    pub(crate) wall_s: f64,
    /// What is held otherwise than the scene says.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    held: Vec<Hold>,
}

impl Sought {
    /// That of a search that began at this time, with what is `held` otherwise than the scene says.
    pub(crate) fn new(
        (scene, held): (&Scene, Vec<Hold>),
        converged: bool,
        linear_solves: usize,
        begin: Instant,
    ) -> Self {
        let wall_s = begin.elapsed().as_secs_f64();
        Self { scene: scene.name.clone(), segments: scene.state.len(), converged, linear_solves, wall_s, held }
    }
}

/// The scene whose equilibrium is looked for, with the state in which the search begins, and what is held otherwise than it says.
pub(crate) fn begun(args: &RestArgs) -> Result<(Scene, Vec<Hold>)> {
    let from = args.begin.from.as_ref().map(|origin| origin.folder.clone());
    let mut scene = chosen(args.scene.as_deref(), from, FIRST, &args.of)?;
    let held = scenes::begin_with_frame(&mut scene, &args.begin)?;
    // At rest nothing moves, whatever it does in the scene.
    let State { velocities, angular_velocities, .. } = &mut scene.state;
    velocities.iter_mut().chain(angular_velocities).for_each(|velocity| velocity.fill(0.0));
    Ok((scene, held))
}

/// A scene in which nothing is driven and nothing changes from time 0 on.
pub(crate) fn still(mut scene: Scene) -> Scene {
    scene.model.motions.clear();
    scene.model.changes.clear();
    scene.model.contacts.obstacles.iter_mut().for_each(|obstacle| obstacle.motion = None);
    scene
}

/// Prints a report, and what was written beside it.
pub(crate) fn tell<T: Serialize>(
    report: &T,
    json: bool,
    closed: Result<Option<Written>>,
    print: impl FnOnce(&T) -> Result<()>,
) -> Result<()> {
    if json {
        say!("{}", serde_json::to_string_pretty(report)?)?;
        return closed.map(drop);
    }
    print(report)?;
    if let Some(written) = closed? {
        say!("written to {}: {}", written.directory.display(), written.names.join(", "))?;
        if let Some(page) = written.page() {
            say!("open {}", page.display())?;
        }
    }
    Ok(())
}

/// What the arguments ask of an equilibrium.
pub(crate) fn params(args: &StaticArgs) -> StaticParams {
    StaticParams {
        method: args.method,
        leave_unstable: !args.rest.keep_unstable,
        tolerance: args.tolerance,
        ..StaticParams::default()
    }
}
