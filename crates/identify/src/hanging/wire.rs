//! The model of a wire that hangs between two level grips.

use std::f64::consts::{PI, TAU};

use cosserat::assembly::{Assembly, Material, RestShape, RodSpec, shape};
use cosserat::derivative::DerivativeError;
use cosserat::motion::KeyframeError;
use cosserat::simulation::SimulationError;
use cosserat::state::{Model, Pose, Springs, State};
use cosserat::statics::StaticError;
use nalgebra::{Rotation3, UnitQuaternion, Vector2, Vector3};
use thiserror::Error;

use super::Photograph;
use crate::cable::GRAVITY;

/// Radius of the rod [m]. Mass and stiffness are given, so that it counts for nothing here.
const RADIUS: f64 = 0.002;

/// What is known of a wire before it is photographed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wire {
    /// Mass per length [kg/m].
    pub line_density: f64,
    /// Length between the grips [m].
    pub length: f64,
    /// Compliance of each grip: length of wire [m] that would bend and twist as much.
    pub grip: f64,
    /// Segments between the grips.
    pub segments: usize,
}

/// Why there is no answer.
#[derive(Debug, Error)]
pub enum HangingError {
    /// A model that is not valid.
    #[error(transparent)]
    Model(#[from] SimulationError),
    /// A path of equilibria that cannot be followed.
    #[error(transparent)]
    Path(#[from] StaticError),
    /// An equilibrium that was not found, or is none.
    #[error(transparent)]
    Equilibrium(#[from] DerivativeError),
    /// A turn that is no motion.
    #[error(transparent)]
    Motion(#[from] KeyframeError),
    /// The grips are further apart than the wire is long.
    #[error("a wire {length} m long does not reach from grip to grip, {apart} m")]
    Short {
        /// Its length [m].
        length: f64,
        /// Distance of the grips [m].
        apart: f64,
    },
    /// Its equilibria cannot be followed up to the twist.
    #[error("with GJ / EI = {ratio} its equilibria can be followed up to {degrees} degrees of twist, and no further")]
    Lost {
        /// GJ / EI.
        ratio: f64,
        /// The twist up to which they were followed [deg].
        degrees: f64,
    },
    /// The wire stays in its plane whatever its stiffness of twist.
    #[error("it does not leave its plane at {degrees} degrees of twist for any GJ / EI from {least} to {most}")]
    NoTwist {
        /// The twist [deg].
        degrees: f64,
        /// Least ratio.
        least: f64,
        /// Largest ratio.
        most: f64,
    },
    /// The wire leaves its plane however soft it is against twist.
    #[error(
        "it leaves its plane before {degrees} degrees of twist with GJ / EI {least} already, the least that is tried"
    )]
    AnyTwist {
        /// The twist [deg].
        degrees: f64,
        /// Least ratio.
        least: f64,
    },
    /// The points do not determine the stiffness of bending.
    #[error("its points are nearest with EI {bending} N m^2, an end of what is tried: they do not determine it")]
    NoBending {
        /// The stiffness at that end [N m^2].
        bending: f64,
    },
}

impl Wire {
    /// The wire between level grips where a photograph has its ends, with `bending` EI [N m^2] and `ratio` GJ / EI, drawn along the
    /// photographed points. Anchor 0 holds its start, anchor 1 its end. The plane is that of x and z.
    ///
    /// On which side a grip points, and how often the wire turns between them, is as the points show it.
    ///
    /// # Errors
    /// If the wire is shorter than the distance of the grips.
    pub fn model(&self, photograph: &Photograph, bending: f64, ratio: f64) -> Result<(Model, State), HangingError> {
        let points: Vec<Vector3<f64>> = photograph.points.iter().map(in_space).collect();
        let (first, last) = (points[0], points[points.len() - 1]);
        let apart = (last - first).norm();
        if self.length <= apart {
            return Err(HangingError::Short { length: self.length, apart });
        }
        // As drawn, with the length that the wire has: the joint to the end's grip closes as the wire comes to rest.
        let drawn = shape::resample(&points, false, false, self.segments);
        let step = self.length / self.segments as f64;
        let mut nodes = vec![first];
        for pair in drawn.windows(2) {
            nodes.push(nodes[nodes.len() - 1] + (pair[1] - pair[0]).normalize() * step);
        }
        let area = PI * RADIUS * RADIUS;
        let youngs_modulus = 4.0 * bending / (area * RADIUS * RADIUS);
        let material = Material {
            youngs_modulus,
            torsion_modulus: 0.5 * ratio * youngs_modulus,
            density: self.line_density / area,
        };
        let mut assembly = Assembly::new(-Vector3::z() * GRAVITY);
        let rod = assembly.rod(&RodSpec {
            d1: Some(Vector3::y().cross(&(nodes[1] - nodes[0]))),
            rest: RestShape::Straight,
            ..RodSpec::new(nodes, RADIUS, material)
        });
        assembly.clamp_start(&rod).clamp_end(&rod);
        let model = assembly.model_mut();
        let joints = model.joints.len() - 2;
        let moment = bending / self.grip;
        let springs = Springs { moment: [moment, moment, ratio * moment], ..Springs::RIGID };
        for (anchor, heading) in headings(&photograph.points).into_iter().enumerate() {
            model.anchors[anchor] = Pose { position: [first, last][anchor], orientation: level(heading) };
            model.soften(joints + anchor, &springs);
        }
        Ok(assembly.finish())
    }
}

/// A place of the plane of x and z.
pub(super) fn in_space(point: &Vector2<f64>) -> Vector3<f64> {
    Vector3::new(point.x, 0.0, point.y)
}

/// Headings of the two grips, from x towards z [rad]: level, and nearest to what the first and the last points show, with all turns
/// between them.
fn headings(points: &[Vector2<f64>]) -> [f64; 2] {
    let heading = |pair: &[Vector2<f64>]| (pair[1].y - pair[0].y).atan2(pair[1].x - pair[0].x);
    let level = |heading: f64| (heading / PI).round() * PI;
    let mut headings = points.windows(2).map(heading);
    let first = headings.next().unwrap_or(0.0);
    let last = headings.fold(first, |at, next| at + (next - at + PI).rem_euclid(TAU) - PI);
    [first, last].map(level)
}

/// The frame of a grip that holds the wire at a heading: d3 along it, d2 across the plane.
fn level(heading: f64) -> UnitQuaternion<f64> {
    let d3 = Vector3::new(heading.cos(), 0.0, heading.sin());
    let d2 = Vector3::y();
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_basis_unchecked(&[d2.cross(&d3), d2, d3]))
}
