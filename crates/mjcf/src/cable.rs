//! Cables: `composite type="cable"` with the plugin `mujoco.elasticity.cable`.
//!
//! MuJoCo makes a chain of bodies with ball joints of it; the plugin acts on each joint with the moment `E I / l` (and `G J / l`) times
//! the difference of rotation vectors from rest, l being the distance of the bodies. That is a discrete elastic rod, and `bend` and
//! `twist` are its Young's and shear moduli.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};

use crate::contact::Touch;
use crate::error::Result;
use crate::geom::{DENSITY, HARMLESS, MARGINS, TOUCH, say_margins};
use crate::option::Notes;
use crate::xml::Element;

/// The plugin whose cables are read.
pub(crate) const PLUGIN: &str = "mujoco.elasticity.cable";
/// Most vertices of a cable.
const MOST: usize = 1_000_001;
/// Sines of angles between segments up to which MuJoCo takes them for straight.
const STRAIGHT: f64 = 1e-7;

/// What the bodies of a cable are made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Section {
    /// Radius [m].
    Circle(f64),
    /// Sides along the normal and along the binormal [m].
    Rectangle([f64; 2]),
}

impl Section {
    fn area(self) -> f64 {
        match self {
            Self::Circle(r) => PI * r * r,
            Self::Rectangle([width, height]) => width * height,
        }
    }

    /// The smaller second moment of area, and the torsion constant [m^4]; of the rectangle the plugin's.
    fn moments(self) -> [f64; 2] {
        match self {
            Self::Circle(r) => [PI * r.powi(4) / 4.0, PI * r.powi(4) / 2.0],
            Self::Rectangle([width, height]) => {
                let (long, short) = (width.max(height), width.min(height));
                let ratio = short / long;
                let torsion = long * short.powi(3) / 16.0 * (16.0 / 3.0 - 3.36 * ratio * (1.0 - ratio.powi(4) / 12.0));
                [long * short.powi(3) / 12.0, torsion]
            }
        }
    }

    /// Radius with which it touches here [m].
    pub(crate) fn radius(self) -> f64 {
        match self {
            Self::Circle(r) => r,
            Self::Rectangle([width, height]) => 0.5 * width.min(height),
        }
    }
}

/// How the first body of a cable is joined to the body that the cable is in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Initial {
    Free,
    Ball,
    /// Not by a joint: it is a part of that body.
    Fixed,
}

/// A cable in world axes.
#[derive(Clone, Debug)]
pub(crate) struct Cable {
    pub(crate) element: Element,
    pub(crate) prefix: String,
    /// The body that it is in.
    pub(crate) body: usize,
    pub(crate) initial: Initial,
    /// [m]
    pub(crate) nodes: Vec<Vector3<f64>>,
    /// Of each segment: where its local y points.
    pub(crate) normals: Vec<Vector3<f64>>,
    pub(crate) section: Section,
    /// Young's and shear moduli [Pa].
    pub(crate) moduli: [f64; 2],
    /// [kg/m^3], so that the rod weighs what the geoms weigh.
    pub(crate) density: f64,
    /// Relaxation times of bending and twist [s].
    pub(crate) relaxation: [f64; 2],
    /// Whether it is straight without forces, whatever its first shape.
    pub(crate) flat: bool,
    pub(crate) touch: Touch,
}

impl Cable {
    /// Number of segments.
    pub(crate) fn count(&self) -> usize {
        self.nodes.len() - 1
    }

    pub(crate) fn length(&self, segment: usize) -> f64 {
        (self.nodes[segment + 1] - self.nodes[segment]).norm()
    }

    pub(crate) fn tangent(&self, segment: usize) -> Vector3<f64> {
        (self.nodes[segment + 1] - self.nodes[segment]).normalize()
    }

    /// The pose of the body of a segment: at its start, x along it.
    pub(crate) fn frame(&self, segment: usize) -> Isometry3<f64> {
        let (x, y) = (self.tangent(segment), self.normals[segment]);
        let turn = UnitQuaternion::from_basis_unchecked(&[x, y, x.cross(&y)]);
        Isometry3::from_parts(self.nodes[segment].into(), turn)
    }

    /// The segment whose body, joint or site has this name, made of the prefix, a letter and a number.
    pub(crate) fn segment_of(&self, name: &str, letter: char) -> Option<usize> {
        let last = self.count() - 1;
        let rest = name.strip_prefix(self.prefix.as_str())?.strip_prefix(letter)?.strip_prefix('_')?;
        match rest {
            "first" => Some(0),
            "last" => Some(last),
            number => number.parse().ok().filter(|k: &usize| (1..last).contains(k) && number == k.to_string()),
        }
    }

    /// The largest angle between two segments [rad].
    pub(crate) fn largest_angle(&self) -> f64 {
        (1..self.count()).map(|k| self.tangent(k - 1).angle(&self.tangent(k))).fold(0.0, f64::max)
    }

    /// Smaller bending stiffness E I [N m^2].
    pub(crate) fn bending(&self) -> f64 {
        self.moduli[0] * self.section.moments()[0]
    }
}

/// Reads a cable that is in a body of this pose.
pub(crate) fn read(
    element: &Element,
    parent: (usize, &Isometry3<f64>),
    parts: &dyn Fn(&Element) -> Result<Element>,
    instances: &[Element],
    notes: &mut Notes,
) -> Result<Cable> {
    let (body, pose) = parent;
    if element.required("type")? != "cable" {
        return element.must_be("type", "cable");
    }
    element.knows(&["type", "prefix", "count", "offset", "size", "vertex", "curve", "initial"], &[])?;
    let prefix = element.text("prefix").unwrap_or_default().to_owned();
    let initial = match element.text("initial").unwrap_or("ball") {
        "free" => Initial::Free,
        "none" => Initial::Fixed,
        "ball" => Initial::Ball,
        "fixed" => {
            notes.say(
                element,
                "initial = \"fixed\" is a ball joint, as MuJoCo reads it; \"none\" holds the first segment",
            );
            Initial::Ball
        }
        _ => return element.must_be("initial", "free, ball or none"),
    };
    let offset = element.vector("offset")?.unwrap_or_default();
    let vertices = vertices(element)?;
    let normals = normals(&vertices);
    let nodes: Vec<_> = vertices.iter().map(|v| (pose * Point3::from(offset + v)).coords).collect();
    let normals = normals.into_iter().map(|n| pose.rotation * n).collect();
    let one = |tag: &str| -> Result<Option<&Element>> {
        let mut all = element.children.iter().filter(|child| child.tag == tag);
        let first = all.next();
        match all.next() {
            Some(second) => second.wrong("a cable has one of them"),
            None => Ok(first),
        }
    };
    for child in &element.children {
        match child.tag.as_str() {
            "geom" | "joint" | "plugin" => {}
            "skin" | "site" => notes.unused(child, &child.tag),
            _ => return child.wrong("is not read in a cable"),
        }
    }
    let Some(geom) = one("geom")? else { return element.wrong("a cable needs a <geom>") };
    let geom = parts(geom)?;
    let read = [&["type", "size", "density", "mass"], &TOUCH[..], &MARGINS].concat();
    geom.knows(&read, &HARMLESS)?;
    say_margins(&geom, notes)?;
    let section = section(&geom, notes)?;
    let total: f64 = nodes.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
    let count = nodes.len() - 1;
    let round_ends = match (section, geom.text("type")) {
        (Section::Circle(r), Some("capsule")) => 4.0 / 3.0 * PI * r.powi(3),
        _ => 0.0,
    };
    let mass = match geom.has("mass") {
        true => count as f64 * geom.positive("mass", 0.0, "kg")?,
        false => geom.positive("density", DENSITY, "kg/m^3")? * (section.area() * total + count as f64 * round_ends),
    };
    let Some(plugin) = one("plugin")? else {
        return element.wrong(&format!("a cable needs <plugin plugin=\"{PLUGIN}\">: without it, it has no stiffness"));
    };
    let (moduli, flat) = material(plugin, instances, notes)?;
    let [bending, torsion] = section.moments();
    let damping = one("joint")?.map(parts).transpose()?.map_or(Ok(0.0), |joint| self::damping(&joint, notes))?;
    if damping > 0.0 && initial == Initial::Ball {
        notes.say(element, "the damping of the first ball joint, to what holds it, is left out; rest is the same");
    }
    if damping > 0.0 && matches!(section, Section::Rectangle([a, b]) if a != b) {
        notes.say(element, "joint damping is that about the softer axis; about the stiffer one the rod is damped more");
    }
    let length = total / count as f64;
    Ok(Cable {
        prefix,
        body,
        initial,
        nodes,
        normals,
        section,
        moduli,
        density: mass / (section.area() * total),
        relaxation: [damping * length / (moduli[0] * bending), damping * length / (moduli[1] * torsion)],
        flat,
        touch: Touch::read(&geom)?,
        element: element.clone(),
    })
}

/// The vertices in the composite's own axes, neighbours apart.
fn vertices(element: &Element) -> Result<Vec<Vector3<f64>>> {
    let vertices: Vec<Vector3<f64>> = match element.numbers("vertex")? {
        Some(_) if element.has("count") => return element.at("count", "vertex says how many there are"),
        Some(numbers) if numbers.len() < 6 || numbers.len() % 3 != 0 => {
            return element.must_be("vertex", "three numbers a vertex, of two vertices or more");
        }
        Some(numbers) => numbers.chunks_exact(3).map(Vector3::from_column_slice).collect(),
        None => curve(element)?,
    };
    if vertices.len() > MOST {
        return element.wrong(&format!("has {} vertices, but {MOST} are the most", vertices.len()));
    }
    if let Some(k) = vertices.windows(2).position(|pair| pair[0] == pair[1]) {
        return element.wrong(&format!("vertices {k} and {} are at one place", k + 1));
    }
    Ok(vertices)
}

/// The vertices of a curve that is given by functions of s, from 0 to 1.
fn curve(element: &Element) -> Result<Vec<Vector3<f64>>> {
    let count = match element.numbers("count")?.as_deref() {
        Some([count, rest @ ..])
            if *count >= 2.0 && *count <= MOST as f64 && count.fract() == 0.0 && rest.iter().all(|n| *n == 1.0) =>
        {
            *count as usize
        }
        Some(_) => return element.must_be("count", &format!("a whole number from 2 to {MOST}, followed by ones")),
        None => return element.wrong("give either vertex, or count and curve"),
    };
    let mut size = [1.0, 0.0, 0.0];
    match element.numbers("size")? {
        Some(given) if (1..=3).contains(&given.len()) => size[..given.len()].copy_from_slice(&given),
        Some(_) => return element.must_be("size", "one to three numbers"),
        None => {}
    }
    let words: Vec<&str> = element.required("curve")?.split_whitespace().collect();
    if words.len() > 3 || words.iter().any(|word| !["s", "cos(s)", "sin(s)", "0"].contains(word)) {
        return element.must_be("curve", "one to three of s, cos(s), sin(s), 0");
    }
    let at = |word: &str, s: f64| match word {
        "s" => size[0] * s,
        "cos(s)" => size[1] * (PI * size[2] * s).cos(),
        "sin(s)" => size[1] * (PI * size[2] * s).sin(),
        _ => 0.0,
    };
    let vertex = |k: usize| {
        let s = k as f64 / (count - 1) as f64;
        Vector3::from_fn(|axis, _| words.get(axis).map_or(0.0, |word| at(word, s)))
    };
    Ok((0..count).map(vertex).collect())
}

/// The normal of each segment: the first towards where the curve bends, or as turned least from y where it begins straight; then
/// by parallel transport (Bergou et al. 2008).
fn normals(nodes: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let tangents: Vec<_> = nodes.windows(2).map(|pair| (pair[1] - pair[0]).normalize()).collect();
    let first = tangents[0];
    let binormal = tangents.get(1).map_or(Vector3::zeros(), |next| first.cross(next));
    let mut normal = match Unit::try_new(binormal, STRAIGHT) {
        Some(binormal) => binormal.cross(&first).normalize(),
        None => {
            let half_turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), PI);
            UnitQuaternion::rotation_between(&Vector3::x(), &first).unwrap_or(half_turn) * Vector3::y()
        }
    };
    let mut normals = vec![normal];
    for pair in tangents.windows(2) {
        if let Some(turn) = UnitQuaternion::rotation_between(&pair[0], &pair[1]) {
            normal = turn * normal;
        }
        // Rounding does not add up.
        normal = (normal - pair[1] * pair[1].dot(&normal)).normalize();
        normals.push(normal);
    }
    normals
}

/// The section of the geom of a cable.
fn section(geom: &Element, notes: &mut Notes) -> Result<Section> {
    let kind = match geom.text("type") {
        None => return geom.wrong("type must be capsule, cylinder or box"),
        Some(_) => geom.choice("type", &["capsule", "cylinder", "box"], "capsule")?,
    };
    let sizes = geom.numbers("size")?.unwrap_or_default();
    let size = |k: usize| match sizes.get(k) {
        Some(size) if *size > 0.0 => Ok(*size),
        Some(_) => geom.must_be("size", "> 0 [m]"),
        None => geom.wrong(&format!("size must have {} numbers", k + 1)),
    };
    match kind {
        "box" => {
            notes.say(geom, "a cable of boxes bends and weighs as such, and touches as a round one, half its thinner side in radius");
            Ok(Section::Rectangle([2.0 * size(1)?, 2.0 * size(2)?]))
        }
        _ => Ok(Section::Circle(size(0)?)),
    }
}

/// Moduli of bending and twist [Pa], and whether the cable is straight at rest, from the plugin's entries.
fn material(plugin: &Element, instances: &[Element], notes: &mut Notes) -> Result<([f64; 2], bool)> {
    plugin.knows(&["plugin", "instance"], &[])?;
    let source = match (plugin.text("instance"), plugin.text("plugin")) {
        (Some(name), _) => match instances.iter().find(|instance| instance.text("name") == Some(name)) {
            Some(instance) => instance,
            None => {
                return plugin.must_be("instance", &format!("the name of an <instance> of {PLUGIN} in <extension>"));
            }
        },
        (None, Some(PLUGIN)) => plugin,
        (None, Some(_)) => return plugin.must_be("plugin", PLUGIN),
        (None, None) => return plugin.wrong("the attribute plugin is missing"),
    };
    let (mut bend, mut twist, mut flat) = (None, None, false);
    for entry in &source.children {
        if entry.tag != "config" {
            return entry.wrong("is not known in <plugin>");
        }
        entry.knows(&["key", "value"], &[])?;
        let modulus = || match entry.number("value", 0.0)? {
            value if value > 0.0 => Ok(Some(value)),
            _ => entry.must_be("value", "> 0 [Pa]"),
        };
        match entry.required("key")? {
            "bend" => bend = modulus()?,
            "twist" => twist = modulus()?,
            "flat" => flat = entry.is_true("value", false)?,
            "vmax" => notes.unused(entry, "vmax (colours)"),
            _ => return entry.must_be("key", "twist, bend, flat or vmax"),
        }
    }
    match (bend, twist) {
        (Some(bend), Some(twist)) => Ok(([bend, twist], flat)),
        (None, _) => {
            source.wrong("<config key=\"bend\"> is missing: without it, the cable has no stiffness of bending")
        }
        (_, None) => source.wrong("<config key=\"twist\"> is missing: without it, the cable has no stiffness of twist"),
    }
}

/// Damping of the ball joints [N m s/rad].
fn damping(joint: &Element, notes: &mut Notes) -> Result<f64> {
    const HARMLESS: [&str; 8] =
        ["name", "group", "user", "solreflimit", "solimplimit", "solreffriction", "solimpfriction", "margin"];
    joint
        .knows(&["kind", "damping", "armature", "stiffness", "frictionloss", "type", "limited", "range"], &HARMLESS)?;
    joint.choice("kind", &["main"], "main")?;
    for (name, message) in [
        ("stiffness", "0: say it by bend and twist of the plugin"),
        ("frictionloss", "0: joints without dry friction are read"),
    ] {
        if joint.not_negative(name, "N m")? != 0.0 {
            return joint.must_be(name, message);
        }
    }
    if joint.has("range") && joint.text("limited") != Some("false") {
        return joint.at("range", "joints without limits are read");
    }
    if joint.not_negative("armature", "kg m^2")? > 0.0 {
        notes.say(joint, "armature, an inertia of the joints, is left out: motions are faster, rest is the same");
    }
    joint.not_negative("damping", "N m s/rad")
}
