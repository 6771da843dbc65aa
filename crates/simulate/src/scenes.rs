//! From the command line to a scene and settings.

use anyhow::{Result, bail};
use scene::Scene;
use scene::sampling::{Family, Parameters};
use solver::cg::CgParams;
use solver::simulation::Settings;
use solver::solvers::SolverKind;

use crate::cli::{RunArgs, SceneArgs};

/// The scene that the arguments name, with their time step and number of steps put in.
pub(crate) fn scene(args: &SceneArgs) -> Result<Scene> {
    let mut scene = match args.scene.as_str() {
        "random-rod" => Parameters::sample(Family::Rod, args.seed, args.index).scene()?,
        "random-helix" => Parameters::sample(Family::Helix, args.seed, args.index).scene()?,
        name => named(name)?,
    };
    scene.run.dt = args.dt.unwrap_or(scene.run.dt);
    scene.run.steps = args.steps.unwrap_or(scene.run.steps);
    Ok(scene)
}

/// The scene file or builtin scene of this name.
pub(crate) fn named(name: &str) -> Result<Scene> {
    let is_file = name.ends_with(".toml") || name.contains(['/', '\\']);
    Ok(if is_file { scene::load(name)? } else { scene::builtin(name)? })
}

/// Settings with the formulation and the outer tolerance of the arguments.
pub(crate) fn settings(args: &SceneArgs) -> Settings {
    let mut settings = Settings::default();
    settings.step.formulation = args.formulation;
    settings.step.relative_tolerance = args.tolerance;
    settings.step.absolute_tolerance = settings.step.absolute_tolerance.min(1e-3 * args.tolerance);
    settings
}

/// The linear solver of the arguments.
pub(crate) fn linear_solver(args: &RunArgs) -> Result<SolverKind> {
    match args.solver {
        SolverKind::Cg(params) => Ok(SolverKind::Cg(CgParams {
            preconditioner: args.preconditioner.unwrap_or(params.preconditioner),
            tolerance: args.linear_tolerance.unwrap_or(params.tolerance),
            ..params
        })),
        other => {
            for (flag, given) in [
                ("--preconditioner", args.preconditioner.is_some()),
                ("--linear-tolerance", args.linear_tolerance.is_some()),
            ] {
                if given {
                    bail!("{flag} needs --solver cg, but the solver is {other}");
                }
            }
            Ok(other)
        }
    }
}

/// Sets the number of threads for the whole program.
pub(crate) fn use_threads(args: &SceneArgs) -> Result<()> {
    if let Some(threads) = args.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global()?;
    }
    Ok(())
}
