//! Where `simulate static` begins: as the scene is drawn, or near the equilibrium that a network proposes.

use equilibria::learned::Learned;
use equilibria::{CableOfModel, Params, Scaled, solve_from};
use rod::{Model, State};

/// Where a search for an equilibrium begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Begin {
    /// Near the equilibrium that a network proposes, where it knows such cables; else as drawn.
    #[default]
    Learned,
    /// As the scene is drawn.
    Drawn,
}

names::names!(Begin { Learned = "learned", Drawn = "drawn" });

/// Puts a single cable between two grips where a network proposes its lowest equilibrium, brought to rest by `equilibria`.
/// Returns the linear solves that this took, of the cable's own segments and of coarse levels. `None`, and nothing changes,
/// where the network knows no such cables, or the cable as it is drawn cannot come to that equilibrium without a jump.
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
