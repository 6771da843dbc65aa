//! The command line.

use clap::{Parser, Subcommand};

use crate::data::DataArgs;
use crate::equilibrium::EquilibriumArgs;
use crate::plan::TrainArgs;
use crate::sweep::args::SweepArgs;

/// Trains COPINGNet: without arguments, the paper's network on the paper's bending rods.
///
/// Data are generated where they are absent. At intervals the network is measured by what counts, the iterations that its
/// guess saves on validation scenes; the best weights are kept.
#[derive(Debug, Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
    #[command(flatten)]
    pub(crate) train: TrainArgs,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Generate a data set, or a part of it, and train nothing.
    Data(DataArgs),
    /// Train and measure networks of many sizes on equal budgets: the paper's ablation.
    ///
    /// Every cell is trained on the same samples for as many epochs, and measured on scenes that no data set holds. What
    /// is done already is not done again, and a cell that was cut off goes on: give the same command. To measure cells
    /// again without training them, on a quiet machine for instance, delete their files in DIR/cells first.
    Sweep(SweepArgs),
    Equilibrium(EquilibriumArgs),
}
