//! Ways at equal error: which is fastest, and by how much.

/// What a level came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Error; zero where the result has the reference's bits.
    pub error: f64,
    /// Time, in any unit that all lines share.
    pub time: f64,
}

impl Place {
    /// Whether it can be compared: a finite error, not negative, and a finite, positive time.
    fn counts(&self) -> bool {
        self.error.is_finite() && self.error >= 0.0 && self.time.is_finite() && self.time > 0.0
    }
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

/// Indices of the places that no other dominates, that is, is at least as good in both and better in one, from the
/// smallest error to the largest, and so from the slowest to the fastest. Of equal places the first counts; what is not
/// finite, or takes no time, does not.
pub fn front(places: &[Place]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..places.len()).filter(|&i| places[i].counts()).collect();
    let key = |i: usize| (places[i].error, places[i].time);
    order.sort_by(|&a, &b| key(a).0.total_cmp(&key(b).0).then(key(a).1.total_cmp(&key(b).1)));
    let mut fastest = f64::INFINITY;
    order.retain(|&i| {
        let is_faster = places[i].time < fastest;
        fastest = fastest.min(places[i].time);
        is_faster
    });
    order
}

/// Time in which a way comes to an error of at most `error`, on its own [`front`], between two levels on the straight
/// line in the logarithms of both. `None` where it does not reach it.
///
/// Nothing is extrapolated: a way that is more accurate at its fastest level takes that level's time. Where the more
/// accurate of the two levels has no error at all it has no logarithm, and its time is taken.
fn time_at_error(places: &[Place], error: f64) -> Option<f64> {
    let front = front(places);
    let beyond = front.partition_point(|&i| places[i].error <= error);
    let within = places[*front.get(beyond.checked_sub(1)?)?];
    let Some(&next) = front.get(beyond) else { return Some(within.time) };
    let next = places[next];
    if within.error == 0.0 {
        return Some(within.time);
    }
    let share = (error / within.error).ln() / (next.error / within.error).ln();
    Some(within.time * (next.time / within.time).powf(share))
}

/// A way's time at an error.
#[derive(Clone, Debug, PartialEq)]
pub struct Timed {
    /// Name of the way.
    pub way: String,
    /// What sort of way it is.
    pub kind: String,
    /// Time, in the lines' unit.
    pub time: f64,
}

/// A way at an error, beside the fastest of some others.
#[derive(Clone, Debug, PartialEq)]
pub struct Beside {
    /// Error.
    pub error: f64,
    /// The way; `None` where it does not reach the error.
    pub own: Option<Timed>,
    /// The fastest of the others; `None` where none of them reaches it.
    pub other: Option<Timed>,
}

impl Beside {
    /// The other's time over the way's own: above 1 where the way is faster.
    pub fn lead(&self) -> Option<f64> {
        Some(self.other.as_ref()?.time / self.own.as_ref()?.time)
    }
}

/// The fastest way at each of these errors, the first of equals, beside the fastest of any other kind.
pub fn winners(lines: &[Line], errors: &[f64]) -> Vec<Beside> {
    let winner = |&error: &f64| {
        let own = fastest(lines, error, |_| true);
        let other = own.as_ref().and_then(|first| fastest(lines, error, |line| line.kind != first.kind));
        Beside { error, own, other }
    };
    errors.iter().map(winner).collect()
}

/// The way called `name` at each of these errors, beside the fastest of all others.
pub fn standings(lines: &[Line], name: &str, errors: &[f64]) -> Vec<Beside> {
    let standing = |&error: &f64| {
        let [own, other] = [true, false].map(|is_own| fastest(lines, error, |line| (line.way == name) == is_own));
        Beside { error, own, other }
    };
    errors.iter().map(standing).collect()
}

/// The fastest way at an error among some, the first of equals; `None` where none of them reaches it.
pub fn fastest(lines: &[Line], error: f64, among: impl Fn(&Line) -> bool) -> Option<Timed> {
    let timed = |line: &Line| {
        let time = time_at_error(&line.places, error)?;
        Some(Timed { way: line.way.clone(), kind: line.kind.clone(), time })
    };
    lines.iter().filter(|line| among(line)).filter_map(timed).min_by(|a, b| a.time.total_cmp(&b.time))
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
        assert_eq!(front(&all), [1, 3, 0]);
        assert_eq!(front(&places(&[(1e-3, 1.0); 3])), [0], "of duplicates the first");
        assert_eq!(front(&places(&[(0.5, 7.0)])), [0]);
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
        assert_eq!(front(&mixed), [odd.len()]);
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
    fn the_rival_of_the_fastest_is_of_another_kind() {
        let lines = [
            line("direct", "direct", &[(1e-2, 2.0), (1e-8, 4.0)]),
            line("direct, quick", "direct", &[(1e-2, 1.0)]),
            line("cg", "cg", &[(1e-2, 8.0), (1e-4, 16.0)]),
            line("lost", "cg", &[(f64::NAN, 0.1)]),
        ];
        let table = winners(&lines, &[1e-1, 1e-4, 1e-6, 1e-9]);
        let names = |timed: &Option<Timed>| timed.as_ref().map(|timed| timed.way.clone());
        assert_eq!(names(&table[0].own).as_deref(), Some("direct, quick"));
        assert_eq!(names(&table[0].other).as_deref(), Some("cg"));
        assert_eq!(table[0].lead(), Some(8.0));
        assert_eq!(names(&table[1].own).as_deref(), Some("direct"));
        assert!((table[1].lead().unwrap() - 16.0 / 2f64.powf(4.0 / 3.0)).abs() < 1e-12);
        assert_eq!((names(&table[2].own).as_deref(), &table[2].other, table[2].lead()), (Some("direct"), &None, None));
        assert_eq!((&table[3].own, &table[3].other, table[3].lead()), (&None, &None, None));
    }

    #[test]
    fn a_way_stands_beside_the_best_of_all_others() {
        let lines = [
            line("auto", "auto", &[(1e-2, 3.0), (1e-6, 3.0)]),
            line("direct", "direct", &[(1e-2, 2.0), (1e-8, 6.0)]),
            line("cg", "cg", &[(1e-3, 4.0)]),
        ];
        let table = standings(&lines, "auto", &[1e-1, 1e-8, 1e-9]);
        assert_eq!((table[0].own.as_ref().unwrap().time, table[0].lead()), (3.0, Some(2.0 / 3.0)));
        assert_eq!((&table[1].own, table[1].lead()), (&None, None));
        assert_eq!(table[1].other.as_ref().unwrap().way, "direct");
        assert_eq!((&table[2].own, &table[2].other, table[2].lead()), (&None, &None, None));
        assert_eq!(standings(&lines, "nobody", &[1.0])[0].own, None);
    }

    #[test]
    fn equal_ways_are_told_in_their_order() {
        let lines = [line("a", "x", &[(1e-3, 1.0)]), line("b", "y", &[(1e-3, 1.0)])];
        let winner = &winners(&lines, &[1e-3])[0];
        assert_eq!((winner.own.as_ref().unwrap().way.as_str(), winner.lead()), ("a", Some(1.0)));
    }
}
