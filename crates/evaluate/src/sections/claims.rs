//! The paper says, we measure: every number of the paper (`claims/claims.toml`) beside ours.

mod settings;

use std::collections::BTreeMap;

use anyhow::{Context as _, Result, bail, ensure};
use report::{Block, Cell, Column, Conditions, Section as PageSection, Table};
use serde::Deserialize;

use crate::context::Context;

/// The paper's numbers.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Paper {
    /// A place in the paper, and then its claims: id, what it is, what the paper says, and the names of two notes, either of
    /// them empty or left out.
    claims: Vec<Vec<String>>,
    notes: BTreeMap<String, String>,
}

/// A number, or a statement about numbers, that the paper gives.
struct Claim {
    id: String,
    what: String,
    paper: String,
    place: String,
    /// How it is read.
    reading: Option<String>,
    /// Why ours may differ.
    reason: Option<String>,
}

/// All claims, settings before results.
fn claims() -> Result<Vec<Claim>> {
    let paper: Paper = toml::from_str(include_str!("claims/claims.toml")).context("claims.toml")?;
    let note = |name: Option<&String>| -> Result<Option<String>> {
        let name = name.filter(|name| !name.is_empty());
        let note = |name| paper.notes.get(name).cloned().with_context(|| format!("claims.toml: no note {name:?}"));
        name.map(note).transpose()
    };
    let (mut claims, mut place) = (Vec::new(), String::new());
    for row in &paper.claims {
        match &row[..] {
            [own] => place.clone_from(own),
            [id, what, says, notes @ ..] => claims.push(Claim {
                id: id.clone(),
                what: what.clone(),
                paper: says.clone(),
                place: place.clone(),
                reading: note(notes.first())?,
                reason: note(notes.get(1))?,
            }),
            _ => bail!("claims.toml: {row:?} is neither a place nor a claim"),
        }
    }
    Ok(claims)
}

/// What the paper says to a claim.
pub(crate) fn paper_says(id: &str) -> Result<String> {
    let claim = claims()?.into_iter().find(|claim| claim.id == id);
    Ok(claim.with_context(|| format!("the paper has no claim {id:?}"))?.paper)
}

/// The section, from what the other sections measured.
pub(crate) fn section(context: &Context, measured: &BTreeMap<String, String>) -> Result<PageSection> {
    let (claims, settings) = (claims()?, settings::settings(context)?);
    for id in settings.keys().chain(measured.keys()) {
        ensure!(claims.iter().any(|claim| claim.id == *id), "a number for {id:?}, which is no claim of the paper");
    }
    let row = |claim: &Claim| {
        let setting = settings.get(&claim.id);
        let ours = setting.map(|[value, _]| value).or_else(|| measured.get(&claim.id));
        let reading = claim.reading.clone().or_else(|| setting.map(|[_, at]| format!("from {at}")));
        let differs = ours.is_some_and(|ours| *ours != claim.paper);
        [
            claim.what.as_str().into(),
            claim.paper.as_str().into(),
            ours.map_or_else(|| Cell::muted("not measured"), |ours| ours.as_str().into()),
            claim.place.as_str().into(),
            reading.unwrap_or_default().into(),
            claim.reason.clone().filter(|_| differs).unwrap_or_default().into(),
        ]
    };
    let known = |claim: &&Claim| settings.contains_key(&claim.id) || measured.contains_key(&claim.id);
    let missing = claims.len() - claims.iter().filter(known).count();
    let is_same = |claim: &&Claim| settings.get(&claim.id).is_some_and(|[value, _]| *value == claim.paper);
    let introduction = format!(
        "The paper leaves open what decides most of these numbers: the tolerance of its conjugate gradients, their \
         preconditioner, the rods' radius and density. Of {} settings {} are the paper's to the digit; the others stand \
         with what they are here. Results are told of `gn`, the paper's network, and where a scene has a plane of \
         `gn, planar`, the same network restricted to it; what is ours stands beside.",
        settings.len(),
        claims.iter().filter(is_same).count()
    );
    let table = Table {
        id: "claims-table".to_owned(),
        title: "The paper says, we measure".to_owned(),
        caption:
            "Every number that the paper gives, settings first. Conditions of what is measured stand with the figures."
                .to_owned(),
        columns: ["what", "paper", "here", "where in the paper", "how it is read", "why it differs"]
            .map(Column::text)
            .to_vec(),
        rows: claims.iter().map(|claim| row(claim).to_vec()).collect(),
        conditions: Conditions::new("numbers of the paper", claims.len().to_string())
            .with("not measured here", missing.to_string()),
    };
    let blocks = vec![Block::Paragraph(introduction), Block::Table(table)];
    Ok(PageSection { id: "claims".to_owned(), title: "The paper and we".to_owned(), blocks })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// Settings from the code that are not the paper's to the digit.
    const DIFFERENT: [&str; 2] = ["trees-10-nodes", "trees-40-nodes"];

    #[test]
    fn every_claim_has_one_id_and_says_all() {
        let claims = claims().unwrap();
        let ids: BTreeSet<&str> = claims.iter().map(|claim| claim.id.as_str()).collect();
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
        let claims = claims().unwrap();
        for (id, [ours, at]) in settings::settings(&Context::for_tests()).unwrap() {
            let claim = claims.iter().find(|claim| claim.id == id).unwrap_or_else(|| panic!("no claim {id}"));
            if !at.contains("card") {
                assert_eq!(ours != claim.paper, DIFFERENT.contains(&id.as_str()), "{id}: {ours}");
            }
        }
    }
}
