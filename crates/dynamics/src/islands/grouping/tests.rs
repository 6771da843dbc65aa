//! Numbers of islands and seats in them.

use super::*;

#[test]
fn islands_are_numbered_by_their_first_sets() {
    let mut islands = Islands::default();
    islands.reset(5);
    assert!(islands.link(3, 1) && islands.link(3, 4) && !islands.link(4, 1));
    islands.number();
    assert_eq!((0..5).map(|set| islands.of(set)).collect::<Vec<_>>(), [0, 1, 2, 1, 1]);
    assert_eq!((&*islands.seats, &*islands.sizes), (&[0, 0, 0, 1, 2][..], &[1, 3, 1][..]));
    assert_eq!((&*islands.firsts, &*islands.leaders), (&[0, 1, 4][..], &[0, 1, 2][..]));
    assert!(islands.joined().eq([false; 3]));
    assert!(islands.link(2, 0));
    assert!(islands.joined().eq([true, false, true]));
    islands.number();
    assert_eq!((&*islands.seats, &*islands.sizes), (&[0, 0, 1, 1, 2][..], &[2, 3][..]));
    assert_eq!(islands.numbers(), [0, 1, 2, 3, 4]);
}
