//! All that a file has, in world axes: bodies with their geoms and joints, cables, constraints, actuators.

use nalgebra::{Isometry3, Unit, UnitQuaternion, Vector3};

use crate::cable::{self, Cable, PLUGIN};
use crate::defaults::Defaults;
use crate::error::Result;
use crate::geom::{self, Geom};
use crate::option::{Compiler, Notes, Options};
use crate::pose::{POSE, pose};
use crate::xml::Element;

/// How a body moves.
#[derive(Clone, Debug)]
pub(crate) enum Kind {
    /// Not at all: the world, what is fixed to it, and mocap bodies.
    Still,
    /// Freely.
    Free,
    /// Along an axis.
    Slide(Slide),
}

/// A slide joint.
#[derive(Clone, Debug)]
pub(crate) struct Slide {
    pub(crate) joint: Element,
    /// In world axes.
    pub(crate) axis: Unit<Vector3<f64>>,
    /// Of a spring towards where it begins [N/m].
    pub(crate) stiffness: f64,
}

/// A body.
pub(crate) struct Body {
    pub(crate) element: Element,
    pub(crate) pose: Isometry3<f64>,
    parent: usize,
    is_mocap: bool,
    /// With the orientation of what each is in.
    joints: Vec<(Element, UnitQuaternion<f64>)>,
    pub(crate) inertial: Option<Element>,
    pub(crate) geoms: Vec<Geom>,
    pub(crate) kind: Kind,
}

impl Body {
    pub(crate) fn name(&self) -> Option<&str> {
        self.element.text("name")
    }
}

/// A file.
pub(crate) struct World {
    pub(crate) root: Element,
    pub(crate) options: Options,
    /// The first one is the world.
    pub(crate) bodies: Vec<Body>,
    pub(crate) cables: Vec<Cable>,
    pub(crate) equalities: Vec<Element>,
    /// Pairs of names.
    pub(crate) excluded: Vec<(Element, [String; 2])>,
    pub(crate) actuators: Vec<Element>,
    pub(crate) notes: Notes,
}

/// What goes through the bodies.
struct Walk<'a> {
    compiler: &'a Compiler,
    defaults: &'a Defaults,
    meshes: &'a [Element],
    instances: &'a [Element],
    bodies: Vec<Body>,
    cables: Vec<Cable>,
    notes: Notes,
}

impl World {
    /// Reads a file's tree.
    pub(crate) fn read(root: &Element) -> Result<Self> {
        let mut notes = Notes::default();
        let compiler = Compiler::read(root)?;
        let options = Options::read(root, &mut notes)?;
        let defaults = Defaults::read(root)?;
        let (mut meshes, mut instances, mut equalities, mut actuators) = (vec![], vec![], vec![], vec![]);
        let mut excluded = Vec::new();
        for section in &root.children {
            for part in &section.children {
                match (section.tag.as_str(), part.tag.as_str()) {
                    ("asset", "mesh") => meshes.push(defaults.applied(part, None)?),
                    ("asset", "texture" | "material" | "skin" | "hfield" | "model") => notes.unused(part, &part.tag),
                    ("extension", "plugin") if part.text("plugin") == Some(PLUGIN) => {
                        instances.extend(part.children_of("instance").cloned());
                    }
                    ("extension", "plugin") => notes.unused(part, "other plugins"),
                    ("equality", _) => equalities.push(part.clone()),
                    ("actuator", _) => actuators.push(defaults.applied(part, None)?),
                    ("contact", "exclude") => {
                        part.knows(&["body1", "body2", "name"], &[])?;
                        let names = [part.required("body1")?.to_owned(), part.required("body2")?.to_owned()];
                        excluded.push((part.clone(), names));
                    }
                    ("contact", _) => return part.wrong("is not read: scenes have one friction for each obstacle"),
                    ("sensor" | "keyframe" | "custom" | "visual" | "statistic" | "size", _) => {
                        notes.unused(part, &section.tag);
                    }
                    ("tendon", _) => return part.wrong("tendons are not read"),
                    ("deformable", _) => return part.wrong("flexes and skins are not read; cables are composites"),
                    ("worldbody" | "default" | "option" | "compiler", _) => {}
                    ("asset" | "extension", _) => return part.wrong(&format!("is not known in <{}>", section.tag)),
                    _ => return section.wrong("is not known"),
                }
            }
            match section.tag.as_str() {
                "visual" | "statistic" | "size" => notes.unused(section, &section.tag),
                "worldbody" | "default" | "option" | "compiler" | "asset" | "extension" | "equality" | "actuator"
                | "contact" | "sensor" | "keyframe" | "custom" | "tendon" | "deformable" => {}
                _ => return section.wrong("is not known"),
            }
        }
        let mut walk = Walk {
            compiler: &compiler,
            defaults: &defaults,
            meshes: &meshes,
            instances: &instances,
            bodies: vec![body(root.clone(), 0, Isometry3::identity())],
            cables: Vec::new(),
            notes,
        };
        for section in root.children_of("worldbody") {
            walk.parts(section, 0, &Isometry3::identity(), None)?;
        }
        let Walk { mut bodies, cables, mut notes, .. } = walk;
        for k in 1..bodies.len() {
            bodies[k].kind = kind(&bodies, k, compiler.autolimits, &mut notes)?;
        }
        let root = Element { children: Vec::new(), ..root.clone() };
        Ok(Self { root, options, bodies, cables, equalities, excluded, actuators, notes })
    }
}

/// A body that nothing is in yet.
fn body(element: Element, parent: usize, pose: Isometry3<f64>) -> Body {
    Body {
        element: Element { children: Vec::new(), ..element },
        pose,
        parent,
        is_mocap: false,
        joints: Vec::new(),
        inertial: None,
        geoms: Vec::new(),
        kind: Kind::Still,
    }
}

impl Walk<'_> {
    /// Reads what is in a body, or in a frame of it, of this pose.
    fn parts(&mut self, element: &Element, index: usize, at: &Isometry3<f64>, class: Option<&str>) -> Result<()> {
        let defaults = self.defaults;
        for part in &element.children {
            let applied = || defaults.applied(part, class);
            match part.tag.as_str() {
                "geom" => {
                    let geom = geom::geom(applied()?, at, self.compiler, self.meshes, &mut self.notes)?;
                    self.bodies[index].geoms.extend(geom);
                }
                "joint" | "freejoint" | "inertial" if index == 0 => {
                    return part.wrong("is of bodies, and the world is none");
                }
                "joint" => self.bodies[index].joints.push((applied()?, at.rotation)),
                "freejoint" => self.bodies[index].joints.push((part.clone(), at.rotation)),
                "inertial" => self.bodies[index].inertial = Some(part.clone()),
                "body" => {
                    part.knows(
                        &[&["name", "childclass", "mocap", "gravcomp"], &POSE[..]].concat(),
                        &["user", "sleep"],
                    )?;
                    if part.number("gravcomp", 0.0)? != 0.0 {
                        return part.must_be("gravcomp", "0: gravity acts on all");
                    }
                    let own = at * pose(part, self.compiler)?;
                    let inner = Body { is_mocap: part.is_true("mocap", false)?, ..body(part.clone(), index, own) };
                    self.bodies.push(inner);
                    let next = self.bodies.len() - 1;
                    self.parts(part, next, &own, part.text("childclass").or(class))?;
                }
                "frame" => {
                    part.knows(&[&["name", "childclass"], &POSE[..]].concat(), &[])?;
                    let own = at * pose(part, self.compiler)?;
                    self.parts(part, index, &own, part.text("childclass").or(class))?;
                }
                "composite" => {
                    let parts = |part: &Element| defaults.applied(part, class);
                    let cable = cable::read(part, (index, at), &parts, self.instances, &mut self.notes)?;
                    if self.cables.iter().any(|other| other.prefix == cable.prefix) {
                        return part.at("prefix", "another cable has the same: their bodies would have the same names");
                    }
                    self.cables.push(cable);
                }
                "camera" | "light" | "site" => self.notes.unused(part, &part.tag),
                "plugin" => return part.wrong("plugins are read in <composite> alone"),
                _ => return part.wrong("is not read"),
            }
        }
        Ok(())
    }
}

/// How a body moves; those before it are known.
fn kind(bodies: &[Body], index: usize, autolimits: bool, notes: &mut Notes) -> Result<Kind> {
    let body = &bodies[index];
    let parent_moves = !matches!(bodies[body.parent].kind, Kind::Still);
    if parent_moves {
        return body.element.wrong("a body in a body that moves is not read");
    }
    let (joint, turn) = match &body.joints[..] {
        [] => return Ok(Kind::Still),
        [joint] => joint,
        [_, (second, _), ..] => return second.wrong("a body with several joints is not read"),
    };
    if body.is_mocap {
        return joint.wrong("a mocap body has no joints");
    }
    let kind = if joint.tag == "freejoint" { "free" } else { joint.text("type").unwrap_or("hinge") };
    match kind {
        "free" if body.parent != 0 => joint.wrong("a body that moves freely must be in the world"),
        "free" => {
            let read = ["name", "type", "damping", "stiffness", "armature", "frictionloss", "align", "limited"];
            joint.knows(&read, &["group", "user"])?;
            for name in ["damping", "stiffness", "armature", "frictionloss"] {
                if joint.number(name, 0.0)? != 0.0 {
                    return joint.must_be(name, "0");
                }
            }
            Ok(Kind::Free)
        }
        "slide" => slide(joint, turn, autolimits, notes).map(Kind::Slide),
        _ if joint.has("type") => joint.must_be("type", "free or slide: other joints of bodies are not read"),
        _ => joint.wrong("a hinge: free and slide joints of bodies are read"),
    }
}

fn slide(joint: &Element, turn: &UnitQuaternion<f64>, autolimits: bool, notes: &mut Notes) -> Result<Slide> {
    const READ: [&str; 12] = [
        "name",
        "type",
        "axis",
        "pos",
        "damping",
        "stiffness",
        "springref",
        "ref",
        "range",
        "limited",
        "armature",
        "frictionloss",
    ];
    const HARMLESS: [&str; 6] = ["group", "user", "solreflimit", "solimplimit", "solreffriction", "solimpfriction"];
    joint.knows(&READ, &[&HARMLESS[..], &["margin"]].concat())?;
    let limited = joint.choice("limited", &["auto", "true", "false"], "auto")?;
    if limited == "true" || limited == "auto" && autolimits && joint.has("range") {
        return joint.at(if joint.has("range") { "range" } else { "limited" }, "slides without limits are read");
    }
    for name in ["springref", "ref", "frictionloss"] {
        if joint.number(name, 0.0)? != 0.0 {
            return joint.must_be(name, "0");
        }
    }
    for (name, unit) in [("damping", "N s/m"), ("armature", "kg")] {
        if joint.not_negative(name, unit)? > 0.0 {
            notes.say(joint, &format!("{name} of the slide is left out: its motion differs, rest is the same"));
        }
    }
    let axis = joint.vector("axis")?.unwrap_or(Vector3::z());
    let Some(axis) = Unit::try_new(axis, 1e-12) else { return joint.must_be("axis", "other than zero") };
    Ok(Slide { joint: joint.clone(), axis: turn * axis, stiffness: joint.not_negative("stiffness", "N/m")? })
}
