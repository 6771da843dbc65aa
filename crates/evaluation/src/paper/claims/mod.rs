//! Every number that the paper gives (section 3.2 and 4, captions, supplement), each with what stands for it here: the
//! rows of the table "the paper says, we measure".
//!
//! The curves of its figures are not given as numbers, and are not here. Where the paper contradicts itself or leaves
//! something open, a claim says which reading is taken.

mod data;
mod ours;
mod results;
mod setups;
mod why;

use std::collections::BTreeMap;

use scene::SceneError;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Our value of a setting.
#[derive(Clone, Copy, Debug)]
pub enum Ours {
    /// As the code has it.
    Code(fn() -> Result<String, SceneError>),
    /// It belongs to what this crate does not know, a network or its training: the caller says it.
    Caller,
}

/// What stands for a claim here.
#[derive(Clone, Copy, Debug)]
pub enum Counterpart {
    /// A setting that we share, or try to.
    Setting {
        /// Where it is in the code.
        at: &'static str,
        /// Its value.
        ours: Ours,
    },
    /// A result, which the caller fills in from measurements.
    Measured,
}

/// A number, or a statement about numbers, that the paper gives.
#[derive(Clone, Copy, Debug)]
pub struct Claim {
    /// Unique name.
    pub id: &'static str,
    /// What it is.
    pub what: &'static str,
    /// What the paper says.
    pub paper: &'static str,
    /// Where it does.
    pub place: &'static str,
    /// What stands for it here.
    pub counterpart: Counterpart,
    /// How it is read, where the paper contradicts itself or leaves something open.
    pub reading: Option<&'static str>,
    /// Why ours differs, where it does.
    pub why: Option<&'static str>,
}

impl Claim {
    const fn code([id, what, paper, place, at]: [&'static str; 5], ours: fn() -> Result<String, SceneError>) -> Self {
        let counterpart = Counterpart::Setting { at, ours: Ours::Code(ours) };
        Self { id, what, paper, place, counterpart, reading: None, why: None }
    }

    const fn caller([id, what, paper, place, at]: [&'static str; 5]) -> Self {
        let counterpart = Counterpart::Setting { at, ours: Ours::Caller };
        Self { id, what, paper, place, counterpart, reading: None, why: None }
    }

    const fn measured([id, what, paper, place]: [&'static str; 4]) -> Self {
        Self { id, what, paper, place, counterpart: Counterpart::Measured, reading: None, why: None }
    }

    const fn read_as(self, reading: &'static str) -> Self {
        Self { reading: Some(reading), ..self }
    }

    const fn because(self, why: &'static str) -> Self {
        Self { why: Some(why), ..self }
    }
}

/// All claims, settings before results.
pub fn claims() -> impl Iterator<Item = &'static Claim> {
    data::CLAIMS.iter().chain(setups::CLAIMS).chain(results::CLAIMS)
}

/// A row of the table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Row {
    /// Name of the claim.
    pub id: String,
    /// What it is.
    pub what: String,
    /// What the paper says.
    pub paper: String,
    /// Where it does.
    pub place: String,
    /// Where our setting is in the code; `None` for a result.
    pub at: Option<String>,
    /// Our value; `None` where nobody has said or measured it.
    pub ours: Option<String>,
    /// How the claim is read.
    pub reading: Option<String>,
    /// Why ours differs, where it does.
    pub why: Option<String>,
}

/// Why there is no table.
#[derive(Debug, Error)]
pub enum TableError {
    /// A value for a claim that does not exist, or that has its value from the code.
    #[error("value {value:?} for {id:?}, but it must be for a result or a setting that the caller says, by its id")]
    Unknown {
        /// The id given.
        id: String,
        /// Its value.
        value: String,
    },
    /// A scene that a setting is read from.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// One row a claim, our values from the code and, by id, from `supplied`.
///
/// # Errors
/// If `supplied` has a value that is not asked for.
pub fn table(supplied: &BTreeMap<String, String>) -> Result<Vec<Row>, TableError> {
    let is_code = |claim: &Claim| matches!(claim.counterpart, Counterpart::Setting { ours: Ours::Code(_), .. });
    let is_asked = |id: &str| claims().any(|claim| claim.id == id && !is_code(claim));
    if let Some((id, value)) = supplied.iter().find(|(id, _)| !is_asked(id)) {
        return Err(TableError::Unknown { id: id.clone(), value: value.clone() });
    }
    let row = |claim: &Claim| {
        let supplied = supplied.get(claim.id).cloned();
        let (at, ours) = match claim.counterpart {
            Counterpart::Setting { at, ours: Ours::Code(ours) } => (Some(at.to_owned()), Some(ours()?)),
            Counterpart::Setting { at, ours: Ours::Caller } => (Some(at.to_owned()), supplied),
            Counterpart::Measured => (None, supplied),
        };
        Ok(Row {
            id: claim.id.to_owned(),
            what: claim.what.to_owned(),
            paper: claim.paper.to_owned(),
            place: claim.place.to_owned(),
            at,
            ours,
            reading: claim.reading.map(str::to_owned),
            why: claim.why.map(str::to_owned),
        })
    };
    claims().map(row).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::super::example::stored;
    use super::*;

    /// Settings that are not the paper's to the digit.
    const DIFFERENT: [&str; 2] = ["trees-10-nodes", "trees-40-nodes"];

    #[test]
    fn every_claim_has_one_id_and_says_all() {
        let ids: BTreeSet<&str> = claims().map(|claim| claim.id).collect();
        assert_eq!(ids.len(), claims().count());
        for claim in claims() {
            for text in [claim.id, claim.what, claim.paper, claim.place] {
                assert!(!text.trim().is_empty(), "{claim:?}");
            }
            assert!(claim.place.starts_with("section") || claim.place.starts_with("supplement"), "{}", claim.place);
            let is_result = results::CLAIMS.iter().any(|result| result.id == claim.id);
            match claim.counterpart {
                Counterpart::Setting { at, .. } => assert!(!at.is_empty() && !is_result, "{}", claim.id),
                Counterpart::Measured => assert!(is_result, "{}", claim.id),
            }
        }
    }

    #[test]
    fn settings_from_the_code_are_the_paper_s() {
        for claim in claims() {
            let Counterpart::Setting { ours: Ours::Code(ours), .. } = claim.counterpart else { continue };
            let is_different = ours().unwrap() != claim.paper;
            assert_eq!(is_different, DIFFERENT.contains(&claim.id), "{}: {}", claim.id, ours().unwrap());
            assert_eq!(is_different, claim.why.is_some(), "{}", claim.id);
        }
    }

    #[test]
    fn the_table_takes_what_the_caller_says_and_nothing_else() {
        let supplied = |id: &str| BTreeMap::from([(id.to_owned(), "7 %".to_owned())]);
        let rows = table(&supplied("knot-total")).unwrap();
        assert_eq!(rows.len(), claims().count());
        assert_eq!(stored(&rows), rows);
        let find = |id: &str| rows.iter().find(|row| row.id == id).unwrap();
        assert_eq!((find("knot-total").ours.as_deref(), find("knot-total").paper.as_str()), (Some("7 %"), "10.4 %"));
        assert_eq!(find("two-rods-total").ours, None);
        assert_eq!(find("data-dt").ours.as_deref(), Some("0.02 s"));
        for id in ["knot-totals", "data-dt"] {
            let message = table(&supplied(id)).unwrap_err().to_string();
            assert!(message.contains(id) && message.contains("7 %"), "{message}");
        }
    }
}
