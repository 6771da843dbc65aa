//! What rods, bodies, obstacles and grips are called in a run's files.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use rod::{Body, Model, Segment, end_of, successors};
use serde::Serialize;

/// Names of all that a model has, for files: rods and rigid bodies by [`rod::Segment::rod`], obstacles, and what holds rods.
///
/// A segment is called after its rod and its number within the rod, `cable segment 3`; a rigid body has its own name. What holds a
/// rod is called after the place that it holds, with the words of scene files: `cable start-face`, `cable end-segment`,
/// `cable segment 3`. As JSON it is the table of numbers and names in `summary.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Names {
    /// By number.
    rods: BTreeMap<usize, Rod>,
    /// Rigid bodies, by number; rods and bodies are numbered together.
    bodies: BTreeMap<usize, Rod>,
    /// By number.
    obstacles: BTreeMap<usize, String>,
    /// By the number of the segment that is held, or `anchor 0` and so on.
    grips: BTreeMap<String, String>,
    /// Number of each segment within its rod, and its rod.
    #[serde(skip)]
    segments: Vec<(usize, usize)>,
}

/// A rod or a rigid body.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
struct Rod {
    name: String,
    /// Number of its first segment.
    first_segment: usize,
    /// How many it has.
    segments: usize,
    /// Whether its last segment is joined to its first: it has no ends.
    #[serde(skip)]
    is_closed: bool,
}

impl Names {
    /// The names of a model whose rods and bodies are called `rods`, by number, and whose obstacles `obstacles`, in their
    /// order. Those without a name are `rod-K`, `body-K` and `obstacle-K` with their number K. Line breaks and other control
    /// characters become spaces.
    pub fn new(model: &Model, rods: &[String], obstacles: &[String]) -> Self {
        let mut found = BTreeMap::<usize, Rod>::new();
        let mut segments = Vec::with_capacity(model.segments.len());
        for (i, segment) in model.segments.iter().enumerate() {
            let kind = if segment.body.is_some() { "body" } else { "rod" };
            let new = || Rod { name: name(rods, kind, segment.rod), first_segment: i, ..Rod::default() };
            let rod = found.entry(segment.rod).or_insert_with(new);
            segments.push((rod.segments, segment.rod));
            rod.segments += 1;
        }
        let next = successors(model);
        for rod in found.values_mut().filter(|rod| rod.segments > 1) {
            let last = next.get(rod.first_segment + rod.segments - 1).copied().flatten();
            rod.is_closed = last.is_some_and(|next| next.segment == rod.first_segment);
        }
        let is_body = |rod: &Rod| model.segments[rod.first_segment].body.is_some();
        let (bodies, rods) = found.into_iter().partition(|(_, rod)| is_body(rod));
        let obstacles = (0..model.contacts.obstacles.len()).map(|k| (k, name(obstacles, "obstacle", k))).collect();
        let mut names = Self { rods, bodies, obstacles, grips: BTreeMap::new(), segments };
        let fixed = (0..model.segments.len()).filter(|&i| model.segments[i].fixed).map(Body::Segment);
        let driven = model.motions.iter().map(|driven| driven.body);
        for body in fixed.chain(driven) {
            if let Body::Segment(i) = body {
                names.grips.insert(number(body), names.held(i));
            }
        }
        let mut anchors: BTreeSet<usize> = (0..model.anchors.len()).collect();
        for joint in &model.joints {
            for (own, other, offset) in [(joint.a, joint.b, joint.offset_b), (joint.b, joint.a, joint.offset_a)] {
                if let (Body::Anchor(k), Body::Segment(i)) = (own, other)
                    && anchors.remove(&k)
                {
                    let face = end_of(model, other, offset).map(|(_, end)| end);
                    names.grips.insert(number(own), names.held_by(i, face));
                }
            }
        }
        names
    }

    /// The name of a rod or a rigid body, by its number.
    pub fn rod(&self, rod: usize) -> Cow<'_, str> {
        let known = self.rods.get(&rod).or_else(|| self.bodies.get(&rod));
        known.map_or_else(|| Cow::Owned(format!("rod-{rod}")), |rod| Cow::Borrowed(rod.name.as_str()))
    }

    /// The name of an obstacle, by its number.
    pub fn obstacle(&self, obstacle: usize) -> Cow<'_, str> {
        let known = self.obstacles.get(&obstacle);
        known.map_or_else(|| Cow::Owned(format!("obstacle-{obstacle}")), |name| Cow::Borrowed(name.as_str()))
    }

    /// What stands of a segment in each row of a table, in their order: number and name of its rod, its own number, and that
    /// within its rod, as CSV.
    pub(crate) fn rows(&self, segments: &[Segment]) -> Vec<String> {
        let row = |(i, segment): (usize, &Segment)| {
            let within = self.segments.get(i).map_or(i, |(within, _)| *within);
            format!("{},{},{i},{within}", segment.rod, csv_field(&self.rod(segment.rod)))
        };
        segments.iter().enumerate().map(row).collect()
    }

    /// The name of a segment: `cable segment 3`, or that of the rigid body that it is.
    pub fn segment(&self, segment: usize) -> String {
        let Some(&(within, rod)) = self.segments.get(segment) else { return format!("segment {segment}") };
        let name = self.rod(rod);
        if self.bodies.contains_key(&rod) { name.into_owned() } else { format!("{name} segment {within}") }
    }

    /// The name of a segment or of what holds a rod.
    pub fn body(&self, body: Body) -> String {
        match body {
            Body::Segment(i) => self.segment(i),
            Body::Anchor(_) => self.grip(body),
        }
    }

    /// The name of what holds a body: `cable start-face`, or `anchor 0` and so on for an anchor that holds nothing.
    pub fn grip(&self, body: Body) -> String {
        let known = self.grips.get(&number(body)).cloned();
        known.unwrap_or_else(|| match body {
            Body::Segment(i) => self.held(i),
            anchor => anchor.to_string(),
        })
    }

    /// Names of all rods and bodies from number 0 to the last one, `""` for numbers that none has.
    pub(crate) fn by_number(&self) -> Vec<&str> {
        let all = self.rods.iter().chain(&self.bodies);
        let mut list = Vec::new();
        for (&number, rod) in all {
            list.resize(list.len().max(number + 1), "");
            list[number] = rod.name.as_str();
        }
        list
    }

    /// Names of all obstacles, by number.
    pub(crate) fn obstacles(&self) -> Vec<&str> {
        self.obstacles.values().map(String::as_str).collect()
    }

    /// A segment that is held whole.
    fn held(&self, segment: usize) -> String {
        let Some(&(within, rod)) = self.segments.get(segment) else { return format!("segment {segment}") };
        match self.rods.get(&rod) {
            Some(Rod { name, is_closed: false, .. }) if within == 0 => format!("{name} start-segment"),
            Some(Rod { name, segments, is_closed: false, .. }) if within + 1 == *segments => {
                format!("{name} end-segment")
            }
            _ => self.segment(segment),
        }
    }

    /// What an anchor holds: the start (0) or end (1) of a segment, or a place along it.
    fn held_by(&self, segment: usize, face: Option<usize>) -> String {
        let (within, rod) = self.segments[segment];
        match (face, self.rods.get(&rod)) {
            (Some(0), Some(Rod { name, .. })) if within == 0 => format!("{name} start-face"),
            (Some(1), Some(Rod { name, segments, .. })) if within + 1 == *segments => format!("{name} end-face"),
            _ => self.segment(segment),
        }
    }
}

/// A segment's number, or `anchor 0` and so on.
pub(crate) fn number(body: Body) -> String {
    match body {
        Body::Segment(i) => i.to_string(),
        anchor => anchor.to_string(),
    }
}

/// The name of number `k`, without control characters.
fn name(names: &[String], kind: &str, k: usize) -> String {
    match names.get(k) {
        Some(name) if !name.is_empty() => name.replace(char::is_control, " "),
        _ => format!("{kind}-{k}"),
    }
}

/// A text as one field of a CSV file (RFC 4180).
pub fn csv_field(text: &str) -> Cow<'_, str> {
    if text.contains([',', '"', '\n', '\r']) {
        Cow::Owned(format!("\"{}\"", text.replace('"', "\"\"")))
    } else {
        Cow::Borrowed(text)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};
    use rod::{Assembly, Material, Obstacle, ObstacleShape, Pose, RigidBody, RodSpec, Surface, shape};
    use serde_json::json;

    use super::*;

    #[test]
    fn places_are_called_after_rods_and_what_they_are() {
        let material = Material { youngs_modulus: 1e6, torsion_modulus: 1e6, density: 1e3 };
        let mut assembly = Assembly::new(Vector3::zeros());
        let line = |y: f64| RodSpec::new(shape::straight(Vector3::y() * y, Vector3::x(), 1.0, 3), 0.01, material);
        let cable = assembly.rod(&line(0.0));
        let at = Pose { position: Vector3::x() * 2.0, orientation: UnitQuaternion::identity() };
        assembly.body(RigidBody::hidden(1.0, Vector3::repeat(0.1)), at);
        let other = assembly.rod(&line(1.0));
        assembly.clamp_end(&other).clamp_start(&cable).fix(cable.end - 1);
        let (centre, radius) = (Vector3::zeros(), 0.1);
        let floor = Obstacle::new(ObstacleShape::Sphere { centre, radius }, Surface::default());
        assembly.model_mut().contacts.obstacles = vec![floor.clone(), floor];
        let (model, _) = assembly.finish();

        let names = Names::new(&model, &["a\n,\"b\"".to_owned(), "hook".to_owned()], &["floor".to_owned()]);
        let expected = json!({
            "rods": {
                "0": { "name": "a ,\"b\"", "first_segment": 0, "segments": 3 },
                "2": { "name": "rod-2", "first_segment": 4, "segments": 3 },
            },
            "bodies": { "1": { "name": "hook", "first_segment": 3, "segments": 1 } },
            "obstacles": { "0": "floor", "1": "obstacle-1" },
            "grips": { "2": "a ,\"b\" end-segment", "anchor 0": "rod-2 end-face", "anchor 1": "a ,\"b\" start-face" },
        });
        assert_eq!(serde_json::to_value(&names).unwrap(), expected);
        assert_eq!([0, 3, 5].map(|i| names.segment(i)), ["a ,\"b\" segment 0", "hook", "rod-2 segment 1"]);
        assert_eq!(names.by_number(), ["a ,\"b\"", "hook", "rod-2"]);

        // Of the last rod alone, numbers of rods stay, and its segments and anchors are counted anew.
        let names = Names::new(&model.part(vec![4, 5, 6]).model, &[], &[]);
        assert_eq!(
            (names.segment(2), names.grip(Body::Anchor(0))),
            ("rod-2 segment 2".into(), "rod-2 end-face".into())
        );
        assert_eq!(names.by_number(), ["", "", "rod-2"]);
    }

    #[test]
    fn fields_are_quoted_where_they_must_be() {
        for text in ["plain", "a, b", "a \"b\"", "two\nlines"] {
            let line = format!("{},1\n", csv_field(text));
            let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(line.as_bytes());
            let row = reader.records().next().unwrap().unwrap();
            assert_eq!(row.iter().collect::<Vec<_>>(), [text, "1"]);
        }
        assert_eq!(csv_field("plain"), "plain");
    }
}
