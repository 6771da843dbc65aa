//! The extremes of what is in rods over a run, as a table: nothing of the steps is kept.

use std::io::Write;
use std::path::Path;

use rod::{JointForce, Model, State, curvature};

use super::centrelines::Centrelines;
use crate::file::write_atomically;
use crate::{ExportError, Names};

/// Columns beside those of all tables of segments.
const COLUMNS: &str = "rod,rod_name,segment,segment_of_rod,s_m,tension_min_n,tension_max_n,bending_moment_min_n_m,\
                       bending_moment_max_n_m,torsion_min_n_m,torsion_max_n_m,curvature_min_per_m,curvature_max_per_m";

/// The least and the largest number seen, infinite the wrong way round before any is.
type Range = [f64; 2];

/// The extremes of each segment, as far as a run has come: of tension, bending moment and torsion at the joints at its two ends
/// and of the curvature there, over all steps that were observed.
#[derive(Clone, Debug, PartialEq)]
pub struct Envelope {
    /// The joint at each end of each segment, where there is one.
    joints: Vec<[Option<usize>; 2]>,
    /// Distance of each segment's centre from the start of its rod, along the segments [m].
    along: Vec<f64>,
    /// Of each joint: tension [N], bending moment [N m], torsion [N m], curvature [1/m].
    extremes: Vec<[Range; 4]>,
}

impl Envelope {
    /// That of a model of which no step has been observed.
    pub fn new(model: &Model) -> Self {
        let lines = Centrelines::new(model);
        let joints = lines.ends.iter().map(|nodes| nodes.map(|node| lines.nodes[node].joint)).collect();
        let mut along = Vec::with_capacity(model.segments.len());
        let mut last = None;
        for segment in &model.segments {
            let start = match last {
                Some((rod, end)) if rod == segment.rod => end,
                _ => 0.0,
            };
            along.push(start + 0.5 * segment.length);
            last = Some((segment.rod, start + segment.length));
        }
        Self { joints, along, extremes: vec![[[f64::INFINITY, f64::NEG_INFINITY]; 4]; model.joints.len()] }
    }

    /// Takes a step into account: the state at its end and what each joint transmits, `[joints]`; with no forces, the
    /// curvature alone.
    pub fn observe(&mut self, model: &Model, state: &State, forces: &[JointForce]) {
        for (k, (joint, [tension, bending, torsion, bent])) in model.joints.iter().zip(&mut self.extremes).enumerate() {
            widen(bent, curvature(model, state, joint));
            if let Some(given) = forces.get(k) {
                widen(tension, given.tension(model, state, joint));
                widen(bending, given.moment.xy().norm());
                widen(torsion, given.moment.z);
            }
        }
    }

    /// Writes a row for each segment, numbers with all their digits; what was not observed, or stands at no joint, is empty.
    ///
    /// # Errors
    /// [`ExportError::Io`] if the table cannot be written.
    pub fn write(&self, path: &Path, model: &Model, names: &Names) -> Result<(), ExportError> {
        write_atomically(path, |writer| {
            writeln!(writer, "{COLUMNS}")?;
            let heads = names.rows(&model.segments);
            for ((head, along), joints) in heads.iter().zip(&self.along).zip(&self.joints) {
                write!(writer, "{head},{along:?}")?;
                for quantity in 0..4 {
                    let own = joints.iter().flatten().map(|&joint| self.extremes[joint][quantity]);
                    let found = own.reduce(|[low, high], [lower, higher]| [low.min(lower), high.max(higher)]);
                    for value in found.unwrap_or([f64::NAN; 2]) {
                        if value.is_finite() { write!(writer, ",{value:?}")? } else { write!(writer, ",")? }
                    }
                }
                writeln!(writer)?;
            }
            Ok(())
        })
    }
}

/// Widens a range to a number; one that is none changes nothing.
fn widen([low, high]: &mut Range, value: f64) {
    (*low, *high) = (low.min(value), high.max(value));
}
