use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::*;
use crate::kernel::math::Quat;

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
            let shape = Shape { component: 0, body: 0, half, radius, free: true, ends: [true; 2], beyond: [None; 2] };
            let start = pose(places[k], turns[k] * 3.0);
            let (place, turn) = (places[k] + common * speed + moves[k] * 0.1, turns[k] * 3.0 + spins[k] * 0.2);
            let sight = Sight::new(&shape, &start, &pose(place, turn), 0.5);
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
