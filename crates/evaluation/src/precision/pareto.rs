//! Ways at equal error: which is fastest, and by how much.

/// What a level came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Error; zero where the result has the reference's bits.
    pub error: f64,
    /// Time, in any unit that all lines share.
    pub time: f64,
}

/// A way's places, in any order.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Name of the way.
    pub way: String,
    /// What sort of way it is.
    pub kind: String,
    /// Its places.
    pub places: Vec<Place>,
}

/// The places that no other dominates, that is, is at least as good in both and better in one, from the smallest error to
/// the largest, and so from the slowest to the fastest. Equal places count once; what is not finite, or takes no time, does
/// not.
pub fn front(places: &[Place]) -> Vec<Place> {
    let range = 0.0..f64::INFINITY;
    let counts = |place: &&Place| range.contains(&place.error) && range.contains(&place.time) && place.time > 0.0;
    let mut front: Vec<Place> = places.iter().filter(counts).copied().collect();
    front.sort_by(|a, b| a.error.total_cmp(&b.error).then(a.time.total_cmp(&b.time)));
    front.dedup_by(|next, last| next.time >= last.time);
    front
}

/// Time in which a way comes to an error of at most `error`, on its own [`front`], between two levels on the straight
/// line in the logarithms of both. `None` where it does not reach it.
///
/// Nothing is extrapolated: a way that is more accurate at its fastest level takes that level's time. Where the more
/// accurate of the two levels has no error at all it has no logarithm, and its time is taken.
fn time_at_error(places: &[Place], error: f64) -> Option<f64> {
    let front = front(places);
    let beyond = front.partition_point(|place| place.error <= error);
    let within = front[beyond.checked_sub(1)?];
    match front.get(beyond) {
        Some(next) if within.error > 0.0 => {
            let share = (error / within.error).ln() / (next.error / within.error).ln();
            Some(within.time * (next.time / within.time).powf(share))
        }
        _ => Some(within.time),
    }
}

/// The fastest way at an error among some, the first of equals, and its time in the lines' unit; `None` where none of them
/// reaches it.
pub fn fastest(lines: &[Line], error: f64, among: impl Fn(&Line) -> bool) -> Option<(&Line, f64)> {
    let timed =
        lines.iter().filter(|line| among(line)).filter_map(|line| Some((line, time_at_error(&line.places, error)?)));
    timed.min_by(|a, b| a.1.total_cmp(&b.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(values: &[(f64, f64)]) -> Vec<Place> {
        values.iter().map(|&(error, time)| Place { error, time }).collect()
    }

    fn line(way: &str, kind: &str, values: &[(f64, f64)]) -> Line {
        Line { way: way.to_owned(), kind: kind.to_owned(), places: places(values) }
    }

    #[test]
    fn the_front_holds_what_nothing_dominates() {
        // Unordered, with a dominated one, and ties in either.
        let all = places(&[(1e-2, 1.0), (1e-6, 4.0), (1e-4, 5.0), (1e-4, 2.0), (1e-6, 6.0), (1e-3, 2.0)]);
        assert_eq!(front(&all), [all[1], all[3], all[0]]);
        assert_eq!(front(&places(&[(1e-3, 1.0); 3])), places(&[(1e-3, 1.0)]), "duplicates count once");
        assert_eq!(front(&places(&[(0.5, 7.0)])), places(&[(0.5, 7.0)]));
        assert!(front(&[]).is_empty());
    }

    #[test]
    fn what_is_no_number_is_on_no_front() {
        let (nan, infinite) = (f64::NAN, f64::INFINITY);
        let odd = [(nan, 1.0), (1e-3, nan), (infinite, 0.5), (1e-9, infinite), (-1.0, 1.0), (1e-9, 0.0), (1e-9, -1.0)];
        assert!(front(&places(&odd)).is_empty());
        assert_eq!(time_at_error(&places(&odd), 1.0), None);
        let mut mixed = places(&odd);
        mixed.extend(places(&[(1e-3, 2.0)]));
        assert_eq!(front(&mixed), [mixed[odd.len()]]);
        assert_eq!(time_at_error(&mixed, nan), None);
    }

    #[test]
    fn times_between_levels_lie_on_the_line_in_logarithms() {
        let all = places(&[(1e-6, 100.0), (1e-2, 1.0), (1e-3, 500.0)]);
        let at = |error| time_at_error(&all, error);
        assert!((at(1e-4).unwrap() / 10.0 - 1.0).abs() < 1e-12);
        assert!((at(1e-3).unwrap() / 10f64.sqrt() - 1.0).abs() < 1e-12, "the dominated level does not count");
        assert_eq!(at(1e-6), Some(100.0));
        assert_eq!(at(1e-2), Some(1.0));
    }

    #[test]
    fn nothing_is_extrapolated() {
        let all = places(&[(1e-6, 100.0), (1e-2, 1.0)]);
        assert_eq!(time_at_error(&all, 0.9e-6), None);
        assert_eq!(time_at_error(&all, 1.0), Some(1.0), "the fastest level is accurate enough");
        let single = places(&[(1e-4, 3.0)]);
        assert_eq!([1e-5, 1e-4, 1e-3].map(|error| time_at_error(&single, error)), [None, Some(3.0), Some(3.0)]);
        assert_eq!(time_at_error(&[], 1.0), None);
    }

    #[test]
    fn a_level_without_error_has_its_own_time() {
        let all = places(&[(0.0, 9.0), (1e-3, 2.0)]);
        assert_eq!([0.0, 1e-5, 1e-3].map(|error| time_at_error(&all, error)), [Some(9.0), Some(9.0), Some(2.0)]);
    }

    #[test]
    fn the_fastest_is_told_among_those_that_reach_the_error() {
        let lines = [
            line("direct", "direct", &[(1e-2, 2.0), (1e-8, 4.0)]),
            line("direct, quick", "direct", &[(1e-2, 1.0)]),
            line("cg", "cg", &[(1e-2, 8.0), (1e-4, 16.0)]),
            line("lost", "cg", &[(f64::NAN, 0.1)]),
        ];
        let name = |error, kind: &str| Some(fastest(&lines, error, |line| line.kind == kind)?.0.way.as_str());
        assert_eq!((name(1e-1, "direct"), name(1e-1, "cg")), (Some("direct, quick"), Some("cg")));
        let time = |error| Some(fastest(&lines, error, |_| true)?.1);
        assert!((time(1e-4).unwrap() - 2f64.powf(4.0 / 3.0)).abs() < 1e-12);
        assert_eq!((name(1e-6, "direct"), name(1e-6, "cg"), time(1e-9)), (Some("direct"), None, None));
    }

    #[test]
    fn equal_ways_are_told_in_their_order() {
        let lines = [line("a", "x", &[(1e-3, 1.0)]), line("b", "y", &[(1e-3, 1.0)])];
        let of = |among: fn(&Line) -> bool| fastest(&lines, 1e-3, among).unwrap().0.way.as_str();
        assert_eq!((of(|_| true), of(|line| line.kind != "x")), ("a", "b"));
    }
}
