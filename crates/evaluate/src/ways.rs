//! Ways to simulate a scene, by name: every solver with every guess, and predictions alone.

use catalogue::{GuessName, Row, learned_start, rows};
use evaluation::precision::{Start, Way};
use graph::{Normal, planar_normal};
use rod::Model;
use scene::Scene;
use solver::auto;
use solver::component::Members;
use solver::formulation::Formulation;
use solver::guess::GuessKind;
use solver::linear::cg::CgParams;
use solver::linear::precondition::PreconditionerKind;
use solver::linear::solvers::SolverKind;
use solver::simulation::Settings;
use solver::step::StepParams;
use solver::topology::Topology;

use crate::context::Size;
use crate::library::Guesses;

/// Guesses of linear solves without learning.
const PLAIN: [GuessKind; 5] =
    [GuessKind::Zero, GuessKind::Previous, GuessKind::Quadratic, GuessKind::Fischer(8), GuessKind::Frozen];

/// Preconditioners that every guess is tried with.
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

/// Where a way begins.
#[derive(Clone, Copy)]
enum Begin {
    Plain(GuessKind),
    /// Where [`auto::choose`] says.
    Auto,
    /// Place among the rows.
    Learned(usize),
    EndToEnd(usize),
}

/// A way by name.
pub(crate) struct Spec {
    pub(crate) name: String,
    pub(crate) kind: &'static str,
    pub(crate) settings: Settings,
    begin: Begin,
}

/// The ways of a scene.
pub(crate) struct Ways<'a> {
    rows: Vec<Row<'a>>,
    plane: Option<Normal>,
    pub(crate) specs: Vec<Spec>,
}

impl<'a> Ways<'a> {
    /// The ways of a scene with these learned guesses; of a quick report the most telling ones.
    pub(crate) fn new(scene: &Scene, guesses: &'a Guesses, size: Size) -> Self {
        let plane = planar_normal(&scene.model, &scene.state);
        let rows = rows(guesses, plane.is_some());
        let specs = specs(scene, &rows, size);
        Self { rows, plane, specs }
    }

    /// Runs `f` with a way; `None` where it cannot be had.
    pub(crate) fn with<T>(&self, spec: &Spec, f: impl FnOnce(&Way<'_>) -> T) -> Option<T> {
        let way = |start| Way { name: spec.name.clone(), kind: spec.kind.to_owned(), settings: spec.settings, start };
        match spec.begin {
            Begin::Plain(GuessKind::Zero) => Some(f(&way(Start::Zero))),
            Begin::Plain(kind) => {
                let factory =
                    |model: &Model, members: &Members, topology: &Topology| kind.build(model, members, topology);
                Some(f(&way(Start::Guess(&factory))))
            }
            Begin::Auto => Some(f(&way(Start::Auto))),
            Begin::Learned(row) => Some(f(&way(Start::Guess(&self.rows[row].factory(self.plane))))),
            Begin::EndToEnd(row) => Some(f(&way(Start::EndToEnd(&self.rows[row].projection(self.plane)?)))),
        }
    }
}

/// All ways by name.
fn specs(scene: &Scene, rows: &[Row<'_>], size: Size) -> Vec<Spec> {
    let mut specs = Vec::new();
    let mut add = |name: String, kind, formulation, solver, begin| {
        // Where conjugate gradients do not converge, halved steps would take their time to show the same.
        let max_halvings = if matches!(solver, SolverKind::Cg(_)) { 0 } else { StepParams::DEFAULT.max_halvings };
        let step = StepParams { formulation, max_halvings, ..StepParams::DEFAULT };
        specs.push(Spec { name, kind, settings: Settings { step, solver }, begin });
    };
    let zero = Begin::Plain(GuessKind::Zero);
    for formulation in Formulation::ALL {
        add(format!("{formulation}, direct"), kinds::DIRECT, formulation, SolverKind::Direct, zero);
        let step = StepParams { formulation, ..StepParams::DEFAULT };
        let solver = auto::choose(&scene.model, &step, None).solver;
        let learned = learned_start(scene, formulation);
        let place = learned.and_then(|(name, _)| rows.iter().position(|row| row.guess_name == name));
        let begin = place.map_or(Begin::Auto, Begin::Learned);
        add(format!("{formulation}, {}", kinds::AUTO), kinds::AUTO, formulation, solver, begin);
    }
    let newton = Formulation::Newton;
    let parabola = GuessKind::StepQuadratic;
    add(format!("newton, direct, {parabola}"), kinds::NEWTON, newton, SolverKind::Direct, Begin::Plain(parabola));
    for (place, row) in rows.iter().enumerate().filter(|(_, row)| row.guess_name.helps_steps()) {
        let name = format!("newton, direct, {}", row.name);
        add(name, kinds::NEWTON_LEARNED, newton, SolverKind::Direct, Begin::Learned(place));
    }
    // The paper's formulation, which the networks of linear solves were trained with.
    let xpbd = Formulation::Xpbd;
    let cg =
        |preconditioner| SolverKind::Cg(CgParams { preconditioner, max_iterations: cap(scene), ..CgParams::default() });
    let of_solves = || rows.iter().enumerate().filter(|(_, row)| row.guess_name.helps_solves());
    for &preconditioner in size.pick(&[PreconditionerKind::Raw, PreconditionerKind::BlockJacobi][..], &PRECONDITIONERS)
    {
        for &kind in size.pick(&[GuessKind::Zero, GuessKind::Fischer(8)][..], &PLAIN) {
            let name = format!("cg {preconditioner}, {}", GuessName::Plain(kind));
            add(name, kinds::CG, xpbd, cg(preconditioner), Begin::Plain(kind));
        }
        for (place, row) in of_solves() {
            let name = format!("cg {preconditioner}, {}", row.name);
            add(name, kinds::LEARNED, xpbd, cg(preconditioner), Begin::Learned(place));
        }
    }
    add("cg frozen, zero".to_owned(), kinds::CG, xpbd, cg(PreconditionerKind::Frozen), zero);
    for (place, row) in of_solves() {
        add(format!("end to end, {}", row.name), kinds::END_TO_END, xpbd, SolverKind::Direct, Begin::EndToEnd(place));
    }
    specs
}

/// Cap on the iterations of a solve on large scenes, some tenths of a second each; conjugate gradients' own on others.
pub(crate) fn cap(scene: &Scene) -> Option<u64> {
    let segments = scene.model.segments.len();
    (segments > 200).then_some(2_000_000 / segments as u64)
}
