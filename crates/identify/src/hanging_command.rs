//! `identify hanging`: the stiffness of wires from photographs of how they hang.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use identify::hanging::{Wire, bending, read, twist_ratio};
use report::significant;
use terminal::{positive, say};

/// Finds EI of a wire from photographs of it, hanging between two level grips in a vertical plane, and GJ / EI from the twist at
/// which it snaps out of that plane.
#[derive(Args)]
pub(crate) struct Hanging {
    /// Shapes of one wire: CSV files with the columns x_m and z_m (up), points in order from grip to grip.
    #[arg(required = true)]
    shapes: Vec<PathBuf>,
    /// Mass per length [kg/m].
    #[arg(long, value_name = "M", value_parser = positive)]
    mass_kg_m: f64,
    /// Length between the grips [m]; else that along the points of each shape.
    #[arg(long, value_name = "L", value_parser = positive)]
    length_m: Option<f64>,
    /// Compliance of each grip: length of wire [m] that would bend and twist as much; else grips are rigid.
    #[arg(long, value_name = "G", value_parser = positive)]
    grip_m: Option<f64>,
    /// Turn of one grip about its axis [deg] at which the wire snapped out of its plane.
    #[arg(long, value_name = "ANGLE", value_parser = positive)]
    twist_deg: Option<f64>,
    /// Segments between the grips.
    #[arg(long, default_value = "200", value_parser = clap::value_parser!(u16).range(10..=2000))]
    segments: u16,
}

impl Hanging {
    /// Prints what is found.
    ///
    /// # Errors
    /// If a file cannot be read, or there is no answer.
    pub(crate) fn run(&self) -> Result<()> {
        let shapes = self.shapes.iter().map(|path| read(path)).collect::<Result<Vec<_>, _>>()?;
        let mut found = Vec::new();
        for shape in &shapes {
            let bent = bending(&self.wire(shape.length()), shape).with_context(|| shape.path.display().to_string())?;
            let off = 100.0 * bent.mean_distance() / self.length_m.unwrap_or(shape.length());
            say!(
                "{}: EI {} N m^2, mean distance of the points {} % of the length",
                shape.path.display(),
                significant(bent.bending, 3),
                significant(off, 2)
            )?;
            found.push(bent.bending);
        }
        let count = found.len() as f64;
        let mean = found.iter().sum::<f64>() / count;
        let variance = found.iter().map(|bending| (bending - mean).powi(2)).sum::<f64>() / (count - 1.0);
        let spread = match found.len() {
            1 => String::new(),
            _ => format!(", standard deviation between shapes {}", significant(variance.sqrt(), 2)),
        };
        say!("EI {} N m^2{spread}", significant(mean, 3))?;
        let Some(twist) = self.twist_deg.map(f64::to_radians) else { return Ok(()) };
        let wire = self.wire(shapes[0].length());
        let ratio =
            twist_ratio(&wire, &shapes[0], mean, twist).with_context(|| shapes[0].path.display().to_string())?;
        say!("GJ / EI {}", significant(ratio, 3))
    }

    fn wire(&self, along: f64) -> Wire {
        Wire {
            line_density: self.mass_kg_m,
            length: self.length_m.unwrap_or(along),
            grip: self.grip_m.unwrap_or(0.0),
            segments: usize::from(self.segments),
        }
    }
}
