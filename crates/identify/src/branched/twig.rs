//! Rods with a free end: branches, and what of the parent lies before a grip in its middle.

use std::ops::Range;

use cosserat::assembly::{Assembly, InnerDamping, Material, RestShape, RodSpec};
use cosserat::motion::{Carried, Driven};
use cosserat::state::darboux::rotation_of;
use cosserat::state::{Body, Model, State};
use nalgebra::Vector3;

use super::{Numbers, Tree};
use crate::cable::{Cable, DENSITY, Place, RADIUS, nodes, place, set_velocities, springs, youngs_modulus};
use crate::parameter::Parameter;
use crate::recording::Grips;

/// How a rod with a free end begins.
#[derive(Clone, Debug)]
pub(super) struct Twig {
    /// What it hangs on.
    pub(super) at: At,
    /// Which branch it is; none: a part of the parent.
    pub(super) branch: Option<usize>,
    /// Its nodes [m] in the first two frames, from where it hangs to its end.
    pub(super) nodes: [Vec<Vector3<f64>>; 2],
    /// Its own markers, by its own segments.
    pub(super) places: Vec<Place>,
}

/// What a rod with a free end hangs on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum At {
    /// The first grip, which holds its face.
    Grip,
    /// A segment of the parent between the grips, in its middle.
    Parent { segment: usize },
    /// A place on another twig, which comes before.
    Twig { index: usize, place: Place },
}

impl Twig {
    /// Those of a cable with markers there in the first two frames: each comes after what it hangs on.
    pub(super) fn all(frames: &[Vec<Vector3<f64>>; 2], tree: &Tree, parts: usize) -> Vec<Self> {
        // The way of each twig through markers, from where it hangs to its end.
        let mut ways: Vec<(Option<usize>, Vec<usize>)> = Vec::new();
        if let Grips::Middle(marker) = tree.grips {
            ways.push((None, (0..=marker).rev().collect()));
        }
        let branches = tree.branches.iter().enumerate();
        ways.extend(branches.map(|(index, branch)| {
            (Some(index), std::iter::once(branch.junction).chain(branch.markers.clone()).collect())
        }));
        // Where branches begin on each: of a twig's inner markers, by their places in its way.
        let begun: Vec<Vec<usize>> = ways
            .iter()
            .map(|(_, way)| {
                let inner = 1..way.len() - 1;
                inner.filter(|&k| tree.branches.iter().any(|branch| branch.junction == way[k])).collect()
            })
            .collect();
        let first = tree.grips.first();
        let at = |own: Option<usize>| {
            let Some(branch) = own else { return At::Grip };
            let junction = tree.branches[branch].junction;
            let on_twig = ways.iter().enumerate().find_map(|(index, (_, way))| {
                let k = way[1..].iter().position(|marker| *marker == junction)? + 1;
                Some(At::Twig { index, place: place(k, parts, &begun[index], 0) })
            });
            on_twig.unwrap_or_else(|| At::Parent { segment: place(junction, parts, &tree.junctions(), first).segment })
        };
        let twig = |((own, way), begun): (&(Option<usize>, Vec<usize>), &Vec<usize>)| {
            let nodes = frames.each_ref().map(|markers| {
                let points: Vec<_> = way.iter().map(|&marker| markers[marker]).collect();
                nodes(&points, parts, begun, [0, points.len() - 1])
            });
            let places = (1..way.len()).map(|k| place(k, parts, begun, 0)).collect();
            Self { at: at(*own), branch: *own, nodes, places }
        };
        ways.iter().zip(&begun).map(twig).collect()
    }

    /// Its segments.
    pub(super) fn segments(&self) -> usize {
        self.nodes[0].len() - 1
    }

    /// What it is made of.
    pub(super) fn material(&self, numbers: &Numbers) -> Material {
        let [bending, mass] = self.branch.map_or([1.0; 2], |branch| numbers.branches[branch]);
        let youngs_modulus = youngs_modulus(&numbers.parent) * bending * mass;
        Material {
            youngs_modulus,
            torsion_modulus: 0.5 * numbers.parent[Parameter::Twist] * youngs_modulus,
            density: DENSITY * mass,
        }
    }

    /// On which side of a segment it begins: angle about the segment's axis from its d1 [rad].
    pub(super) fn side(&self, state: &State, segment: usize) -> f64 {
        let begin = self.nodes[0][1] - self.nodes[0][0];
        let local = state.orientations[segment].inverse() * begin;
        local.y.atan2(local.x)
    }

    /// Adds twigs to the parent, which is there alone.
    pub(super) fn add_all(twigs: &[Self], assembly: &mut Assembly, numbers: &Numbers, parent: &Cable) {
        let mut rods: Vec<Added> = Vec::with_capacity(twigs.len());
        for twig in twigs {
            let added = twig.add(assembly, &rods, numbers, parent);
            rods.push(added);
        }
        balance(&rods, assembly);
        // After that, as it turns the faces in the grip.
        let model = assembly.model_mut();
        let held = rods.iter().filter(|added| added.host.is_none()).map(|added| added.joints.end - 1);
        for joint in held.collect::<Vec<_>>() {
            let Body::Anchor(anchor) = model.joints[joint].a else { continue };
            let carried = Carried::gripped(parent.first_motion().clone(), &model.anchors[anchor], 0.0);
            let motion = parent.first_motion().clone();
            model.motions.push(Driven { carried, ..Driven::new(Body::Anchor(anchor), motion) });
        }
    }

    fn add(&self, assembly: &mut Assembly, before: &[Added], numbers: &Numbers, parent: &Cable) -> Added {
        let tau = numbers.parent[Parameter::InnerDamping];
        let rod = assembly.rod(&RodSpec {
            inner_damping: InnerDamping { bending: tau, twist: tau, stretch: 0.0 },
            rest: RestShape::Initial,
            ..RodSpec::new(self.nodes[0].clone(), RADIUS, self.material(numbers))
        });
        let on = match self.at {
            At::Grip => None,
            At::Parent { segment } => Some((segment, 0.5)),
            At::Twig { index, place } => Some((before[index].rod.start + place.segment, place.share)),
        };
        match on {
            Some((segment, share)) => {
                assembly.branch(segment, share, &rod);
                if let Some(joint) = assembly.model_mut().joints.last_mut() {
                    joint.measure_from_rest(1.0);
                    // It bends over the half of the branch's first segment; the other half is that of what it hangs on.
                    joint.bend_compliance *= 0.5;
                    joint.twist_compliance *= 0.5;
                }
            }
            None => {
                assembly.clamp_start(&rod);
                let model = assembly.model_mut();
                model.soften(model.joints.len() - 1, &springs(&numbers.parent));
            }
        }
        set_velocities(assembly.state_mut(), rod.start, &self.nodes, parent.interval());
        let joints = assembly.model_mut().joints.len() - rod.len()..assembly.model_mut().joints.len();
        Added { rod, joints, host: on.map(|(segment, _)| segment) }
    }
}

/// A twig in an assembly.
struct Added {
    /// Its segments.
    rod: Range<usize>,
    /// Its joints, of which the last is that to what it hangs on.
    joints: Range<usize>,
    /// The segment on which it hangs.
    host: Option<usize>,
}

/// Gives the joints of twigs the rest shape with which they hang as they are drawn under gravity, with all that hangs on them; the faces in
/// a grip are turned instead.
fn balance(rods: &[Added], assembly: &mut Assembly) {
    let State { positions, orientations, .. } = assembly.state_mut().clone();
    let model: &mut Model = assembly.model_mut();
    // Of each twig: its weight, with all that hangs on it, and the moment of that about its start.
    let mut loads = vec![(Vector3::zeros(), Vector3::zeros()); rods.len()];
    for (index, added) in rods.iter().enumerate().rev() {
        let (mut weight, mut moment) = (Vector3::zeros(), Vector3::zeros());
        let mut at = positions[added.rod.end - 1];
        for segment in added.rod.clone().rev() {
            let half = orientations[segment] * Vector3::z() * (0.5 * model.segments[segment].length);
            let start = positions[segment] - half;
            let own = model.gravity * model.segments[segment].mass();
            // About the segment's start: of what hangs beyond it, and of itself.
            moment += (at - start).cross(&weight) + half.cross(&own);
            weight += own;
            for (other, (load, about)) in rods.iter().zip(&loads).filter(|(other, _)| other.host == Some(segment)) {
                let begin = positions[other.rod.start]
                    - orientations[other.rod.start] * Vector3::z() * (0.5 * model.segments[other.rod.start].length);
                moment += about + (begin - start).cross(load);
                weight += load;
            }
            at = start;
            let first = model.joints[added.joints.start].rest_darboux;
            let joint = if segment == added.rod.start {
                added.joints.end - 1
            } else {
                added.joints.start + (segment - added.rod.start) - 1
            };
            let joint = &mut model.joints[joint];
            let local = orientations[segment].inverse() * moment;
            let soft = Vector3::new(joint.bend_compliance, joint.bend_compliance, joint.twist_compliance);
            let strain = local.component_mul(&soft) * joint.length;
            match joint.a {
                // At rest it is bent as the joint beside it, and what holds it is turned.
                Body::Anchor(anchor) => {
                    joint.rest_darboux = if added.rod.len() > 1 { first } else { Vector3::zeros() };
                    let bent = rotation_of(&(joint.rest_darboux + strain), joint.length);
                    model.anchors[anchor].orientation = orientations[segment] * bent.inverse();
                }
                Body::Segment(_) => joint.rest_darboux -= strain,
            }
        }
        loads[index] = (weight, moment);
    }
}
