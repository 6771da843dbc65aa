//! The paper says, we measure: every number of the paper (`claims/claims.toml`) beside ours.

mod settings;

use std::collections::BTreeMap;

use anyhow::{Context as _, Result, bail, ensure};
use report::{Cell, Conditions, Section as PageSection};
use serde::Deserialize;

use crate::blocks::{section as page_section, table};
use crate::context::Context;

/// The paper's numbers.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Paper {
    /// A place in the paper, and then its claims: id, what it is, what the paper says, and the names of two notes, either of
    /// them empty or left out.
    claims: Vec<Vec<String>>,
    /// Of claims that are scenes: name and words, see [`settings::settings`].
    scenes: BTreeMap<String, [String; 2]>,
    notes: BTreeMap<String, String>,
}

/// A number, or a statement about numbers, that the paper gives.
struct Claim<'a> {
    id: &'a str,
    what: &'a str,
    paper: &'a str,
    place: &'a str,
    /// How it is read.
    reading: Option<&'a str>,
    /// Why ours may differ.
    reason: Option<&'a str>,
}

fn paper() -> Result<Paper> {
    toml::from_str(include_str!("claims/claims.toml")).context("claims.toml")
}

impl Paper {
    /// All claims, settings before results.
    fn claims(&self) -> Result<Vec<Claim<'_>>> {
        let note = |notes: &[String], k: usize| -> Result<Option<&str>> {
            let Some(name) = notes.get(k).filter(|name| !name.is_empty()) else { return Ok(None) };
            let note = self.notes.get(name).with_context(|| format!("claims.toml: no note {name:?}"))?;
            Ok(Some(note))
        };
        let (mut claims, mut place) = (Vec::new(), "");
        for row in &self.claims {
            match &row[..] {
                [own] => place = own,
                [id, what, paper, notes @ ..] => {
                    let [reading, reason] = [note(notes, 0)?, note(notes, 1)?];
                    claims.push(Claim { id, what, paper, place, reading, reason });
                }
                _ => bail!("claims.toml: {row:?} is neither a place nor a claim"),
            }
        }
        Ok(claims)
    }
}

/// What the paper says to a claim.
pub(crate) fn paper_says(id: &str) -> Result<String> {
    let paper = paper()?;
    let claim = paper.claims()?.into_iter().find(|claim| claim.id == id);
    Ok(claim.with_context(|| format!("the paper has no claim {id:?}"))?.paper.to_owned())
}

/// The section, from what the other sections measured.
pub(crate) fn section(context: &Context, measured: &BTreeMap<String, String>) -> Result<PageSection> {
    let paper = paper()?;
    let (claims, settings) = (paper.claims()?, settings::settings(context, &paper.scenes)?);
    for id in settings.keys().chain(measured.keys()) {
        ensure!(claims.iter().any(|claim| claim.id == id), "a number for {id:?}, which is no claim of the paper");
    }
    let (mut rows, mut missing, mut same) = (Vec::new(), 0, 0);
    for &Claim { id, what, paper, place, reading, reason } in &claims {
        let setting = settings.get(id);
        let ours = setting.map(|[value, _]| value).or_else(|| measured.get(id));
        let reading = reading.map(str::to_owned).or_else(|| setting.map(|[_, at]| format!("from {at}")));
        let differs = ours.is_some_and(|ours| ours != paper);
        missing += usize::from(ours.is_none());
        same += usize::from(setting.is_some() && !differs);
        rows.push(vec![
            what.into(),
            paper.into(),
            ours.map_or_else(|| Cell::muted("not measured"), Cell::from),
            place.into(),
            reading.unwrap_or_default().into(),
            reason.filter(|_| differs).unwrap_or_default().into(),
        ]);
    }
    let introduction = format!(
        "The paper leaves open what decides most of these numbers: the tolerance of its conjugate gradients, their \
         preconditioner, the rods' radius and density. Of {} settings {same} are the paper's to the digit; the others stand \
         with what they are here. Results are those of `gn`, the paper's network, and, where a scene lies in a plane, of \
         `gn, planar`, the same network restricted to it; our own networks stand beside.",
        settings.len(),
    );
    let conditions = Conditions::new("numbers of the paper", claims.len().to_string())
        .with("not measured here", missing.to_string());
    let head = [
        "claims-table",
        "The paper says, we measure",
        "Every number that the paper gives, settings first. Conditions of what is measured stand with the figures.",
    ];
    let headings = "what | paper | here | where in the paper | how it is read | why it differs";
    Ok(page_section(["claims", "The paper and we", &introduction], vec![table(head, headings, rows, conditions)]))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// Settings from the code that are not the paper's to the digit.
    const DIFFERENT: [&str; 2] = ["trees-10-nodes", "trees-40-nodes"];

    #[test]
    fn every_claim_has_one_id_and_says_all() {
        let paper = paper().unwrap();
        let claims = paper.claims().unwrap();
        let ids: BTreeSet<&str> = claims.iter().map(|claim| claim.id).collect();
        assert_eq!((ids.len(), claims.len()), (claims.len(), 93));
        for Claim { id, what, paper, place, .. } in &claims {
            assert!([what, paper].iter().all(|text| !text.trim().is_empty()), "{id}");
            assert!(place.starts_with("section") || place.starts_with("supplement"), "{id}: {place}");
        }
        assert_eq!(paper_says("knot-total").unwrap(), "10.4 %");
        assert!(paper_says("knot-totals").unwrap_err().to_string().contains("knot-totals"));
    }

    #[test]
    fn settings_are_claims_and_those_from_the_code_are_the_paper_s() {
        let paper = paper().unwrap();
        let claims = paper.claims().unwrap();
        for (id, [ours, at]) in settings::settings(&Context::for_tests(), &paper.scenes).unwrap() {
            let claim = claims.iter().find(|claim| claim.id == id).unwrap_or_else(|| panic!("no claim {id}"));
            if !at.contains("card") {
                assert_eq!(ours != *claim.paper, DIFFERENT.contains(&id.as_str()), "{id}: {ours}");
            }
        }
    }
}
