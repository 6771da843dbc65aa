//! Tables of starts, of cables of any kind.

use equilibria::Problem;
use evaluation::cables::{Measured, Way};
use report::{Block, Cell, Conditions};
use serde::{Deserialize, Serialize};

use crate::blocks::table;
use crate::show::number;

/// By how much less often a rival may find the lowest equilibrium.
pub(crate) const LESS: f64 = 0.005;

/// A way as it was measured.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Row {
    pub(crate) start: String,
    pub(crate) levels: Vec<usize>,
    pub(crate) measured: Measured,
}

impl Row {
    /// Ways with what they came to.
    pub(crate) fn of<P: Problem>(ways: &[Way<P>], measured: Vec<Measured>) -> Vec<Self> {
        let row = |(way, measured): (&Way<P>, Measured)| Self {
            start: way.name.clone(),
            levels: way.levels.clone(),
            measured,
        };
        ways.iter().zip(measured).map(row).collect()
    }

    pub(super) fn time(&self) -> f64 {
        self.measured.query_us[0]
    }

    fn levels(&self) -> String {
        let levels: Vec<String> = self.levels.iter().map(ToString::to_string).collect();
        if levels.is_empty() { "-".to_owned() } else { levels.join(", ") }
    }
}

/// A learned start of this name and coarse level, and the fastest without learning that finds the lowest as often but for `less`,
/// or as rarely as it likes; of those that fail in less than `failed` of the queries.
pub(crate) fn pair<'a>(
    rows: &'a [Row],
    (name, level): (&str, usize),
    less: Option<f64>,
    failed: f64,
) -> Option<[&'a Row; 2]> {
    let own = rows.iter().find(|row| row.start == name && row.levels == [level])?;
    let least = less.map_or(0.0, |less| own.measured.lowest - less);
    let fits =
        |row: &&Row| !row.start.starts_with("learned") && row.measured.lowest >= least && row.measured.failed < failed;
    Some([own, rows.iter().filter(fits).min_by(|a, b| a.time().total_cmp(&b.time()))?])
}

/// What a rival takes over what a learned start takes.
pub(crate) fn ratio([own, rival]: [&Row; 2]) -> Cell {
    number(rival.time() / own.time()).into()
}

/// Columns [`compared`] fills.
pub(crate) const COMPARED: &str =
    "#learned [us] | #lowest % | rival | coarse levels | #rival [us] | #lowest % | #rival, to learned";

/// Both of a pair, with their ratio.
pub(crate) fn compared(pair: Option<[&Row; 2]>) -> Vec<Cell> {
    let Some([own, rival]) = pair else { return vec![Cell::muted("-"); 7] };
    let texts = [
        number(own.time()),
        percent(own.measured.lowest),
        rival.start.clone(),
        rival.levels(),
        number(rival.time()),
        percent(rival.measured.lowest),
    ];
    texts.into_iter().map(Cell::from).chain([ratio([own, rival])]).collect()
}

/// All ways.
pub(crate) fn all(head: [&str; 3], rows: &[Row], conditions: Conditions) -> Block {
    let with_interval = |[mean, half]: [f64; 2]| format!("{} +- {}", number(mean), number(half));
    let row = |row: &Row| {
        let Measured { query_us, solves, coarse_solves, indefinite, regularised, failed, lowest } = &row.measured;
        let texts = [
            row.start.clone(),
            row.levels(),
            with_interval(*query_us),
            with_interval(*solves),
            number(*coarse_solves),
            percent(*indefinite),
            number(*regularised),
            percent(*failed),
            percent(*lowest),
        ];
        texts.into_iter().map(Cell::from).collect()
    };
    let headings = "start | coarse levels | #time [us] | #solves | #coarse solves | #indefinite starts % | #regularised solves | #failed % | #lowest %";
    table(head, headings, rows.iter().map(row).collect(), conditions)
}

pub(super) fn percent(share: f64) -> String {
    format!("{:.2}", 100.0 * share)
}
