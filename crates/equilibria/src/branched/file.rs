//! Tables of branched queries and of their answers.

use nalgebra::UnitQuaternion;

use super::answer::BranchedEquilibrium;
use super::query::{ARMS, BranchedQuery};
use super::star::Star;
use crate::answer::{Equilibrium, Wrench};
use crate::file::{
    CABLE, CableColumns, GRIP, GripColumns, Header, MORE, Row, Tabled, cable_numbers, grip_numbers, wrench_names,
};
use crate::query::{Cable, Grip};

/// What the names of an arm's columns begin with, and those of its grip.
fn prefixes(arm: usize) -> [String; 2] {
    ["arm", "grip"].map(|what| format!("{what}{}_", arm + 1))
}

/// Where the columns of the arms and of their grips are.
pub struct Columns(Vec<(CableColumns, GripColumns)>);

impl Tabled for Star {
    type Columns = Columns;
    const SHAPE: &'static [usize] = &[ARMS];

    /// Arm after arm.
    fn names() -> Vec<String> {
        let of = |k: usize| {
            let [arm, grip] = prefixes(k);
            let arm = CABLE.iter().chain(&MORE).map(move |name| format!("{arm}{name}"));
            arm.chain(GRIP.iter().map(move |name| format!("{grip}{name}")))
        };
        (0..ARMS).flat_map(of).collect()
    }

    fn columns(header: &Header) -> Result<Columns, String> {
        let of = |k: usize| {
            let [arm, grip] = prefixes(k);
            Ok((CableColumns::new(header, &arm)?, GripColumns::new(header, &grip)?))
        };
        (0..ARMS).map(of).collect::<Result<_, _>>().map(Columns)
    }

    fn query(columns: &Columns, row: &Row) -> Result<BranchedQuery, String> {
        let mut arms = [Cable::new(1.0, 1.0, 1.0, 0.0); ARMS];
        let mut grips = [Grip { position: Default::default(), orientation: UnitQuaternion::identity() }; ARMS];
        for (k, (arm, grip)) in columns.0.iter().enumerate() {
            (arms[k], grips[k]) = (arm.cable(row)?, grip.grip(row)?);
        }
        let query = BranchedQuery { arms, grips };
        query.validate().map_err(|error| error.to_string())?;
        Ok(query)
    }

    fn query_numbers(query: &BranchedQuery) -> Vec<f64> {
        let arms = query.arms.iter().zip(&query.grips);
        arms.flat_map(|(arm, grip)| cable_numbers(arm).into_iter().chain(grip_numbers(grip))).collect()
    }

    fn answer_names() -> Vec<String> {
        let junction = GRIP.iter().map(|name| format!("junction_{name}"));
        let of = |k: usize| ["grip", "junction"].into_iter().flat_map(move |what| wrench_names(&format!("{what}{k}")));
        junction.chain((1..=ARMS).flat_map(of)).collect()
    }

    fn answer_numbers(found: &BranchedEquilibrium) -> Vec<f64> {
        let junction = Grip { position: found.junction.position, orientation: found.junction.orientation };
        let wrenches = found.arms.iter().flat_map(|arm| &arm.grips);
        grip_numbers(&junction).into_iter().chain(wrenches.flat_map(Wrench::numbers)).collect()
    }

    fn cables(found: &BranchedEquilibrium) -> &[Equilibrium] {
        &found.arms
    }
}
