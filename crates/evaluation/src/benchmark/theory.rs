//! Closed forms that are roots of an equation.

/// The root of `f` between `low` and `high`, where its sign changes, by bisection.
pub(super) fn root(f: impl Fn(f64) -> f64, [mut low, mut high]: [f64; 2]) -> f64 {
    let is_negative = f(low) < 0.0;
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        *(if (f(middle) < 0.0) == is_negative { &mut low } else { &mut high }) = middle;
    }
    0.5 * (low + high)
}

/// A catenary `z = a cosh(x / a)` between two points.
pub(super) struct Catenary {
    /// Its parameter [m]: the horizontal pull over the weight per length.
    pub a: f64,
    /// Where it starts and ends along x [m], seen from its lowest point.
    pub ends: [f64; 2],
}

impl Catenary {
    /// Of a `length` between ends that are `d` apart along x and `h` in height [m]: `sqrt(length^2 - h^2) = 2 a sinh(d / 2 a)` and
    /// `h / length = tanh(middle / a)`.
    pub(super) fn new(length: f64, d: f64, h: f64) -> Self {
        let along = (length * length - h * h).sqrt();
        let a = root(|a| 2.0 * a * (0.5 * d / a).sinh() - along, [0.01 * d, 1e4 * d]);
        let middle = a * (h / length).atanh();
        Self { a, ends: [middle - 0.5 * d, middle + 0.5 * d] }
    }

    /// Height above its directrix [m] at `x`: the tension over the weight per length.
    pub(super) fn height(&self, x: f64) -> f64 {
        self.a * (x / self.a).cosh()
    }
}

/// The twisting moment [N m] at which a straight rod of bending stiffness `b` [N m^2] and `length` [m] in a `tension` [N] buckles
/// between two ends that keep their directions, the one free to come nearer: Greenhill's problem (1883) with clamped ends.
///
/// The complex deflection `w'''' - i M w''' / b - T w'' / b = 0` is of the form `a + i c x + p exp(i k x) + q exp(i l x)` about the middle, with
/// `k, l = (M +- sqrt(M^2 - 4 b T)) / 2 b`; w and w' vanish at the ends `x = h` where
/// `k l sin((l - k) h) = (l - k) sin(k h) sin(l h) / h`. Without tension that is `tan(k h) = k h`, `M length = 8.9868 b`.
pub(super) fn buckling_moment(b: f64, length: f64, tension: f64) -> f64 {
    let h = 0.5 * length;
    let condition = |m: f64| {
        let spread = (m * m - 4.0 * b * tension).max(0.0).sqrt();
        let [k, l] = [(m + spread) / (2.0 * b), (m - spread) / (2.0 * b)];
        k * l * ((l - k) * h).sin() - (l - k) * (k * h).sin() * (l * h).sin() / h
    };
    // At M^2 = 4 b T both wave numbers are the same, and the condition holds for nothing; from there in small steps to the first root.
    let least = 2.0 * (b * tension).sqrt();
    let step = 1e-3 * b / length;
    let mut m = least + step;
    while condition(m).signum() == condition(m + step).signum() {
        m += step;
    }
    root(condition, [m, m + step])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Greenhill's clamped ends without tension; a long rod in tension comes near to `2 sqrt(b T)`.
    #[test]
    fn the_buckling_moment_has_its_limits() {
        assert!((buckling_moment(1.0, 1.0, 1e-6) / 8.986_818_9 - 1.0).abs() < 1e-5);
        let long = buckling_moment(1.0, 400.0, 1.0);
        assert!(long > 2.0 && long < 2.0002, "{long}");
    }

    #[test]
    fn a_level_catenary_has_its_length() {
        let catenary = Catenary::new(3.0, 2.0, 0.0);
        assert!((2.0 * catenary.a * (1.0 / catenary.a).sinh() - 3.0).abs() < 1e-9);
        assert!((catenary.ends[0] + 1.0).abs() < 1e-9);
    }
}
