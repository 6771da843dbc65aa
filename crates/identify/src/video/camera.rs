//! Pinhole cameras, and what they say of where a cable is.

use std::convert::Infallible;

use cosserat::optimise::{LeastSquares, Normal, Residuals};
use nalgebra::{DMatrix, DVector, Rotation3, Vector2, Vector3};

/// What the first camera sees of a frame at even places along the cable, and the second one if there is one [px].
pub(super) type Views = (Vec<Vector2<f64>>, Option<Vec<Vector2<f64>>>);

/// By how much the length of the cable may change, root mean square.
const MOST_STRETCH: f64 = 0.1;
/// What cameras usually are: the focal length in widths of the picture, by a factor of e^0.5. It decides where nothing else does: of one
/// camera that looks along the normal.
const USUAL_FOCAL: f64 = 0.9;

/// What is known of a video.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Video {
    /// Length of the cable, the parts in the grips included [m].
    pub length: f64,
    /// Length at each end that a grip holds straight [m]: it gives the grip's direction.
    pub grip: f64,
    /// Width and height of the pictures [px].
    pub image: [f64; 2],
    /// Focal length of the cameras [px]; `None`: it is found.
    pub focal: Option<f64>,
    /// By how much the first of two cameras looks down [rad]. One camera tells it by itself.
    pub pitch: f64,
    /// Time over which positions are smoothed by parabolas [s].
    pub window: f64,
    /// Markers to make, two in each grip included.
    pub markers: usize,
}

/// Cameras, and where they are.
pub(super) struct Cameras {
    pinholes: Pinholes,
    /// Middle of the picture [px].
    middle: Vector2<f64>,
    /// Lengths of the frame in which cameras are found, to metres.
    scale: f64,
    /// See [`super::Reconstruction`].
    pub(super) missed: f64,
    pub(super) stretch: f64,
    /// Directions to the right, away and up in the first camera's axes: to its right, down and forward.
    axes: [Vector3<f64>; 3],
}

/// One camera and a plane, or two cameras.
enum Pinholes {
    /// Focal length [px], and the normal of the plane at the distance 1.
    One { focal: f64, normal: Vector3<f64> },
    /// Focal lengths [px], and how the second camera sees what the first one does: turned, then shifted.
    Two { focal: [f64; 2], turn: Rotation3<f64>, shift: Vector3<f64> },
}

impl Pinholes {
    /// From the numbers that are searched for.
    fn new(numbers: &DVector<f64>, has_two: bool) -> Self {
        if has_two {
            let turn = Rotation3::new(Vector3::new(numbers[2], numbers[3], numbers[4]));
            let shift = Vector3::new(numbers[5], numbers[6], numbers[7]);
            return Self::Two { focal: [numbers[0].exp(), numbers[1].exp()], turn, shift };
        }
        Self::One { focal: numbers[0].exp(), normal: Vector3::new(numbers[1], numbers[2], 1.0).normalize() }
    }

    /// Focal length of each camera [px].
    fn focal(&self) -> Vec<f64> {
        match self {
            Self::One { focal, .. } => vec![*focal],
            Self::Two { focal, .. } => focal.to_vec(),
        }
    }

    /// Where a place is that cameras see so, from the middles of their pictures, and how far each of them misses it [px].
    fn place(&self, first: Vector2<f64>, second: Option<Vector2<f64>>) -> (Vector3<f64>, [Vector2<f64>; 2]) {
        match (self, second) {
            (Self::Two { focal, turn, shift }, Some(second)) => {
                let [a, b] = [ray(first, focal[0]), turn.inverse() * ray(second, focal[1])];
                let from = turn.inverse() * -*shift;
                // The middle of the shortest way between both rays.
                let (aa, ab, bb) = (a.norm_squared(), a.dot(&b), b.norm_squared());
                let determinant = (aa * bb - ab * ab).max(1e-12 * aa * bb);
                let (on_a, on_b) = (a.dot(&from), b.dot(&from));
                let [t, u] = [(on_a * bb - ab * on_b) / determinant, (ab * on_a - aa * on_b) / determinant];
                let at = (a * t + from + b * u) * 0.5;
                let missed = |at: Vector3<f64>, focal: f64, seen: Vector2<f64>| {
                    if at.z > 1e-6 { at.xy() * (focal / at.z) - seen } else { Vector2::repeat(focal) }
                };
                (at, [missed(at, focal[0], first), missed(turn * at + shift, focal[1], second)])
            }
            (Self::One { focal, normal }, _) => {
                let ray = ray(first, *focal);
                (ray / normal.dot(&ray).max(1e-3), [Vector2::zeros(); 2])
            }
            (Self::Two { .. }, None) => (Vector3::zeros(), [Vector2::zeros(); 2]),
        }
    }
}

/// The direction in which a camera sees a point of its picture, from the middle.
fn ray(at: Vector2<f64>, focal: f64) -> Vector3<f64> {
    Vector3::new(at.x / focal, at.y / focal, 1.0)
}

/// What cameras leave unexplained.
struct Fit {
    /// What each point is off [px]: of rays that miss each other, of lengths that change.
    residuals: DVector<f64>,
    /// The lengths' scale that makes their mean right [m].
    scale: f64,
    missed: f64,
    stretch: f64,
}

/// What is left unexplained of what was seen, from the middles of the pictures.
fn fit(pinholes: &Pinholes, seen: &[Views], video: &Video) -> Fit {
    let mut residuals = Vec::new();
    // Lengths between neighbours, and what they are in the picture [px].
    let mut parts = Vec::new();
    for (first, second) in seen {
        let mut before: Option<Vector3<f64>> = None;
        for (k, &seen) in first.iter().enumerate() {
            let other = second.as_ref().map(|own| own[k]);
            let (at, missed) = pinholes.place(seen, other);
            if other.is_some() {
                residuals.extend(missed.iter().flat_map(|own| [own.x, own.y]));
            }
            if let Some(before) = before {
                parts.push(((at - before).norm(), (seen - first[k - 1]).norm()));
            }
            before = Some(at);
        }
    }
    let squares = |values: &[f64]| values.iter().map(|own| own * own).sum::<f64>();
    let missed = (squares(&residuals) / (residuals.len().max(2) / 2) as f64).sqrt();
    let mean = parts.iter().map(|(length, _)| length).sum::<f64>() / parts.len() as f64;
    let in_picture = parts.iter().map(|(_, length)| length).sum::<f64>() / parts.len() as f64;
    let changes: Vec<f64> = parts.iter().map(|(length, _)| length / mean - 1.0).collect();
    let stretch = (squares(&changes) / changes.len() as f64).sqrt();
    residuals.extend(changes.iter().map(|change| change * in_picture));
    // As much as one point that is a pixel off.
    let expected = video.focal.unwrap_or(USUAL_FOCAL * video.image[0]);
    residuals.extend(pinholes.focal().iter().map(|focal| (focal / expected).ln() / 0.5));
    let parts_of_frame = parts.len() as f64 / seen.len() as f64;
    Fit { residuals: DVector::from_vec(residuals), scale: video.length / (parts_of_frame * mean), missed, stretch }
}

/// What cameras of such numbers leave unexplained, with derivatives by differences.
struct Unexplained<'a> {
    seen: &'a [Views],
    video: &'a Video,
    has_two: bool,
}

impl Unexplained<'_> {
    fn residuals(&self, numbers: &DVector<f64>) -> DVector<f64> {
        fit(&Pinholes::new(numbers, self.has_two), self.seen, self.video).residuals
    }
}

impl Residuals for Unexplained<'_> {
    type Error = Infallible;

    fn loss(&mut self, numbers: &DVector<f64>) -> Result<f64, Infallible> {
        Ok(0.5 * self.residuals(numbers).norm_squared())
    }

    fn normal(&mut self, numbers: &DVector<f64>) -> Result<Normal, Infallible> {
        let step = 1e-6;
        let slope = |k: usize| {
            let moved = |by: f64| {
                let mut other = numbers.clone();
                other[k] += by;
                self.residuals(&other)
            };
            (moved(step) - moved(-step)) / (2.0 * step)
        };
        let slopes: Vec<DVector<f64>> = (0..numbers.len()).map(slope).collect();
        Ok(Normal::new(&self.residuals(numbers), &DMatrix::from_columns(&slopes)))
    }
}

impl Cameras {
    /// The cameras by which rays meet best and the cable keeps its length best.
    pub(super) fn find(seen: &[Views], video: &Video) -> Result<Self, String> {
        let middle = Vector2::new(video.image[0], video.image[1]) * 0.5;
        let centred = |own: &Vec<Vector2<f64>>| own.iter().map(|at| at - middle).collect::<Vec<_>>();
        let seen: Vec<Views> = seen.iter().map(|(a, b)| (centred(a), b.as_ref().map(centred))).collect();
        let has_two = seen.iter().all(|(_, second)| second.is_some());
        let focal = video.focal.unwrap_or(USUAL_FOCAL * video.image[0]).ln();
        // Two cameras at the same height that look at the same place, or a plane seen from the front and from its sides.
        let starts: Vec<Vec<f64>> = if has_two {
            [30.0_f64, 60.0, 90.0, 120.0, 150.0]
                .iter()
                .flat_map(|angle| [*angle, -angle])
                .map(|angle| {
                    let turn = Rotation3::new(Vector3::y() * angle.to_radians());
                    let shift = Vector3::z() - turn * Vector3::z();
                    [vec![focal; 2], turn.scaled_axis().iter().copied().collect(), shift.iter().copied().collect()]
                        .concat()
                })
                .collect()
        } else {
            [[0.0, 0.0], [0.5, 0.0], [-0.5, 0.0], [0.0, 0.5], [0.0, -0.5]].map(|[x, y]| vec![focal, x, y]).to_vec()
        };
        let mut unexplained = Unexplained { seen: &seen, video, has_two };
        // What is known stays.
        let known = if video.focal.is_some() { 1 + usize::from(has_two) } else { 0 };
        let mut search = |start: Vec<f64>| {
            let bound = |(k, &at): (usize, &f64)| if k < known { [at; 2] } else { [f64::NEG_INFINITY, f64::INFINITY] };
            let bounds = start.iter().enumerate().map(bound).collect();
            let start = DVector::from_vec(start);
            let mut search = LeastSquares { bounds, tolerance: 1e-9, ..LeastSquares::new(start) };
            let Ok(found) = search.run(&mut unexplained, 60);
            (search.x, found.loss)
        };
        let best = starts.into_iter().map(&mut search).min_by(|(_, a), (_, b)| a.total_cmp(b));
        let Some((numbers, _)) = best else { return Err("there are no cameras".into()) };
        let pinholes = Pinholes::new(&numbers, has_two);
        let Fit { scale, missed, stretch, .. } = fit(&pinholes, &seen, video);
        if stretch.is_nan() || stretch > MOST_STRETCH {
            let why = if has_two {
                "do both clips have the same frame numbers, and s the same start?"
            } else {
                "does it move in one plane, and is s a share of its length?"
            };
            return Err(format!(
                "no camera explains what is seen: parts of the cable change their length by {:.0} % (root mean square), at most {:.0} % is \
                 allowed; {why}",
                100.0 * stretch,
                100.0 * MOST_STRETCH
            ));
        }
        let axes = match &pinholes {
            Pinholes::One { normal, .. } => {
                // Both the plane's normal and what is to the right in a picture that stands upright are level.
                let up = Vector3::x().cross(normal).normalize();
                [normal.cross(&up).normalize() * -1.0, *normal, up]
            }
            Pinholes::Two { .. } => {
                let (sine, cosine) = video.pitch.sin_cos();
                let up = Vector3::new(0.0, -cosine, -sine);
                [Vector3::x(), up.cross(&Vector3::x()), up]
            }
        };
        Ok(Self { pinholes, middle, scale, missed, stretch, axes })
    }

    /// Where a place is that cameras see so [px]: to the right, away and up from the first camera [m]; of one camera in the plane of the motion.
    pub(super) fn place(&self, first: Vector2<f64>, second: Option<Vector2<f64>>) -> Vector3<f64> {
        let (at, _) = self.pinholes.place(first - self.middle, second.map(|own| own - self.middle));
        let at = at * self.scale;
        let [right, away, up] = self.axes.map(|axis| axis.dot(&at));
        // All of the plane is as far away, but for rounding.
        let away = if matches!(self.pinholes, Pinholes::One { .. }) { 0.0 } else { away };
        Vector3::new(right, away, up)
    }

    /// Focal length of each camera [px].
    pub(super) fn focal(&self) -> Vec<f64> {
        self.pinholes.focal()
    }

    /// See [`super::Reconstruction`].
    pub(super) fn angle(&self) -> f64 {
        match &self.pinholes {
            Pinholes::One { normal, .. } => normal.z.clamp(-1.0, 1.0).acos(),
            Pinholes::Two { turn, .. } => (turn * Vector3::z()).z.clamp(-1.0, 1.0).acos(),
        }
    }
}
