//! Constraints `connect` and `weld`, and what their names mean.

use nalgebra::{Point3, Vector3};

use crate::error::Result;
use crate::option::Notes;
use crate::world::World;
use crate::xml::Element;

/// One side of a constraint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Side {
    /// A body of the file; 0 is the world.
    Body(usize),
    /// A segment of a cable.
    Segment { cable: usize, segment: usize },
}

/// A constraint.
pub(crate) struct Constraint {
    pub(crate) element: Element,
    pub(crate) sides: [Side; 2],
    /// Where a `connect` holds both together, in the world [m]; `None` of a `weld`.
    pub(crate) place: Option<Vector3<f64>>,
}

impl World {
    /// What a name of a body means.
    pub(crate) fn side(&self, name: &str) -> Option<Side> {
        if name == "world" {
            return Some(Side::Body(0));
        }
        if let Some(index) = self.bodies.iter().skip(1).position(|body| body.name() == Some(name)) {
            return Some(Side::Body(index + 1));
        }
        let segment = |(cable, own): (usize, &crate::cable::Cable)| {
            Some(Side::Segment { cable, segment: own.segment_of(name, 'B')? })
        };
        self.cables.iter().enumerate().find_map(segment)
    }

    /// The constraints that are active.
    pub(crate) fn constraints(&self, notes: &mut Notes) -> Result<Vec<Constraint>> {
        if !self.options.equalities {
            return Ok(Vec::new());
        }
        let mut constraints = Vec::new();
        for element in &self.equalities {
            if !matches!(element.tag.as_str(), "connect" | "weld") {
                return element.wrong("connect and weld are read of <equality>");
            }
            const READ: [&str; 7] = ["body1", "body2", "anchor", "relpose", "torquescale", "active", "name"];
            element.knows(&READ, &["class", "solref", "solimp"])?;
            if !element.is_true("active", true)? {
                notes.say(element, "is not active, and left out");
                continue;
            }
            let side = |name: &str| match element.text(name) {
                None if name == "body2" => Ok(Side::Body(0)),
                None => element.wrong(&format!("the attribute {name} is missing; sites are not read here")),
                Some(body) => match self.side(body) {
                    Some(side) => Ok(side),
                    None => element.at(name, "there is no body of that name"),
                },
            };
            let sides = [side("body1")?, side("body2")?];
            let place = if element.tag == "connect" {
                let Some(anchor) = element.vector("anchor")? else {
                    return element.wrong("the attribute anchor is missing");
                };
                let frame = match sides[0] {
                    Side::Body(index) => self.bodies[index].pose,
                    Side::Segment { cable, segment } => self.cables[cable].frame(segment),
                };
                Some((frame * Point3::from(anchor)).coords)
            } else {
                if element.number("torquescale", 1.0)? <= 0.0 {
                    return element.must_be("torquescale", "> 0; <connect> holds a place alone");
                }
                // A quaternion of zeros stands for the pose at the start.
                if element.exactly::<7>("relpose")?.is_some_and(|pose| pose[3..] != [0.0; 4]) {
                    return element.at("relpose", "a weld holds bodies as they are at the start; leave it out");
                }
                None
            };
            constraints.push(Constraint { element: element.clone(), sides, place });
        }
        Ok(constraints)
    }
}
