//! Woven nets: yarns go over and under each other in turns and touch where they cross.

use std::num::NonZeroUsize;

/// 4 by 3 yarns of radius 1 mm, 5 mm and 6 mm apart, `segments` a mesh.
fn patch(segments: usize, parts: usize) -> scene::Scene {
    let text = format!(
        "contact = {{}}\n[[nets]]\nname = \"patch\"\nwoven = true\nsize_m = [0.015, 0.012]\nmeshes = [3, 2]\n\
        segments = {segments}\nradius_m = 0.001\n"
    );
    scene::parse_refined(&text, "x.toml", NonZeroUsize::new(parts).unwrap()).unwrap()
}

#[test]
fn yarns_touch_where_they_cross_over_and_under_in_turns() {
    for segments in [2, 3, 4] {
        let scene = patch(segments, 1);
        let names: Vec<_> = scene.rods.iter().map(|rod| rod.name.as_str()).collect();
        let yarns = ["x-0", "x-1", "x-2", "y-0", "y-1", "y-2", "y-3"].map(|yarn| format!("patch/{yarn}"));
        assert_eq!(names, yarns);
        let beyond = segments / 2;
        let counts: Vec<_> = scene.rods.iter().map(|rod| rod.segments.len()).collect();
        let [x, y] = [3, 2].map(|meshes| meshes * segments + 2 * beyond + 1);
        assert_eq!(counts, [x, x, x, y, y, y, y]);
        // Nothing is joined but a yarn's own segments.
        assert_eq!(scene.model.joints.len(), scene.model.segments.len() - scene.rods.len());
        for j in 0..3 {
            for i in 0..4 {
                let [over, under] = [(j, i), (3 + i, j)].map(|(yarn, crossing): (usize, usize)| {
                    scene.state.positions[scene.rods[yarn].segments.start + beyond + crossing * segments]
                });
                let way = over - under;
                let side = if (i + j).is_multiple_of(2) { 1.0 } else { -1.0 };
                assert!(way.xy().norm() < 1e-15 && (way.z - side * 0.002).abs() < 1e-15, "{i} {j}: {way:?}");
            }
        }
        let refined = patch(segments, 3);
        let length = |scene: &scene::Scene| scene.model.segments.iter().map(|s| s.length).sum::<f64>();
        assert_eq!(refined.model.segments.len(), 3 * scene.model.segments.len());
        assert!((length(&refined) / length(&scene) - 1.0).abs() < 1e-12);
    }
}
