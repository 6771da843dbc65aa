//! From the command line to a scene and settings.

use anyhow::{Result, anyhow, bail};
use scene::sampling::{Family, Parameters};
use scene::{Scene, SceneError};
use solver::simulation::Settings;

use crate::cli::SceneArgs;

/// The scene that the arguments name, with their time step and number of steps put in.
pub(crate) fn scene(args: &SceneArgs) -> Result<Scene> {
    let mut scene = named(&args.scene, args.seed, args.index)?;
    scene.run.dt = args.dt.unwrap_or(scene.run.dt);
    scene.run.steps = args.steps.unwrap_or(scene.run.steps);
    Ok(scene)
}

/// Names of random scenes.
const RANDOM: [(&str, Family); 4] = [
    ("random-rod", Family::Rod),
    ("random-helix", Family::Helix),
    ("random-knot", Family::Knot),
    ("random-tree", Family::Tree),
];

/// The names of random scenes, in words.
pub(crate) fn random_names() -> String {
    RANDOM.map(|(name, _)| name).join(", ")
}

/// The scene file, builtin or random scene of this name.
pub(crate) fn named(name: &str, seed: Option<u64>, index: Option<u64>) -> Result<Scene> {
    if let Some((_, family)) = RANDOM.into_iter().find(|&(random, _)| random == name) {
        return Ok(Parameters::sample(family, seed.unwrap_or(0), index.unwrap_or(0)).scene()?);
    }
    for (flag, given) in [("--seed", seed.is_some()), ("--index", index.is_some())] {
        if given {
            bail!("{flag} needs a random scene ({}), but the scene is {name}", random_names());
        }
    }
    let is_file = name.ends_with(".toml") || name.contains(['/', '\\']);
    let found = if is_file { scene::load(name) } else { scene::builtin(name) };
    found.map_err(|error| match error {
        SceneError::Read { file, source } => anyhow!("cannot read the scene {file}: {source}"),
        SceneError::UnknownBuiltin { name, known } => anyhow!(
            "there is no builtin scene `{name}`; there are {known}, {}, and files that end in .toml",
            random_names()
        ),
        invalid @ SceneError::Invalid { .. } => invalid.into(),
    })
}

/// Settings with the formulation and the tolerances of the arguments; the absolute one goes down with the relative one.
pub(crate) fn settings(args: &SceneArgs) -> Settings {
    let mut settings = Settings::default();
    settings.step.formulation = args.formulation;
    settings.step.relative_tolerance = args.tolerance;
    settings.step.absolute_tolerance = settings.step.absolute_tolerance.min(1e-3 * args.tolerance);
    settings.step.contact_tolerance = args.contact_tolerance;
    settings.step.contact_projection = args.contacts;
    settings
}

/// Sets the number of threads for the whole program.
pub(crate) fn use_threads(args: &SceneArgs) -> Result<()> {
    if let Some(threads) = args.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()?;
    }
    Ok(())
}
