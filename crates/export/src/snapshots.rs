//! A picture of a motion: the centreline at several times in one SVG.

use std::io::Write;
use std::path::Path;

use chart::{Px, Xml, polyline};
use nalgebra::{Vector2, Vector3};
use rod::{Model, ObstacleShape, State};

use crate::file::write_atomically;
use crate::silhouette::{draw_bodies, fill};
use crate::{ExportError, TrajectoryReader};

/// Most times shown.
const FRAMES: usize = 12;
/// Width and height of the drawing, and its margin [px].
const SIZE: [f64; 2] = [720.0, 480.0];
const MARGIN: f64 = 40.0;
/// Colours of the first and the last time (red, green, blue).
const COLOURS: [[f64; 3]; 2] = [[176.0, 196.0, 222.0], [180.0, 60.0, 20.0]];
/// Colour of obstacles, and those of one that moves at the first and the last time (red, green, blue).
const OBSTACLE: &str = "#e4e4e0";
const MOVING: [[f64; 3]; 2] = [[246.0, 246.0, 244.0], [220.0, 220.0, 214.0]];
/// What falls moves by more than this share of the scene's size along gravity.
const FALL: f64 = 0.02;
/// A plane is drawn if its normal leans out of the paper by less than this (sine of the angle).
const ASKEW: f64 = 0.1;

/// Draws rods and rigid bodies at up to twelve evenly spaced times, from pale (first) to dark (last), and the obstacles,
/// those that move at the same times. They are seen along a world axis: the one along which shape and motion are spread
/// least, but never the one along which they fall. z points up where it is shown. Planes are drawn where they are seen from
/// the side.
///
/// # Errors
/// [`ExportError::Segments`] if the trajectory is not one of `model`; [`ExportError::Io`] if the picture cannot be
/// written or the trajectory not be read.
pub fn write_snapshots(path: &Path, trajectory: &mut TrajectoryReader, model: &Model) -> Result<(), ExportError> {
    trajectory.expect_segments(model.segments.len())?;
    let last = trajectory.frames().saturating_sub(1);
    let shown = FRAMES.min(trajectory.frames());
    let mut frames = Vec::with_capacity(shown);
    for k in 0..shown {
        let mut state = State::default();
        let time = trajectory.read_frame(k * last / (shown - 1).max(1), &mut state)?;
        frames.push((time, state));
    }
    let svg = draw(&trajectory.info().scene.clone(), &frames, model);
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
    fn new(frames: &[(f64, State)], reach: f64, gravity: &Vector3<f64>) -> Self {
        let points = || frames.iter().flat_map(|(_, state)| &state.positions);
        let none = Vector3::zeros();
        let first = points().next().unwrap_or(&none);
        let low = points().fold(*first, |low, p| low.inf(p)).add_scalar(-reach);
        let high = points().fold(*first, |high, p| high.sup(p)).add_scalar(reach);
        let extent = high - low;
        let down = gravity.iamax();
        let begin = frames.first().map_or(&[][..], |(_, state)| &state.positions);
        let moves = |(_, state): &(f64, State)| {
            state.positions.iter().zip(begin).map(|(p, start)| (p[down] - start[down]).abs()).fold(0.0, f64::max)
        };
        let falls = gravity[down] != 0.0 && frames.iter().map(moves).fold(0.0, f64::max) > FALL * extent.max();
        let mean = points().sum::<Vector3<f64>>() / points().count().max(1) as f64;
        let spread: Vector3<f64> = points().map(|p| (p - mean).component_mul(&(p - mean))).sum();
        let seen_along = (0..3).filter(|&axis| !(falls && axis == down)).min_by(|&a, &b| {
            // Of equals the later one: from the side rather than from the front, and from above where nothing falls.
            spread[a].total_cmp(&spread[b]).then(b.cmp(&a))
        });
        let axes = match seen_along {
            Some(0) => [1, 2],
            Some(1) => [0, 2],
            _ => [0, 1],
        };
        let pick = |v: Vector3<f64>| Vector2::new(v[axes[0]], v[axes[1]]);
        let (low, extent) = (pick(low), pick(extent));
        let room = Vector2::new(SIZE[0] - 2.0 * MARGIN, SIZE[1] - 2.0 * MARGIN);
        let scale = (room.x / extent.x).min(room.y / extent.y);
        let offset = Vector2::repeat(MARGIN) + 0.5 * (room - extent * scale);
        Self { axes, low, scale, offset }
    }

    /// A place of the world on the paper [px].
    fn place(&self, p: &Vector3<f64>) -> [f64; 2] {
        let v = (Vector2::new(p[self.axes[0]], p[self.axes[1]]) - self.low) * self.scale + self.offset;
        [v.x, SIZE[1] - v.y]
    }
}

fn draw(scene: &str, frames: &[(f64, State)], model: &Model) -> String {
    let segments = &model.segments;
    let reach = segments.iter().map(|s| 0.5 * s.length + s.radius).fold(1e-9, f64::max);
    let view = View::new(frames, reach, &model.gravity);
    let [width, height] = SIZE;
    let mut svg = Xml::element("title", &[], scene);
    let paper: [chart::Attribute<'_>; 3] = [("width", &width), ("height", &height), ("fill", &"white")];
    svg.push(Xml::nest("rect", &paper, []));
    let last = frames.len().saturating_sub(1).max(1) as f64;
    for obstacle in &model.contacts.obstacles {
        match obstacle.motion {
            None => draw_obstacle(&mut svg, &view, &obstacle.shape, OBSTACLE),
            Some(_) => frames.iter().enumerate().for_each(|(k, (time, _))| {
                draw_obstacle(&mut svg, &view, &obstacle.shape_at(*time), &between(MOVING, k as f64 / last));
            }),
        }
    }
    // As thick as the first segment of a rod, but to be seen.
    let thickness =
        segments.iter().find(|s| s.body.is_none()).map_or(0.0, |s| 2.0 * s.radius * view.scale).clamp(1.2, 30.0);
    for (k, (_, state)) in frames.iter().enumerate() {
        let line = |(i, segment): (usize, &rod::Segment)| {
            let half = state.axis(i) * (0.5 * segment.length);
            polyline([view.place(&(state.positions[i] - half)), view.place(&(state.positions[i] + half))])
        };
        let path: String =
            segments.iter().enumerate().filter(|(_, segment)| segment.body.is_none()).map(line).collect();
        let colour = between(COLOURS, k as f64 / last);
        stroke(&mut svg, &path, &colour, thickness);
        draw_bodies(&mut svg, model, state, &colour, |place| view.place(place));
    }
    let metre = nice_length(0.2 * width / view.scale);
    let digits = (-metre.log10().floor()).max(0.0) as usize;
    let at = [MARGIN, height - 14.0];
    stroke(&mut svg, &polyline([at, [at[0] + metre * view.scale, at[1]]]), "#444", 2.0);
    svg.label([at[0], at[1] - 6.0], "", "", &format!("{metre:.digits$} m"));
    if let (Some((first, _)), Some((end, _))) = (frames.first(), frames.last()) {
        let text = format!("{scene}, {first:.2} s (pale) to {end:.2} s");
        svg.label([width - MARGIN, 20.0], "end", "", &text);
    }
    let frame = format!("0 0 {width} {height}");
    let look: [chart::Attribute<'_>; 4] = [
        ("xmlns", &"http://www.w3.org/2000/svg"),
        ("viewBox", &frame),
        ("font-family", &"sans-serif"),
        ("font-size", &13),
    ];
    let svg = Xml::nest("svg", &look, [svg]);
    format!("{svg}\n")
}

/// A colour between two others.
fn between([from, to]: [[f64; 3]; 2], share: f64) -> String {
    let [r, g, b] = [0, 1, 2].map(|c| (from[c] + share * (to[c] - from[c])) as u8);
    format!("rgb({r},{g},{b})")
}

fn stroke(svg: &mut Xml, path: &str, colour: &str, width: f64) {
    let look: [chart::Attribute<'_>; 3] = [("fill", &"none"), ("stroke", &colour), ("stroke-width", &Px(width))];
    svg.push(Xml::nest("path", &[&look[..], &[("stroke-linecap", &"round"), ("d", &path)]].concat(), []));
}

fn draw_obstacle(svg: &mut Xml, view: &View, shape: &ObstacleShape, colour: &str) {
    match shape {
        ObstacleShape::HalfSpace { point, normal } => {
            let [across, up] = view.axes.map(|axis| normal[axis]);
            if across.hypot(up) < (1.0 - ASKEW * ASKEW).sqrt() {
                return;
            }
            // Far beyond the paper, which cuts it off. The paper's second axis points down.
            let far = 4.0 * SIZE[0];
            let [x, y] = view.place(point);
            let corner = |along: f64, into: f64| {
                [x + far * (along * up - into * across), y + far * (along * across + into * up)]
            };
            let path = polyline([corner(-1.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(-1.0, 1.0)]) + "z";
            svg.push(Xml::nest("path", &[("fill", &colour), ("d", &path)], []));
        }
        ObstacleShape::Sphere { centre, radius } => {
            stroke(svg, &polyline([view.place(centre); 2]), colour, 2.0 * radius * view.scale);
        }
        ObstacleShape::Capsule { start, end, radius } => {
            stroke(svg, &polyline([view.place(start), view.place(end)]), colour, 2.0 * radius * view.scale);
        }
        ObstacleShape::Box { .. } | ObstacleShape::Cylinder { .. } | ObstacleShape::Mesh { .. } => {
            let Some((mesh, turn)) = shape.surface() else { return };
            let place = |corner: &Vector3<f64>| view.place(&(shape.pivot() + turn * corner));
            fill(svg, mesh.positions.iter().map(place).collect(), colour);
        }
    }
}

/// The largest of 1, 2 and 5 times a power of ten that is not above `length` [m].
fn nice_length(length: f64) -> f64 {
    let power = 10_f64.powi(length.log10().floor() as i32);
    [5.0, 2.0, 1.0].map(|k| k * power).into_iter().find(|&nice| nice <= length).unwrap_or(power)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(positions: &[[f64; 3]]) -> (f64, State) {
        (0.0, State { positions: positions.iter().map(|p| Vector3::from(*p)).collect(), ..State::default() })
    }

    #[test]
    fn lengths_are_round() {
        let nice = [0.7, 1.0, 3.3, 70.0].map(nice_length);
        assert!(nice.iter().zip([0.5, 1.0, 2.0, 50.0]).all(|(a, b)| (a - b).abs() < 1e-12), "{nice:?}");
    }

    #[test]
    fn points_stay_on_the_paper() {
        let frames = [frame(&[[-3.0, 0.0, 5.0], [4.0, 0.1, -2.0]])];
        let view = View::new(&frames, 0.5, &Vector3::zeros());
        assert_eq!(view.axes, [0, 2]);
        let places: Vec<_> = frames[0].1.positions.iter().map(|p| view.place(p)).collect();
        for [x, y] in &places {
            assert!((MARGIN..=SIZE[0] - MARGIN).contains(x) && (MARGIN..=SIZE[1] - MARGIN).contains(y));
        }
        assert!(places[0][1] < places[1][1], "z points up");
    }

    #[test]
    fn a_fall_is_seen_even_if_it_is_short() {
        let down = Vector3::new(0.0, 0.0, -9.81);
        let flat = [[-1.0, -2.0, 0.0], [1.0, 2.0, 0.0]];
        let fallen = flat.map(|[x, y, _]| [x, y, -0.3]);
        let axes = |end: &[[f64; 3]], gravity| View::new(&[frame(&flat), frame(end)], 0.1, &gravity).axes;
        assert_eq!(axes(&fallen, down), [1, 2]);
        assert_eq!(axes(&fallen, Vector3::zeros()), [0, 1]);
        assert_eq!(axes(&flat, down), [0, 1], "nothing falls");
    }

    #[test]
    fn the_ground_is_below_the_rods() {
        let frames = [frame(&[[-1.0, 0.0, 0.0], [1.0, 0.0, 1.0]])];
        let view = View::new(&frames, 0.1, &Vector3::zeros());
        assert_eq!(view.axes, [0, 2]);
        let ground = |normal| ObstacleShape::HalfSpace {
            point: Vector3::new(0.0, 7.0, 0.0),
            normal: nalgebra::Unit::new_normalize(normal),
        };
        let drawn = |shape| {
            let mut svg = Xml::default();
            draw_obstacle(&mut svg, &view, &shape, OBSTACLE);
            svg.to_string()
        };
        let svg = drawn(ground(Vector3::z()));
        let path = svg.split("d=\"M").nth(1).unwrap().trim_end_matches("z\"/>");
        let heights: Vec<f64> = path.split('L').map(|p| p.split(' ').nth(1).unwrap().parse().unwrap()).collect();
        let level = view.place(&Vector3::zeros())[1];
        assert!(heights.iter().all(|y| *y > level - 0.1) && heights.iter().any(|y| *y > level + SIZE[1]), "{svg}");
        assert_eq!(drawn(ground(Vector3::y())), "", "seen from above");
    }
}
