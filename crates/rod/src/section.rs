//! Cross-sections: what they resist and what they weigh.

use std::f64::consts::PI;

use crate::{Material, Stretch};

/// The cross-section of a segment. Its width lies along d1, its height along d2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Section {
    /// A full circle.
    Circle {
        /// Radius r [m].
        radius: f64,
    },
    /// A ring: the section of a pipe.
    Tube {
        /// Outer radius [m].
        outer: f64,
        /// Inner radius [m], smaller.
        inner: f64,
    },
    /// A full rectangle.
    Rectangle {
        /// Side along d1 [m].
        width: f64,
        /// Side along d2 [m].
        height: f64,
    },
    /// A full ellipse.
    Ellipse {
        /// Axis along d1, from end to end [m].
        width: f64,
        /// Axis along d2, from end to end [m].
        height: f64,
    },
    /// Any section, by what was measured of it; the material's moduli and density say nothing of it.
    Known {
        /// What it resists.
        stiffness: Stiffness,
        /// What it weighs.
        inertia: LineInertia,
    },
}

/// What a section resists.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stiffness {
    /// Against stretch, E A [N]; only [`Stretch::Physical`] asks for it.
    pub stretch: f64,
    /// Against shear, k G A [N], the same across d1 and d2; only [`Stretch::Physical`] asks for it.
    pub shear: f64,
    /// Against bending about d1 and about d2, E I_1 and E I_2 [N m^2].
    pub bending: [f64; 2],
    /// Against twist, G J [N m^2].
    pub torsion: f64,
}

/// Inertia of a rod per length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineInertia {
    /// Mass [kg/m].
    pub mass: f64,
    /// Polar moment of inertia about the axis [kg m].
    pub polar: f64,
}

impl Section {
    /// Area A [m^2]; that of [`Section::Known`] is not known: NaN.
    pub fn area(self) -> f64 {
        match self {
            Self::Circle { radius } => PI * radius.powi(2),
            Self::Tube { outer, inner } => PI * (outer.powi(2) - inner.powi(2)),
            Self::Rectangle { width, height } => width * height,
            Self::Ellipse { width, height } => 0.25 * PI * width * height,
            Self::Known { .. } => f64::NAN,
        }
    }

    /// Second moments of area about d1 and about d2, I_1 and I_2 [m^4]; NaN for [`Section::Known`].
    pub fn second_moments(self) -> [f64; 2] {
        let two = |[width, height]: [f64; 2], factor: f64| {
            [factor * (width * height.powi(3)), factor * (height * width.powi(3))]
        };
        match self {
            Self::Circle { radius } => [PI * radius.powi(4) / 4.0; 2],
            Self::Tube { outer, inner } => [PI * (outer.powi(4) - inner.powi(4)) / 4.0; 2],
            Self::Rectangle { width, height } => two([width, height], 1.0 / 12.0),
            Self::Ellipse { width, height } => two([width, height], PI / 64.0),
            Self::Known { .. } => [f64::NAN; 2],
        }
    }

    /// Torsion constant J [m^4] (Saint-Venant): the polar moment of area of circles and tubes,
    /// `pi a^3 b^3 / (a^2 + b^2)` of an ellipse of half axes a and b, a series for the rectangle (Timoshenko and Goodier,
    /// Theory of Elasticity, section 109). NaN for [`Section::Known`].
    pub fn torsion_constant(self) -> f64 {
        match self {
            Self::Ellipse { width, height } => {
                let (a, b) = (0.5 * width, 0.5 * height);
                PI * (a * b).powi(3) / (a * a + b * b)
            }
            Self::Rectangle { width, height } => rectangle_torsion(width.max(height), width.min(height)),
            Self::Circle { .. } | Self::Tube { .. } | Self::Known { .. } => 2.0 * self.second_moments()[0],
        }
    }

    /// Timoshenko's shear correction factor k: 9/10 of the full circle and of ellipses, 5/6 of rectangles; of a tube of
    /// radii r_i = m r_o `9 (1 + m^2)^2 / (10 (1 + m^2)^2 + 26 m^2)` (Cowper 1966 for a Poisson's ratio of 1/2, which is
    /// 9/10 for m = 0).
    fn shear_factor(self) -> f64 {
        match self {
            Self::Tube { outer, inner } => {
                let m2 = (inner / outer).powi(2);
                9.0 * (1.0 + m2).powi(2) / (10.0 * (1.0 + m2).powi(2) + 26.0 * m2)
            }
            Self::Rectangle { .. } => 5.0 / 6.0,
            Self::Circle { .. } | Self::Ellipse { .. } | Self::Known { .. } => Stretch::SHEAR_FACTOR,
        }
    }

    /// What a rod of this section and `material` resists.
    pub fn stiffness(self, material: &Material) -> Stiffness {
        if let Self::Known { stiffness, .. } = self {
            return stiffness;
        }
        Stiffness {
            stretch: material.youngs_modulus * self.area(),
            shear: self.shear_factor() * material.torsion_modulus * self.area(),
            bending: self.second_moments().map(|moment| material.youngs_modulus * moment),
            torsion: material.torsion_modulus * self.torsion_constant(),
        }
    }

    /// What a rod of this section and `material` weighs; its polar moment is rho (I_1 + I_2).
    pub fn line_inertia(self, material: &Material) -> LineInertia {
        if let Self::Known { inertia, .. } = self {
            return inertia;
        }
        let [first, second] = self.second_moments();
        LineInertia { mass: material.density * self.area(), polar: material.density * (first + second) }
    }

    /// Radius [m] with which a rod of this section touches and feels the air unless another is given: the outer one, or
    /// half of the smaller side; `None` for [`Section::Known`].
    pub fn contact_radius(self) -> Option<f64> {
        match self {
            Self::Circle { radius } => Some(radius),
            Self::Tube { outer, .. } => Some(outer),
            Self::Rectangle { width, height } | Self::Ellipse { width, height } => Some(0.5 * width.min(height)),
            Self::Known { .. } => None,
        }
    }
}

/// Torsion constant of a rectangle with the sides a >= b:
/// `a b^3 / 3 (1 - 192 b / (pi^5 a) sum_{n odd} tanh(n pi a / 2 b) / n^5)`.
fn rectangle_torsion(a: f64, b: f64) -> f64 {
    /// sum over odd n of 1 / n^5: 31/32 of the zeta function at 5.
    const ALL: f64 = 31.0 / 32.0 * 1.036_927_755_143_37;
    // What tanh leaves of 1 falls so fast that few terms are needed.
    let missing: f64 = (1..=15)
        .step_by(2)
        .map(|n| {
            let n = f64::from(n);
            (1.0 - (0.5 * n * PI * a / b).tanh()) / n.powi(5)
        })
        .sum();
    a * b.powi(3) / 3.0 * (1.0 - 192.0 * b / (PI.powi(5) * a) * (ALL - missing))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(value: f64, expected: f64, tolerance: f64) {
        assert!((value / expected - 1.0).abs() < tolerance, "{value} != {expected}");
    }

    /// Timoshenko and Goodier, section 109, table 7: J / (a b^3) for a / b.
    #[test]
    fn rectangles_twist_as_the_tables_say() {
        for (ratio, expected) in [(1.0, 0.1406), (1.5, 0.196), (2.0, 0.229), (3.0, 0.263), (5.0, 0.291), (10.0, 0.312)]
        {
            for (width, height) in [(ratio, 1.0), (1.0, ratio)] {
                let constant = Section::Rectangle { width, height }.torsion_constant() / ratio;
                assert!((constant - expected).abs() < 6e-4, "a / b = {ratio}: {constant}");
            }
        }
        // A thin strip: b^3 a / 3 (1 - 0.63025 b / a).
        let strip = Section::Rectangle { width: 1.0, height: 1e-3 };
        close(strip.torsion_constant(), 1e-9 / 3.0 * (1.0 - 0.630_249_7e-3), 1e-9);
    }

    #[test]
    fn sections_become_each_other_in_their_limits() {
        let circle = Section::Circle { radius: 0.3 };
        let material = Material { youngs_modulus: 2e6, torsion_modulus: 7e5, density: 900.0 };
        for same in [Section::Ellipse { width: 0.6, height: 0.6 }, Section::Tube { outer: 0.3, inner: 0.0 }] {
            let (own, other) = (circle.stiffness(&material), same.stiffness(&material));
            close(other.stretch, own.stretch, 1e-14);
            close(other.shear, own.shear, 1e-14);
            close(other.bending[0], own.bending[0], 1e-14);
            close(other.bending[1], own.bending[1], 1e-14);
            close(other.torsion, own.torsion, 1e-14);
            close(same.line_inertia(&material).polar, circle.line_inertia(&material).polar, 1e-14);
        }
        // Thin walls: A = 2 pi r t, J = 2 pi r^3 t.
        let thin = Section::Tube { outer: 1.0, inner: 1.0 - 1e-6 };
        close(thin.area(), 2.0 * PI * 1e-6, 1e-5);
        close(thin.torsion_constant(), 2.0 * PI * 1e-6, 1e-5);
        // A full ellipse of half axes a and b has I_1 = pi a b^3 / 4.
        close(Section::Ellipse { width: 4.0, height: 2.0 }.second_moments()[0], PI * 2.0 / 4.0, 1e-14);
    }
}
