//! What is found on the way of segments.

use super::super::testing::Rods;
use super::*;

const STILL: [f64; 3] = [0.0; 3];

fn found(rods: &mut Rods, dt: f64) -> Vec<(u32, Partner, Feature)> {
    rods.predict(dt);
    rods.find().2.iter().map(|contact| contact.key).collect()
}

#[test]
fn a_segment_that_passes_another_within_a_step_is_found_and_one_that_falls_short_is_not() {
    let two = |speed: f64| {
        Rods::new(&[
            ([0.0; 3], [1.0, 0.0, 0.0], 1, 0.01, STILL),
            ([0.0, 0.0, 0.5], [0.0, 1.0, 0.0], 1, 0.02, [0.0, 0.0, -speed]),
        ])
    };
    assert_eq!(found(&mut two(100.0), 0.01), [(0, Partner::Segment(1), Feature::Nearest)], "1 m in a step");
    assert!(found(&mut two(10.0), 0.01).is_empty(), "0.1 m in a step");
}

#[test]
fn axes_that_are_parallel_are_held_apart_at_their_ends_as_well() {
    let beside = ([0.0, 0.0, 0.025], [1.0, 0.0, 0.0], 1, 0.01, STILL);
    let mut two = Rods::new(&[([0.0; 3], [1.0, 0.0, 0.0], 1, 0.01, STILL), beside]);
    let expected = Feature::PARALLEL.map(|feature| (0, Partner::Segment(1), feature));
    assert_eq!(found(&mut two, 0.01), expected);
}

#[test]
fn neighbours_on_a_rod_are_not_found_where_all_boxes_meet() {
    // Of a rod as long as half of its circumference no segment touches another one.
    let rod = ([0.0; 3], [0.3, 0.0, 0.0], 6, 0.1, STILL);
    assert!(found(&mut Rods::new(&[rod]), 0.01).is_empty());
    let across = ([0.0, 0.0, 0.15], [0.0, 1.0, 0.0], 1, 0.1, STILL);
    let keys = found(&mut Rods::new(&[rod, across]), 0.01);
    assert!(!keys.is_empty() && keys.iter().all(|key| key.1 == Partner::Segment(6)), "{keys:?}");
}
