//! What holds and joins cables, from joints and constraints: fixed segments, pinned ends, joins, and links of one rigid segment for
//! what a scene has no other word for (a body on a slide, a place in the world that a cable's inside is held at).

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Unit, Vector3};

use crate::cable::{Cable, Initial};
use crate::equality::{Constraint, Side};
use crate::error::Result;
use crate::option::Notes;
use crate::world::{Body, Kind, Slide, World};
use crate::xml::Element;

/// How near to an end face, in lengths of a segment, a place is taken for it.
const AT_FACE: f64 = 0.02;
/// How far from a segment's axis, in its lengths, a place is taken to be on it.
const ON_AXIS: f64 = 0.01;
/// How much stiffer than the cable links are.
const RIGID: f64 = 1e3;

/// A place on a rod: its name, a segment and a fraction of it.
#[derive(Clone, Debug)]
pub(crate) struct Place {
    pub(crate) rod: String,
    pub(crate) segment: usize,
    pub(crate) fraction: f64,
}

/// A rod of one rigid segment.
pub(crate) struct Link {
    pub(crate) element: Element,
    pub(crate) name: String,
    pub(crate) centre: Vector3<f64>,
    pub(crate) axis: Unit<Vector3<f64>>,
    pub(crate) length: f64,
    pub(crate) radius: f64,
    /// [N m^2]
    pub(crate) bending: f64,
    /// [kg]
    pub(crate) mass: f64,
    /// The body on a slide that it stands for, and the stiffness of the slide [N/m]; `None` of one that stays where it is.
    pub(crate) slide: Option<(usize, f64)>,
}

impl Link {
    fn start(&self) -> Vector3<f64> {
        self.centre - self.axis.into_inner() * (0.5 * self.length)
    }
}

/// What is held of a cable.
#[derive(Clone, Debug, Default)]
pub(crate) struct Holds {
    /// Segments that stay where they are.
    pub(crate) fixed: BTreeSet<usize>,
    /// End faces that are pinned, and what says so.
    pub(crate) pins: [Option<Element>; 2],
    /// The rigid body on which it starts.
    pub(crate) branch_of: Option<usize>,
}

/// The other side of a join.
pub(crate) enum Partner {
    Rod(Place),
    /// A body of the file.
    Body(usize),
}

/// A join of two rods, or of a rod and a rigid body.
pub(crate) struct Join {
    pub(crate) element: Element,
    pub(crate) a: Place,
    pub(crate) b: Partner,
    pub(crate) joint: &'static str,
}

/// What a scene says beyond shapes and materials.
pub(crate) struct Plan<'a> {
    pub(crate) world: &'a World,
    pub(crate) notes: Notes,
    /// Names of rods, bodies and obstacles so far.
    names: BTreeSet<String>,
    /// Of the cables.
    pub(crate) rods: Vec<String>,
    /// Of the bodies of the file that move freely.
    pub(crate) bodies: BTreeMap<usize, String>,
    pub(crate) holds: Vec<Holds>,
    pub(crate) links: Vec<Link>,
    pub(crate) joins: Vec<Join>,
    /// Bodies that are welded to what stays where it is.
    pub(crate) fixed: BTreeSet<usize>,
    /// What motors would do, as comments: the index of a cable, and a line.
    pub(crate) motors: Vec<(usize, String)>,
    /// Stiffness that actuators add to slides [N/m], by body.
    servos: BTreeMap<usize, f64>,
}

impl<'a> Plan<'a> {
    pub(crate) fn new(world: &'a World) -> Result<Self> {
        let mut plan = Self {
            world,
            notes: world.notes.clone(),
            names: BTreeSet::new(),
            rods: Vec::new(),
            bodies: BTreeMap::new(),
            holds: vec![Holds::default(); world.cables.len()],
            links: Vec::new(),
            joins: Vec::new(),
            fixed: BTreeSet::new(),
            motors: Vec::new(),
            servos: BTreeMap::new(),
        };
        for cable in &world.cables {
            let name = plan.name(Some(cable.prefix.trim_end_matches('_')).filter(|name| !name.is_empty()), "cable");
            plan.rods.push(name);
        }
        for (index, body) in world.bodies.iter().enumerate().filter(|(_, body)| matches!(body.kind, Kind::Free)) {
            let name = plan.name(body.name(), "body");
            plan.bodies.insert(index, name);
        }
        for (index, cable) in world.cables.iter().enumerate() {
            plan.begin(index, cable)?;
        }
        plan.actuators()?;
        for constraint in world.constraints(&mut plan.notes)? {
            plan.hold(&constraint)?;
        }
        for (index, body) in world.bodies.iter().enumerate() {
            if let Kind::Slide(slide) = &body.kind
                && plan.links.iter().all(|link| link.slide.is_none_or(|(known, _)| known != index))
            {
                return slide.joint.wrong("a body on a slide that holds no cable is not read");
            }
        }
        Ok(plan)
    }

    /// A name that nothing has yet: the given one, or that of its kind.
    pub(crate) fn name(&mut self, given: Option<&str>, kind: &str) -> String {
        let own = given.unwrap_or(kind);
        let numbered = (1..).map(|k| if k == 1 { own.to_owned() } else { format!("{own}-{k}") });
        let name = numbered.filter(|name| !self.names.contains(name)).take(1).collect::<String>();
        self.names.insert(name.clone());
        name
    }

    /// Holds a cable's first segment as its `initial` says.
    fn begin(&mut self, index: usize, cable: &Cable) -> Result<()> {
        let (world, holds) = (self.world, &mut self.holds[index]);
        match (&world.bodies[cable.body].kind, cable.initial) {
            (Kind::Still, Initial::Fixed) => {
                holds.fixed.insert(0);
            }
            (Kind::Still, Initial::Ball) => holds.pins[0] = Some(cable.element.clone()),
            (Kind::Still, Initial::Free) if cable.body == 0 => {}
            (_, Initial::Free) => return cable.element.at("initial", "a cable that is free is in the world"),
            (Kind::Free, Initial::Fixed) => {
                holds.branch_of = Some(cable.body);
                let message =
                    "the first segment yields to its body as to a clamped face; in MuJoCo it is a part of the body";
                self.notes.say(&cable.element, message);
            }
            (Kind::Free, Initial::Ball) => {
                return cable.element.wrong("a ball joint to a body that moves is not read; initial=\"none\" is");
            }
            (Kind::Slide(_), _) => {
                return cable.element.wrong("a cable in a body on a slide is not read; connect or weld is");
            }
        }
        Ok(())
    }

    fn hold(&mut self, constraint: &Constraint) -> Result<()> {
        let element = &constraint.element;
        let (first, second) = (constraint.sides[0], constraint.sides[1]);
        let is_still = |side| matches!(side, Side::Body(k) if matches!(self.world.bodies[k].kind, Kind::Still));
        match (first, second) {
            (Side::Segment { cable, segment }, other) if is_still(other) => {
                self.hold_still(element, cable, segment, constraint.place)
            }
            (other, Side::Segment { cable, segment }) if is_still(other) => {
                self.hold_still(element, cable, segment, constraint.place)
            }
            (Side::Segment { cable, segment }, Side::Body(body))
            | (Side::Body(body), Side::Segment { cable, segment }) => {
                self.hold_to_body(element, (cable, segment), body, constraint.place)
            }
            (Side::Segment { cable, segment }, Side::Segment { cable: other, segment: theirs }) => {
                let (place, joint) = match constraint.place {
                    Some(place) => (place, "ball"),
                    None => (self.near(cable, segment, &self.world.cables[other].nodes[theirs]), "rigid"),
                };
                let a = self.on_cable(element, cable, segment, &place)?;
                let b = self.on_cable(element, other, theirs, &place)?;
                self.joins.push(Join { element: element.clone(), a, b: Partner::Rod(b), joint });
                Ok(())
            }
            (Side::Body(body), other) | (other, Side::Body(body))
                if is_still(other)
                    && constraint.place.is_none()
                    && matches!(self.world.bodies[body].kind, Kind::Free) =>
            {
                self.fixed.insert(body);
                Ok(())
            }
            _ => element.wrong("is read where one side is a cable, or a weld holds a body where it is"),
        }
    }

    /// Holds a segment of a cable to what stays where it is: in a place, or altogether.
    fn hold_still(
        &mut self,
        element: &Element,
        cable: usize,
        segment: usize,
        place: Option<Vector3<f64>>,
    ) -> Result<()> {
        let own = &self.world.cables[cable];
        let Some(place) = place else {
            self.holds[cable].fixed.insert(segment);
            return Ok(());
        };
        let on = self.on_cable(element, cable, segment, &place)?;
        let (length, last) = (own.length(segment), own.count() - 1);
        for (face, (at, fraction)) in [(0, 0.0), (last, 1.0)].into_iter().enumerate() {
            let off = (on.fraction - fraction).abs();
            if segment == at && off <= AT_FACE {
                if off > 1e-6 {
                    let message = format!("holds the end face, {:.3e} m from its anchor", off * length);
                    self.notes.say(element, &message);
                }
                self.holds[cable].pins[face] = Some(element.clone());
                return Ok(());
            }
        }
        let name = self.name(element.text("name"), "post");
        let link = Link {
            element: element.clone(),
            name,
            centre: place,
            axis: Unit::new_normalize(own.tangent(segment)),
            length: own.section.radius(),
            radius: own.section.radius(),
            bending: RIGID * own.bending(),
            mass: own.density * own.section.radius().powi(3),
            slide: None,
        };
        self.join(element, on, link, "ball");
        Ok(())
    }

    /// Joins a segment of a cable to a body that moves.
    fn hold_to_body(
        &mut self,
        element: &Element,
        (cable, segment): (usize, usize),
        body: usize,
        place: Option<Vector3<f64>>,
    ) -> Result<()> {
        let own = &self.world.bodies[body];
        match (&own.kind, place) {
            (Kind::Slide(slide), place) => {
                let joint = if place.is_some() { "ball" } else { "rigid" };
                let place = place.unwrap_or_else(|| self.near(cable, segment, &own.pose.translation.vector));
                let on = self.on_cable(element, cable, segment, &place)?;
                let link = self.slider(body, own, slide, &self.world.cables[cable], place)?;
                self.join(element, on, link, joint);
                Ok(())
            }
            (_, Some(_)) => element
                .wrong("holds a cable and a body that moves freely at an angle that is free; a weld of both is read"),
            (_, None) => {
                let place = self.near(cable, segment, &own.pose.translation.vector);
                let a = self.on_cable(element, cable, segment, &place)?;
                self.notes.say(element, "yields as a clamped face does: half a segment bends; in MuJoCo both are one");
                self.joins.push(Join { element: element.clone(), a, b: Partner::Body(body), joint: "rigid" });
                Ok(())
            }
        }
    }

    /// The end of a segment that is nearer to a place.
    fn near(&self, cable: usize, segment: usize, place: &Vector3<f64>) -> Vector3<f64> {
        let nodes = &self.world.cables[cable].nodes;
        let [start, end] = [nodes[segment], nodes[segment + 1]];
        if (start - place).norm() < (end - place).norm() { start } else { end }
    }

    /// A place on a segment of a cable.
    fn on_cable(&self, element: &Element, cable: usize, segment: usize, place: &Vector3<f64>) -> Result<Place> {
        let own = &self.world.cables[cable];
        let (length, from) = (own.length(segment), place - own.nodes[segment]);
        let along = from.dot(&own.tangent(segment)) / length;
        let across = (from - own.tangent(segment) * (along * length)).norm();
        if across > ON_AXIS * length || !(-AT_FACE..=1.0 + AT_FACE).contains(&along) {
            let out = across.max(length * (along - 1.0).max(-along));
            return element.wrong(&format!("lies {out:.3e} m off the cable's segment, but must be on its axis"));
        }
        Ok(Place { rod: self.rods[cable].clone(), segment, fraction: along.clamp(0.0, 1.0) })
    }

    /// Joins a place to a link, which is a new one, or one that stands for the same body.
    fn join(&mut self, element: &Element, a: Place, link: Link, joint: &'static str) {
        let is_same = |known: &&Link| known.slide.is_some() && known.slide == link.slide;
        let fraction = |link: &Link, place: &Vector3<f64>| (place - link.start()).dot(&link.axis) / link.length;
        let (rod, fraction) = match self.links.iter().find(is_same) {
            Some(known) => (known.name.clone(), fraction(known, &link.centre)),
            None => (link.name.clone(), 0.5),
        };
        if !self.links.iter().any(|known| known.name == rod) {
            self.links.push(link);
        }
        let b = Partner::Rod(Place { rod, segment: 0, fraction });
        self.joins.push(Join { element: element.clone(), a, b, joint });
    }

    /// A body on a slide, as a link through a place.
    fn slider(&mut self, body: usize, own: &Body, slide: &Slide, cable: &Cable, place: Vector3<f64>) -> Result<Link> {
        let stiffness = slide.stiffness + self.servos.get(&body).copied().unwrap_or(0.0);
        let known = self.links.iter().find(|link| link.slide.is_some_and(|(known, _)| known == body));
        let name = match known {
            Some(link) => {
                let off = place - link.centre;
                if off.norm() > ON_AXIS * link.length {
                    return own.element.wrong("holds cables in two places; a body on a slide holds them in one");
                }
                link.name.clone()
            }
            None => self.name(own.name(), "slider"),
        };
        let mass = mass(own)?;
        if own.geoms.iter().any(|geom| !geom.touch.touches_nothing()) && self.world.options.contacts {
            self.notes.say(&own.element, "the body on the slide touches as a capsule of the cable's radius");
        }
        Ok(Link {
            element: own.element.clone(),
            name,
            centre: place,
            axis: slide.axis,
            length: 2.0 * cable.section.radius(),
            radius: cable.section.radius(),
            bending: RIGID * cable.bending(),
            mass,
            slide: Some((body, stiffness)),
        })
    }

    /// Reads what actuators do while their control is 0, which it is until a program sets it.
    fn actuators(&mut self) -> Result<()> {
        let world = self.world;
        for element in world.actuators.iter().filter(|_| world.options.actuation) {
            const READ: [&str; 12] = [
                "site",
                "joint",
                "gear",
                "ctrlrange",
                "ctrllimited",
                "kp",
                "kv",
                "name",
                "forcerange",
                "forcelimited",
                "dampratio",
                "refsite",
            ];
            if !matches!(element.tag.as_str(), "motor" | "position" | "velocity") {
                return element.wrong("motor, position and velocity are read of <actuator>");
            }
            element.knows(
                &READ,
                &["group", "user", "lengthrange", "cranklength", "actearly", "nsample", "delay", "interp"],
            )?;
            if let Some([least, most]) = element.exactly("ctrlrange")?
                && element.text("ctrllimited") != Some("false")
                && !(least..=most).contains(&0.0)
            {
                return element.must_be("ctrlrange", "a range with 0: control is 0 here");
            }
            let gear = element.numbers("gear")?.unwrap_or_default();
            let gear: [f64; 6] = std::array::from_fn(|k| {
                gear.get(k).copied().unwrap_or(if k == 0 && gear.is_empty() { 1.0 } else { 0.0 })
            });
            let slide = world.bodies.iter().position(|body| {
                matches!(&body.kind, Kind::Slide(slide) if element.has("joint") && slide.joint.text("name") == element.text("joint"))
            });
            match (element.tag.as_str(), slide) {
                ("motor", _) => {
                    self.notes.say(element, "exerts nothing: its control is 0 until a program sets it");
                    self.motor(element, &gear);
                }
                ("position", Some(body)) => {
                    for name in ["kv", "dampratio"] {
                        if element.number(name, 0.0)? != 0.0 {
                            self.notes.say(element, &format!("{name}, a damping, is left out; rest is the same"));
                        }
                    }
                    if element.has("forcerange") && element.text("forcelimited") != Some("false") {
                        return element.at("forcerange", "a spring has no limit");
                    }
                    let stiffness = element.positive("kp", 1.0, "N/m")? * gear[0].powi(2);
                    *self.servos.entry(body).or_insert(0.0) += stiffness;
                    let message =
                        "is a spring that holds the slide where it begins: its control is 0 until a program sets it";
                    self.notes.say(element, message);
                }
                ("velocity", Some(_)) => {
                    self.notes.say(element, "is left out: it damps while its control is 0; rest is the same");
                }
                _ => return element.wrong("is read on a slide joint alone"),
            }
        }
        Ok(())
    }

    /// Notes down what a motor on an end of a cable would do.
    fn motor(&mut self, element: &Element, gear: &[f64; 6]) {
        let site = element.text("site").unwrap_or_default();
        let on = |(index, cable): (usize, &'a Cable)| Some((index, cable, cable.segment_of(site, 'S')?));
        let Some((index, cable, segment)) = self.world.cables.iter().enumerate().find_map(on) else { return };
        let turn = cable.frame(segment).rotation;
        let at = if segment == 0 { "start-face" } else { "end-face" };
        let [force, torque] = [Vector3::new(gear[0], gear[1], gear[2]), Vector3::new(gear[3], gear[4], gear[5])];
        let mut parts = vec![format!("at = \"{at}\"")];
        for (key, value) in [("force_n", force), ("torque_n_m", torque)] {
            if value.norm() > 0.0 {
                parts.push(format!("{key} = {}", crate::toml::vector(&(turn * value))));
            }
        }
        let range = element.text("ctrlrange").map(|range| format!(", {range} at most")).unwrap_or_default();
        let comment = format!(
            "# A motor would be, in world axes and times its control{range}: loads = [{{ {} }}]",
            parts.join(", ")
        );
        self.motors.push((index, comment));
    }
}

/// The mass of a body [kg].
pub(crate) fn mass(body: &Body) -> Result<f64> {
    if let Some(inertial) = &body.inertial {
        inertial.required("mass")?;
        return inertial.positive("mass", 0.0, "kg");
    }
    let mut sum = 0.0;
    for geom in &body.geoms {
        match geom.weight() {
            Some(mass) => sum += mass,
            None => return geom.element.wrong("give the mass of a mesh"),
        }
    }
    match sum > 0.0 {
        true => Ok(sum),
        false => body.element.wrong("a body that moves needs a mass"),
    }
}
