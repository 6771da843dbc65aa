//! Feeding: eyelets that drive rods through them, out of a store and into it.

/// A drive at an eyelet, as of a winch, a spool or a pair of rollers: it moves the rod through the eyelet at a given speed, as far as its
/// force goes.
#[derive(Clone, Debug, PartialEq)]
pub struct Feed {
    /// Times [s], each later than the one before, and speeds of the rod through the eyelet, from its start towards its end, then [m/s]. Positive
    /// speed pays out. Linear between the times, constant before and after.
    pub speeds: Vec<[f64; 2]>,
    /// The largest force along the rod [N]. Where more is needed the rod slips in the drive.
    pub max_force: f64,
    /// Whether the rod is stored before the eyelet: what of it has not come out yet takes no part in the motion.
    pub is_stored: bool,
    /// The least and the largest length of the rod beyond the eyelet [m], at which it stops.
    pub lengths: [f64; 2],
}

impl Feed {
    /// The speed at a time [s], in m/s; 0 if none is given.
    pub fn speed(&self, time: f64) -> f64 {
        linear(&self.speeds, time)
    }
}

/// What is given at times [s], linear between them and constant before and after; 0 if nothing is.
pub(crate) fn linear(given: &[[f64; 2]], time: f64) -> f64 {
    let next = given.partition_point(|&[at, _]| at <= time);
    match (given.get(next.wrapping_sub(1)), given.get(next)) {
        (Some([from, old]), Some([to, new])) => old + (new - old) * (time - from) / (to - from),
        (Some([_, value]), None) | (None, Some([_, value])) => *value,
        (None, None) => 0.0,
    }
}
