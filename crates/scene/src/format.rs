//! The file format as serde reads it: names, types and defaults, without any check of values.
//!
//! `docs/scenes.md` documents each key. Values keep their place in the text ([`Spanned`]), so that whoever checks them
//! can name the line. Choices between shapes are externally tagged (`[rods.shape.helix]`): other forms lose the place.

use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use toml::Spanned;

mod body;
mod contact;
mod curve;
mod eyelet;
mod law;
mod list;
mod load;
mod many;
mod motion;
mod number;
mod place;
mod probe;
mod pulley;
mod section;
mod sheath;

pub(crate) use body::{Body, BodyShape, Mesh as BodyMesh};
pub(crate) use contact::{Capsule, Contact, Friction, Obstacle, ObstacleShape, Sphere};
pub(crate) use curve::{Between, Curve};
pub(crate) use eyelet::{Eyelet, Feed};
pub(crate) use law::{MomentTable, Relaxation, StrandFriction, Strength, Unloading, Yield};
pub(crate) use list::List;
pub(crate) use load::{Foundation, Load, Motor};
pub(crate) use many::{Copies, Heap, Net, Strands};
pub(crate) use motion::{Grip, Hold, Interpolation, Motion, Quaternion};
pub(crate) use number::{Count, Number, Vector};
pub(crate) use place::{Clamp, Face, Place};
pub(crate) use probe::Probe;
pub(crate) use pulley::{Drive, Pulley};
pub(crate) use section::{Bending, Frame, InnerDamping, Piece, Section, Stiffness, Stretch};
pub(crate) use sheath::Sheath;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    #[serde(default)]
    pub(crate) description: String,
    pub(crate) gravity_m_s2: Option<Vector>,
    pub(crate) gravity_over_time: Option<Spanned<Gravity>>,
    #[serde(default)]
    pub(crate) run: Run,
    #[serde(default)]
    pub(crate) damping: Damping,
    #[serde(default)]
    pub(crate) bending: Bending,
    pub(crate) contact: Option<Contact>,
    #[serde(default)]
    pub(crate) obstacles: Vec<Spanned<Obstacle>>,
    pub(crate) air: Option<Air>,
    #[serde(default)]
    pub(crate) bodies: Vec<Spanned<Body>>,
    #[serde(default)]
    pub(crate) rods: Vec<Spanned<Rod>>,
    #[serde(default)]
    pub(crate) nets: Vec<Spanned<Net>>,
    #[serde(default)]
    pub(crate) joins: Vec<Spanned<Join>>,
    #[serde(default)]
    pub(crate) eyelets: Vec<Spanned<Eyelet>>,
    #[serde(default)]
    pub(crate) pulleys: Vec<Spanned<Pulley>>,
    #[serde(default)]
    pub(crate) sheaths: Vec<Spanned<Sheath>>,
    #[serde(default)]
    pub(crate) probes: Vec<Spanned<Probe>>,
    #[serde(default)]
    pub(crate) copies: Vec<Spanned<Copies>>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Run {
    pub(crate) dt_s: Option<Number>,
    pub(crate) steps: Option<Count>,
    pub(crate) every: Option<Count>,
    pub(crate) from: Option<Spanned<String>>,
    pub(crate) begin: Option<Spanned<Beginning>>,
    pub(crate) integrator: Option<Integrator>,
}

/// The rule that integrates the motion.
#[derive(Clone, Copy, Deserialize, PartialEq)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Integrator {
    Euler,
    Bdf2,
}

#[derive(Clone, Copy, Deserialize, PartialEq)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Beginning {
    Drawn,
    Equilibrium,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Damping {
    pub(crate) linear_per_s: Option<Number>,
    pub(crate) angular_per_s: Option<Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Air {
    pub(crate) density_kg_m3: Option<Number>,
    pub(crate) normal_drag: Option<Number>,
    pub(crate) tangential_drag: Option<Number>,
    pub(crate) buoyancy: Option<Spanned<bool>>,
    pub(crate) wind: Option<Wind>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Wind {
    pub(crate) velocity_m_s: Vector,
    pub(crate) gusts: Option<Gusts>,
    pub(crate) rotation_period_s: Option<Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Gusts {
    pub(crate) strength: Number,
    pub(crate) length_m: Option<Number>,
    pub(crate) time_s: Option<Number>,
    #[serde(default)]
    pub(crate) seed: u64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Rod {
    pub(crate) name: Option<Spanned<String>>,
    pub(crate) shape: Spanned<Shape>,
    pub(crate) radius_m: Option<Spanned<Radius>>,
    pub(crate) youngs_modulus_pa: Option<Number>,
    pub(crate) torsion_modulus_pa: Option<Number>,
    pub(crate) density_kg_m3: Option<Number>,
    pub(crate) section: Option<Spanned<Section>>,
    pub(crate) pieces: Option<Spanned<Vec<Piece>>>,
    #[serde(default)]
    pub(crate) stretch: Stretch,
    #[serde(default)]
    pub(crate) inner_damping: InnerDamping,
    pub(crate) r#yield: Option<Spanned<Yield>>,
    pub(crate) strand_friction: Option<Spanned<StrandFriction>>,
    pub(crate) relaxation: Option<Relaxation>,
    pub(crate) moment_table: Option<Spanned<MomentTable>>,
    pub(crate) strength: Option<Spanned<Strength>>,
    pub(crate) frame: Option<Frame>,
    pub(crate) twist_deg: Option<Number>,
    pub(crate) rest: Option<Rest>,
    pub(crate) rest_over_time: Option<Spanned<RestOverTime>>,
    pub(crate) strain: Option<Number>,
    pub(crate) rest_length_m: Option<Number>,
    pub(crate) tension_n: Option<Number>,
    pub(crate) branch_of: Option<Spanned<Place>>,
    pub(crate) branch_joint: Option<Spanned<Hold>>,
    pub(crate) branch_stiffness_n_m_rad: Option<Spanned<List<Number, 2>>>,
    pub(crate) branch_rest_deg: Option<Vector>,
    pub(crate) branch_motor: Option<Spanned<Motor>>,
    #[serde(default)]
    pub(crate) clamp: Vec<Spanned<Clamp>>,
    #[serde(default)]
    pub(crate) fixed_segments: Vec<Count>,
    pub(crate) first_turns_deg: Option<Spanned<Vec<Number>>>,
    pub(crate) velocity_m_s: Option<Vector>,
    pub(crate) angular_velocity_rad_s: Option<Vector>,
    #[serde(default)]
    pub(crate) velocities: Vec<Velocity>,
    #[serde(default)]
    pub(crate) grips: Vec<Spanned<Grip>>,
    #[serde(default)]
    pub(crate) motions: Vec<Spanned<Motion>>,
    #[serde(default)]
    pub(crate) masses: Vec<Mass>,
    #[serde(default)]
    pub(crate) loads: Vec<Spanned<Load>>,
    #[serde(default)]
    pub(crate) foundations: Vec<Spanned<Foundation>>,
    pub(crate) tree: Option<Tree>,
    pub(crate) strands: Option<Strands>,
    pub(crate) heap: Option<Heap>,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Shape {
    Straight(Straight),
    Helix(Helix),
    Arc(Arc),
    Ring(Ring),
    Polyline(Polyline),
    Knot(Knot),
    Hung(Hung),
    #[serde(alias = "usd")]
    Curve(Curve),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Straight {
    pub(crate) start_m: Option<Vector>,
    pub(crate) direction: Option<Vector>,
    pub(crate) angle_deg: Option<Number>,
    pub(crate) length_m: Number,
    pub(crate) segments: Count,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Helix {
    pub(crate) start_m: Option<Vector>,
    pub(crate) radius_m: Number,
    pub(crate) height_m: Number,
    pub(crate) winding: Number,
    pub(crate) segments: Count,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Arc {
    pub(crate) start_m: Option<Vector>,
    pub(crate) direction: Option<Vector>,
    pub(crate) towards: Option<Vector>,
    pub(crate) radius_m: Number,
    pub(crate) angle_deg: Number,
    pub(crate) segments: Count,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Ring {
    pub(crate) centre_m: Option<Vector>,
    pub(crate) radius_m: Number,
    pub(crate) segments: Count,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Polyline {
    pub(crate) nodes_m: Spanned<Vec<Vector>>,
    #[serde(default)]
    pub(crate) closed: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Knot {
    pub(crate) start_m: Option<Vector>,
    pub(crate) direction: Option<Vector>,
    pub(crate) loop_m: Number,
    pub(crate) length_m: Number,
    pub(crate) segments: Count,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Hung {
    pub(crate) from_m: Option<Vector>,
    pub(crate) to_m: Vector,
    pub(crate) length_m: Number,
    pub(crate) segments: Count,
    pub(crate) start_direction: Option<Vector>,
    pub(crate) end_direction: Option<Vector>,
}

/// The rest shape over time: a list of times with one of vectors, or of a vector a joint; or a file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RestOverTime {
    pub(crate) times_s: Option<Spanned<Vec<Number>>>,
    pub(crate) darboux_per_m: Option<Spanned<Vec<Vector>>>,
    pub(crate) darboux_of_joints_per_m: Option<Spanned<Vec<Spanned<Vec<Vector>>>>>,
    pub(crate) file: Option<Spanned<String>>,
    pub(crate) interpolation: Option<Spanned<Interpolation>>,
    #[serde(default)]
    pub(crate) repeats: bool,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Rest {
    Initial,
    Straight,
    #[serde(rename = "darboux_per_m")]
    Darboux(Vector),
    #[serde(rename = "darboux_of_joints_per_m")]
    OfJoints(Spanned<Vec<Vector>>),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Velocity {
    pub(crate) segment: Count,
    pub(crate) velocity_m_s: Option<Vector>,
    pub(crate) angular_velocity_rad_s: Option<Vector>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Mass {
    pub(crate) segment: Count,
    pub(crate) mass_kg: Number,
}

/// Gravity over time.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Gravity {
    pub(crate) times_s: Spanned<Vec<Number>>,
    pub(crate) values_m_s2: Spanned<Vec<Vector>>,
    pub(crate) interpolation: Option<Spanned<Interpolation>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Tree {
    pub(crate) branches: Count,
    pub(crate) levels: Count,
    pub(crate) segments: Option<Count>,
    pub(crate) segment_m: Option<Number>,
    pub(crate) length_ratio: Option<Number>,
    pub(crate) radius_ratio: Option<Number>,
    pub(crate) angle_deg: Option<Number>,
    #[serde(default)]
    pub(crate) seed: u64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Join {
    pub(crate) a: Spanned<Place>,
    pub(crate) b: Spanned<Place>,
    #[serde(default)]
    pub(crate) joint: Hold,
    pub(crate) motor: Option<Spanned<Motor>>,
}

/// One radius for the whole rod, or a linear taper.
#[derive(Clone, Copy)]
pub(crate) struct Radius {
    pub(crate) start: f64,
    pub(crate) end: f64,
}

impl<'de> Deserialize<'de> for Radius {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrPair;

        impl<'de> Visitor<'de> for NumberOrPair {
            type Value = Radius;

            fn expecting(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
                formatter.write_str("a number or [start, end]")
            }

            fn visit_f64<E: Error>(self, value: f64) -> Result<Radius, E> {
                Ok(Radius { start: value, end: value })
            }

            fn visit_i64<E: Error>(self, value: i64) -> Result<Radius, E> {
                self.visit_f64(value as f64)
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut values: A) -> Result<Radius, A::Error> {
                let wrong = |count| A::Error::invalid_length(count, &Self);
                let start = values.next_element()?.ok_or_else(|| wrong(0))?;
                let end = values.next_element()?.ok_or_else(|| wrong(1))?;
                match values.next_element::<f64>()? {
                    None => Ok(Radius { start, end }),
                    Some(_) => Err(wrong(3)),
                }
            }
        }

        deserializer.deserialize_any(NumberOrPair)
    }
}
