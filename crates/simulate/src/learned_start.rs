//! Where `simulate static` begins: as the scene is drawn or, with the cargo feature `gn`, near the equilibrium that a network
//! proposes.

use anyhow::{Result, bail};
use cosserat::state::{Model, State};
#[cfg(feature = "gn")]
use equilibria::learned::Learned;
#[cfg(feature = "gn")]
use equilibria::{CableOfModel, Params, Scaled, solve_from};

/// Where a search for an equilibrium begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Begin {
    /// Near the equilibrium that a network proposes, where it knows such cables; else as drawn.
    #[cfg_attr(feature = "gn", default)]
    Learned,
    /// As the scene is drawn.
    #[cfg_attr(not(feature = "gn"), default)]
    Drawn,
}

names::names!(Begin { Learned = "learned", Drawn = "drawn" });

impl Begin {
    /// Checks that the program has what this start needs.
    ///
    /// # Errors
    /// If it is `learned` and the program was built without the cargo feature `gn`.
    pub(crate) fn check(self) -> Result<()> {
        if self == Self::Learned && cfg!(not(feature = "gn")) {
            bail!("--start {self} needs the cargo feature gn");
        }
        Ok(())
    }
}

/// Puts a single cable between two grips where a network proposes its lowest equilibrium, brought to rest by `equilibria`.
/// Returns the linear solves that this took, of the cable's own segments and of coarse levels. `None`, and nothing changes,
/// where the network knows no such cables, or the cable as it is drawn cannot come to that equilibrium without a jump.
#[cfg(feature = "gn")]
pub(crate) fn propose(model: &Model, state: &mut State) -> Option<u32> {
    let cable = CableOfModel::new(model, state).filter(|cable| Learned::knows(&Scaled::new(&cable.query)))?;
    let defaults = Params::default();
    let segments = cable.segments.len();
    let levels = defaults.levels.iter().copied().filter(|&level| level <= segments).collect();
    let params = Params { segments, levels, ..defaults };
    let answer = solve_from(&[cable.query], &params, &Learned::default()).ok()?.pop()?.ok()?;
    let lowest = answer.equilibria.first().filter(|lowest| cable.is_near(state, lowest))?;
    cable.store(lowest, state);
    Some(answer.solves + answer.coarse_solves)
}

/// Without networks nothing is proposed.
#[cfg(not(feature = "gn"))]
pub(crate) fn propose(_: &Model, _: &mut State) -> Option<u32> {
    None
}
