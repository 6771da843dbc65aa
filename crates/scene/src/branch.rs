//! The joint with which a branch begins on another rod.

use nalgebra::UnitQuaternion;
use rod::darboux;
use toml::Spanned;

use crate::builder::{Builder, Spot};
use crate::error::{Result, Source};
use crate::format::{self, Hold};
use crate::motor;

/// Makes the joint that was made last what the rod says: free to turn, or as stiff and at rest at the angle that it names.
pub(crate) fn shape_joint(
    builder: &mut Builder,
    source: &Source,
    rod: &format::Rod,
    branch_of: Option<Spot>,
) -> Result<()> {
    let format::Rod { branch_joint, branch_stiffness_n_m_rad: stiffness, branch_rest_deg: rest, branch_motor, .. } =
        rod;
    let is_hinge = branch_joint.as_ref().is_some_and(|joint| *joint.get_ref() == Hold::Hinge);
    if let (Some(motor), false) = (branch_motor, is_hinge) {
        return source.wrong(motor.span(), "goes with `branch_joint = \"hinge\"`");
    }
    let of_rigid = stiffness.as_ref().map(Spanned::span).or(rest.as_ref().map(Spanned::span));
    let Some(span) = branch_joint.as_ref().map(Spanned::span).or(of_rigid.clone()) else { return Ok(()) };
    let Some(Spot::Rod(..)) = branch_of else { return source.wrong(span, "goes with `branch_of` a rod") };
    let hold = branch_joint.as_ref().map_or(Hold::Rigid, |joint| *joint.get_ref());
    if let (Some(span), true) = (of_rigid, hold != Hold::Rigid) {
        return source.wrong(span, "goes with a rigid `branch_joint`");
    }
    builder.free_last_joint(hold);
    if let Some(own) = branch_motor {
        motor::add(builder, source, own)?;
    }
    let stiffness = stiffness.as_ref().map(|list| {
        let [bend, twist] = &list.get_ref().0;
        Ok([source.positive(bend, "N m/rad")?, source.positive(twist, "N m/rad")?])
    });
    let (stiffness, rest) = (stiffness.transpose()?, rest.as_ref().map(|rest| source.turn(rest)).transpose()?);
    let joints = &mut builder.assembly.model_mut().joints;
    let last = joints.len().wrapping_sub(1);
    let Some(joint) = joints.last_mut() else { return Ok(()) };
    // A Darboux vector is an angle over the joint's length.
    let square = joint.length.powi(2);
    if let Some([bend, twist]) = stiffness {
        joint.bend_compliance = 1.0 / (bend * square);
        joint.bend_extra = 0.0;
        joint.twist_compliance = 1.0 / (twist * square);
    }
    if let Some(rest) = rest {
        joint.measure_from_rest(1.0);
        // From the branch as it is drawn to the branch at rest, in its own axes.
        joint.rest_darboux = darboux::darboux(&UnitQuaternion::identity(), &rest, joint.length);
        builder.own_rests.push(last);
    }
    Ok(())
}
