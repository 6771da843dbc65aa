//! How queries are answered: cuts, tolerance, caps.

/// Fewest segments of a cable.
pub const FEWEST_SEGMENTS: usize = 8;
/// Most segments of a cable.
pub const MOST_SEGMENTS: usize = 10_000;

/// How queries are answered.
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    /// Equal segments in which each cable, or each arm, is cut.
    pub segments: usize,
    /// Segments of the coarse levels, in their order; each has end segments as short as those of the cable.
    pub levels: Vec<usize>,
    /// Error that is left: of turns [rad] as predicted, and the residual ([`crate::Equilibrium::residual`]).
    pub tolerance: f64,
    /// Cap on the linear solves of a search; four times as many where it is done again.
    pub most_solves: u32,
    /// Whether all equilibria that are found are wanted, not the lowest alone.
    pub branches: bool,
    /// Whether a query for which the starts lead nowhere is tried again from all [`Curves`](crate::start::Curves), or many [`Stars`](crate::branched::start::Stars), with
    /// short steps and without coarse levels.
    pub again: bool,
}

impl Default for Params {
    fn default() -> Self {
        Self { segments: 50, levels: vec![11], tolerance: 1e-8, most_solves: 100, branches: false, again: true }
    }
}

/// A parameter that is not allowed.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
#[error("{name} = {value}, but it must be {allowed}")]
pub struct ParamsError {
    /// Name of the parameter.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// What is allowed.
    pub allowed: String,
}

impl Params {
    /// Checks every number.
    ///
    /// # Errors
    /// The first parameter that is not allowed.
    pub fn validate(&self) -> Result<(), ParamsError> {
        let check = |name, value: f64, ok: bool, allowed: String| {
            if ok { Ok(()) } else { Err(ParamsError { name, value, allowed }) }
        };
        let range = FEWEST_SEGMENTS..=MOST_SEGMENTS;
        let allowed = format!("from {FEWEST_SEGMENTS} to {MOST_SEGMENTS}");
        check("segments", self.segments as f64, range.contains(&self.segments), allowed)?;
        let mut least = 4;
        for &level in &self.levels {
            let allowed = format!(
                "from {least} to the number of segments, {}, and each finer than the one before",
                self.segments
            );
            check("level", level as f64, (least..=self.segments).contains(&level), allowed)?;
            least = level;
        }
        let tolerance = (1e-11..=1e-2).contains(&self.tolerance);
        check("tolerance", self.tolerance, tolerance, "from 1e-11 to 1e-2".to_owned())?;
        check("most solves", f64::from(self.most_solves), self.most_solves > 0, "1 or more".to_owned())
    }
}
