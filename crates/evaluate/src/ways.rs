//! Ways to simulate a scene, by name: every solver with every guess, and predictions alone.

use catalogue::{GuessName, Row, learned_start, rows};
use cosserat::guess::{self, GuessKind};
use cosserat::scene::Scene;
use cosserat::simulation::{CgParams, Formulation, Integrator, PreconditionerKind, Settings, SolverKind, StepParams};
use evaluation::precision::{Start, Way};
use graph::planar_normal;

use crate::context::Size;
use crate::library::Guesses;

/// Guesses of linear solves without learning.
const PLAIN: [GuessKind; 5] =
    [GuessKind::Zero, GuessKind::Previous, GuessKind::Quadratic, GuessKind::Fischer(8), GuessKind::Frozen];

/// Preconditioners that `compare` and `guesses` try.
pub(crate) const PRECONDITIONERS: [PreconditionerKind; 3] =
    [PreconditionerKind::Raw, PreconditionerKind::Jacobi, PreconditionerKind::BlockJacobi];

/// Sorts of ways: those of one are no rivals of each other.
pub(crate) mod kinds {
    pub(crate) const DIRECT: &str = "direct";
    pub(crate) const CG: &str = "cg without learning";
    pub(crate) const LEARNED: &str = "cg from a learned guess";
    pub(crate) const NEWTON: &str = "newton";
    pub(crate) const NEWTON_LEARNED: &str = "newton from a learned guess";
    pub(crate) const END_TO_END: &str = "end to end";
    /// What `simulate` does by itself; ways of it have this name, too.
    pub(crate) const AUTO: &str = "auto";
}

/// How steps are solved, but for the formulation: by Euler's rule, from whose steps guesses have learned.
const STEP: StepParams = StepParams { integrator: Integrator::Euler, ..StepParams::DEFAULT };

/// The ways of a scene with these learned guesses; of a quick report the most telling ones.
pub(crate) fn ways<'a>(scene: &Scene, guesses: &'a Guesses, size: Size) -> Vec<Way<'a>> {
    let plane = planar_normal(&scene.model, &scene.state);
    let rows = rows(guesses, plane.is_some());
    let learned = |row: &Row<'a>| Start::Learned(Box::new(row.factory(plane)));
    let mut ways = Vec::new();
    let mut add = |name: String, kind, formulation, solver, start| {
        // Where conjugate gradients do not converge, halved steps would take their time to show the same.
        let max_halvings = if matches!(solver, SolverKind::Cg(_)) { 0 } else { StepParams::DEFAULT.max_halvings };
        let step = StepParams { formulation, max_halvings, ..STEP };
        ways.push(Way { name, kind, settings: Settings { step, solver }, start });
    };
    for formulation in Formulation::ALL {
        let direct = format!("{formulation}, direct");
        add(direct, kinds::DIRECT, formulation, SolverKind::Direct, Start::Plain(GuessKind::Zero));
        let step = StepParams { formulation, ..STEP };
        let solver = guess::choose(&scene.model, &step, None).solver;
        let chosen = learned_start(scene, &step);
        let chosen = chosen.and_then(|(name, _)| rows.iter().find(|row| row.guess_name == name));
        let start = chosen.map_or(Start::Auto, learned);
        add(format!("{formulation}, {}", kinds::AUTO), kinds::AUTO, formulation, solver, start);
    }
    let newton = Formulation::Newton;
    let parabola = GuessKind::StepQuadratic;
    add(format!("newton, direct, {parabola}"), kinds::NEWTON, newton, SolverKind::Direct, Start::Plain(parabola));
    for row in rows.iter().filter(|row| row.guess_name.helps_steps()) {
        let name = format!("newton, direct, {}", row.name);
        add(name, kinds::NEWTON_LEARNED, newton, SolverKind::Direct, learned(row));
    }
    // The paper's formulation, which the networks of linear solves were trained with.
    let xpbd = Formulation::Xpbd;
    let cg =
        |preconditioner| SolverKind::Cg(CgParams { preconditioner, max_iterations: cap(scene), ..CgParams::default() });
    let of_solves = || rows.iter().filter(|row| row.guess_name.helps_solves());
    for preconditioner in [PreconditionerKind::Raw, PreconditionerKind::BlockJacobi] {
        for &kind in size.pick(&[GuessKind::Zero, GuessKind::Fischer(8)][..], &PLAIN) {
            let name = format!("cg {preconditioner}, {}", GuessName::Plain(kind));
            add(name, kinds::CG, xpbd, cg(preconditioner), Start::Plain(kind));
        }
        for row in of_solves() {
            let name = format!("cg {preconditioner}, {}", row.name);
            add(name, kinds::LEARNED, xpbd, cg(preconditioner), learned(row));
        }
    }
    let frozen = cg(PreconditionerKind::Frozen);
    add("cg frozen, zero".to_owned(), kinds::CG, xpbd, frozen, Start::Plain(GuessKind::Zero));
    for (row, projection) in of_solves().filter_map(|row| Some((row, row.projection(plane)?))) {
        let name = format!("end to end, {}", row.name);
        add(name, kinds::END_TO_END, xpbd, SolverKind::Direct, Start::EndToEnd(projection));
    }
    ways
}

/// Cap on the iterations of a solve on large scenes, some tenths of a second each; conjugate gradients' own on others.
pub(crate) fn cap(scene: &Scene) -> Option<u64> {
    let segments = scene.model.segments.len();
    (segments > 200).then_some(2_000_000 / segments as u64)
}
