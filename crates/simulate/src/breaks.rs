//! The joints that broke in a run: a table, and what a summary says.

use std::fmt::{self, Display, Formatter};
use std::path::Path;

use anyhow::Result;
use cosserat::scene::Scene;
use cosserat::state::{Body, Break, Model};
use export::{TableWriter, csv_field};
use serde::Serialize;

use crate::held::place;
use crate::numbers::number;

/// Of the joints that broke.
pub(crate) const BREAKS: &str = "breaks.csv";
const COLUMNS: &str = "time_s,joint,first,second,by,tension_n,moment_n_m,curvature_per_m";

/// The joints that broke in a run, in order.
#[derive(Clone, Debug, Serialize)]
#[serde(transparent)]
pub(crate) struct Breaks(Vec<Broken>);

/// How a joint broke.
#[derive(Clone, Debug, Serialize)]
struct Broken {
    /// Time up to which it held [s].
    time_s: f64,
    joint: usize,
    /// The bodies that it joined, in words.
    between: [String; 2],
    /// What was asked of it beyond what it bears.
    by: &'static str,
    /// What the step would have asked of it.
    tension_n: f64,
    moment_n_m: f64,
    curvature_per_m: f64,
}

impl Breaks {
    /// Those of a run; `None` where no joint can break.
    pub(crate) fn of(scene: &Scene, breaks: &[Break]) -> Option<Self> {
        let model = &scene.model;
        let of = |one: &Break| Broken {
            time_s: one.time,
            joint: one.joint,
            between: [model.joints[one.joint].a, model.joints[one.joint].b].map(|body: Body| place(scene, body)),
            by: by(model, one),
            tension_n: one.load.tension,
            moment_n_m: one.load.moment,
            curvature_per_m: one.load.curvature,
        };
        (!model.breakable.is_empty()).then(|| Self(breaks.iter().map(of).collect()))
    }

    /// Writes the table.
    ///
    /// # Errors
    /// If the disk does not take it.
    pub(crate) fn write(&self, directory: &Path) -> Result<()> {
        let mut table = TableWriter::create(&directory.join(BREAKS), COLUMNS)?;
        table.add(|writer| {
            for Broken { time_s, joint, between, by, tension_n, moment_n_m, curvature_per_m } in &self.0 {
                let [first, second] = between.each_ref().map(|name| csv_field(name));
                write!(writer, "{time_s:?},{joint},{first},{second},{by},")?;
                writeln!(writer, "{tension_n:?},{moment_n_m:?},{curvature_per_m:?}")?;
            }
            Ok(())
        })?;
        table.finish()?;
        Ok(())
    }
}

/// What was asked of a joint beyond what it bears, in a word.
fn by(model: &Model, one: &Break) -> &'static str {
    let strength = model.breakable.iter().find(|own| own.joint == one.joint).map(|own| own.strength);
    let of = strength.map_or(0, |strength| strength.share(&one.load).1);
    ["tension", "moment", "curvature"][of]
}

impl Display for Breaks {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Some(Broken { time_s, between: [a, b], by, .. }) = self.0.first() else {
            return write!(f, "no joint broke");
        };
        let count = self.0.len();
        let joints = if count == 1 { "1 joint".to_owned() } else { format!("{count} joints") };
        write!(f, "{joints} broke, the first between {a} and {b} at {} s by its {by}", number(*time_s))
    }
}
