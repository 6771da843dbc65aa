//! The scene's text: what moves and holds rods as the plan says, obstacles, rigid bodies, contacts.

use std::path::Path;

use nalgebra::{Isometry3, Point3, Vector3};

use crate::cable::{Cable, Section};
use crate::contact::Common;
use crate::converted::Converted;
use crate::equality::Side;
use crate::error::Result;
use crate::geom::{Geom, Shape};
use crate::plan::{Join, Link, Partner, Place, Plan, mass};
use crate::toml::{Writer, number, numbers, quaternion, quoted, vector};
use crate::world::{Body, Kind, World};

/// How long a scene runs [s]: files have no end.
const DURATION: f64 = 5.0;
/// Frames that are kept a second.
const FRAMES: f64 = 50.0;
/// Stiffness of a slide without a spring [N/m]: a grip cannot have none. Over a metre it pulls with 1e-6 N.
const FREE_SLIDE: f64 = 1e-6;
/// Angle between segments [rad] from which a cable counts as bent.
const BENT: f64 = 1e-3;
/// How far nodes may be from even places on a line, in its lengths.
const EVEN: f64 = 1e-9;

/// Writes a file's scene, which stands in a folder from which that of the file is seen as `folder`.
pub(crate) fn write(world: &World, path: &Path, folder: &Path) -> Result<Converted> {
    let mut plan = Plan::new(world)?;
    let mut body = Writer::default();
    contacts(&mut plan, &mut body, folder)?;
    bodies(&mut plan, &mut body, folder)?;
    for (index, cable) in world.cables.iter().enumerate() {
        rod(&plan, &mut body, index, cable);
    }
    for link in &plan.links {
        self::link(&mut body, link);
    }
    for join in &plan.joins {
        self::join(&plan, &mut body, join);
    }
    if world.cables.is_empty() && plan.bodies.is_empty() {
        return world.root.wrong("has neither a cable nor a body that moves");
    }
    let head = head(&mut plan, path);
    let (body, origins) = body.finish();
    let (head, _) = head.finish();
    let lines = head.lines().count();
    let origins = std::iter::repeat_n(String::new(), lines).chain(origins).collect();
    Ok(Converted { toml: head + &body, warnings: plan.notes.sentences(), origins })
}

/// What stands before the first table, and the run.
fn head(plan: &mut Plan, path: &Path) -> Writer {
    let options = &plan.world.options;
    if options.density > 0.0 {
        let message = "density and wind become [air]: the drag of cylinders across the wind, where MuJoCo takes boxes";
        plan.notes.say(&plan.world.root, message);
    }
    let mut head = Writer::default();
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    head.line(&format!("# From {}.", one_line(&file)));
    for sentence in plan.notes.sentences() {
        head.line(&format!("# - {}", one_line(&sentence)));
    }
    if let Some(model) = plan.world.root.text("model") {
        head.key("description", quoted(model));
    }
    head.key("gravity_m_s2", vector(&options.gravity));
    if plan.world.cables.iter().any(|cable| !cable.flat && cable.largest_angle() > BENT) {
        head.line("# Joints that are bent at rest are as stiff as their material, as in MuJoCo.");
        head.key("bending", "\"rest-rotation\"");
    }
    let whole = |value: f64| value.round().clamp(1.0, 1e9);
    head.line("").line("[run]");
    head.key("dt_s", number(options.timestep));
    head.line(&format!("# {DURATION} s: the file says no end."));
    head.key("steps", format!("{}", whole(DURATION / options.timestep)));
    head.key("every", format!("{}", whole(1.0 / (FRAMES * options.timestep))));
    if options.density > 0.0 {
        head.line("").line("[air]").key("density_kg_m3", number(options.density));
        head.key("wind.velocity_m_s", vector(&options.wind));
    }
    head
}

/// `text` in one line, for comments.
fn one_line(text: &str) -> String {
    text.replace(char::is_control, " ")
}

/// Contacts between what moves, and the obstacles.
fn contacts(plan: &mut Plan, body: &mut Writer, folder: &Path) -> Result<()> {
    let world = plan.world;
    let still: Vec<(usize, &Body)> =
        world.bodies.iter().enumerate().filter(|(_, body)| matches!(body.kind, Kind::Still)).collect();
    if !world.options.contacts {
        for geom in still.iter().flat_map(|(_, body)| &body.geoms) {
            plan.notes.say(&geom.element, "is left out: contacts are switched off");
        }
        return Ok(());
    }
    let cables: Vec<_> = world.cables.iter().map(|cable| cable.touch).collect();
    let free = |index: &usize| &world.bodies[*index].geoms;
    let others: Vec<_> = plan.bodies.keys().flat_map(free).map(|geom| geom.touch).collect();
    let among = |k: usize| cables[k..].iter().chain(&others).map(move |other| (k, other));
    let pairs = (0..cables.len()).flat_map(among).map(|(k, other)| cables[k].with(other));
    match Common::of(pairs) {
        Common::Mixed => {
            return world.cables[0].element.wrong(
                "cables and bodies that move touch each other with several coefficients of friction, or some of them do \
                 not; a scene has one for all of them",
            );
        }
        Common::Friction(friction) => {
            body.line("").line("[contact]").key("friction", number(friction));
        }
        Common::None if !others.is_empty() => {
            body.line("").line("[contact]").key("between_segments", "false");
        }
        Common::None => {}
    }
    let excluded = excluded(plan)?;
    for (index, own) in still {
        for geom in &own.geoms {
            if excluded.contains(&index) {
                let message =
                    "is left out, as its body is excluded from contacts with a cable: a scene has no excluded pairs";
                plan.notes.say(&geom.element, message);
                continue;
            }
            let touches = cables.iter().chain(&others).map(|other| geom.touch.with(other));
            let friction = match Common::of(touches) {
                Common::None => {
                    plan.notes.say(&geom.element, "touches nothing that moves, and is left out");
                    continue;
                }
                Common::Mixed => {
                    return geom.element.wrong(
                        "touches what moves with several coefficients of friction, or not all of it; an obstacle has one \
                         for all",
                    );
                }
                Common::Friction(friction) => friction,
            };
            let name = plan.name(geom.element.text("name").or(own.name()), "obstacle");
            body.of(&geom.element).line("").line("[[obstacles]]").key("name", quoted(&name));
            obstacle(body, geom, folder);
            if friction > 0.0 {
                body.key("friction", number(friction));
            }
        }
    }
    Ok(())
}

/// Bodies that stay where they are and are excluded from contacts with a cable.
fn excluded(plan: &mut Plan) -> Result<Vec<usize>> {
    let world = plan.world;
    let mut bodies = Vec::new();
    for (element, names) in &world.excluded {
        let mut sides = [Side::Body(0); 2];
        for (k, name) in names.iter().enumerate() {
            sides[k] = match world.side(name) {
                Some(side) => side,
                None => return element.at(["body1", "body2"][k], "there is no body of that name"),
            };
        }
        match sides {
            [Side::Segment { .. }, Side::Body(0)] | [Side::Body(0), Side::Segment { .. }] => {
                return element
                    .wrong("a cable touches the geoms of the world, or its geom says by contype that it does not");
            }
            [Side::Segment { .. }, Side::Body(body)] | [Side::Body(body), Side::Segment { .. }] => {
                match world.bodies[body].kind {
                    Kind::Still => bodies.push(body),
                    // What is joined does not touch.
                    Kind::Slide(_) => {}
                    Kind::Free => {
                        let message = "is left out: segments that are joined to a body do not touch it, others do";
                        plan.notes.say(element, message);
                    }
                }
            }
            [Side::Segment { cable, segment }, Side::Segment { cable: other, segment: theirs }] => {
                if cable != other || segment.abs_diff(theirs) > 1 {
                    plan.notes.say(element, "is left out: segments touch that are neither joined nor neighbours");
                }
            }
            // Rigid bodies do not touch each other.
            [Side::Body(_), Side::Body(_)] => {}
        }
    }
    Ok(bodies)
}

fn end(pose: &Isometry3<f64>, z: f64) -> String {
    vector(&(pose * nalgebra::Point3::new(0.0, 0.0, z)).coords)
}

fn obstacle(body: &mut Writer, geom: &Geom, folder: &Path) {
    let pose = &geom.pose;
    let centre = vector(&pose.translation.vector);
    match &geom.shape {
        Shape::Plane => {
            let normal = vector(&(pose.rotation * Vector3::z()));
            body.key("shape.plane", format!("{{ point_m = {centre}, normal = {normal} }}"));
        }
        Shape::Sphere(r) => {
            body.key("shape.sphere", format!("{{ centre_m = {centre}, radius_m = {} }}", number(*r)));
        }
        Shape::Capsule([r, half]) | Shape::Cylinder([r, half]) => {
            let kind = if matches!(geom.shape, Shape::Capsule(_)) { "capsule" } else { "cylinder" };
            let (start, end) = (end(pose, -half), end(pose, *half));
            let ends = format!("{{ start_m = {start}, end_m = {end}, radius_m = {} }}", number(*r));
            body.key(&format!("shape.{kind}"), ends);
        }
        Shape::Box(halves) => {
            let sides = numbers(&halves.map(|half| 2.0 * half));
            let turn = quaternion(&pose.rotation);
            body.key("shape.box", format!("{{ sides_m = {sides}, centre_m = {centre}, orientation = {turn} }}"));
        }
        Shape::Mesh(file, scale) => {
            let turn = quaternion(&pose.rotation);
            let mesh = mesh(file, *scale, folder);
            body.key("shape.mesh", format!("{{ {mesh}, position_m = {centre}, orientation = {turn} }}"));
        }
    }
}

fn mesh(file: &str, scale: f64, folder: &Path) -> String {
    format!("file = {}, scale = {}", quoted(&folder.join(file).to_string_lossy()), number(scale))
}

/// Rigid bodies that move freely.
fn bodies(plan: &mut Plan, body: &mut Writer, folder: &Path) -> Result<()> {
    let world = plan.world;
    for (index, name) in plan.bodies.clone() {
        let own = &world.bodies[index];
        let [geom] = &own.geoms[..] else {
            return own.element.wrong("a body that moves freely with one geom is read");
        };
        body.of(&own.element).line("").line("[[bodies]]").key("name", quoted(&name));
        let shape = match &geom.shape {
            Shape::Plane => return geom.element.wrong("a plane does not move"),
            Shape::Sphere(r) => format!("sphere = {{ radius_m = {} }}", number(*r)),
            Shape::Capsule([r, half]) => round("capsule", *r, *half),
            Shape::Cylinder([r, half]) => round("cylinder", *r, *half),
            Shape::Box(halves) => format!("box = {{ sides_m = {} }}", numbers(&halves.map(|half| 2.0 * half))),
            Shape::Mesh(file, scale) => {
                let centre = centre_of_mass(own)?.map(|centre| geom.pose.inverse_transform_point(&centre).coords);
                let centre =
                    centre.map_or_else(String::new, |centre| format!(", centre_of_mass_m = {}", vector(&centre)));
                format!("mesh = {{ {}{centre} }}", mesh(file, *scale, folder))
            }
        };
        body.line(&format!("shape.{shape}"));
        match (&own.inertial, geom.weight()) {
            (None, None) => {
                body.key("density_kg_m3", number(geom.density));
            }
            _ => {
                body.key("mass_kg", number(mass(own)?));
            }
        }
        if let Some(moments) = moments(own, geom)? {
            body.key("inertia_kg_m2", numbers(&moments));
        }
        body.key("position_m", vector(&geom.pose.translation.vector));
        body.key("orientation", quaternion(&geom.pose.rotation));
        if plan.fixed.contains(&index) {
            body.key("fixed", "true");
        }
        if geom.touch.touches_nothing() || !world.options.contacts {
            body.key("touches", "false");
        }
    }
    if plan.bodies.len() > 1 {
        let (index, _) = plan.bodies.first_key_value().expect("there are two");
        let message = "rigid bodies touch cables and obstacles, but not each other";
        plan.notes.say(&world.bodies[*index].element, message);
    }
    Ok(())
}

fn round(kind: &str, radius: f64, half: f64) -> String {
    format!("{kind} = {{ radius_m = {}, length_m = {} }}", number(radius), number(2.0 * half))
}

/// The centre of mass that a body gives, in the world [m].
fn centre_of_mass(own: &Body) -> Result<Option<Point3<f64>>> {
    let Some(inertial) = &own.inertial else { return Ok(None) };
    Ok(Some(own.pose * Point3::from(inertial.vector("pos")?.unwrap_or_default())))
}

/// Moments of inertia that a body gives [kg m^2]: about the axes of its geom, through its centre.
fn moments(own: &Body, geom: &Geom) -> Result<Option<[f64; 3]>> {
    let Some(inertial) = &own.inertial else { return Ok(None) };
    inertial.knows(&["mass", "pos", "diaginertia", "quat"], &[])?;
    // A mesh may have it anywhere.
    let is_middle = |centre: Point3<f64>| (centre.coords - geom.pose.translation.vector).norm() <= 1e-9;
    if !matches!(geom.shape, Shape::Mesh(..)) && !centre_of_mass(own)?.is_none_or(is_middle) {
        return inertial.at("pos", "the centre of mass must be that of the geom");
    }
    let is_turned = inertial.exactly::<4>("quat")?.is_some_and(|q| q != [1.0, 0.0, 0.0, 0.0]);
    if is_turned || own.pose.rotation.angle_to(&geom.pose.rotation) > 1e-9 {
        return inertial.wrong("its axes must be those of the geom and of the body");
    }
    let Some(moments) = inertial.exactly::<3>("diaginertia")? else {
        return inertial.wrong("the attribute diaginertia is missing");
    };
    Ok(Some(moments))
}

/// A cable.
fn rod(plan: &Plan, body: &mut Writer, index: usize, cable: &Cable) {
    let holds = &plan.holds[index];
    body.of(&cable.element).line("").line("[[rods]]").key("name", quoted(&plan.rods[index]));
    let (start, end) = (cable.nodes[0], cable.nodes[cable.count()]);
    let (way, count) = (end - start, cable.count() as f64);
    let is_even =
        |(k, node): (usize, &Vector3<f64>)| (start + way * (k as f64 / count) - node).norm() <= EVEN * way.norm();
    if holds.branch_of.is_none() && way.norm() > 0.0 && cable.nodes.iter().enumerate().all(is_even) {
        let (start, along) = (vector(&start), vector(&way.normalize()));
        let length = number(way.norm());
        body.key(
            "shape.straight",
            format!("{{ start_m = {start}, direction = {along}, length_m = {length}, segments = {} }}", cable.count()),
        );
    } else {
        body.line("shape.polyline.nodes_m = [");
        for node in &cable.nodes {
            body.line(&format!("    {},", vector(node)));
        }
        body.line("]");
    }
    if let Section::Rectangle([width, height]) = cable.section {
        body.key("section.rectangle", format!("{{ width_m = {}, height_m = {} }}", number(width), number(height)));
        body.key("frame.d1", vector(&cable.normals[0]));
    }
    body.key("radius_m", number(cable.section.radius()));
    body.key("youngs_modulus_pa", number(cable.moduli[0]));
    body.key("torsion_modulus_pa", number(cable.moduli[1]));
    body.key("density_kg_m3", number(cable.density));
    if cable.flat {
        body.key("rest", "\"straight\"");
    }
    if cable.relaxation[0] > 0.0 {
        let [bending, twist] = cable.relaxation.map(number);
        body.key("inner_damping", format!("{{ bending_s = {bending}, twist_s = {twist} }}"));
    }
    if let Some(of) = holds.branch_of {
        let own = &plan.world.bodies[of];
        let frame = own.geoms.first().map_or(own.pose, |geom| geom.pose);
        let at = vector(&frame.inverse_transform_point(&start.into()).coords);
        body.key("branch_of", format!("{{ body = {}, at_m = {at} }}", quoted(&plan.bodies[&of])));
    }
    let last = cable.count() - 1;
    let ends = [(0, "start-segment"), (last, "end-segment")];
    let clamps: Vec<String> = ends
        .iter()
        .filter(|(k, _)| holds.fixed.contains(k))
        .map(|(_, name)| quoted(name))
        .take(1 + last.min(1))
        .collect();
    if !clamps.is_empty() {
        body.key("clamp", format!("[{}]", clamps.join(", ")));
    }
    let inside: Vec<String> =
        holds.fixed.iter().filter(|&&k| k != 0 && k != last).map(|segment| segment.to_string()).collect();
    if !inside.is_empty() {
        body.key("fixed_segments", format!("[{}]", inside.join(", ")));
    }
    for (_, comment) in plan.motors.iter().filter(|(own, _)| *own == index) {
        body.line(&one_line(comment));
    }
    for (face, says) in ["start-face", "end-face"].iter().zip(&holds.pins) {
        if let Some(element) = says {
            body.of(element).line("").line("[[rods.grips]]").key("at", quoted(face)).key("joint", "\"ball\"");
        }
    }
}

/// A link of one rigid segment.
fn link(body: &mut Writer, link: &Link) {
    let what = if link.slide.is_some() { "A body on a slide" } else { "A place in the world" };
    body.of(&link.element).line("").line(&format!("# {what}, as one stiff segment.")).line("[[rods]]");
    body.key("name", quoted(&link.name));
    let start = link.centre - link.axis.into_inner() * (0.5 * link.length);
    let (start, axis, length) = (vector(&start), vector(&link.axis), number(link.length));
    body.key(
        "shape.straight",
        format!("{{ start_m = {start}, direction = {axis}, length_m = {length}, segments = 1 }}"),
    );
    body.key("radius_m", number(link.radius));
    let (bending, mass) = (number(link.bending), number(link.mass / link.length));
    body.key(
        "section.stiffness",
        format!("{{ bending_n_m2 = [{bending}, {bending}], torsion_n_m2 = {bending}, mass_kg_m = {mass} }}"),
    );
    match link.slide {
        None => {
            body.key("fixed_segments", "[0]");
        }
        Some((_, stiffness)) => {
            if stiffness < FREE_SLIDE {
                body.line(&format!("# The slide is free: {} N/m stand for none.", number(FREE_SLIDE)));
            }
            let stiffness = number(stiffness.max(FREE_SLIDE));
            body.key("grips", format!("[{{ at = \"start-face\", stiffness_n_m = [inf, {stiffness}] }}]"));
        }
    }
}

fn join(plan: &Plan, body: &mut Writer, join: &Join) {
    let place = |place: &Place| {
        let (rod, fraction) = (quoted(&place.rod), number(place.fraction));
        format!("{{ rod = {rod}, segment = {}, fraction = {fraction} }}", place.segment)
    };
    body.of(&join.element).line("").line("[[joins]]").key("a", place(&join.a));
    match &join.b {
        Partner::Rod(b) => {
            body.key("b", place(b)).key("joint", quoted(join.joint));
        }
        Partner::Body(index) => {
            body.key("b", format!("{{ body = {} }}", quoted(&plan.bodies[index])));
        }
    }
}
