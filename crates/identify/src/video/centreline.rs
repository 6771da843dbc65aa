//! The centreline of a cable in the pictures of a camera, and what is smooth in it.

use std::collections::BTreeMap;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use nalgebra::{DMatrix, Vector2};

use crate::recording::RecordingError;

/// Control points of the curve in a picture: bends of a tenth of the length are seen.
const CONTROL_POINTS: usize = 20;
/// What a frame must show: so many points, none further apart.
const FEWEST_POINTS: usize = 9;
const LONGEST_GAP: f64 = 0.15;
/// The weight of third differences that leaves a curve through its points.
const INTERPOLATES: f64 = 1e-4;
/// Share of the smoothness by which places are met best: by which curvatures are hardly less than they are. Of a simulated cable that is off by 1 and
/// 3 px the bending stiffness is found 1 to 2 % off that of exact pictures, 4 and 16 % with all of it.
const OF_SMOOTHNESS: f64 = 0.1;
/// Of four control points.
const THIRD_DIFFERENCE: [f64; 4] = [-1.0, 3.0, -3.0, 1.0];

/// Points of a cable in the pictures of a camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Centreline {
    /// The file.
    pub path: PathBuf,
    /// Frames by number.
    pub frames: Vec<i64>,
    /// Their times [s], the first of them 0.
    pub time: Vec<f64>,
    /// Points of each frame: distance along the cable as a share of its length, and where it is [px], u to the right and v down.
    pub points: Vec<Vec<(f64, Vector2<f64>)>>,
}

/// Reads a CSV file with the columns `frame` (whole numbers), `s` (0 to 1 along the cable), `u` and `v` [px], a row a point, at so many frames
/// a second. A row with an empty cell is a point that was not seen.
///
/// # Errors
/// With the file and the line.
pub fn read(path: &Path, rate: f64) -> Result<Centreline, RecordingError> {
    let wrong = |message: String| RecordingError::new(path, message);
    let bytes = fs::read(path).map_err(|error| wrong(error.to_string()))?;
    let mut table = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(&bytes[..]);
    let header = table.headers().map_err(|error| wrong(error.to_string()))?.clone();
    let names = ["frame", "s", "u", "v"];
    let mut columns = [0; 4];
    for (column, name) in columns.iter_mut().zip(names) {
        let found = header.iter().position(|own| own == name);
        *column =
            found.ok_or_else(|| wrong(format!("there is no column {name:?}: a centreline has frame, s, u and v")))?;
    }
    let mut frames: BTreeMap<i64, Vec<(f64, Vector2<f64>)>> = BTreeMap::new();
    for row in table.records() {
        let row = row.map_err(|error| wrong(error.to_string()))?;
        let line = row.position().map_or(0, csv::Position::line);
        let cell = |k: usize| -> Result<f64, RecordingError> {
            let text = row.get(columns[k]).unwrap_or_default();
            let number = if text.is_empty() { Ok(f64::NAN) } else { text.parse::<f64>() };
            number
                .ok()
                .filter(|number| !number.is_infinite())
                .ok_or_else(|| wrong(format!("line {line}, column {}: {text:?} is no number", names[k])))
        };
        let [frame, s, u, v] = [cell(0)?, cell(1)?, cell(2)?, cell(3)?];
        if frame.fract() != 0.0 || frame.abs() > 1e9 {
            return Err(wrong(format!("line {line}, column frame: {frame}, but it must be a whole number")));
        }
        if s.is_finite() && !(0.0..=1.0).contains(&s) {
            return Err(wrong(format!(
                "line {line}, column s: {s}, but it must be from 0 to 1, a share of the length"
            )));
        }
        let points = frames.entry(frame as i64).or_default();
        if [s, u, v].iter().all(|number| number.is_finite()) {
            points.push((s, Vector2::new(u, v)));
        }
    }
    if frames.len() < 3 {
        return Err(wrong(format!("{} frames, but there must be at least 3", frames.len())));
    }
    let first = frames.keys().next().copied().unwrap_or_default();
    let time = frames.keys().map(|frame| (frame - first) as f64 / rate).collect();
    let (frames, points) = frames.into_iter().unzip();
    Ok(Centreline { path: path.to_owned(), frames, time, points })
}

impl Centreline {
    /// Refuses what another camera saw in other frames.
    pub(super) fn alike(&self, other: &Self) -> Result<(), RecordingError> {
        if self.frames == other.frames {
            return Ok(());
        }
        let span =
            |own: &Self| format!("{} from {} on", own.frames.len(), own.frames.first().copied().unwrap_or_default());
        let message = format!(
            "{} frames, but {} has {}: both cameras must have the same ones",
            span(other),
            self.path.display(),
            span(self)
        );
        Err(RecordingError::new(&other.path, message))
    }

    /// Curves of all frames: cubic splines through the points, whose control points go over time as parabolas over a `window` [s] do (Savitzky and
    /// Golay 1964); then penalised (Eilers and Marx 1996), as smooth as generalised cross-validation says for the clip as a whole (Craven and Wahba
    /// 1979). Frames in which too little of the cable is seen take theirs from those around them.
    ///
    /// # Errors
    /// If too little is seen for longer than the window.
    pub(super) fn smoothed(&self, window: f64) -> Result<Smooth, RecordingError> {
        let systems: Vec<Option<System>> = self.points.iter().map(|points| System::new(points)).collect();
        let fitted: Vec<Option<DMatrix<f64>>> =
            systems.iter().map(|system| Some(system.as_ref()?.solved(INTERPOLATES)?.0)).collect();
        let known: Vec<usize> = (0..fitted.len()).filter(|&frame| fitted[frame].is_some()).collect();
        let last = self.time.last().copied().unwrap_or_default();
        let interval = last / (self.time.len() - 1) as f64;
        let size = ((window / interval).round() as usize + 1).max(3);
        let longest = window.max(interval) + 0.5 * interval;
        if known.len() < size {
            let message = format!(
                "{} of {} frames show points all along the cable, but at least {size} must: {} or more points, none further apart than {}",
                known.len(),
                fitted.len(),
                FEWEST_POINTS,
                LONGEST_GAP
            );
            return Err(RecordingError::new(&self.path, message));
        }
        let mut smoothed = Vec::new();
        for (frame, &time) in self.time.iter().enumerate() {
            let after = known.partition_point(|&own| own < frame);
            let nearest = known[after.saturating_sub(1)..(after + 1).min(known.len())]
                .iter()
                .map(|&own| (self.time[own] - time).abs())
                .fold(f64::INFINITY, f64::min);
            if nearest > longest {
                let message = "too little of the cable is seen around it: cut these frames off";
                let mut error = RecordingError::new(&self.path, message);
                error.place.frame = Some(frame);
                return Err(error);
            }
            let from = after.saturating_sub(size / 2).min(known.len() - size);
            let around = &known[from..from + size];
            let times: Vec<f64> = around.iter().map(|&own| (self.time[own] - time) / interval).collect();
            let weights = parabola(&times);
            let mut sum = DMatrix::zeros(CONTROL_POINTS, 2);
            for (&own, weight) in around.iter().zip(weights) {
                if let Some(points) = &fitted[own] {
                    sum += points * weight;
                }
            }
            let own = known[after.min(known.len() - 1)];
            smoothed.extend(systems[own].as_ref().map(|system| system.of(&sum)));
        }
        let smoothness = OF_SMOOTHNESS * smoothness(&smoothed);
        let control = smoothed.iter().filter_map(|system| Some(system.solved(smoothness)?.0)).collect();
        // At the ends of a clip parabolas are known from one side only, and the first two frames say how the cable begins.
        let cut = ((size - 1) / 2).min((self.time.len() - 3) / 2);
        Ok(Smooth { control, cut })
    }
}

/// The smooth curves of all frames.
pub(super) struct Smooth {
    /// Control points of each frame, a row each [px].
    control: Vec<DMatrix<f64>>,
    /// Frames at each end that are cut off.
    cut: usize,
}

impl Smooth {
    /// The frames that are of use.
    pub(super) fn kept(&self) -> Range<usize> {
        self.cut..self.control.len() - self.cut
    }

    /// Where a place along the cable is in a frame [px].
    pub(super) fn at(&self, frame: usize, s: f64) -> Vector2<f64> {
        let control = &self.control[frame];
        let (first, weights) = basis(s);
        let mut at = Vector2::zeros();
        for (k, weight) in weights.into_iter().enumerate() {
            at += Vector2::new(control[(first + k, 0)], control[(first + k, 1)]) * weight;
        }
        at
    }
}

/// The normal equations of a frame's points.
struct System {
    count: f64,
    matrix: DMatrix<f64>,
    side: DMatrix<f64>,
    /// Sum of the squares of the coordinates.
    squares: f64,
}

impl System {
    /// `None` where there are too few points, or none along a part of the cable.
    fn new(points: &[(f64, Vector2<f64>)]) -> Option<Self> {
        let mut places: Vec<f64> = points.iter().map(|(s, _)| *s).collect();
        places.extend([0.0, 1.0]);
        places.sort_by(f64::total_cmp);
        if points.len() < FEWEST_POINTS || places.windows(2).any(|pair| pair[1] - pair[0] > LONGEST_GAP) {
            return None;
        }
        let (mut matrix, mut side) =
            (DMatrix::zeros(CONTROL_POINTS, CONTROL_POINTS), DMatrix::zeros(CONTROL_POINTS, 2));
        let mut squares = 0.0;
        for (s, at) in points {
            let (first, weights) = basis(*s);
            squares += at.norm_squared();
            for (j, a) in weights.into_iter().enumerate() {
                for (k, b) in weights.into_iter().enumerate() {
                    matrix[(first + j, first + k)] += a * b;
                }
                side[(first + j, 0)] += a * at.x;
                side[(first + j, 1)] += a * at.y;
            }
        }
        Some(Self { count: points.len() as f64, matrix, side, squares })
    }

    /// The same for these control points in place of points.
    fn of(&self, control: &DMatrix<f64>) -> Self {
        let side = &self.matrix * control;
        Self { count: CONTROL_POINTS as f64, squares: side.dot(control), matrix: self.matrix.clone(), side }
    }

    /// Control points with this weight of their third differences, the squares that they leave and the degrees of freedom that they take.
    fn solved(&self, smoothness: f64) -> Option<(DMatrix<f64>, f64, f64)> {
        let mut penalised = self.matrix.clone();
        for first in 0..CONTROL_POINTS - 3 {
            for (j, a) in THIRD_DIFFERENCE.into_iter().enumerate() {
                for (k, b) in THIRD_DIFFERENCE.into_iter().enumerate() {
                    penalised[(first + j, first + k)] += smoothness * a * b;
                }
            }
        }
        let factor = penalised.cholesky()?;
        let control = factor.solve(&self.side);
        let left = self.squares - 2.0 * control.dot(&self.side) + (&self.matrix * &control).dot(&control);
        let taken = factor.solve(&self.matrix).trace();
        Some((control, left.max(0.0), taken))
    }
}

/// The weight of third differences by which points that are left out would be met best.
fn smoothness(systems: &[System]) -> f64 {
    let stride = systems.len().div_ceil(20);
    let missed = |smoothness: f64| -> f64 {
        let of = |system: &System| {
            let (_, left, taken) = system.solved(smoothness)?;
            Some(system.count * left / (system.count - taken).powi(2))
        };
        systems.iter().step_by(stride).map(|system| of(system).unwrap_or(f64::INFINITY)).sum()
    };
    let weights = (-12..=12).map(|power| 10.0_f64.powf(0.5 * f64::from(power)));
    weights.map(|weight| (weight, missed(weight))).min_by(|a, b| a.1.total_cmp(&b.1)).map_or(1.0, |(weight, _)| weight)
}

/// The four cubic B-splines on even knots that are not zero at `s`: the first one's number, and values.
fn basis(s: f64) -> (usize, [f64; 4]) {
    let spans = CONTROL_POINTS - 3;
    let place = s * spans as f64;
    let span = (place.floor().max(0.0) as usize).min(spans - 1);
    let t = place - span as f64;
    let values = [
        (1.0 - t).powi(3),
        3.0 * t.powi(3) - 6.0 * t * t + 4.0,
        -3.0 * t.powi(3) + 3.0 * t * t + 3.0 * t + 1.0,
        t.powi(3),
    ];
    (span, values.map(|value| value / 6.0))
}

/// The weights by which values at these times give the parabola nearest to them at time 0.
fn parabola(times: &[f64]) -> Vec<f64> {
    let design = DMatrix::from_fn(times.len(), 3, |row, power| times[row].powi(power as i32));
    let pseudo = design.pseudo_inverse(1e-12);
    pseudo.map_or_else(
        |_| vec![1.0 / times.len() as f64; times.len()],
        |inverse| inverse.row(0).iter().copied().collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filmed(frames: usize, count: usize) -> Centreline {
        let point = |frame: usize, k: usize| {
            let (s, t) = (k as f64 / (count - 1) as f64, frame as f64);
            (s, Vector2::new(100.0 + 800.0 * s + 2.0 * t, 300.0 * s * (1.0 - s) + 0.1 * t * t))
        };
        let points = (0..frames).map(|frame| (0..count).map(|k| point(frame, k)).collect()).collect();
        let time = (0..frames).map(|frame| 0.01 * frame as f64).collect();
        Centreline { path: "a.csv".into(), frames: (0..frames as i64).collect(), time, points }
    }

    #[test]
    fn parabolas_along_the_cable_and_over_time_stay() {
        let mut own = filmed(20, 41);
        // Two frames in which half of the cable is hidden, and one at the start.
        [0, 9, 10].into_iter().for_each(|frame| own.points[frame].truncate(20));
        let smooth = own.smoothed(0.1).unwrap();
        for frame in 0..20 {
            for s in [0.0, 0.013, 0.5, 0.77, 1.0] {
                let t = frame as f64;
                let expected = Vector2::new(100.0 + 800.0 * s + 2.0 * t, 300.0 * s * (1.0 - s) + 0.1 * t * t);
                assert!((smooth.at(frame, s) - expected).norm() < 1e-8, "frame {frame}, {s}");
            }
        }
    }

    #[test]
    fn what_is_hidden_for_long_is_told() {
        let mut own = filmed(40, 41);
        (10..35).for_each(|frame| own.points[frame].truncate(20));
        let error = own.smoothed(0.05).err().map(|error| error.to_string()).unwrap_or_default();
        assert_eq!(error, "a.csv: frame 15: too little of the cable is seen around it: cut these frames off");
    }
}
