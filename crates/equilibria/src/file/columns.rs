//! What cables and grips have columns for, and the tables of cables between two grips.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::table::{Header, Row, Tabled};
use super::writer::wrench_names;
use crate::answer::{Equilibrium, Wrench};
use crate::query::{Cable, Carried, Grip, Query};
use crate::scaled::Scaled;

/// Columns that each cable has.
pub(crate) const CABLE: [&str; 4] = ["length_m", "ei_n_m2", "gj_n_m2", "weight_n_m"];
/// Columns that may be missing: a second bending stiffness, the rest shape, the compliance of a joint, and a weight at a place.
pub(crate) const MORE: [&str; 7] =
    ["ei2_n_m2", "curvature1_1_m", "curvature2_1_m", "twist_1_m", "stretch_m_n", "carried_n", "carried_at_m"];
/// Those of a grip.
pub(crate) const GRIP: [&str; 7] = ["x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"];
/// What the names of the grips' columns begin with. Those of the second grip are there all or none, and in a row with a free end
/// all are empty.
const START: &str = "start_";
pub(super) const END: &str = "end_";

/// Where the columns of a cable are.
pub(crate) struct CableColumns {
    needed: [usize; 4],
    more: [Option<usize>; 7],
}

impl CableColumns {
    /// Those whose names begin so.
    pub(crate) fn new(header: &Header, prefix: &str) -> Result<Self, String> {
        let (mut needed, mut more) = ([0; 4], [None; 7]);
        for (own, name) in needed.iter_mut().zip(CABLE) {
            *own = header.needed(&format!("{prefix}{name}"))?;
        }
        for (own, name) in more.iter_mut().zip(MORE) {
            *own = header.place(&format!("{prefix}{name}"))?;
        }
        Ok(Self { needed, more })
    }

    /// The cable of a row.
    pub(crate) fn cable(&self, row: &Row) -> Result<Cable, String> {
        let [length, bending, torsion, weight] = self.needed;
        let number = |column| row.number(column);
        let mut cable = Cable::new(number(length)?, number(bending)?, number(torsion)?, number(weight)?);
        let more = |k: usize| self.more[k].filter(|&column| row.has(column)).map(number).transpose();
        if let Some(second) = more(0)? {
            cable.bending[1] = second;
        }
        cable.rest = Vector3::new(more(1)?.unwrap_or(0.0), more(2)?.unwrap_or(0.0), more(3)?.unwrap_or(0.0));
        if let Some(compliance) = more(4)? {
            cable.stretch_compliance = compliance;
        }
        cable.carried = Carried { weight: more(5)?.unwrap_or(0.0), place: more(6)?.unwrap_or(0.0) };
        Ok(cable)
    }
}

/// Where the columns of a grip are.
pub(crate) struct GripColumns([usize; 7]);

impl GripColumns {
    /// Those whose names begin so.
    pub(crate) fn new(header: &Header, prefix: &str) -> Result<Self, String> {
        let mut columns = [0; 7];
        for (own, name) in columns.iter_mut().zip(GRIP) {
            *own = header.needed(&format!("{prefix}{name}"))?;
        }
        Ok(Self(columns))
    }

    /// The grip of a row.
    pub(crate) fn grip(&self, row: &Row) -> Result<Grip, String> {
        let mut values = [0.0; 7];
        for (value, column) in values.iter_mut().zip(self.0) {
            *value = row.number(column)?;
        }
        let [x, y, z, qw, qx, qy, qz] = values;
        let orientation = UnitQuaternion::new_unchecked(Quaternion::new(qw, qx, qy, qz));
        Ok(Grip { position: Vector3::new(x, y, z), orientation })
    }
}

/// Numbers of a cable, as [`CABLE`] and [`MORE`] say.
pub(crate) fn cable_numbers(cable: &Cable) -> [f64; 11] {
    let Cable { length, bending: [first, second], torsion, weight, rest, stretch_compliance, carried } = *cable;
    let more = [second, rest.x, rest.y, rest.z, stretch_compliance, carried.weight, carried.place];
    let mut all = [length, first, torsion, weight, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    all[4..].copy_from_slice(&more);
    all
}

/// Numbers of a grip, as [`GRIP`] says.
pub(crate) fn grip_numbers(grip: &Grip) -> [f64; 7] {
    let (x, q) = (grip.position, grip.orientation);
    [x.x, x.y, x.z, q.w, q.i, q.j, q.k]
}

/// Where the columns of a cable between two grips are.
pub struct Columns {
    cable: CableColumns,
    start: GripColumns,
    end: Option<GripColumns>,
}

impl Tabled for Scaled {
    type Columns = Columns;
    const SHAPE: &'static [usize] = &[];

    fn names() -> Vec<String> {
        let cable = CABLE.iter().chain(&MORE).map(|&name| name.to_owned());
        let grip = |prefix: &'static str| GRIP.iter().map(move |name| format!("{prefix}{name}"));
        cable.chain(grip(START)).chain(grip(END)).collect()
    }

    fn columns(header: &Header) -> Result<Columns, String> {
        let (cable, start) = (CableColumns::new(header, "")?, GripColumns::new(header, START)?);
        let has_end = header.0.iter().any(|name| name.starts_with(END));
        let end = has_end.then(|| GripColumns::new(header, END)).transpose()?;
        Ok(Columns { cable, start, end })
    }

    fn query(columns: &Columns, row: &Row) -> Result<Query, String> {
        let Columns { cable, start, end } = columns;
        let held = end.as_ref().filter(|end| end.0.iter().any(|&column| row.has(column)));
        let (cable, start) = (cable.cable(row)?, start.grip(row)?);
        let query = Query { cable, start, end: held.map(|end| end.grip(row)).transpose()? };
        query.validate().map_err(|error| error.to_string())?;
        Ok(query)
    }

    fn query_numbers(query: &Query) -> Vec<f64> {
        let end = query.end.as_ref().map_or([f64::NAN; 7], grip_numbers);
        [&cable_numbers(&query.cable)[..], &grip_numbers(&query.start), &end].concat()
    }

    fn answer_names() -> Vec<String> {
        ["start", "end"].into_iter().flat_map(wrench_names).collect()
    }

    fn answer_numbers(found: &Equilibrium) -> Vec<f64> {
        found.grips.iter().flat_map(Wrench::numbers).collect()
    }

    fn cables(found: &Equilibrium) -> &[Equilibrium] {
        std::slice::from_ref(found)
    }
}
