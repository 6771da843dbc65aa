//! USD as text: curves with widths for rods, meshes for rigid bodies and obstacles, and their motion as time samples.
//!
//! Prims and attributes are those of OpenUSD's `UsdGeom` (BasisCurves, Mesh, Xform). Rest shapes, masses and stiffnesses stand in the
//! attributes of the Alliance for OpenUSD's proposed schema of deformable bodies (`PhysicsCurvesDeformableSimAPI`,
//! `PhysicsCurvesDeformableMaterialAPI`), which programs that do not know it pass over.

use std::collections::BTreeSet;
use std::fmt::{self, Display};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use nalgebra::{UnitQuaternion, Vector3};
use rod::{Model, Pose, State};

use super::centrelines::{Centrelines, Chain};
use super::frame::Frame;
use super::solids::{OBSTACLE, ROD, Solid};
use crate::file::stage;
use crate::{ExportError, Format, Names, TrajectoryReader};

/// Name of the file.
const FILE: &str = "run.usda";
/// Frames a second where those of the run are not evenly spaced in time.
pub(super) const UNEVEN_RATE: f64 = 24.0;
/// Nodes times frames that are in memory at once; the trajectory is read once for each part of that size.
const PLACES_AT_ONCE: usize = 4 << 20;
/// Relative difference of numbers that are alike but for rounding.
const ROUNDING: f64 = 1e-9;

/// Writes `run.usda`. Each entry of the scene is a BasisCurves prim with a curve a rod; open and closed rods of one entry are two.
/// Curves have the name of the body that they are in, since Blender drops a parent with a single child.
/// Time codes are numbers of frames where these are evenly spaced in time, else seconds times 24.
pub(super) fn write(
    directory: &Path,
    trajectory: &mut TrajectoryReader,
    model: &Model,
    names: &Names,
) -> Result<Vec<PathBuf>, ExportError> {
    if trajectory.frames() == 0 {
        return Err(ExportError::Format { format: Format::Usda, reason: "it has no frame".to_owned() });
    }
    let (lines, solids) = (Centrelines::new(model), Solid::all(model, trajectory)?);
    let clock = Clock::new(&trajectory.times()?);
    let mut first = Frame::default();
    first.read(trajectory, 0)?;
    let mut identifiers = Identifiers::default();
    let curves = Curves::all(model, names, &lines, &mut identifiers);
    let mut title = trajectory.info().scene.clone();
    for frame in 1..trajectory.frames() {
        if let Some((mode, frequency)) =
            trajectory.mode(frame).filter(|_| trajectory.mode(frame) != trajectory.mode(frame - 1))
        {
            title += &format!(", from frame {frame} on mode {mode}, {frequency:.6} Hz");
        }
    }
    let file = stage(&directory.join(FILE), |writer| {
        write_header(writer, &title, &clock)?;
        for curves in &curves {
            curves.write_material(writer)?;
        }
        for part in parts(&curves, clock.codes.len()) {
            let places = places(part, model, &lines, trajectory).map_err(io::Error::other)?;
            let mut before = 0;
            for curves in part {
                let own = before..before + curves.nodes;
                curves.write(writer, model, &lines, &first.state, |frame| &places[frame][own.clone()], &clock)?;
                before = own.end;
            }
        }
        let poses = poses(&solids, model, trajectory).map_err(io::Error::other)?;
        for (solid, poses) in solids.iter().zip(&poses) {
            let name = identifiers.add(&solid.name(model, names));
            write_solid(writer, &name, solid, poses, &clock)?;
        }
        writeln!(writer, "}}")
    })?;
    Ok(vec![file.publish()?])
}

/// Time codes of the frames.
struct Clock {
    /// Codes a second.
    rate: f64,
    codes: Vec<f64>,
}

impl Clock {
    fn new(times: &[f64]) -> Self {
        let count = times.len();
        let span = times.last().unwrap_or(&0.0) - times.first().unwrap_or(&0.0);
        let step = span / (count.max(2) - 1) as f64;
        let is_even = |(k, time): (usize, &f64)| (time - times[0] - k as f64 * step).abs() <= 1e-6 * step;
        if !times.windows(2).all(|pair| pair[0] < pair[1]) || count < 2 {
            // Frames of modes, or a single one.
            return Self { rate: UNEVEN_RATE, codes: (0..count).map(|k| k as f64).collect() };
        }
        if !times.iter().enumerate().all(is_even) {
            return Self { rate: UNEVEN_RATE, codes: times.iter().map(|time| time * UNEVEN_RATE).collect() };
        }
        let rate = 1.0 / step;
        let whole = rate.round();
        let rate = if (rate - whole).abs() <= ROUNDING.sqrt() * whole { whole } else { rate };
        let start = (times[0] * rate).round();
        Self { rate, codes: (0..count).map(|k| start + k as f64).collect() }
    }

    /// Writes an attribute's value at each frame.
    fn samples<D: Display>(&self, writer: &mut impl Write, value: impl Fn(usize) -> D) -> io::Result<()> {
        writeln!(writer, ".timeSamples = {{")?;
        for (frame, code) in self.codes.iter().enumerate() {
            writeln!(writer, "                {code}: {},", value(frame))?;
        }
        writeln!(writer, "            }}")
    }
}

/// Identifiers of prims, each of which is given once.
#[derive(Default)]
struct Identifiers(BTreeSet<String>);

impl Identifiers {
    /// A name as an identifier: letters, digits and underscores, no digit first, unlike those before it.
    fn add(&mut self, name: &str) -> Prim {
        let kept = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
        let mut identifier: String = name.chars().map(kept).collect();
        if !identifier.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
            identifier.insert(0, '_');
        }
        let mut unique = identifier.clone();
        for k in 2.. {
            if self.0.insert(unique.clone()) {
                break;
            }
            unique = format!("{identifier}_{k}");
        }
        Prim { identifier: unique, name: name.to_owned() }
    }
}

/// What a prim is called.
struct Prim {
    identifier: String,
    /// As in the scene.
    name: String,
}

/// A text in quotation marks.
struct Quoted<'a>(&'a str);

impl Display for Quoted<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let escaped = self.0.replace('\\', "\\\\").replace('"', "\\\"").replace(['\n', '\r'], " ");
        write!(f, "\"{escaped}\"")
    }
}

/// A list of values in square brackets.
struct List<I>(I);

impl<I: Iterator<Item = T> + Clone, T: Display> Display for List<I> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "[")?;
        for (k, value) in self.0.clone().enumerate() {
            write!(f, "{}{value}", if k == 0 { "" } else { ", " })?;
        }
        write!(f, "]")
    }
}

/// A tuple of numbers in single precision, with all their digits.
struct Tuple<const N: usize>([f32; N]);

impl<const N: usize> Display for Tuple<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "(")?;
        for (k, value) in self.0.iter().enumerate() {
            write!(f, "{}{value:?}", if k == 0 { "" } else { ", " })?;
        }
        write!(f, ")")
    }
}

fn tuple(x: &Vector3<f64>) -> Tuple<3> {
    Tuple(x.map(|x| x as f32).into())
}

fn write_header(writer: &mut impl Write, title: &str, clock: &Clock) -> io::Result<()> {
    let (start, end) = (clock.codes.first().unwrap_or(&0.0), clock.codes.last().unwrap_or(&0.0));
    let rate = clock.rate;
    writeln!(
        writer,
        "#usda 1.0\n(\n    defaultPrim = \"Run\"\n    doc = {}\n    startTimeCode = {start}\n    endTimeCode = {end}\n    \
         timeCodesPerSecond = {rate}\n    framesPerSecond = {rate}\n    metersPerUnit = 1\n    kilogramsPerUnit = 1\n    \
         upAxis = \"Z\"\n)\n\ndef Xform \"Run\" (\n    kind = \"component\"\n)\n{{",
        Quoted(title)
    )
}

/// The rods of one entry of the scene that are all open, or all closed.
struct Curves<'a> {
    prim: Prim,
    /// Its material's.
    material_prim: Prim,
    chains: Vec<&'a Chain>,
    closed: bool,
    /// Nodes of all its rods.
    nodes: usize,
    /// Mass [kg].
    mass: f64,
    material: Material,
}

impl<'a> Curves<'a> {
    fn all(model: &Model, names: &Names, lines: &'a Centrelines, identifiers: &mut Identifiers) -> Vec<Self> {
        let mut groups: Vec<(String, bool, Vec<&Chain>)> = Vec::new();
        for chain in lines.chains.iter().filter(|chain| model.segments[lines.first(chain)].body.is_none()) {
            let name = names.rod(chain.rod);
            // Rods of an entry follow each other.
            let alike = entry(&name).and_then(|entry| {
                groups.iter_mut().rev().take(2).find(|(own, closed, _)| own == entry && *closed == chain.closed)
            });
            match alike {
                Some((_, _, chains)) => chains.push(chain),
                None => groups.push((entry(&name).unwrap_or(&name).to_owned(), chain.closed, vec![chain])),
            }
        }
        let curves = |(name, closed, chains): (String, bool, Vec<&'a Chain>)| {
            let nodes = chains.iter().map(|chain| chain.nodes.len()).sum();
            let of = |chain: &&Chain| segments(lines, chain).map(|i| model.segments[i].mass()).sum::<f64>();
            let mass = chains.iter().map(of).sum();
            let material = Material::of(model, lines, &chains);
            let prim = identifiers.add(&name);
            let material_prim = identifiers.add(&format!("{}_material", prim.identifier));
            Self { prim, material_prim, chains, closed, nodes, mass, material }
        };
        groups.into_iter().map(curves).collect()
    }

    fn write_material(&self, writer: &mut impl Write) -> io::Result<()> {
        let Material { thickness, stretch, shear, bend, twist } = self.material;
        writeln!(
            writer,
            "    def Material \"{}\" (\n        prepend apiSchemas = [\"PhysicsCurvesDeformableMaterialAPI\"]\n    )\n    {{",
            self.material_prim.identifier
        )?;
        let numbers = [
            ("Thickness", thickness),
            ("StretchStiffness", stretch),
            ("ShearStiffness", shear),
            ("BendStiffness", bend),
            ("TwistStiffness", twist),
        ];
        for (name, value) in numbers {
            if let Some(value) = value {
                writeln!(writer, "        float physics:curves{name} = {:?}", value as f32)?;
            }
        }
        writeln!(writer, "    }}\n")
    }

    fn write<'b>(
        &self,
        writer: &mut impl Write,
        model: &Model,
        lines: &Centrelines,
        first: &State,
        places: impl Fn(usize) -> &'b [[f32; 3]],
        clock: &Clock,
    ) -> io::Result<()> {
        let Prim { identifier, name } = &self.prim;
        writeln!(
            writer,
            "    def Xform \"{identifier}\" (\n        displayName = {}\n        prepend apiSchemas = [\"PhysicsDeformableBodyAPI\"]\n    \
             )\n    {{\n        float physics:mass = {:?}\n\n        def BasisCurves \"{identifier}\" (\n            prepend apiSchemas = \
             [\"PhysicsCurvesDeformableSimAPI\", \"MaterialBindingAPI\"]\n        )\n        {{",
            Quoted(name),
            self.mass as f32
        )?;
        let own = self.chains.iter().flat_map(|chain| &lines.nodes[chain.nodes.clone()]);
        let widths = own.map(|node| 2.0 * node.radius(model) as f32);
        let rest: Vec<Vector3<f64>> =
            self.chains.iter().flat_map(|chain| rest_shape(model, lines, chain, first)).collect();
        writeln!(writer, "            uniform token type = \"linear\"")?;
        writeln!(
            writer,
            "            uniform token wrap = \"{}\"",
            if self.closed { "periodic" } else { "nonperiodic" }
        )?;
        writeln!(
            writer,
            "            int[] curveVertexCounts = {}",
            List(self.chains.iter().map(|chain| chain.nodes.len()))
        )?;
        writeln!(
            writer,
            "            float[] widths = {} (\n                interpolation = \"vertex\"\n            )",
            List(widths)
        )?;
        writeln!(writer, "            color3f[] primvars:displayColor = [{}]", Tuple(ROD.map(|x| x as f32)))?;
        writeln!(writer, "            point3f[] physics:restShapePoints = {}", List(rest.iter().map(tuple)))?;
        writeln!(writer, "            rel material:binding:physics = </Run/{}>", self.material_prim.identifier)?;
        write!(writer, "            point3f[] points")?;
        clock.samples(writer, |frame| List(places(frame).iter().map(|&place| Tuple(place))))?;
        writeln!(writer, "        }}\n    }}\n")
    }
}

/// The name of the scene's entry that a rod with others comes from: `hair` of `hair/12`.
fn entry(name: &str) -> Option<&str> {
    let (entry, number) = name.rsplit_once('/')?;
    (!entry.is_empty() && number.bytes().all(|c| c.is_ascii_digit())).then_some(entry)
}

/// What is alike along all rods of a prim; `None` where it is not.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Material {
    /// Diameter [m].
    thickness: Option<f64>,
    /// EA and GA [N].
    stretch: Option<f64>,
    shear: Option<f64>,
    /// EI and GJ [N m^2].
    bend: Option<f64>,
    twist: Option<f64>,
}

impl Material {
    fn of(model: &Model, lines: &Centrelines, chains: &[&Chain]) -> Self {
        let joints = || chains.iter().flat_map(|chain| inner_joints(lines, chain)).map(|k| &model.joints[k]);
        let radii = chains.iter().flat_map(|chain| segments(lines, chain)).map(|i| model.segments[i].radius);
        Self {
            thickness: alike(radii.map(|radius| 2.0 * radius)),
            stretch: alike(joints().map(|joint| joint.length / joint.stretch_compliance)),
            // Sections that shear or bend unlike along d1 and d2 have no single stiffness.
            shear: alike(joints().map(|joint| match joint.shear_extra {
                0.0 => joint.length / joint.shear_compliance,
                _ => f64::NAN,
            })),
            bend: alike(joints().map(|joint| match joint.bend_extra {
                0.0 => 1.0 / (joint.length * joint.bend_compliance),
                _ => f64::NAN,
            })),
            twist: alike(joints().map(|joint| 1.0 / (joint.length * joint.twist_compliance))),
        }
    }
}

/// The number that all are, but for rounding, if it is finite.
fn alike(mut numbers: impl Iterator<Item = f64>) -> Option<f64> {
    let first = numbers.next().filter(|first| first.is_finite())?;
    numbers.all(|number| (number - first).abs() <= ROUNDING * first.abs()).then_some(first)
}

/// Segments of a chain in their order.
fn segments(lines: &Centrelines, chain: &Chain) -> impl Iterator<Item = usize> {
    lines.nodes[chain.nodes.clone()].iter().filter_map(|node| node.after)
}

/// Joints between two segments of a chain.
fn inner_joints(lines: &Centrelines, chain: &Chain) -> impl Iterator<Item = usize> {
    let inner = lines.nodes[chain.nodes.clone()].iter().filter(|node| node.before.is_some() && node.after.is_some());
    inner.filter_map(|node| node.joint)
}

/// Nodes of a rod without forces, placed so that its first segment is where it is in a state [m].
fn rest_shape(model: &Model, lines: &Centrelines, chain: &Chain, state: &State) -> Vec<Vector3<f64>> {
    let nodes = &lines.nodes[chain.nodes.clone()];
    let first = lines.first(chain);
    let mut turn: UnitQuaternion<f64> = state.orientations[first];
    let mut end = state.positions[first] - turn * Vector3::z() * (0.5 * model.segments[first].length);
    let mut places = Vec::with_capacity(nodes.len());
    for (k, node) in nodes.iter().enumerate() {
        if let (true, Some(joint)) = (k > 0, node.joint.map(|joint| &model.joints[joint])) {
            let rest = joint.rest_rotation();
            // A joint may count its bodies from the end of the rod.
            let is_forward = joint.a == rod::Body::Segment(node.before.unwrap_or(usize::MAX));
            turn *= if is_forward { rest } else { rest.inverse() };
        }
        places.push(end);
        if let Some(i) = node.after {
            end += turn * Vector3::z() * model.segments[i].length;
        }
    }
    places
}

/// Parts of the curves whose places in all frames are in memory at once.
fn parts<'a, 'b>(curves: &'a [Curves<'b>], frames: usize) -> Vec<&'a [Curves<'b>]> {
    let mut parts = Vec::new();
    let mut from = 0;
    while from < curves.len() {
        let mut nodes = 0;
        let fit = curves[from..].iter().take_while(|curves| {
            nodes += curves.nodes;
            nodes * frames <= PLACES_AT_ONCE
        });
        let to = from + fit.count().max(1);
        parts.push(&curves[from..to]);
        from = to;
    }
    parts
}

/// Places of the nodes of some curves in each frame, one after the other [m].
fn places(
    curves: &[Curves<'_>],
    model: &Model,
    lines: &Centrelines,
    trajectory: &mut TrajectoryReader,
) -> Result<Vec<Vec<[f32; 3]>>, ExportError> {
    let mut frame = Frame::default();
    (0..trajectory.frames())
        .map(|index| {
            frame.read(trajectory, index)?;
            let nodes =
                curves.iter().flat_map(|curves| &curves.chains).flat_map(|chain| &lines.nodes[chain.nodes.clone()]);
            Ok(nodes.map(|node| node.position(model, &frame.state).map(|x| x as f32).into()).collect())
        })
        .collect()
}

/// Poses of each solid in all frames, of those that never move in the first.
fn poses(solids: &[Solid], model: &Model, trajectory: &mut TrajectoryReader) -> Result<Vec<Vec<Pose>>, ExportError> {
    let mut poses = vec![Vec::new(); solids.len()];
    let mut frame = Frame::default();
    let frames = if solids.iter().all(|solid| solid.is_still(model)) { 1 } else { trajectory.frames() };
    for index in 0..frames {
        frame.read(trajectory, index)?;
        for (solid, own) in solids.iter().zip(&mut poses) {
            if index == 0 || !solid.is_still(model) {
                own.push(solid.of.at(model, &frame).pose);
            }
        }
    }
    Ok(poses)
}

/// Writes a mesh, which moves if it has more than one pose.
fn write_solid(
    writer: &mut impl Write,
    Prim { identifier, name }: &Prim,
    solid: &Solid,
    poses: &[Pose],
    clock: &Clock,
) -> io::Result<()> {
    let colour = if solid.of.segment().is_some() { ROD } else { OBSTACLE };
    let mesh = &solid.mesh;
    writeln!(writer, "    def Mesh \"{identifier}\" (\n        displayName = {}\n    )\n    {{", Quoted(name))?;
    writeln!(writer, "        uniform token subdivisionScheme = \"none\"")?;
    writeln!(writer, "        int[] faceVertexCounts = {}", List(mesh.triangles.iter().map(|_| 3)))?;
    writeln!(writer, "        int[] faceVertexIndices = {}", List(mesh.triangles.as_flattened().iter()))?;
    writeln!(writer, "        point3f[] points = {}", List(mesh.positions.iter().map(tuple)))?;
    writeln!(
        writer,
        "        normal3f[] normals = {} (\n            interpolation = \"vertex\"\n        )",
        List(mesh.normals.iter().map(tuple))
    )?;
    writeln!(writer, "        color3f[] primvars:displayColor = [{}]", Tuple(colour.map(|x| x as f32)))?;
    writeln!(writer, "        uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:orient\"]")?;
    let place = |pose: &Pose| Tuple(pose.position.map(|x| x as f32).into());
    let turn = |pose: &Pose| {
        let q = pose.orientation.quaternion();
        Tuple([q.w, q.i, q.j, q.k].map(|x| x as f32))
    };
    if let [pose] = poses {
        writeln!(writer, "        float3 xformOp:translate = {}", place(pose))?;
        writeln!(writer, "        quatf xformOp:orient = {}", turn(pose))?;
    } else {
        write!(writer, "        float3 xformOp:translate")?;
        clock.samples(writer, |frame| place(&poses[frame]))?;
        write!(writer, "        quatf xformOp:orient")?;
        clock.samples(writer, |frame| turn(&poses[frame]))?;
    }
    writeln!(writer, "    }}\n")
}
