//! The guesses of a table, a row each.

use anyhow::Result;
use graph::Normal;
use rod::Model;
use serde::Serialize;
use solver::component::Members;
use solver::guess::InitialGuess;
use solver::projection::Projection;
use solver::topology::Topology;

use crate::guess::Guess;
use crate::name::{GuessName, Origin};
use crate::training::Training;

/// A row of a table: its name, the guess, and whether it is restricted to the scene's plane.
pub struct Row<'a> {
    /// What the table calls it.
    pub name: String,
    /// The guess's own name.
    pub guess_name: GuessName,
    guess: &'a Guess,
    planar: bool,
}

impl<'a> Row<'a> {
    /// The guess in a scene that stays in this plane, if it stays in one.
    pub fn factory(
        &self,
        plane: Option<Normal>,
    ) -> impl Fn(&Model, &Members, &Topology) -> Option<Box<dyn InitialGuess>> + use<'a> {
        self.guess.factory(plane.filter(|_| self.planar))
    }

    /// The predictions in the projection's place in a scene that stays in this plane, if it stays in one; `None` for a
    /// guess that is not a learned one of linear solves.
    pub fn projection(
        &self,
        plane: Option<Normal>,
    ) -> Option<impl Fn(&Model, &Members, &Topology) -> Box<dyn Projection> + use<'a>> {
        let plane = plane.filter(|_| self.planar);
        match self.guess {
            Guess::Learned(learned) if self.guess_name.helps_solves() => {
                Some(move |model: &Model, members: &Members, topology: &Topology| {
                    learned.project(plane, model, members, topology)
                })
            }
            _ => None,
        }
    }
}

/// Which network stands behind a row.
#[derive(Debug, Serialize)]
pub struct NetworkOf {
    /// Name of the row.
    pub guess: String,
    /// The network.
    #[serde(flatten)]
    pub origin: Origin,
}

/// The networks of those rows that have one.
pub fn networks(rows: &[Row<'_>]) -> Vec<NetworkOf> {
    let of = |row: &Row<'_>| {
        let origin = row.guess.origin()?.clone();
        Some(NetworkOf { guess: row.name.clone(), origin })
    };
    rows.iter().filter_map(of).collect()
}

/// Gets what these guesses need, each once.
pub fn load(names: impl IntoIterator<Item = GuessName>, training: &Training) -> Result<Vec<(GuessName, Guess)>> {
    let mut guesses: Vec<(GuessName, Guess)> = Vec::new();
    for name in names {
        if guesses.iter().all(|(other, _)| *other != name) {
            guesses.push((name, Guess::load(name, training)?));
        }
    }
    Ok(guesses)
}

/// The rows of a table; where scenes are planar, the learned ones that know nothing of it by themselves a second time.
pub fn rows(guesses: &[(GuessName, Guess)], are_planar: bool) -> Vec<Row<'_>> {
    let mut rows = Vec::new();
    for (guess_name, guess) in guesses {
        let guess_name = *guess_name;
        let knows_planes = guess.knows_planes();
        rows.push(Row { name: guess_name.to_string(), guess_name, guess, planar: knows_planes });
        if are_planar && guess_name.is_learned() && !knows_planes {
            rows.push(Row { name: format!("{guess_name}, planar"), guess_name, guess, planar: true });
        }
    }
    rows
}
