//! Clamps, grips and motions.

use nalgebra::Vector3;

use super::Draft;
use crate::random::{list, short};

impl Draft {
    /// How an open rod is held, if at all; what it is branched from holds its start.
    pub(super) fn hold(&mut self, segments: usize, is_branch: bool) {
        let ends: &[&str] = if is_branch { &["end"] } else { &["start", "end"] };
        let (mut clamps, mut entries) = (Vec::new(), Vec::new());
        for end in ends {
            // Most rods hang from one end.
            if !self.random.chance(if *end == "start" { 0.7 } else { 0.25 }) {
                continue;
            }
            let part = if segments > 1 && self.random.chance(0.3) { "segment" } else { "face" };
            let at = format!("{end}-{part}");
            match self.random.whole(0, 2) {
                0 => clamps.push(at),
                which => entries.push((at, which == 2)),
            }
        }
        if !clamps.is_empty() {
            put!(self, "clamp = {clamps:?}");
        }
        if segments > 3 && self.random.chance(0.04) {
            put!(self, "fixed_segments = [{}]", segments / 2);
        }
        for (at, is_driven) in entries {
            if is_driven { self.motion(&at) } else { self.grip(&at, true) }
        }
    }

    /// Times between which something is held for a part of the run.
    fn times(&mut self) {
        let end = self.end();
        let from = if self.random.chance(0.5) { short(end * self.random.uniform(0.1, 0.5)) } else { 0.0 };
        if from > 0.0 {
            put!(self, "from_s = {from:?}");
        }
        if from == 0.0 || self.random.chance(0.5) {
            put!(self, "until_s = {:?}", short(from + end * self.random.uniform(0.2, 0.4)));
        }
    }

    fn grip(&mut self, at: &str, may_have_times: bool) {
        put!(self, "\n[[rods.grips]]\nat = \"{at}\"");
        if may_have_times && self.random.chance(0.4) {
            self.times();
        }
        if !at.ends_with("face") {
            return;
        }
        let joint = self.random.pick(&["rigid", "ball", "hinge"]);
        put!(self, "joint = \"{joint}\"");
        if self.random.chance(0.35) {
            put!(self, "stiffness_n_m = {:?}", [0; 2].map(|_| self.random.even_log(1.0, 1e5)));
        }
        if joint == "rigid" && self.random.chance(0.35) {
            put!(self, "stiffness_n_m_rad = {:?}", [0; 2].map(|_| self.random.even_log(1e-3, 1e3)));
        }
    }

    fn motion(&mut self, at: &str) {
        put!(self, "\n[[rods.motions]]\nat = \"{at}\"");
        let has_times = self.random.chance(0.3);
        if has_times {
            self.times();
        }
        self.way_of(0.1);
        if !has_times && at.ends_with("face") && self.random.chance(0.25) {
            self.grip(at, false);
        }
    }

    /// A motion's keys, by lists or from a table: shifts up to this part of the scene's size.
    pub(super) fn way_of(&mut self, share: f64) {
        let (end, share) = (self.end(), share * self.random.even_log(0.03, 1.0));
        let far = [0; 2].map(|_| (self.random.direction() * (share * self.size)).map(short));
        // No more than a radian a step.
        let most = 12.0 * self.steps as f64;
        let turn = [0; 2].map(|_| (self.random.direction() * self.random.uniform(0.0, most)).map(short));
        let times = [0.0, short(0.5 * end), short(0.9 * end)];
        let shifts = [Vector3::zeros(), far[0], far[0] + far[1]].map(|x| list(x.map(short)));
        let turns = [Vector3::zeros(), turn[0], turn[1]].map(list);
        match self.random.whole(0, 4) {
            0 | 1 => {
                put!(self, "times_s = {times:?}\nshifts_m = {shifts:?}");
                if self.random.chance(0.5) {
                    put!(self, "turns_deg = {turns:?}");
                }
                put!(self, "interpolation = \"{}\"", self.random.pick(&["linear", "smooth"]));
            }
            2 => {
                let rates = |of: [Vector3<f64>; 2]| of.map(|x| list((x / end).map(short)));
                put!(self, "times_s = {:?}\nvelocities_m_s = {:?}", [times[0], times[1]], rates(far));
                if self.random.chance(0.5) {
                    put!(self, "angular_velocities_rad_s = {:?}", rates(turn.map(|x| x.map(f64::to_radians))));
                }
            }
            3 => put!(self, "times_s = {times:?}\nturns_deg = {turns:?}"),
            _ => {
                let mut text = "time_s,shift_x_m,shift_y_m,shift_z_m,turn_x_deg,turn_y_deg,turn_z_deg\n".to_owned();
                for (time, ([a, b, c], [d, e, f])) in times.iter().zip(shifts.iter().zip(&turns)) {
                    text += &format!("{time:?},{a:?},{b:?},{c:?},{d:?},{e:?},{f:?}\n");
                }
                let name = self.file("csv", text);
                put!(self, "file = \"{name}\"");
            }
        }
    }
}
