//! Wavefront OBJ: polylines through the nodes, and meshes of rigid bodies and obstacles.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use rod::Model;

use super::centrelines::Centrelines;
use super::frame::Frame;
use super::solids::Solid;
use crate::folder::Folder;
use crate::{ExportError, Names, TrajectoryReader};

/// Writes `obj/frame_0000.obj` and so on: vertices are the nodes [m], with all digits, and each rod is an object of one
/// polyline, which ends where it began if the rod is closed. OBJ has no radii: they are in a comment above the line, one of all its
/// vertices if they are alike, else one a vertex in their order [m]. Rigid bodies and obstacles are objects of triangles.
pub(super) fn write(
    directory: &Path,
    trajectory: &mut TrajectoryReader,
    model: &Model,
    names: &Names,
) -> Result<Vec<PathBuf>, ExportError> {
    let (lines, solids) = (Centrelines::new(model), Solid::all(model, trajectory)?);
    let folder = Folder::stage(&directory.join("obj"), trajectory.frames(), "obj")?;
    let mut frame = Frame::default();
    for index in 0..trajectory.frames() {
        frame.read(trajectory, index)?;
        folder.write(index, |writer| {
            write!(writer, "# frame {index}, time {:?} s", frame.time)?;
            if let Some((mode, frequency)) = frame.mode {
                write!(writer, ", mode {mode}, {frequency:?} Hz")?;
            }
            writeln!(writer)?;
            for node in &lines.nodes {
                let x = node.position(model, &frame.state);
                writeln!(writer, "v {:?} {:?} {:?}", x.x, x.y, x.z)?;
            }
            for chain in lines.chains.iter().filter(|chain| model.segments[lines.first(chain)].body.is_none()) {
                writeln!(writer, "o {}", names.rod(chain.rod))?;
                write_radii(writer, lines.nodes[chain.nodes.clone()].iter().map(|node| node.radius(model)))?;
                write!(writer, "l")?;
                let first = chain.closed.then_some(chain.nodes.start);
                for node in chain.nodes.clone().chain(first) {
                    write!(writer, " {}", node + 1)?;
                }
                writeln!(writer)?;
            }
            let mut first = lines.nodes.len() + 1;
            for solid in &solids {
                writeln!(writer, "o {}", solid.name(model, names))?;
                for x in solid.places(solid.of.at(model, &frame).pose) {
                    writeln!(writer, "v {:?} {:?} {:?}", x.x, x.y, x.z)?;
                }
                for [a, b, c] in solid.mesh.triangles.iter().map(|triangle| triangle.map(|i| first + i as usize)) {
                    writeln!(writer, "f {a} {b} {c}")?;
                }
                first += solid.mesh.positions.len();
            }
            Ok(())
        })?;
    }
    Ok(vec![folder.publish()?])
}

/// Writes the radii of a rod's vertices [m]: `# radius_m 0.01` where they are alike, else `# radii_m 0.01 0.02 ...`.
fn write_radii(writer: &mut impl Write, radii: impl Iterator<Item = f64> + Clone) -> io::Result<()> {
    let mut own = radii.clone();
    match own.next() {
        Some(first) if own.all(|radius| radius == first) => writeln!(writer, "# radius_m {first:?}"),
        _ => {
            write!(writer, "# radii_m")?;
            for radius in radii {
                write!(writer, " {radius:?}")?;
            }
            writeln!(writer)
        }
    }
}
