//! The sections of the report, a file each: what a section measures, and in a file below it how that is shown.

mod ablation;
mod branched;
mod cables;
pub(crate) mod claims;
mod dynamics;
mod equilibria;
mod gradients;
mod knot;
mod laws;
mod long_term;
mod needs;
mod newton;
mod nrmse;
pub(crate) mod paper;
mod performance;
mod precision;
mod real_cables;
mod speedups;
pub(crate) mod stability;
mod temporal;
mod time_step;

use crate::cells::{Cells, Job, Section};

/// A page of the report, written when one of its sections is asked for.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Place {
    /// Its folder in that of the report; empty for the first page.
    pub(crate) folder: &'static str,
    pub(crate) title: &'static str,
    pub(crate) lead: &'static [&'static str],
    /// Whether networks are measured: then the paper's numbers and where the networks come from stand at its head.
    pub(crate) has_networks: bool,
}

/// How accurate and how fast simulations are, learning aside.
static ACCURACY: Place = Place {
    folder: "accuracy",
    title: "Elastic rods: how accurate, how fast, how stable",
    lead: &[
        "What a user gets without learning: error against run time of each formulation and integrator, stiff and extreme cases, \
         and what each scene leaves out.",
        "One command, `cargo run -p evaluate -- report --only time-step,stability,needs`, measures it. Every figure and table has a \
         CSV file.",
    ],
    has_networks: false,
};

/// What random scenes break.
static RANDOM: Place = Place {
    folder: "random",
    title: "Elastic rods: random scenes and the laws of mechanics",
    lead: &[
        "Ten thousand scenes drawn at random from the documented features, each run held against laws of mechanics step by step: \
         momentum, energy, friction, passing, restarts.",
        "One command, `cargo run -p evaluate -- report --only laws`, measures it. Every table has a CSV file.",
    ],
    has_networks: false,
};

/// Solvers and starts, learned ones among them.
static SOLVERS: Place = Place {
    folder: "solvers",
    title: "Elastic rods: solvers and starts at equal error",
    lead: &[
        "Error against run time of every linear solver, formulation and start, learned ones among them, on eleven scenes.",
        "One command, `cargo run -p evaluate -- report --only precision`, measures it. Times of a guess include its features, its \
         inference and its guards. Every figure and table has a CSV file.",
    ],
    has_networks: true,
};

/// What learned guesses are worth.
static LEARNED: Place = Place {
    folder: "paper",
    title: "Elastic rods: what a learned guess is worth",
    lead: &[
        "Position-based dynamics of stiff Cosserat rods solves a linear system in every outer iteration. COPINGNet predicts \
         where conjugate gradients should begin. This page holds that guess against the paper's figures and numbers; the page on \
         solvers holds it against every other way to simulate the same scenes.",
        "One command, `cargo run -p evaluate -- report`, measures all but the networks of the ablation, which `train sweep` \
         trains and measures. Times of a guess include its features, its inference and its guards. The paper's own comparisons are at \
         equal tolerance, as each figure says. Every figure and table has a CSV file.",
    ],
    has_networks: true,
};

/// What the exact tangent is worth.
static EXACT: Place = Place {
    folder: "tangent",
    title: "Elastic rods: what the exact tangent is worth",
    lead: &[
        "The exact second derivative of a step's energy makes formulation `newton` converge in fewer iterations, finds \
         equilibria, and gives derivatives of whole runs. This page has what each costs, beside what it replaces.",
        "One command, `cargo run -p evaluate -- report --only newton,equilibria,gradients`, measures it in minutes. Every figure \
         and table has a CSV file.",
    ],
    has_networks: false,
};

/// What a learned start of equilibria is worth.
static STARTS: Place = Place {
    folder: "equilibria",
    title: "Elastic rods: equilibria without a history",
    lead: &[
        "Between two steps of a motion the last solution is a start that is hard to beat. A planner asks otherwise: thousands of \
         independent questions, with several answers each. This page has what a learned start is worth there.",
        "One command, `cargo run -p evaluate -- report --only cables`, measures it in minutes. Every table has a CSV file.",
    ],
    has_networks: false,
};

/// What a learned start of branched cables is worth.
static BRANCHES: Place = Place {
    folder: "branched",
    title: "Elastic rods: branched cables between three grips",
    lead: &[
        "Three cables meet at a junction, and each has its other end in a grip. Which shape do they take, without a history? This page \
         has what a learned start is worth there, beside searches over the junction's pose and the nearest of many answers.",
        "One command, `cargo run -p evaluate -- report --only branched`, measures it in minutes. Every table has a CSV file.",
    ],
    has_networks: false,
};

/// How near simulations come to real cables.
static REAL: Place = Place {
    folder: "real",
    title: "Elastic rods: how near predictions come to real cables",
    lead: &[
        "Everything else here is held against theory. This page holds predictions against recordings of real cables.",
        "One command, `cargo run -p evaluate -- real-cables --recordings FOLDER --out report`, measures it in some half an hour a cable. The \
         folder has a folder a cable, with the recordings to learn from in `train` and those to predict in `eval`; the data set of \
         DEFORM is laid out so. The recordings are not part of this project. Every figure and table has a CSV file.",
    ],
    has_networks: false,
};

/// A section on the command line.
pub(crate) struct Named {
    /// Its name, as a command, too.
    pub(crate) name: &'static str,
    /// What it is.
    pub(crate) about: &'static str,
    /// Where it stands.
    page: &'static Place,
    job: fn() -> Box<dyn Job>,
}

const fn learned(name: &'static str, about: &'static str, job: fn() -> Box<dyn Job>) -> Named {
    Named { name, about, page: &LEARNED, job }
}

const fn accuracy(name: &'static str, about: &'static str, job: fn() -> Box<dyn Job>) -> Named {
    Named { name, about, page: &ACCURACY, job }
}

const fn random(name: &'static str, about: &'static str, job: fn() -> Box<dyn Job>) -> Named {
    Named { name, about, page: &RANDOM, job }
}

const fn exact(name: &'static str, about: &'static str, job: fn() -> Box<dyn Job>) -> Named {
    Named { name, about, page: &EXACT, job }
}

const fn starts(name: &'static str, about: &'static str, job: fn() -> Box<dyn Job>) -> Named {
    Named { name, about, page: &STARTS, job }
}

const fn solvers(name: &'static str, about: &'static str, job: fn() -> Box<dyn Job>) -> Named {
    Named { name, about, page: &SOLVERS, job }
}

const fn branches(name: &'static str, about: &'static str, job: fn() -> Box<dyn Job>) -> Named {
    Named { name, about, page: &BRANCHES, job }
}

const fn real(name: &'static str, about: &'static str, job: fn() -> Box<dyn Job>) -> Named {
    Named { name, about, page: &REAL, job }
}

fn cells<S: Section + 'static>(section: S) -> Box<dyn Job> {
    Box::new(Cells::new(section))
}

/// All sections, in the order of their pages.
pub(crate) static SECTIONS: [Named; 19] = [
    accuracy("time-step", "Error against run time, by formulation and integrator", || {
        cells(time_step::TimeStep::default())
    }),
    accuracy("stability", "Stiff and extreme cases", || cells(stability::Stability::default())),
    accuracy("needs", "What each scene needs, and what is chosen for it", || cells(needs::Scenes)),
    random("laws", "Random scenes, held against laws of mechanics", || cells(laws::Laws)),
    solvers("precision", "Error against run time of solvers and starts", || cells(precision::Precision::default())),
    learned("performance", "Over the number of segments, stiffness and tolerance", || cells(performance::Performance)),
    learned("temporal", "Iterations over the frames", || cells(temporal::Temporal)),
    learned("long-term", "Length over a long time", || cells(long_term::LongTerm)),
    learned("dynamics", "The supplement's motions", || cells(dynamics::Dynamics)),
    learned("nrmse", "Error over time, guesses against end-to-end predictions", || cells(nrmse::Nrmse)),
    learned("speedups", "Collisions, knot and trees", || cells(speedups::Speedups)),
    learned("knot", "The knot, solved and predicted", || cells(knot::Knot)),
    learned("ablation", "Networks of other sizes", || Box::new(ablation::Ablation::default())),
    exact("newton", "Steps with the exact tangent", || cells(newton::Newton)),
    exact("equilibria", "Equilibria by Newton's method", || cells(equilibria::Equilibria)),
    exact("gradients", "Derivatives of runs", || cells(gradients::Gradients)),
    starts("cables", "Starts for the equilibria of cables", || cells(cables::Cables)),
    branches("branched", "Starts for the equilibria of branched cables", || cells(branched::Branched)),
    real("real-cables", "Predictions of real cables (with --recordings alone)", || {
        cells(real_cables::RealCables::default())
    }),
];

/// The folders of all pages, with what they are about.
pub(crate) fn folders() -> Vec<(&'static str, &'static str)> {
    let mut folders: Vec<_> = SECTIONS.iter().map(|section| (section.page.folder, section.page.title)).collect();
    folders.dedup();
    folders
}

/// The pages of all sections, or of those of these names: each with these sections. Real cables are there where there are
/// recordings.
pub(crate) fn pages(only: &[String], has_recordings: bool) -> Vec<(&'static Place, Vec<Box<dyn Job>>)> {
    let is_asked = |section: &&Named| match only {
        [] => has_recordings || section.page != &REAL,
        only => only.iter().any(|name| name == section.name),
    };
    let asked: Vec<_> = SECTIONS.iter().filter(is_asked).collect();
    let pages = asked.chunk_by(|section, next| section.page == next.page);
    pages.map(|own| (own[0].page, own.iter().map(|section| (section.job)()).collect())).collect()
}
