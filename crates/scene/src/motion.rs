//! From an entry of `[[rods.motions]]`, or an obstacle's `motion`, to a motion: lists in the scene, or columns of a CSV file.

use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};
use rod::{Interpolation, Motion, Pose, Track};
use toml::Spanned;

use crate::error::{Result, Source};
use crate::format;
use crate::given::{Given, Turning, Way, unit};
use crate::table::read;

/// An entry's motion, for whatever it drives.
pub(crate) struct Prepared {
    given: Given,
    interpolation: Interpolation,
    /// The motion itself, where it is the same for all.
    shared: Option<Arc<Motion>>,
}

impl Prepared {
    /// Reads and checks an entry, its file included.
    pub(crate) fn new(source: &Source, entry: &Spanned<format::Motion>) -> Result<Self> {
        let own = entry.get_ref();
        let given = match (&own.file, &own.times_s) {
            (Some(file), None) => {
                if let Some(span) = spans(own).into_iter().flatten().next() {
                    return source.wrong(span, "goes with `times_s`; with `file` it is a column of that file");
                }
                read(source, file)?
            }
            (None, Some(times)) => lists(source, own, times)?,
            _ => return source.wrong(entry.span(), "give either `times_s` and lists, or a `file`"),
        };
        if let (true, Some(interpolation)) = (given.goes_by_velocity(), &own.interpolation) {
            return source
                .wrong(interpolation.span(), "goes with poses; velocities are held from one time to the next");
        }
        let mut prepared = Self { given, interpolation: interpolation(&own.interpolation), shared: None };
        if matches!((&prepared.given.way, &prepared.given.turning), (Way::Positions(_), Turning::Orientations(_))) {
            let anywhere = Pose { position: Vector3::zeros(), orientation: UnitQuaternion::identity() };
            prepared.shared = Some(prepared.motion(source, entry, &anywhere)?);
        }
        Ok(prepared)
    }

    /// Whether it is the body's own way: of one that a grip takes hold of later it begins where the body is then.
    pub(crate) fn moves_along(&self) -> bool {
        !matches!(self.given.way, Way::Positions(_))
    }

    /// The motion of what begins at `pose`; `entry` is what was read.
    pub(crate) fn motion(&self, source: &Source, entry: &Spanned<format::Motion>, pose: &Pose) -> Result<Arc<Motion>> {
        if let Some(shared) = &self.shared {
            return Ok(shared.clone());
        }
        match self.given.motion(pose, self.interpolation) {
            Ok(motion) => Ok(Arc::new(motion)),
            Err(error) => source.wrong(entry.span(), &error.to_string()),
        }
    }
}

pub(crate) fn interpolation(given: &Option<Spanned<format::Interpolation>>) -> Interpolation {
    match given.as_ref().map(Spanned::get_ref) {
        Some(format::Interpolation::Held) => Interpolation::Held,
        Some(format::Interpolation::Smooth) => Interpolation::Smooth,
        Some(format::Interpolation::Linear) | None => Interpolation::Linear,
    }
}

/// Places in the text of the lists that are given: three of where it goes, three of how it turns.
fn spans(given: &format::Motion) -> [Option<std::ops::Range<usize>>; 6] {
    let of = |list: &Option<Spanned<Vec<format::Vector>>>| list.as_ref().map(Spanned::span);
    [
        of(&given.shifts_m),
        of(&given.positions_m),
        of(&given.velocities_m_s),
        of(&given.turns_deg),
        given.orientations.as_ref().map(Spanned::span),
        of(&given.angular_velocities_rad_s),
    ]
}

/// The lists of the scene, checked.
fn lists(source: &Source, given: &format::Motion, times: &Spanned<Vec<format::Number>>) -> Result<Given> {
    let spans = spans(given);
    for kind in spans.chunks(3) {
        if let Some(second) = kind.iter().flatten().nth(1) {
            return source.wrong(second.clone(), "says a second time what another list says; leave one of them out");
        }
    }
    let count = times.get_ref().len();
    if spans.iter().all(Option::is_none) {
        return source.wrong(times.span(), "without a list of what happens at these times, such as `shifts_m`");
    }
    let seconds = ascending(source, times)?;
    let vectors = |list: &Option<Spanned<Vec<format::Vector>>>, unit: &str| {
        let Some(list) = list else { return Ok(None) };
        one_a_time(source, list, count)?;
        list.get_ref().iter().map(|value| source.vector(value, unit)).collect::<Result<Vec<_>>>().map(Some)
    };
    let first_is_zero = |list: &Option<Spanned<Vec<format::Vector>>>| {
        let first = list.as_ref().and_then(|list| list.get_ref().first());
        match first.filter(|first| first.get_ref().0 != [0.0; 3]) {
            Some(first) => source.must_be(first.span(), "[0, 0, 0]: a motion begins where its body is"),
            None => Ok(()),
        }
    };
    first_is_zero(&given.shifts_m)?;
    first_is_zero(&given.turns_deg)?;
    let way = match (vectors(&given.shifts_m, "m")?, vectors(&given.positions_m, "m")?) {
        (Some(shifts), _) => Way::Shifts(shifts),
        (_, Some(positions)) => Way::Positions(positions),
        _ => vectors(&given.velocities_m_s, "m/s")?.map_or(Way::None, Way::Velocities),
    };
    let turning = match (vectors(&given.turns_deg, "degrees")?, &given.orientations) {
        (Some(turns), _) => Turning::Turns(turns.iter().map(|turn| turn.map(f64::to_radians)).collect()),
        (_, Some(list)) => {
            one_a_time(source, list, count)?;
            let turn = |value: &format::Quaternion| match unit(value.get_ref().0) {
                Some(turn) => Ok(turn),
                None => source.must_be(value.span(), "a unit quaternion [w, x, y, z], its norm 1 to within 1e-3"),
            };
            Turning::Orientations(list.get_ref().iter().map(turn).collect::<Result<_>>()?)
        }
        _ => vectors(&given.angular_velocities_rad_s, "rad/s")?.map_or(Turning::None, Turning::Rates),
    };
    let course = Given { times: seconds, way, turning };
    if course.is_mixed() {
        return source.wrong(times.span(), "velocities and poses do not go together; give one or the other");
    }
    Ok(course)
}

/// The times [s] of a list, each later than the one before.
pub(crate) fn ascending(source: &Source, times: &Spanned<Vec<format::Number>>) -> Result<Vec<f64>> {
    let mut seconds: Vec<f64> = Vec::with_capacity(times.get_ref().len());
    for time in times.get_ref() {
        let now = source.not_negative(time, "s")?;
        if seconds.last().is_some_and(|&before| now <= before) {
            return source.must_be(time.span(), "later than the time before it");
        }
        seconds.push(now);
    }
    Ok(seconds)
}

/// Vectors over time, in `unit`.
pub(crate) fn track(
    source: &Source,
    times: &Spanned<Vec<format::Number>>,
    values: &Spanned<Vec<format::Vector>>,
    between: &Option<Spanned<format::Interpolation>>,
    repeats: bool,
    unit: &str,
) -> Result<Arc<Track>> {
    let seconds = ascending(source, times)?;
    one_a_time(source, values, seconds.len())?;
    let vector = |(time, value): (f64, &format::Vector)| Ok((time, source.vector(value, unit)?));
    let values = seconds.into_iter().zip(values.get_ref()).map(vector).collect::<Result<Vec<_>>>()?;
    made(source, times.span(), &values, interpolation(between), repeats)
}

/// The track through these values, over and over if it repeats; `span` stands in errors.
pub(crate) fn made(
    source: &Source,
    span: std::ops::Range<usize>,
    values: &[(f64, Vector3<f64>)],
    between: Interpolation,
    repeats: bool,
) -> Result<Arc<Track>> {
    let track = Track::new(values, between).and_then(|track| if repeats { track.repeated() } else { Ok(track) });
    track.map(Arc::new).or_else(|error| source.wrong(span, &error.to_string()))
}

pub(crate) fn one_a_time<T>(source: &Source, list: &Spanned<Vec<T>>, count: usize) -> Result<()> {
    match list.get_ref().len() {
        found if found == count => Ok(()),
        found => source.wrong(list.span(), &format!("has {found} entries, but `times_s` has {count}")),
    }
}
