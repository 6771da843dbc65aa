//! Clamps, grips and motions.

use nalgebra::Vector3;

use super::Draft;
use crate::random::{list, number, short, vector};

impl Draft {
    /// How an open rod is held, if at all; what it is branched from holds its start.
    pub(super) fn hold(&mut self, segments: &usize, is_hung: bool, is_branch: bool) {
        if is_hung {
            self.line("clamp", "[\"start-face\", \"end-face\"]");
            return;
        }
        let ends: &[&str] = if is_branch { &["end"] } else { &["start", "end"] };
        let mut clamps = Vec::new();
        let mut entries = Vec::new();
        for end in ends {
            // Most rods hang from one end.
            let share = if *end == "start" { 0.7 } else { 0.25 };
            if !self.random.chance(share) {
                continue;
            }
            let part = if *segments > 1 && self.random.chance(0.3) { "segment" } else { "face" };
            match self.random.whole(0, 2) {
                0 => clamps.push(format!("\"{end}-{part}\"")),
                1 => entries.push((format!("{end}-{part}"), false)),
                _ => entries.push((format!("{end}-{part}"), true)),
            }
        }
        if !clamps.is_empty() {
            self.line("clamp", list(clamps));
        }
        if *segments > 3 && self.random.chance(0.04) {
            self.line("fixed_segments", format!("[{}]", segments / 2));
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
            self.number("from_s", from);
        }
        if from == 0.0 || self.random.chance(0.5) {
            let until = short(from + end * self.random.uniform(0.2, 0.4));
            self.number("until_s", until);
        }
    }

    fn grip(&mut self, at: &str, may_have_times: bool) {
        self.entry("rods.grips");
        self.line("at", format!("\"{at}\""));
        if may_have_times && self.random.chance(0.4) {
            self.times();
        }
        if at.ends_with("face") {
            let joint = self.random.pick(&["rigid", "ball", "hinge"]);
            if joint != "rigid" {
                self.line("joint", format!("\"{joint}\""));
            }
            if self.random.chance(0.35) {
                let stiffness = [0; 2].map(|_| self.random.even_log(1.0, 1e5));
                self.line("stiffness_n_m", list(stiffness.map(number)));
            }
            if joint == "rigid" && self.random.chance(0.35) {
                let stiffness = [0; 2].map(|_| self.random.even_log(1e-3, 1e3));
                self.line("stiffness_n_m_rad", list(stiffness.map(number)));
            }
        }
    }

    fn motion(&mut self, at: &str) {
        self.entry("rods.motions");
        self.line("at", format!("\"{at}\""));
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
        let turn =
            [0; 2].map(|_| (self.random.direction() * self.random.uniform(0.0, 12.0 * self.steps as f64)).map(short));
        let times = [0.0, short(0.5 * end), short(0.9 * end)];
        let zero = Vector3::zeros();
        match self.random.whole(0, 4) {
            0 | 1 => {
                self.line("times_s", list(times.map(number)));
                self.line("shifts_m", list([zero, far[0], far[0] + far[1]].map(|x| vector(x.map(short)))));
                if self.random.chance(0.5) {
                    self.line("turns_deg", list([zero, turn[0], turn[1]].map(vector)));
                }
                let interpolation = self.random.pick(&["linear", "smooth"]);
                self.line("interpolation", format!("\"{interpolation}\""));
            }
            2 => {
                self.line("times_s", list([times[0], times[1]].map(number)));
                self.line(
                    "velocities_m_s",
                    list([vector((far[0] / end).map(short)), vector((far[1] / end).map(short))]),
                );
                if self.random.chance(0.5) {
                    let rates = turn.map(|turn| vector((turn.map(f64::to_radians) / end).map(short)));
                    self.line("angular_velocities_rad_s", list(rates));
                }
            }
            3 => {
                self.line("times_s", list(times.map(number)));
                self.line("turns_deg", list([zero, turn[0], turn[1]].map(vector)));
            }
            _ => {
                let mut text = "time_s,shift_x_m,shift_y_m,shift_z_m,turn_x_deg,turn_y_deg,turn_z_deg\n".to_owned();
                for (k, time) in times.into_iter().enumerate() {
                    let (x, t) = if k == 0 { (zero, zero) } else { (far[k - 1], turn[k - 1]) };
                    text.push_str(&format!("{time:?},{:?},{:?},{:?},{:?},{:?},{:?}\n", x.x, x.y, x.z, t.x, t.y, t.z));
                }
                let name = self.file("csv", text);
                self.line("file", format!("\"{name}\""));
            }
        }
    }
}
