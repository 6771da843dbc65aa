//! Weight, and drag that follows the shape: a fixed point, which Aitken's relaxation brings about.
//!
//! The tangent does not know how drag changes with the shape, and where it changes much, plain iterations diverge. The
//! relaxation is that of Kuettler and Wall (2008).

use component::Component;
use kernels::Spatial;

/// Where no segment moves further in a step, drag is brought up to date [segment lengths, rad].
const CALM: f64 = 0.03;
/// The first share of a change of the drag that is taken.
const FIRST: f64 = 0.25;
/// Least and largest share.
const SHARES: [f64; 2] = [0.05, 0.5];

/// The forces of air and weight on the bodies of a component.
pub(super) struct Wind {
    /// Those that are in effect [N, N m], one entry a body.
    pub(super) forces: Vec<Spatial<f64>>,
    /// Those of the current shape.
    new: Vec<Spatial<f64>>,
    /// The last difference of the two.
    last: Vec<Spatial<f64>>,
    share: f64,
}

impl Wind {
    pub(super) fn new(component: &mut Component<f64>) -> Self {
        let mut forces = Vec::new();
        component.weigh(&mut forces, false);
        Self { forces, new: Vec::new(), last: Vec::new(), share: FIRST }
    }

    /// Brings drag up to date where the last step moved little; returns whether that is still to be done.
    pub(super) fn follow(&mut self, component: &mut Component<f64>, movement: f64) -> bool {
        if !component.has_air() {
            return false;
        }
        if movement > CALM {
            return true;
        }
        component.weigh(&mut self.new, true);
        let Self { forces, new, last, share } = self;
        // `new` becomes the difference.
        new.iter_mut().zip(forces.iter()).for_each(|(new, &force)| *new = new.plus(force, -1.0));
        if !last.is_empty() {
            let (mut along, mut size) = (0.0, 0.0);
            for (now, &before) in new.iter().zip(last.iter()) {
                let change = now.plus(before, -1.0);
                along += before.dot(change);
                size += change.dot(change);
            }
            if size > 0.0 {
                *share = (-*share * along / size).clamp(SHARES[0], SHARES[1]);
            }
        }
        forces.iter_mut().zip(new.iter()).for_each(|(force, &change)| *force = force.plus(change, *share));
        last.clone_from(new);
        false
    }
}
