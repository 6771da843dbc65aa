//! A picture of a motion: the centreline at several times in one SVG.

use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

use nalgebra::{Vector2, Vector3};
use rod::{Segment, State};

use crate::file::write_atomically;
use crate::{ExportError, TrajectoryReader};

/// Most times shown.
const FRAMES: usize = 12;
/// Width and height of the drawing, and its margin [px].
const SIZE: [f64; 2] = [720.0, 480.0];
const MARGIN: f64 = 40.0;
/// Colours of the first and the last time (red, green, blue).
const COLOURS: [[f64; 3]; 2] = [[176.0, 196.0, 222.0], [180.0, 60.0, 20.0]];

/// Draws the rods at up to twelve evenly spaced times, from pale (first) to dark (last), seen along the world axis in
/// which they extend least; z points up where it is shown.
///
/// # Errors
/// [`ExportError::Segments`] if `segments` are not the trajectory's; [`ExportError::Io`] if the picture cannot be
/// written or the trajectory not be read.
pub fn write_snapshots(
    path: &Path,
    trajectory: &mut TrajectoryReader,
    segments: &[Segment],
) -> Result<(), ExportError> {
    trajectory.expect_segments(segments.len())?;
    let last = trajectory.frames().saturating_sub(1);
    let shown = FRAMES.min(trajectory.frames());
    let mut frames = Vec::with_capacity(shown);
    for k in 0..shown {
        let mut state = State::default();
        let time = trajectory.read_frame(k * last / (shown - 1).max(1), &mut state)?;
        frames.push((time, state));
    }
    let svg = draw(&trajectory.info().scene.clone(), &frames, segments);
    write_atomically(path, |writer| writer.write_all(svg.as_bytes()))
}

/// From the world to the paper.
struct View {
    axes: [usize; 2],
    low: Vector2<f64>,
    /// Pixels per metre.
    scale: f64,
    offset: Vector2<f64>,
}

impl View {
    fn new(frames: &[(f64, State)], reach: f64) -> Self {
        let points = || frames.iter().flat_map(|(_, state)| &state.positions);
        let none = Vector3::zeros();
        let first = points().next().unwrap_or(&none);
        let low = points().fold(*first, |low, p| low.inf(p)).add_scalar(-reach);
        let high = points().fold(*first, |high, p| high.sup(p)).add_scalar(reach);
        let extent = high - low;
        let axes = match extent.imin() {
            0 => [1, 2],
            1 => [0, 2],
            _ => [0, 1],
        };
        let pick = |v: Vector3<f64>| Vector2::new(v[axes[0]], v[axes[1]]);
        let (low, extent) = (pick(low), pick(extent));
        let room = Vector2::new(SIZE[0] - 2.0 * MARGIN, SIZE[1] - 2.0 * MARGIN);
        let scale = (room.x / extent.x).min(room.y / extent.y);
        let offset = Vector2::repeat(MARGIN) + 0.5 * (room - extent * scale);
        Self { axes, low, scale, offset }
    }

    fn place(&self, p: &Vector3<f64>) -> Vector2<f64> {
        let v = (Vector2::new(p[self.axes[0]], p[self.axes[1]]) - self.low) * self.scale + self.offset;
        Vector2::new(v.x, SIZE[1] - v.y)
    }
}

fn draw(scene: &str, frames: &[(f64, State)], segments: &[Segment]) -> String {
    let reach = segments.iter().map(|s| 0.5 * s.length + s.radius).fold(1e-9, f64::max);
    let view = View::new(frames, reach);
    let [width, height] = SIZE;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" \
         font-size=\"13\">\n<title>{}</title>\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n",
        escaped(scene)
    );
    let [from, to] = COLOURS;
    for (k, (_, state)) in frames.iter().enumerate() {
        let share = k as f64 / (frames.len() - 1).max(1) as f64;
        let [r, g, b] = [0, 1, 2].map(|c| (from[c] + share * (to[c] - from[c])) as u8);
        // One path a frame: a line per segment, as thick as the first one (but to be seen).
        let thickness = segments.first().map_or(0.0, |s| 2.0 * s.radius * view.scale).clamp(1.2, 30.0);
        let _ = write!(svg, "<path fill=\"none\" stroke=\"rgb({r},{g},{b})\" stroke-width=\"{thickness:.1}\" ");
        svg.push_str("stroke-linecap=\"round\" d=\"");
        for (i, segment) in segments.iter().enumerate() {
            let half = state.axis(i) * (0.5 * segment.length);
            let (a, b) = (view.place(&(state.positions[i] - half)), view.place(&(state.positions[i] + half)));
            let _ = write!(svg, "M{:.1} {:.1}L{:.1} {:.1}", a.x, a.y, b.x, b.y);
        }
        svg.push_str("\"/>\n");
    }
    let metre = nice_length(0.2 * width / view.scale);
    let digits = (-metre.log10().floor()).max(0.0) as usize;
    let (x, y, bar) = (MARGIN, height - 14.0, metre * view.scale);
    let _ = write!(
        svg,
        "<path stroke=\"#444\" stroke-width=\"2\" d=\"M{x} {y}h{bar:.1}\"/>\n\
         <text x=\"{x}\" y=\"{:.1}\" fill=\"#444\">{metre:.digits$} m</text>\n",
        y - 6.0
    );
    if let (Some((first, _)), Some((end, _))) = (frames.first(), frames.last()) {
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"20\" fill=\"#444\" text-anchor=\"end\">{}, {first:.2} s (pale) to {end:.2} s</text>",
            width - MARGIN,
            escaped(scene)
        );
    }
    svg.push_str("</svg>\n");
    svg
}

/// The largest of 1, 2 and 5 times a power of ten that is not above `length` [m].
fn nice_length(length: f64) -> f64 {
    let power = 10_f64.powi(length.log10().floor() as i32);
    [5.0, 2.0, 1.0].map(|k| k * power).into_iter().find(|&nice| nice <= length).unwrap_or(power)
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_round() {
        let nice = [0.7, 1.0, 3.3, 70.0].map(nice_length);
        assert!(nice.iter().zip([0.5, 1.0, 2.0, 50.0]).all(|(a, b)| (a - b).abs() < 1e-12), "{nice:?}");
    }

    #[test]
    fn points_stay_on_the_paper() {
        let state =
            State { positions: vec![Vector3::new(-3.0, 0.0, 5.0), Vector3::new(4.0, 0.1, -2.0)], ..State::default() };
        let view = View::new(&[(0.0, state.clone())], 0.5);
        assert_eq!(view.axes, [0, 2]);
        for p in &state.positions {
            let place = view.place(p);
            assert!(
                place.x >= MARGIN && place.x <= SIZE[0] - MARGIN && place.y >= MARGIN && place.y <= SIZE[1] - MARGIN
            );
        }
        assert!(view.place(&state.positions[0]).y < view.place(&state.positions[1]).y, "z points up");
    }
}
