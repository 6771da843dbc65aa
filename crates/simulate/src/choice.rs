//! Linear solver and start of a run: what the arguments ask for, and what is chosen where they leave it open.

use anyhow::{Result, bail};
use catalogue::{GuessName, learned_start};
use cosserat::guess::{self, Choice};
use cosserat::scene::Scene;
use cosserat::simulation::{CgParams, Formulation, Integrator, SolverKind, StepParams};

use crate::cli::{RunArgs, SceneArgs};
use crate::solver_name::SolverName;

/// How a scene is solved.
#[derive(Debug)]
pub(crate) struct Way {
    /// Linear solver.
    pub(crate) solver: SolverKind,
    /// Start of solves or steps.
    pub(crate) guess: GuessName,
    /// What was chosen, where the start was left open: it knows of sets that move in lanes.
    pub(crate) choice: Option<Choice>,
    /// What was left open, what it became, and why, in one line; `None` where the arguments say it all.
    pub(crate) chosen: Option<String>,
}

/// The formulation of a run with such a start: that which is `asked` for, else of learned starts of linear solves that of the steps they
/// have learned from.
pub(crate) fn formulation(asked: Option<Formulation>, guess: Option<GuessName>) -> Formulation {
    let learned = guess.is_some_and(|guess| guess.is_learned() && guess.helps_solves());
    asked.unwrap_or(if learned { Formulation::Xpbd } else { Formulation::default() })
}

/// The integrator of a run with such a start: that which is `asked` for, else of learned starts that of the steps they have learned from.
pub(crate) fn integrator(asked: Option<Integrator>, guess: Option<GuessName>) -> Integrator {
    let learned = guess.is_some_and(GuessName::is_learned);
    asked.unwrap_or(if learned { Integrator::Euler } else { Integrator::default() })
}

/// The way that the arguments ask for; what they leave open is chosen for the scene.
///
/// # Errors
/// If flags do not go together.
pub(crate) fn way((of_scene, args): (&SceneArgs, &RunArgs), scene: &Scene, step: &StepParams) -> Result<Way> {
    check_guess(args, step)?;
    let (asked_solver, why_cg) = asked_solver(args)?;
    if let Some(guess) = args.guess
        && args.end_to_end.is_some()
    {
        if args.solver != SolverName::Auto {
            bail!("--end-to-end replaces all solves, but --solver {} asks for them", args.solver);
        }
        return Ok(Way { solver: SolverKind::Direct, guess, choice: None, chosen: None });
    }
    let mut choice = guess::choose(&scene.model, step, asked_solver);
    choice.why_solver = why_cg.or(choice.why_solver);
    let solver = choice.solver;
    let Some(guess) = args.guess else {
        if let Some((guess, why)) = learned_start(scene, step) {
            let reasons = choice.reason_of_solver().into_iter().chain([why]);
            return Ok(Way { solver, guess, choice: None, chosen: Some(reasons.collect::<Vec<_>>().join("; ")) });
        }
        let (guess, chosen) = (GuessName::Plain(choice.guess), Some(choice.reason()));
        return Ok(Way { solver, guess, choice: Some(choice), chosen });
    };
    if guess.helps_solves() && !matches!(solver, SolverKind::Cg(_)) {
        bail!("--guess {guess} needs --solver cg, but the solver is {solver}, which has no use for a start");
    }
    let formulation = (of_scene.formulation.is_none() && step.formulation != Formulation::default())
        .then(|| format!("formulation {}", step.formulation));
    let rule = (of_scene.integrator.or(scene.run.integrator).is_none() && step.integrator != Integrator::default())
        .then(|| format!("integrator {}", step.integrator));
    let open: Vec<_> = formulation.into_iter().chain(rule).collect();
    let learned = (!open.is_empty()).then(|| format!("{}: {guess} has learned from such steps", open.join(", ")));
    let reasons: Vec<_> = learned.into_iter().chain(choice.reason_of_solver()).collect();
    let chosen = (!reasons.is_empty()).then(|| reasons.join("; "));
    Ok(Way { solver, guess, choice: None, chosen })
}

/// The solver that the arguments ask for. Flags that conjugate gradients alone can use ask for these where the solver is
/// left open; then there is also a line that says so.
fn asked_solver(args: &RunArgs) -> Result<(Option<SolverKind>, Option<String>)> {
    let params =
        [("--preconditioner", args.preconditioner.is_some()), ("--linear-tolerance", args.linear_tolerance.is_some())];
    let of_cg = |params: CgParams| {
        SolverKind::Cg(CgParams {
            preconditioner: args.preconditioner.unwrap_or(params.preconditioner),
            tolerance: args.linear_tolerance.unwrap_or(params.tolerance),
            ..params
        })
    };
    match args.solver {
        SolverName::Fixed(SolverKind::Cg(params)) => Ok((Some(of_cg(params)), None)),
        SolverName::Fixed(other) => {
            if let Some((flag, _)) = params.iter().find(|(_, given)| *given) {
                bail!("{flag} needs --solver cg, but the solver is {other}");
            }
            Ok((Some(other), None))
        }
        SolverName::Auto => {
            let guess = args.guess.filter(|guess| guess.helps_solves()).map(|guess| format!("--guess {guess}"));
            let flag = params.iter().find(|(_, given)| *given).map(|(flag, _)| (*flag).to_owned());
            let why = guess.or(flag).map(|flag| format!("no other has a use for {flag}"));
            Ok((why.is_some().then(|| of_cg(CgParams::default())), why))
        }
    }
}

fn check_guess(args: &RunArgs, step: &StepParams) -> Result<()> {
    let StepParams { formulation, integrator, .. } = *step;
    let name = args.guess.map_or("the default".to_owned(), |guess| guess.to_string());
    for (flag, given) in [
        ("--end-to-end", args.end_to_end.is_some()),
        ("--planar", args.planar),
        ("--scenario", args.scenario.is_some()),
    ] {
        if given && !args.guess.is_some_and(GuessName::is_learned) {
            bail!("{flag} needs a learned guess (--guess knn, gn, gn-best or gn-step), but the guess is {name}");
        }
    }
    if args.guess.is_some_and(GuessName::is_learned) && integrator != Integrator::Euler {
        bail!(
            "--guess {name} needs --integrator euler, from whose steps it has learned, but the integrator is {integrator}"
        );
    }
    if args.guess.is_some_and(GuessName::helps_steps) {
        if args.end_to_end.is_some() {
            bail!("--end-to-end needs a guess of linear solves (--guess knn, gn or gn-best), but the guess is {name}");
        }
        if !formulation.momentum() {
            bail!("--guess {name} needs --formulation newton, but the formulation is {formulation}");
        }
    }
    Ok(())
}
