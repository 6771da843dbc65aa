//! Probes: what one reads off a place of a rod.

use nalgebra::Vector3;
use names::names;

use crate::{Body, JointForce, Model, Pose, Reaction, State, curvature};

/// What a probe reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// Where the place is [m].
    Position,
    /// Orientation of its segment, as a quaternion.
    Orientation,
    /// Its velocity [m/s].
    Velocity,
    /// Angular velocity of its segment [rad/s].
    AngularVelocity,
    /// Pull along the rod at the joint next to it [N]; negative where the rod is pressed.
    Tension,
    /// Force that this joint transmits [N].
    Force,
    /// Moment that it transmits, in the axes of its first body [N m]: bending about x and y, twist about z.
    Moment,
    /// Curvature of the rod there [1/m].
    Curvature,
    /// Force [N] and moment [N m] of what holds the rod there.
    Reaction,
    /// Velocity of the air there [m/s].
    Wind,
    /// Force of the air on its segment [N].
    Drag,
}

names!(Quantity {
    Position = "position",
    Orientation = "orientation",
    Velocity = "velocity",
    AngularVelocity = "angular-velocity",
    Tension = "tension",
    Force = "force",
    Moment = "moment",
    Curvature = "curvature",
    Reaction = "reaction",
    Wind = "wind",
    Drag = "drag",
});

impl Quantity {
    /// Names of its numbers, with units.
    pub fn columns(self) -> &'static [&'static str] {
        match self {
            Quantity::Position => &["x_m", "y_m", "z_m"],
            Quantity::Orientation => &["qw", "qx", "qy", "qz"],
            Quantity::Velocity => &["v_x_m_per_s", "v_y_m_per_s", "v_z_m_per_s"],
            Quantity::AngularVelocity => &["w_x_rad_per_s", "w_y_rad_per_s", "w_z_rad_per_s"],
            Quantity::Tension => &["tension_n"],
            Quantity::Force => &["force_x_n", "force_y_n", "force_z_n"],
            Quantity::Moment => &["moment_x_n_m", "moment_y_n_m", "moment_z_n_m"],
            Quantity::Curvature => &["curvature_per_m"],
            Quantity::Reaction => &[
                "reaction_force_x_n",
                "reaction_force_y_n",
                "reaction_force_z_n",
                "reaction_moment_x_n_m",
                "reaction_moment_y_n_m",
                "reaction_moment_z_n_m",
            ],
            Quantity::Wind => &["wind_x_m_per_s", "wind_y_m_per_s", "wind_z_m_per_s"],
            Quantity::Drag => &["drag_x_n", "drag_y_n", "drag_z_n"],
        }
    }

    /// Whether it is of a step: at the start there is none yet.
    pub fn is_of_step(self) -> bool {
        matches!(self, Quantity::Tension | Quantity::Force | Quantity::Moment | Quantity::Reaction)
    }

    /// Whether it is read off a joint.
    pub fn is_of_joint(self) -> bool {
        matches!(self, Quantity::Tension | Quantity::Force | Quantity::Moment | Quantity::Curvature)
    }
}

/// A place of a rod, and what is read there.
#[derive(Clone, Debug, PartialEq)]
pub struct Probe {
    /// Its name.
    pub name: String,
    /// Index of the segment.
    pub segment: usize,
    /// Place along the segment's axis, from its centre [m].
    pub offset: f64,
    /// What is read, in order.
    pub quantities: Vec<Quantity>,
}

/// What a probe is read off: the end of a step of a model.
#[derive(Clone, Copy, Debug)]
pub struct Reading<'a> {
    /// The model; what changes over time is that of the end of the step: see [`Model::set_time`].
    pub model: &'a Model,
    /// The time [s], for what the air does.
    pub time: f64,
    /// The state.
    pub state: &'a State,
    /// What each joint transmits.
    pub forces: &'a [JointForce],
    /// What holds what is held, as of [`Reaction::all`]; may be empty where no probe reads reactions.
    pub reactions: &'a [Reaction],
}

impl Probe {
    /// The joint of the segment that is nearest to the place; `None` where it has none.
    pub fn joint(&self, model: &Model) -> Option<usize> {
        let own = Body::Segment(self.segment);
        let distance = |joint: &crate::Joint| {
            let a = (joint.a == own).then_some(joint.offset_a);
            let offset = a.or((joint.b == own).then_some(joint.offset_b))?;
            Some((offset - self.offset).abs())
        };
        let found = model.joints.iter().enumerate().filter(|(_, joint)| !joint.is_foundation());
        let found = found.filter_map(|(index, joint)| Some((index, distance(joint)?)));
        found.min_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(index, _)| index)
    }

    /// What holds the rod at the place: its segment, if that is fixed, else the anchor of the nearest joint.
    pub fn held(&self, model: &Model) -> Option<Body> {
        if model.segments.get(self.segment)?.fixed {
            return Some(Body::Segment(self.segment));
        }
        let joint = &model.joints[self.joint(model)?];
        [joint.a, joint.b].into_iter().find(|body| matches!(body, Body::Anchor(_)))
    }

    /// Reads all quantities into `values`, one number a column, in place of what was there. What is not there, a joint,
    /// what holds or air, is not a number.
    pub fn read(&self, now: &Reading<'_>, values: &mut Vec<f64>) {
        let Reading { model, time, state, forces, reactions } = *now;
        let (i, pose) = (self.segment, model.pose(Body::Segment(self.segment), state));
        let Pose { position, orientation } = pose;
        let arm = orientation * Vector3::z() * self.offset;
        let joint = || self.joint(model).map(|index| (&model.joints[index], forces.get(index)));
        values.clear();
        for &quantity in &self.quantities {
            let before = values.len();
            match quantity {
                Quantity::Position => values.extend(&(position + arm)),
                Quantity::Orientation => values.extend([orientation.w, orientation.i, orientation.j, orientation.k]),
                Quantity::Velocity => values.extend(&(state.velocities[i] + state.angular_velocities[i].cross(&arm))),
                Quantity::AngularVelocity => values.extend(&state.angular_velocities[i]),
                Quantity::Curvature => values.extend(joint().map(|(joint, _)| curvature(model, state, joint))),
                Quantity::Tension | Quantity::Force | Quantity::Moment => {
                    if let Some((joint, Some(given))) = joint() {
                        match quantity {
                            Quantity::Tension => values.push(given.tension(model, state, joint)),
                            Quantity::Force => values.extend(&given.force),
                            _ => values.extend(&given.moment),
                        }
                    }
                }
                Quantity::Reaction => {
                    let held = self.held(model);
                    let found = reactions.iter().find(|reaction| Some(reaction.body) == held);
                    values.extend(found.iter().flat_map(|own| own.force.iter().chain(&own.moment)));
                }
                Quantity::Wind => {
                    let wind = model.air.as_ref().map(|air| air.wind.velocity(&(position + arm), time));
                    values.extend(wind.iter().flat_map(|velocity| velocity.iter()));
                }
                Quantity::Drag => {
                    let drag = model.air.is_some().then(|| model.drag(i, state, time));
                    values.extend(drag.iter().flat_map(|drag| drag.force.iter()));
                }
            }
            values.resize(before + quantity.columns().len(), f64::NAN);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Assembly, Material, RodSpec, shape};

    fn probe(segment: usize, offset: f64) -> Probe {
        Probe { name: "p".to_owned(), segment, offset, quantities: Quantity::ALL.to_vec() }
    }

    #[test]
    fn a_place_has_the_joint_next_to_it_and_what_holds_it() {
        let material = Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 100.0 };
        let mut assembly = Assembly::new(Vector3::zeros());
        let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 4);
        let rod = assembly.rod(&RodSpec::new(nodes, 0.01, material));
        assembly.clamp_start(&rod).fix(rod.end - 1);
        let (model, mut state) = assembly.finish();
        let found = |segment, offset| (probe(segment, offset).joint(&model), probe(segment, offset).held(&model));
        assert_eq!(found(0, -0.125), (Some(3), Some(Body::Anchor(0))));
        assert_eq!(found(0, 0.1), (Some(0), None));
        assert_eq!(found(1, -0.1), (Some(0), None));
        assert_eq!(found(2, 0.1), (Some(2), None));
        assert_eq!(found(3, 0.1), (Some(2), Some(Body::Segment(3))));

        // A place off the centre of a segment that turns.
        state.velocities[1] = Vector3::new(1.0, 0.0, 0.0);
        state.angular_velocities[1] = Vector3::z() * 2.0;
        let forces = vec![JointForce { force: Vector3::x() * 3.0, moment: Vector3::y() }; 4];
        let mut values = Vec::new();
        let now = Reading { model: &model, time: 0.0, state: &state, forces: &forces, reactions: &[] };
        probe(1, 0.1).read(&now, &mut values);
        let columns: usize = Quantity::ALL.map(|quantity| quantity.columns().len()).iter().sum();
        assert_eq!(values.len(), columns);
        let near = |values: &[f64], at: usize, expected: &[f64]| {
            expected.iter().zip(&values[at..]).for_each(|(a, b)| assert!((a - b).abs() < 1e-12, "{at}: {a} {b}"));
        };
        near(&values, 0, &[0.475, 0.0, 0.0]);
        near(&values, 7, &[1.0, 0.2, 0.0]);
        near(&values, 10, &[0.0, 0.0, 2.0]);
        near(&values, 13, &[3.0, 3.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
        assert!(values[21..].iter().all(|x| x.is_nan()), "nothing holds it, and there is no air");
        let wind = crate::Wind::steady(Vector3::y() * 3.0);
        let air = crate::Air { density: 1.2, normal_drag: 1.0, tangential_drag: 0.0, wind };
        let windy = Model { air: Some(air), ..model.clone() };
        probe(2, 0.1).read(&Reading { model: &windy, ..now }, &mut values);
        near(&values, 27, &[0.0, 3.0, 0.0, 0.0, 1.2 * 0.01 * 0.25 * 9.0, 0.0]);
    }
}
