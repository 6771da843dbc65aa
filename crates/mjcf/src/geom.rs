//! Geoms: shapes with a pose, a mass, and what they touch.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

use crate::contact::Touch;
use crate::error::Result;
use crate::option::{Compiler, Notes};
use crate::pose::{POSE, pose, z_to};
use crate::xml::Element;

/// What a geom is.
#[derive(Clone, Debug)]
pub(crate) enum Shape {
    /// All below its local z = 0.
    Plane,
    /// Of this radius [m].
    Sphere(f64),
    /// Radius and half of the length without round ends, along z [m].
    Capsule([f64; 2]),
    /// Radius and half of the length, along z [m].
    Cylinder([f64; 2]),
    /// Halves of the sides [m].
    Box([f64; 3]),
    /// A file, and its scale.
    Mesh(String, f64),
}

impl Shape {
    /// [m^3]; `None` of planes and meshes.
    pub(crate) fn volume(&self) -> Option<f64> {
        match *self {
            Self::Plane | Self::Mesh(..) => None,
            Self::Sphere(r) => Some(4.0 / 3.0 * PI * r.powi(3)),
            Self::Capsule([r, half]) => Some(PI * r * r * (2.0 * half + 4.0 / 3.0 * r)),
            Self::Cylinder([r, half]) => Some(2.0 * PI * r * r * half),
            Self::Box([x, y, z]) => Some(8.0 * x * y * z),
        }
    }
}

/// A geom of a body.
#[derive(Clone, Debug)]
pub(crate) struct Geom {
    pub(crate) element: Element,
    pub(crate) shape: Shape,
    /// In the world.
    pub(crate) pose: Isometry3<f64>,
    pub(crate) touch: Touch,
    /// [kg], where it is given.
    pub(crate) mass: Option<f64>,
    /// [kg/m^3]
    pub(crate) density: f64,
}

impl Geom {
    /// [kg]; `None` of a mesh that gives a density.
    pub(crate) fn weight(&self) -> Option<f64> {
        self.mass.or_else(|| Some(self.density * self.shape.volume()?))
    }
}

/// Attributes of geoms that change looks alone, or how soft MuJoCo's contacts are.
pub(crate) const HARMLESS: [&str; 12] = [
    "name",
    "rgba",
    "material",
    "group",
    "user",
    "solref",
    "solimp",
    "solmix",
    "fluidshape",
    "fluidcoef",
    "fitscale",
    "hfield",
];
/// Attributes of [`Touch`].
pub(crate) const TOUCH: [&str; 5] = ["contype", "conaffinity", "condim", "friction", "priority"];
/// Distances at which MuJoCo's contacts begin.
pub(crate) const MARGINS: [&str; 2] = ["margin", "gap"];

/// Reads a geom with its defaults; `parent` is the pose of what it is in. `None` of one that nothing can touch and whose shape is
/// unknown here.
pub(crate) fn geom(
    element: Element,
    parent: &Isometry3<f64>,
    compiler: &Compiler,
    meshes: &[Element],
    notes: &mut Notes,
) -> Result<Option<Geom>> {
    let read = [&["type", "size", "fromto", "mass", "density", "mesh"], &POSE[..], &TOUCH, &MARGINS].concat();
    element.knows(&read, &HARMLESS)?;
    let touch = Touch::read(&element)?;
    say_margins(&element, notes)?;
    const SHAPES: [&str; 9] = ["plane", "sphere", "capsule", "cylinder", "box", "mesh", "ellipsoid", "hfield", "sdf"];
    let kind = element.choice("type", &SHAPES, if element.has("mesh") { "mesh" } else { "sphere" })?;
    if let "ellipsoid" | "hfield" | "sdf" = kind {
        if touch.touches_nothing() {
            notes.say(&element, &format!("a geom of type {kind} that touches nothing is left out"));
            return Ok(None);
        }
        return element.must_be("type", "plane, sphere, capsule, cylinder, box or mesh");
    }
    let sizes = element.numbers("size")?.unwrap_or_default();
    let size = |k: usize| match sizes.get(k) {
        Some(size) if *size > 0.0 => Ok(*size),
        Some(_) => element.must_be("size", "> 0 [m]"),
        None => element.wrong(&format!("the attribute size must have {} numbers", k + 1)),
    };
    let mut own = pose(&element, compiler)?;
    let mut half = None;
    if let Some([a, b, c, d, e, f]) = element.exactly("fromto")? {
        if !matches!(kind, "capsule" | "cylinder" | "box") {
            return element.at("fromto", "it goes with capsules, cylinders and boxes");
        }
        let (from, to) = (Vector3::new(a, b, c), Vector3::new(d, e, f));
        let Some(axis) = Unit::try_new(from - to, 1e-12) else {
            return element.must_be("fromto", "two places");
        };
        half = Some(0.5 * (to - from).norm());
        own = Isometry3::from_parts(Translation3::from(0.5 * (from + to)), z_to(&axis));
    }
    let length = |k: usize| half.map_or_else(|| size(k), Ok);
    let shape = match kind {
        "plane" => Shape::Plane,
        "sphere" => Shape::Sphere(size(0)?),
        "capsule" => Shape::Capsule([size(0)?, length(1)?]),
        "cylinder" => Shape::Cylinder([size(0)?, length(1)?]),
        "box" => Shape::Box([size(0)?, if half.is_some() { size(0)? } else { size(1)? }, length(2)?]),
        _ => {
            let (shape, turn) = mesh(&element, compiler, meshes, notes)?;
            own *= turn;
            shape
        }
    };
    let mass = if element.has("mass") { Some(element.not_negative("mass", "kg")?) } else { None };
    let density = if element.has("density") { element.not_negative("density", "kg/m^3")? } else { DENSITY };
    Ok(Some(Geom { shape, pose: parent * own, touch, mass, density, element }))
}

/// Of geoms that give neither mass nor density [kg/m^3].
pub(crate) const DENSITY: f64 = 1000.0;

/// Names distances at which contacts begin in MuJoCo, but not here.
pub(crate) fn say_margins(element: &Element, notes: &mut Notes) -> Result<()> {
    for name in MARGINS {
        if element.number(name, 0.0)? != 0.0 {
            notes.say(element, &format!("{name} is left out: contacts begin where surfaces meet"));
        }
    }
    Ok(())
}

/// The mesh that a geom names.
fn mesh(
    geom: &Element,
    compiler: &Compiler,
    meshes: &[Element],
    notes: &mut Notes,
) -> Result<(Shape, UnitQuaternion<f64>)> {
    let name = geom.required("mesh")?;
    let stem = |file: &str| file.rsplit('/').next().and_then(|file| file.rsplit_once('.')).map(|(s, _)| s.to_owned());
    let named = |mesh: &&Element| match (mesh.text("name"), mesh.text("file")) {
        (Some(own), _) => own == name,
        (None, Some(file)) => stem(file).as_deref() == Some(name),
        (None, None) => false,
    };
    let Some(asset) = meshes.iter().find(named) else {
        return geom.must_be("mesh", "the name of a <mesh> in <asset>");
    };
    asset.knows(
        &["name", "file", "scale", "refpos", "refquat", "content_type", "inertia"],
        &["smoothnormal", "maxhullvert"],
    )?;
    let file = asset.required("file")?;
    if !["obj", "stl"].iter().any(|ending| file.to_ascii_lowercase().ends_with(&format!(".{ending}"))) {
        return asset.must_be("file", "an OBJ or STL file");
    }
    if asset.vector("refpos")?.is_some_and(|v| v.norm() > 0.0) {
        return asset.must_be("refpos", "0 0 0");
    }
    if asset.exactly::<4>("refquat")?.is_some_and(|q| q != [1.0, 0.0, 0.0, 0.0]) {
        return asset.must_be("refquat", "1 0 0 0");
    }
    let scale = match asset.exactly::<3>("scale")? {
        None => 1.0,
        Some([x, y, z]) if x > 0.0 && x == y && x == z => x,
        Some(_) => return asset.must_be("scale", "three times the same number > 0"),
    };
    notes.say(geom, "the mesh touches as it is; MuJoCo takes its convex hull");
    let path = if file.starts_with('/') { file.to_owned() } else { format!("{}{file}", compiler.meshdir) };
    Ok((Shape::Mesh(path, scale), UnitQuaternion::identity()))
}
