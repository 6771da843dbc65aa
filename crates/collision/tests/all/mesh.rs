//! Meshes: which edges count, what is inside, how far things are.

use collision::TriangleMesh;
use nalgebra::Vector3;

/// A box between two corners, its triangles looking outwards.
fn cuboid(low: Vector3<f64>, high: Vector3<f64>) -> (Vec<Vector3<f64>>, Vec<[u32; 3]>) {
    let corner = |i: usize| Vector3::from_fn(|k, _| if i >> k & 1 == 0 { low[k] } else { high[k] });
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    ((0..8).map(corner).collect(), quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
}

#[test]
fn a_box_has_twelve_edges_and_an_inside() {
    let (positions, triangles) = cuboid(Vector3::new(-1.0, 0.0, 2.0), Vector3::new(1.0, 3.0, 2.5));
    let mesh = TriangleMesh::new(&positions, &triangles);
    assert_eq!((mesh.faces().len(), mesh.edges().len()), (12, 12), "no diagonal");
    assert!(mesh.encloses(&Vector3::new(0.9, 2.9, 2.01)) && !mesh.encloses(&Vector3::new(0.9, 2.9, 1.99)));
    assert!(!mesh.encloses(&Vector3::new(0.9, 3.1, 2.2)));
    // Each edge faces along the bisector of its sides, and along neither of its faces.
    let centre = Vector3::new(0.0, 1.5, 2.25);
    for edge in mesh.edges() {
        let out = 0.5 * (edge.ends[0] + edge.ends[1]) - centre;
        let out = out.map(|x| if x.abs() < 1e-12 { 0.0 } else { x.signum() }).normalize();
        assert!(edge.faces(&out, 0.0) && !edge.faces(&-out, 1e-3), "{edge:?}");
    }
    // The same inside out is a room: nothing is inside of its walls.
    let room: Vec<[u32; 3]> = triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    assert!(!TriangleMesh::new(&positions, &room).encloses(&centre));
    // Without a lid it is open.
    assert!(!TriangleMesh::new(&positions, &triangles[2..]).encloses(&centre));
}

/// The solid angle under which a place sees a triangle, positive from behind (Van Oosterom and Strackee 1983).
fn solid_angle(corners: &[Vector3<f64>; 3], place: &Vector3<f64>) -> f64 {
    let [a, b, c] = corners.map(|corner| corner - place);
    let [x, y, z] = [a, b, c].map(|corner| corner.norm());
    let below = x * y * z + a.dot(&b) * z + a.dot(&c) * y + b.dot(&c) * x;
    2.0 * a.dot(&b.cross(&c)).atan2(below)
}

#[test]
fn what_is_inside_sees_the_surface_all_around_it() {
    // A box with a room in it, and a box that overlaps both; places right below corners and edges of all of them.
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for (low, high, is_room) in [(0.0, 4.0, false), (1.0, 3.0, true), (2.0, 5.0, false)] {
        let (own, faces) = cuboid(Vector3::repeat(low), Vector3::repeat(high));
        let first = positions.len() as u32;
        positions.extend(own);
        triangles
            .extend(faces.into_iter().map(|[a, b, c]| if is_room { [a, c, b] } else { [a, b, c] }.map(|i| first + i)));
    }
    let mesh = TriangleMesh::new(&positions, &triangles);
    assert!(mesh.is_closed());
    let steps = || (-1..12).map(|k| 0.5 * f64::from(k));
    let (mut inside, mut all) = (0, 0);
    for (x, y) in steps().flat_map(|x| steps().map(move |y| (x, y))) {
        for z in (0..11).map(|k| 0.25 + 0.5 * f64::from(k)) {
            for shift in [0.0, 0.123] {
                let place = Vector3::new(x + shift, y + 0.7 * shift, z);
                let angle: f64 = mesh.faces().iter().map(|face| solid_angle(&face.corners, &place)).sum();
                let turns = angle / (4.0 * std::f64::consts::PI);
                let nearest = mesh.faces().iter().map(|face| (face.nearest(&place) - place).norm());
                let nearest = nearest.fold(f64::INFINITY, f64::min);
                assert_eq!(mesh.distance(&place), nearest, "{place}");
                if nearest > 1e-9 {
                    assert_eq!(mesh.encloses(&place), turns > 0.5, "{place}: {turns}");
                    (inside, all) = (inside + usize::from(turns > 0.5), all + 1);
                }
            }
        }
    }
    assert!(inside > all / 8 && inside < all / 2, "{inside} of {all}");
}

#[test]
fn vertices_at_one_place_are_one_and_triangles_without_area_none() {
    let (positions, triangles) = cuboid(Vector3::zeros(), Vector3::repeat(1.0));
    let loose: Vec<Vector3<f64>> = triangles.iter().flatten().map(|&i| positions[i as usize]).collect();
    let mut own: Vec<[u32; 3]> = (0..12).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    own.push([0, 0, 1]);
    let mesh = TriangleMesh::new(&loose, &own);
    assert_eq!((mesh.faces().len(), mesh.edges().len()), (12, 12));
    assert!(mesh.encloses(&Vector3::repeat(0.5)));
}

#[test]
fn a_sheet_has_its_border_and_its_folds() {
    let flat = |fold: f64| {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, fold]];
        TriangleMesh::new(&corners.map(Vector3::from), &[[0, 1, 2], [0, 2, 3]])
    };
    assert_eq!(flat(0.0).edges().len(), 4);
    assert_eq!(flat(0.1).edges().len(), 5);
}

#[test]
fn distances_are_those_of_a_fine_sampling() {
    let corners = [Vector3::zeros(), Vector3::new(1.0, 0.2, 0.0), Vector3::new(0.3, 0.9, 0.4)];
    let mesh = TriangleMesh::new(&corners, &[[0, 1, 2]]);
    let face = &mesh.faces()[0];
    const N: usize = 200;
    let points: Vec<Vector3<f64>> = (0..=N)
        .flat_map(|i| (0..=N - i).map(move |j| (i as f64 / N as f64, j as f64 / N as f64)))
        .map(|(u, v)| corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v)
        .collect();
    let segments = [
        [[0.4, 0.3, 1.0], [0.4, 0.3, 0.5]],
        [[0.4, 0.3, 1.0], [0.4, 0.3, -0.5]],
        [[2.0, 0.0, 0.0], [1.5, -1.0, 1.0]],
        [[-1.0, 0.5, 0.6], [1.0, -0.8, 0.5]],
        [[-0.2, -0.1, 0.1], [-0.2, -0.1, 0.1]],
    ];
    for segment in segments.map(|ends| ends.map(Vector3::from)) {
        let sampled = points
            .iter()
            .map(|point| {
                let t = collision::closest::point(&segment, point);
                (segment[0] + (segment[1] - segment[0]) * t - point).norm()
            })
            .fold(f64::INFINITY, f64::min);
        let distance = face.distance(&segment);
        assert!(
            distance <= sampled + 1e-12 && sampled < distance + 1.0 / N as f64,
            "{segment:?}: {distance} {sampled}"
        );
    }
}
