//! A stretch of time.

/// A stretch of time to step over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Its start [s].
    pub time: f64,
    /// Its length [s].
    pub dt: f64,
}

impl Interval {
    /// Its two halves.
    pub fn halves(self) -> [Self; 2] {
        let dt = 0.5 * self.dt;
        [Self { dt, ..self }, Self { time: self.time + dt, dt }]
    }
}
