//! Scenes with contacts start without overlaps: brute force over all pairs.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;
use rod::{Body, Model, ObstacleShape};
use scene::Scene;

/// What rounding may do [m].
const ROUNDING: f64 = 1e-9;

/// Ends of a segment's axis [m].
fn ends(scene: &Scene, i: usize) -> [Vector3<f64>; 2] {
    let half = scene.state.axis(i) * (0.5 * scene.model.segments[i].length);
    [scene.state.positions[i] - half, scene.state.positions[i] + half]
}

fn point_distance(p: Vector3<f64>, [start, end]: [Vector3<f64>; 2]) -> f64 {
    let along = end - start;
    (p - start - along * ((p - start).dot(&along) / along.norm_squared()).clamp(0.0, 1.0)).norm()
}

/// Distance [m] between two straight lines with ends: inside of both, or at one of the four ends.
fn distance(a: [Vector3<f64>; 2], b: [Vector3<f64>; 2]) -> f64 {
    let (u, v, w) = (a[1] - a[0], b[1] - b[0], a[0] - b[0]);
    let (uu, uv, vv, uw, vw) = (u.dot(&u), u.dot(&v), v.dot(&v), u.dot(&w), v.dot(&w));
    let area = uu * vv - uv * uv;
    let (s, t) = ((uv * vw - vv * uw) / area, (uu * vw - uv * uw) / area);
    // Parallel lines are nearest at an end, among other places.
    let inside = area > 1e-12 * uu * vv && (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t);
    let between = if inside { (w + u * s - v * t).norm() } else { f64::INFINITY };
    let at_ends = [point_distance(a[0], b), point_distance(a[1], b), point_distance(b[0], a), point_distance(b[1], a)];
    at_ends.into_iter().fold(between, f64::min)
}

/// The joints of each segment: its own offset, the other segment and that one's offset.
fn joints(model: &Model) -> Vec<Vec<(f64, usize, f64)>> {
    let mut of = vec![Vec::new(); model.segments.len()];
    for joint in &model.joints {
        if let (Body::Segment(a), Body::Segment(b)) = (joint.a, joint.b) {
            of[a].push((joint.offset_a, b, joint.offset_b));
            of[b].push((joint.offset_b, a, joint.offset_a));
        }
    }
    of
}

/// Whether `b` is joined to `a` directly, or is reached from its end in less than `reach` [m] along rods and joints.
fn neighbours(joints: &[Vec<(f64, usize, f64)>], a: usize, b: usize, reach: f64) -> bool {
    if joints[a].iter().any(|&(_, other, _)| other == b) {
        return true;
    }
    let mut places: Vec<_> = joints[a].iter().map(|&(_, other, offset)| (other, offset, 0.0)).collect();
    let mut found = 0;
    while found < places.len() {
        let (segment, entry, way) = places[found];
        found += 1;
        for &(exit, other, offset) in &joints[segment] {
            let way = way + f64::abs(exit - entry);
            let shorter = |&(s, o, w): &(usize, f64, f64)| s == other && o == offset && w <= way;
            if way < reach && !places.iter().any(shorter) {
                if other == b {
                    return true;
                }
                places.push((other, offset, way));
            }
        }
    }
    false
}

/// The first overlap, in words.
fn overlap(scene: &Scene) -> Option<String> {
    let segments = &scene.model.segments;
    let lines: Vec<_> = (0..segments.len()).map(|i| ends(scene, i)).collect();
    for (k, obstacle) in scene.model.contacts.obstacles.iter().enumerate() {
        for (i, line) in lines.iter().enumerate() {
            let depth = segments[i].radius
                - match obstacle.shape {
                    ObstacleShape::HalfSpace { point, normal } => {
                        line.map(|end| (end - point).dot(&normal)).into_iter().fold(f64::INFINITY, f64::min)
                    }
                    ObstacleShape::Sphere { centre, radius } => point_distance(centre, *line) - radius,
                    ObstacleShape::Capsule { start, end, radius } => distance(*line, [start, end]) - radius,
                    // The solver's tests see to them.
                    _ => f64::INFINITY,
                };
            if depth > ROUNDING {
                return Some(format!("segment {i} is {depth} m deep in {}", scene.obstacles[k]));
            }
        }
    }
    scene.model.contacts.between_segments?;
    let joints = joints(&scene.model);
    for a in 0..segments.len() {
        for b in a + 1..segments.len() {
            let radii = segments[a].radius + segments[b].radius;
            let far = radii + 0.5 * (segments[a].length + segments[b].length);
            if (scene.state.positions[a] - scene.state.positions[b]).norm_squared() > far * far {
                continue;
            }
            let depth = radii - distance(lines[a], lines[b]);
            if depth > ROUNDING && !neighbours(&joints, a, b, FRAC_PI_2 * radii) {
                return Some(format!("segments {a} and {b} overlap by {depth} m"));
            }
        }
    }
    None
}

#[test]
fn no_builtin_scene_starts_with_an_overlap() {
    let mut with_contacts = 0;
    for builtin in scene::builtins() {
        let scene = scene::builtin(builtin.name).unwrap();
        with_contacts += usize::from(!scene.model.contacts.is_empty());
        assert_eq!(overlap(&scene), None, "{}", builtin.name);
    }
    assert!(with_contacts >= 5);
}

#[test]
fn overlaps_are_found() {
    let parse = |text: &str| scene::parse(&format!("contact = {{}}\n{text}"), "x.toml").unwrap();
    let rod = |start: &str, rest: &str| {
        format!(
            "[[rods]]\nradius_m = 0.05\nshape.straight = {{ length_m = 2, segments = 20, start_m = {start}, {rest} }}\n"
        )
    };
    let one = rod("[0, 0, 0]", "direction = [1, 0, 0]");
    assert_eq!(overlap(&parse(&one)), None);
    let across = |z: f64| parse(&format!("{one}{}", rod(&format!("[1, -1, {z}]"), "direction = [0, 1, 0]")));
    assert_eq!(overlap(&across(0.101)), None);
    assert!(overlap(&across(0.099)).unwrap().starts_with("segments "));
    let ground = |z: f64| parse(&format!("{one}[[obstacles]]\nshape.plane.point_m = [0, 0, {z}]\n"));
    assert_eq!(overlap(&ground(-0.051)), None);
    assert!(overlap(&ground(-0.049)).unwrap().ends_with(" deep in obstacle-0"));
    let ball =
        |x: f64| parse(&format!("{one}[[obstacles]]\nshape.sphere = {{ centre_m = [{x}, 0, 0], radius_m = 1 }}\n"));
    assert_eq!(overlap(&ball(-1.051)), None);
    assert!(overlap(&ball(-1.049)).is_some());
    let post = "shape.capsule = { start_m = [1, 0, 0.15], end_m = [1, 0, 1], radius_m = 0.1001 }";
    assert!(overlap(&parse(&format!("{one}[[obstacles]]\n{post}\n"))).is_some());
    // A hairpin of which the legs are nearer than two radii, but far from each other along the rod.
    let hairpin =
        "[[rods]]\nradius_m = 0.05\nshape.polyline.nodes_m = [[0, 0, 0], [1, 0, 0], [1, 0.09, 0], [0, 0.09, 0]]\n";
    assert_eq!(overlap(&parse(hairpin)), None, "legs that are 0.09 m apart along the rod are neighbours");
    let wide = hairpin.replace("[1, 0, 0], [1, 0.09, 0]", "[1, 0, 0], [1.1, 0.04, 0], [1, 0.09, 0]");
    assert!(overlap(&parse(&wide)).unwrap().starts_with("segments 0 and 3 overlap"));
}
