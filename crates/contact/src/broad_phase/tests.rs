use kernels::math::Quat;
use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::*;

fn vector() -> impl Strategy<Value = Vector3<f64>> {
    [-1.0..1.0, -1.0..1.0, -1.0..1.0].prop_map(Vector3::from)
}

/// A pose at a place, turned by a rotation vector.
fn pose(place: Vector3<f64>, turn: Vector3<f64>) -> BodyPose<f64> {
    let q = UnitQuaternion::from_scaled_axis(turn);
    BodyPose { x: Vec3(place.into()), q: Quat { w: q.w, v: Vec3(q.imag().into()) } }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// What is left out does not touch, wherever in their rooms two segments are, however fast they are together.
    #[test]
    fn segments_that_are_apart_do_not_touch_in_their_rooms(
        places in [vector(), vector()], turns in [vector(), vector()], common in vector(),
        moves in [vector(), vector()], spins in [vector(), vector()], later in [vector(), vector()],
        sizes in [(0.02..0.3_f64, 0.01..0.1_f64), (0.02..0.3, 0.01..0.1)], speed in 0.0..3.0_f64,
    ) {
        let one = |k: usize| {
            let (half, radius) = sizes[k];
            let shape = Shape::new(0, 0, half, radius);
            let start = pose(places[k], turns[k] * 3.0);
            let (place, turn) = (places[k] + common * speed + moves[k] * 0.1, turns[k] * 3.0 + spins[k] * 0.2);
            let sight = SweptBound::new(&shape, &start, &pose(place, turn), 0.5);
            // Near the border of its room, within or beyond it.
            let now = pose(place + later[k] * sight.room, turn);
            (sight, shape.place(&now).map(to_nalgebra), sight.holds(&now), radius)
        };
        let ((a, now_a, holds_a, r), (b, now_b, holds_b, s)) = (one(0), one(1));
        prop_assert_eq!(a.is_apart_from(&b), b.is_apart_from(&a));
        if a.is_apart_from(&b) && holds_a && holds_b {
            let distance = closest::segments(&now_a, &now_b).distance;
            prop_assert!(distance > r + s, "{} {}", distance, r + s);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Two that are told to be apart by how far they strayed do not touch at the ends of parts, nor between, though neither went straight.
    #[test]
    fn segments_apart_by_their_strays_have_not_met_in_parts_of_a_step(
        places in [vector(), vector()], turns in [vector(), vector()], common in vector(), moves in [vector(), vector()],
        strays in [[vector(), vector(), vector(), vector()], [vector(), vector(), vector(), vector()]], spins in [vector(), vector()],
        sizes in [(0.02..0.3_f64, 0.01..0.1_f64), (0.02..0.3, 0.01..0.1)], speed in 0.0..3.0_f64, off in 0.0..0.3_f64,
    ) {
        let shape = |k: usize| {
            let (half, radius) = sizes[k];
            Shape::new(0, 0, half, radius)
        };
        let expected = |k: usize, share: f64| {
            (places[k] + (common * speed + moves[k] * 0.2) * share, turns[k] * 3.0 + spins[k] * (0.2 * share))
        };
        let mut all = BroadPhase::default();
        all.of(0..2);
        let mut own = [0, 1].map(|k| {
            let mut search = BroadPhase::default();
            search.of(std::iter::once(k));
            search
        });
        all.sights.extend([0, 1].map(|k| {
            let [(from, turned_from), (to, turned_to)] = [0.0, 1.0].map(|share| expected(k, share));
            SweptBound::new(&shape(k), &pose(from, turned_from), &pose(to, turned_to), 0.5)
        }));
        // The ends of both axes at the start and after each quarter of the step.
        let ends = [0, 1].map(|k| {
            let mut ends = vec![shape(k).place(&pose(places[k], turns[k] * 3.0)).map(to_nalgebra)];
            for (part, stray) in strays[k].iter().enumerate() {
                let share = 0.25 * (part + 1) as f64;
                let (place, turn) = expected(k, share);
                let now = pose(place + stray * off, turn);
                own[k].note_strays(&all, share, |_| now);
                ends.push(shape(k).place(&now).map(to_nalgebra));
            }
            ends
        });
        if all.are_apart([0, 1], [0, 1].map(|i| own[i as usize].stray(i))) {
            for part in 0..4 {
                for tenth in 0..=10 {
                    let at = |k: usize| [0, 1].map(|end| {
                        let [from, to] = [ends[k][part][end], ends[k][part + 1][end]];
                        from + (to - from) * (0.1 * f64::from(tenth))
                    });
                    let distance = closest::segments(&at(0), &at(1)).distance;
                    prop_assert!(distance > sizes[0].1 + sizes[1].1, "{} after {} tenths of part {}", distance, tenth, part);
                }
            }
        }
    }
}

/// What took no part of a step may be anywhere.
#[test]
fn nothing_is_known_of_what_did_not_end_a_part() {
    let mut search = BroadPhase::default();
    search.of(3..5);
    assert_eq!([3, 7].map(|segment| search.stray(segment)), [f64::INFINITY; 2]);
}
