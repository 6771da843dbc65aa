//! A change of all that a run depends on; and, as a gradient, the derivative with respect to it.

use nalgebra::Vector3;
use rod::{Body, InnerDamping, JointForce, Model};

/// A small change of all that a run depends on, or the derivative of a number with respect to each entry: see
/// [`Variation::dot`]. Lists have an entry for each joint, segment or load of the model.
#[derive(Clone, Debug, PartialEq)]
pub struct Variation {
    /// Of joints.
    pub joints: Vec<JointVariation>,
    /// Of segments.
    pub segments: Vec<SegmentVariation>,
    /// Of loads at all times: force [N] and torque [N m].
    pub loads: Vec<[Vector3<f64>; 2]>,
    /// Of gravity at all times [m/s^2].
    pub gravity: Vector3<f64>,
    /// Of the rates of [`rod::Damping`], linear and angular [1/s].
    pub damping: [f64; 2],
    /// Of the air.
    pub air: AirVariation,
    /// Of all coefficients of friction, as a factor.
    pub friction: f64,
    /// Of the first state, in which joints transmit nothing yet. Fixed segments that nothing moves stay where they are put.
    pub start: StateVariation,
    /// Of bodies that are held, at the ends of all steps, beyond that of the first state. What is not listed does not change.
    pub held: Vec<HeldVariation>,
    /// Of obstacles. What is not listed does not change.
    pub obstacles: Vec<ObstacleVariation>,
}

/// A change of a [`rod::Joint`], number by number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointVariation {
    /// Of [`rod::Joint::rest_darboux`], at all times where it changes.
    pub rest_darboux: Vector3<f64>,
    /// Of [`rod::Joint::stretch_compliance`].
    pub stretch_compliance: f64,
    /// Of [`rod::Joint::shear_compliance`].
    pub shear_compliance: f64,
    /// Of [`rod::Joint::shear_extra`].
    pub shear_extra: f64,
    /// Of [`rod::Joint::bend_compliance`].
    pub bend_compliance: f64,
    /// Of [`rod::Joint::bend_extra`].
    pub bend_extra: f64,
    /// Of [`rod::Joint::twist_compliance`].
    pub twist_compliance: f64,
    /// Of [`rod::Joint::inner_damping`].
    pub inner_damping: InnerDamping,
}

impl Default for JointVariation {
    fn default() -> Self {
        Self {
            rest_darboux: Vector3::zeros(),
            stretch_compliance: 0.0,
            shear_compliance: 0.0,
            shear_extra: 0.0,
            bend_compliance: 0.0,
            bend_extra: 0.0,
            twist_compliance: 0.0,
            inner_damping: InnerDamping::NONE,
        }
    }
}

impl JointVariation {
    /// All its numbers, those of [`JointVariation::of_numbers`].
    pub fn numbers(&self) -> [f64; 12] {
        let InnerDamping { bending, twist, stretch } = self.inner_damping;
        [
            self.rest_darboux.x,
            self.rest_darboux.y,
            self.rest_darboux.z,
            self.stretch_compliance,
            self.shear_compliance,
            self.shear_extra,
            self.bend_compliance,
            self.bend_extra,
            self.twist_compliance,
            bending,
            twist,
            stretch,
        ]
    }

    /// From all its numbers.
    pub fn of_numbers(x: &[f64; 12]) -> Self {
        Self {
            rest_darboux: Vector3::new(x[0], x[1], x[2]),
            stretch_compliance: x[3],
            shear_compliance: x[4],
            shear_extra: x[5],
            bend_compliance: x[6],
            bend_extra: x[7],
            twist_compliance: x[8],
            inner_damping: InnerDamping { bending: x[9], twist: x[10], stretch: x[11] },
        }
    }
}

/// A change of a segment's inertia.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SegmentVariation {
    /// Of its mass [kg].
    pub mass: f64,
    /// Of its moments of inertia about its axes d1, d2 and d3 [kg m^2]; of a segment of a rod, whose first two are the same, the
    /// change of that is the mean of their changes.
    pub inertia: Vector3<f64>,
}

/// A change of the [`rod::Air`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AirVariation {
    /// Of its density [kg/m^3].
    pub density: f64,
    /// Of the drag coefficient across the axes.
    pub normal_drag: f64,
    /// Of that along the axes.
    pub tangential_drag: f64,
    /// Of its velocity, everywhere and at all times [m/s].
    pub wind: Vector3<f64>,
}

impl AirVariation {
    /// Adds another one.
    pub fn add(&mut self, other: &Self) {
        self.density += other.density;
        self.normal_drag += other.normal_drag;
        self.tangential_drag += other.tangential_drag;
        self.wind += other.wind;
    }
}

/// A change of a state, one entry a segment, and of what joints transmit; or the derivative of a number with respect to it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StateVariation {
    /// Of positions [m].
    pub positions: Vec<Vector3<f64>>,
    /// Of orientations: rotation vectors in world axes [rad], `q' = exp(turn) q`.
    pub turns: Vec<Vector3<f64>>,
    /// Of velocities [m/s].
    pub velocities: Vec<Vector3<f64>>,
    /// Of angular velocities [rad/s].
    pub angular_velocities: Vec<Vector3<f64>>,
    /// Of what joints transmit at the end of the step [N, N m], as [`crate::simulation::Simulation::store_joint_forces`] tells it,
    /// one entry a joint; empty where nobody asks for it, and always empty in [`Variation::start`].
    pub forces: Vec<JointForce>,
}

impl StateVariation {
    /// None, of so many segments, without what joints transmit.
    pub fn zero(segments: usize) -> Self {
        let zero = || vec![Vector3::zeros(); segments];
        let (positions, turns, velocities, angular_velocities) = (zero(), zero(), zero(), zero());
        Self { positions, turns, velocities, angular_velocities, forces: Vec::new() }
    }

    /// None, with an entry for each segment and each joint of a model.
    pub fn with_forces(model: &Model) -> Self {
        Self { forces: vec![JointForce::default(); model.joints.len()], ..Self::zero(model.segments.len()) }
    }

    /// Its lists of segments, with their names.
    pub fn lists(&self) -> [(&'static str, &Vec<Vector3<f64>>); 4] {
        [
            ("positions", &self.positions),
            ("turns", &self.turns),
            ("velocities", &self.velocities),
            ("angular velocities", &self.angular_velocities),
        ]
    }

    /// Sum of the products of all entries; what joints transmit counts where both list it.
    pub fn dot(&self, other: &Self) -> f64 {
        let force = |(a, b): (&JointForce, &JointForce)| a.force.dot(&b.force) + a.moment.dot(&b.moment);
        let forces = self.forces.iter().zip(&other.forces).map(force).sum::<f64>();
        self.lists().iter().zip(other.lists()).map(|((_, a), (_, b))| sum(a, b)).sum::<f64>() + forces
    }
}

/// A change of where a held body is.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldVariation {
    /// A fixed segment or an anchor.
    pub body: Body,
    /// At the end of each step, from the first: shift [m] and turn in world axes [rad]. Between two steps it is in proportion,
    /// at the start zero, and it stays as it is after the last.
    pub poses: Vec<[Vector3<f64>; 2]>,
}

/// A change of where an obstacle is.
#[derive(Clone, Debug, PartialEq)]
pub struct ObstacleVariation {
    /// Its index in [`rod::Contacts::obstacles`].
    pub obstacle: usize,
    /// At the start and at the end of each step, from the first: shift [m] of its pose ([`rod::Obstacle::at`]), and turn about that
    /// place in world axes [rad]. Between two of them it is in proportion, and it stays as it is after the last: one alone moves
    /// the obstacle with all of its way.
    pub poses: Vec<[Vector3<f64>; 2]>,
}

/// Sum of the products of ways, of which the second goes on with its last entry.
fn along(own: &[[Vector3<f64>; 2]], other: &[[Vector3<f64>; 2]]) -> f64 {
    let pairs = own.iter().enumerate().filter_map(|(k, own)| Some((own, other.get(k).or(other.last())?)));
    pairs.map(|(own, other)| sum(own, other)).sum()
}

fn sum(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

impl Variation {
    /// None.
    pub fn zero(model: &Model) -> Self {
        Self {
            joints: vec![JointVariation::default(); model.joints.len()],
            segments: vec![SegmentVariation::default(); model.segments.len()],
            loads: vec![[Vector3::zeros(); 2]; model.loads.len()],
            gravity: Vector3::zeros(),
            damping: [0.0; 2],
            air: AirVariation::default(),
            friction: 0.0,
            start: StateVariation::zero(model.segments.len()),
            held: Vec::new(),
            obstacles: Vec::new(),
        }
    }

    /// Sum of the products of all entries: of a gradient with a variation, by how much the number changes. Held bodies and
    /// obstacles count where both list them; where the variation lists fewer of their poses it goes on with the last.
    pub fn dot(&self, other: &Self) -> f64 {
        let joint = |(a, b): (&JointVariation, &JointVariation)| -> f64 {
            a.numbers().iter().zip(b.numbers()).map(|(a, b)| a * b).sum()
        };
        let segment = |(a, b): (&SegmentVariation, &SegmentVariation)| a.mass * b.mass + a.inertia.dot(&b.inertia);
        let pair = |(a, b): (&[Vector3<f64>; 2], &[Vector3<f64>; 2])| sum(a, b);
        let held = |own: &HeldVariation| -> f64 {
            let same = other.held.iter().filter(|held| held.body == own.body);
            same.map(|held| along(&own.poses, &held.poses)).sum()
        };
        let obstacle = |own: &ObstacleVariation| -> f64 {
            let same = other.obstacles.iter().filter(|other| other.obstacle == own.obstacle);
            same.map(|other| along(&own.poses, &other.poses)).sum()
        };
        let [linear, angular] = self.damping;
        self.joints.iter().zip(&other.joints).map(joint).sum::<f64>()
            + self.segments.iter().zip(&other.segments).map(segment).sum::<f64>()
            + self.loads.iter().zip(&other.loads).map(pair).sum::<f64>()
            + self.gravity.dot(&other.gravity)
            + linear * other.damping[0]
            + angular * other.damping[1]
            + self.air.density * other.air.density
            + self.air.normal_drag * other.air.normal_drag
            + self.air.tangential_drag * other.air.tangential_drag
            + self.air.wind.dot(&other.air.wind)
            + self.friction * other.friction
            + self.start.dot(&other.start)
            + self.held.iter().map(held).sum::<f64>()
            + self.obstacles.iter().map(obstacle).sum::<f64>()
    }
}
