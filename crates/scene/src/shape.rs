//! From a shape's keys to the nodes of a centreline.

use std::ops::Range;

use nalgebra::Vector3;
use rod::shape;

use crate::MAX_SEGMENTS;
use crate::error::{Result, Source, short};
use crate::format::{Arc, Helix, Hung, Knot, Number, Polyline, Rest, Ring, Shape, Straight, Vector};
use crate::refine::Refinement;

/// Least and largest distance between neighbouring nodes [m].
pub(crate) const NODE_DISTANCE: Range<f64> = 1e-12..1e12;

impl Shape {
    /// Number of segments, before refinement.
    pub(crate) fn segments(&self, source: &Source) -> Result<usize> {
        let (count, least) = match self {
            Shape::Straight(Straight { segments, .. })
            | Shape::Helix(Helix { segments, .. })
            | Shape::Arc(Arc { segments, .. })
            | Shape::Knot(Knot { segments, .. }) => (segments, 1),
            Shape::Hung(Hung { segments, .. }) => (segments, shape::HUNG_SEGMENTS),
            Shape::Curve(curve) => return curve.count(source),
            Shape::Ring(Ring { segments, .. }) => (segments, 3),
            Shape::Polyline(polyline) => return polyline.segments(source),
        };
        source.count(count, least, MAX_SEGMENTS)
    }

    pub(crate) fn closed(&self) -> bool {
        match self {
            Shape::Ring(_) => true,
            Shape::Polyline(polyline) => polyline.closed,
            Shape::Curve(curve) => curve.closed,
            Shape::Straight(_) | Shape::Helix(_) | Shape::Arc(_) | Shape::Knot(_) | Shape::Hung(_) => false,
        }
    }

    /// The shape without bend-twist energy where none is given: a cable hangs by its weight and was made straight.
    pub(crate) fn rest(&self) -> &Rest {
        match self {
            Shape::Hung(_) => &Rest::Straight,
            _ => &Rest::Initial,
        }
    }

    /// The key that says where the shape begins, if it is given.
    pub(crate) fn start(&self) -> Option<&Vector> {
        match self {
            Shape::Straight(Straight { start_m, .. })
            | Shape::Helix(Helix { start_m, .. })
            | Shape::Arc(Arc { start_m, .. })
            | Shape::Knot(Knot { start_m, .. }) => start_m.as_ref(),
            Shape::Hung(Hung { from_m, .. }) => from_m.as_ref(),
            Shape::Ring(_) | Shape::Polyline(_) | Shape::Curve(_) => None,
        }
    }

    /// Nodes [m] of the segments' parts; `at` [m] is where a branch begins, `gravity` [m/s^2] what a cable hangs by. `span`
    /// is the shape's place in the text.
    pub(crate) fn nodes(
        &self,
        source: &Source,
        span: Range<usize>,
        at: Option<Vector3<f64>>,
        gravity: Vector3<f64>,
        refinement: Refinement,
    ) -> Result<Vec<Vector3<f64>>> {
        let count = self.segments(source)? * refinement.0;
        let start = |key: &Option<Vector>| match (at, key) {
            (Some(at), _) => Ok(at),
            (None, Some(key)) => source.vector(key, "m"),
            (None, None) => Ok(Vector3::zeros()),
        };
        let nodes = match self {
            Shape::Straight(s) => {
                let length = source.positive(&s.length_m, "m")?;
                shape::straight(start(&s.start_m)?, s.direction(source)?, length, count)
            }
            Shape::Helix(s) => {
                let radius = source.positive(&s.radius_m, "m")?;
                let height = source.finite(&s.height_m, "m")?;
                let winding = source.finite(&s.winding, "turns")?;
                shape::helix(start(&s.start_m)?, radius, height, winding, count)
            }
            Shape::Arc(s) => s.nodes(source, start(&s.start_m)?, count)?,
            Shape::Knot(s) => s.nodes(source, start(&s.start_m)?, count)?,
            Shape::Hung(s) => s.nodes(source, start(&s.from_m)?, gravity, count)?,
            Shape::Curve(s) => s.nodes(source, at, refinement, count)?,
            Shape::Ring(s) => {
                let centre = s.centre_m.as_ref().map_or(Ok(Vector3::zeros()), |key| source.vector(key, "m"))?;
                shape::ring(centre, source.positive(&s.radius_m, "m")?, count)
            }
            Shape::Polyline(s) => {
                let nodes = s.nodes_m.get_ref().iter().map(|node| source.vector(node, "m"));
                let nodes: Vec<_> = nodes.collect::<Result<_>>()?;
                let shift = at.map_or(Vector3::zeros(), |at| at - nodes[0]);
                let nodes: Vec<_> = nodes.into_iter().map(|node| node + shift).collect();
                refinement.cut(&nodes, s.closed)
            }
        };
        self.check_distances(source, span, &nodes, refinement)?;
        Ok(nodes)
    }

    fn check_distances(
        &self,
        source: &Source,
        span: Range<usize>,
        nodes: &[Vector3<f64>],
        refinement: Refinement,
    ) -> Result<()> {
        let count = nodes.len() - usize::from(!self.closed());
        for i in 0..count {
            let next = (i + 1) % nodes.len();
            let distance = (nodes[next] - nodes[i]).norm();
            if !NODE_DISTANCE.contains(&distance) {
                let Range { start, end } = NODE_DISTANCE;
                return source.wrong(
                    match self {
                        Shape::Polyline(polyline) => {
                            let given = polyline.nodes_m.get_ref();
                            given[next.div_ceil(refinement.0) % given.len()].span()
                        }
                        _ => span,
                    },
                    &format!(
                        "nodes {i} and {next} are {distance} m apart, but neighbours must be {start:e} to {end:e} m apart"
                    ),
                );
            }
        }
        Ok(())
    }
}

impl Straight {
    fn direction(&self, source: &Source) -> Result<Vector3<f64>> {
        match (&self.direction, &self.angle_deg) {
            (None, None) => Ok(Vector3::x()),
            (Some(direction), None) => source.direction(direction),
            (None, Some(angle)) => {
                let angle = source.finite(angle, "degrees")?.to_radians();
                Ok(Vector3::new(angle.cos(), 0.0, angle.sin()))
            }
            (Some(_), Some(angle)) => source.wrong(angle.span(), "give either `direction` or `angle_deg`, not both"),
        }
    }
}

impl Arc {
    fn nodes(&self, source: &Source, start: Vector3<f64>, count: usize) -> Result<Vec<Vector3<f64>>> {
        let unit = |key: &Option<Vector>, default| key.as_ref().map_or(Ok(default), |key| source.direction(key));
        let along = unit(&self.direction, Vector3::x())?;
        let towards = unit(&self.towards, Vector3::z())?;
        let across = towards - along * along.dot(&towards);
        if across.norm() < 1e-6 {
            let given = self.towards.as_ref().or(self.direction.as_ref()).map_or(0..0, Vector::span);
            return source.wrong(given, "`towards` must not be parallel to `direction`");
        }
        let across = across.normalize();
        let radius = source.positive(&self.radius_m, "m")?;
        let angle = source.number(&self.angle_deg, |v| v > 0.0 && v <= 360.0, "> 0 and <= 360 [degrees]")?.to_radians();
        let node = |i: usize| {
            let turned = angle * i as f64 / count as f64;
            start + radius * (along * turned.sin() + across * (1.0 - turned.cos()))
        };
        Ok((0..=count).map(node).collect())
    }
}

impl Knot {
    fn nodes(&self, source: &Source, start: Vector3<f64>, count: usize) -> Result<Vec<Vector3<f64>>> {
        let direction = self.direction.as_ref().map_or(Ok(Vector3::x()), |key| source.direction(key))?;
        let (width, length) = (source.positive(&self.loop_m, "m")?, source.positive(&self.length_m, "m")?);
        let most = length / shape::KNOT_ROPE;
        if width > most {
            let allowed = format!("at most length_m / {} = {} [m]", shape::KNOT_ROPE, short(most));
            return source.must_be(self.loop_m.span(), &allowed);
        }
        let least = shape::KNOT_SEGMENTS * (length / width);
        if (count as f64) < least {
            let allowed = format!("at least {} length_m / loop_m = {}", shape::KNOT_SEGMENTS, short(least));
            return source.must_be(self.segments.span(), &allowed);
        }
        Ok(shape::knot(start, direction, width, length, count))
    }
}

impl Polyline {
    fn segments(&self, source: &Source) -> Result<usize> {
        let nodes = self.nodes_m.get_ref().len();
        let least = if self.closed { 3 } else { 2 };
        if nodes < least || nodes > MAX_SEGMENTS {
            return source.wrong(self.nodes_m.span(), &format!("{nodes} nodes, but there must be at least {least}"));
        }
        Ok(if self.closed { nodes } else { nodes - 1 })
    }
}

/// `value`, checked by `check`, or `default` where it is left out.
pub(crate) fn number_or(value: &Option<Number>, default: f64, check: impl Fn(&Number) -> Result<f64>) -> Result<f64> {
    value.as_ref().map_or(Ok(default), check)
}
