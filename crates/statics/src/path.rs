//! Equilibria along a course: what is driven, or a load that changes, takes the rods from one to the next.
//!
//! The path goes on at folds, where no equilibrium lies ahead in time: there the rods would snap. It is followed by
//! pseudo-arclength (Keller 1977): the time is one more unknown, and a step goes so far along the path whether that leads on or
//! back in time. The matrix of a step is the exact tangent, taken as it is where it is not positive; by its signs the
//! directions are counted in which the equilibrium is unstable (Haynsworth 1968).

mod course;
mod params;
mod tracer;

use component::{Component, Members, split};
use course::Course;
use jointed::tangent::elimination::Elimination;
use rod::{JointForce, Model, State};
use tracer::{Found, Tracer};

use crate::error::{StaticError, unbreakable, without_contacts, without_eyelets};
use crate::{StaticReport, equilibrium, is_windy};

pub use params::PathParams;

/// An equilibrium of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathPoint {
    /// Time at which what is driven is there [s].
    pub time: f64,
    /// Length of the path up to here, in the unit of [`PathParams::longest_step`].
    pub length: f64,
    /// Directions in which it is unstable.
    pub unstable: usize,
}

/// What happens on a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathEventKind {
    /// The path turns back in time, or forward again: a rod that is driven on snaps to another equilibrium.
    Fold,
    /// Other paths cross or leave: a column buckles. The path goes on straight ahead.
    Bifurcation,
}

impl std::fmt::Display for PathEventKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            PathEventKind::Fold => "fold",
            PathEventKind::Bifurcation => "bifurcation",
        })
    }
}

/// A place of a path where directions become unstable or stable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathEvent {
    /// What it is.
    pub kind: PathEventKind,
    /// When [s].
    pub time: f64,
    /// Number of the equilibrium of the path that is there, from 0.
    pub point: usize,
    /// Directions in which the path is unstable before and after it.
    pub unstable: [usize; 2],
}

/// How a path ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathEnd {
    /// At the time up to which it was to be followed.
    Until,
    /// Back at time 0, after a fold.
    Start,
    /// At the most equilibria that were allowed.
    Points,
    /// Where it was stopped.
    Stopped,
    /// Where no equilibrium was found close by: at a jump of what is driven, or where joints cannot stay together.
    Lost,
    /// Before it began: the first equilibrium was not found.
    NoStart,
}

/// What became of a path.
#[derive(Clone, Debug, PartialEq)]
pub struct PathReport {
    /// How the first equilibrium was found.
    pub start: StaticReport,
    /// Number of equilibria.
    pub points: usize,
    /// Linear solves, those of the first equilibrium and of steps that were taken back included.
    pub solves: usize,
    /// Folds and bifurcations, in order.
    pub events: Vec<PathEvent>,
    /// How it ended.
    pub end: PathEnd,
}

/// Follows the equilibria of a model from that to which [`equilibrium`] brings `state` at time 0, along the model's motions,
/// changing loads and changing gravity, on and back in time. `each` is told of every one in turn: where it is, and what its joints
/// transmit; it returns whether to go on. Of the last one `state` is left. Joints with laws go from each equilibrium to the next in one
/// increment, infinitely slowly: the path loads them, and unloads them.
///
/// # Errors
/// If the model, the state or a parameter is not valid, and [`StaticError::Path`] if nothing changes over time, if sets of
/// rods change that are not joined, or if the model has what a path does not know: contacts, wind, torques as loads, grips with
/// times, several loops.
pub fn path(
    model: &Model,
    state: &mut State,
    params: &PathParams,
    each: &mut dyn FnMut(&PathPoint, &State, &[JointForce]) -> bool,
) -> Result<PathReport, StaticError> {
    model.validate(state)?;
    params.validate()?;
    without_eyelets(model, "a path of equilibria")?;
    unbreakable(model, "a path of equilibria")?;
    without_contacts(model, "a path of equilibria")?;
    if is_windy(model) {
        return Err(StaticError::Path("a scene without wind, whose drag has no energy"));
    }
    if model.motions.iter().any(rod::Driven::is_timed) {
        return Err(StaticError::Path("grips that hold all the time, but some take hold or let go on the way"));
    }
    // What is fixed goes on with the velocities that it has; they are left aside to find the first equilibrium.
    let moving = state.clone();
    let start = equilibrium(model, state, &params.rest)?;
    let (begins_at_rest, solves) = (start.converged, start.steps);
    let mut report = PathReport { start, points: 0, solves, events: Vec::new(), end: PathEnd::NoStart };
    let mut begins = state.clone();
    for (i, _) in model.segments.iter().enumerate().filter(|(_, segment)| segment.fixed) {
        begins.velocities[i] = moving.velocities[i];
        begins.angular_velocities[i] = moving.angular_velocities[i];
    }
    let mut changing = None;
    for (members, topology) in split(model) {
        let topology = std::sync::Arc::new(topology);
        let mut component = Component::new(model, &begins, topology.clone(), &[&members]);
        if !component.changes() {
            continue;
        }
        if changing.is_some() {
            return Err(StaticError::Path(
                "all that changes over time to be joined, but it is several sets of rods; take them one by one",
            ));
        }
        if component.has_torques() {
            return Err(StaticError::Path(
                "loads that are forces fixed in space: torques, and loads that follow their segments, have no energy",
            ));
        }
        let elimination = Elimination::new(&topology).ok_or(StaticError::Loops("a path of equilibria"))?;
        component.stop_inner_damping();
        component.change_laws_slowly();
        changing = Some((component, members, elimination));
    }
    let Some((component, members, elimination)) = changing else {
        return Err(StaticError::Path("something that changes over time: a motion, a load or gravity"));
    };
    if !begins_at_rest {
        return Ok(report);
    }
    let mut tracer = Tracer::new(component, elimination, params);
    let forces = report.start.forces.clone();
    let mut teller = Teller { model, state, members, each, length: 0.0, forces };
    follow(&mut tracer, &Course::new(model, params.until), params, &mut teller, &mut report);
    report.solves += tracer.solves;
    Ok(report)
}

/// Tells of the equilibria that are found.
struct Teller<'a> {
    model: &'a Model,
    state: &'a mut State,
    members: Members,
    each: &'a mut dyn FnMut(&PathPoint, &State, &[JointForce]) -> bool,
    length: f64,
    /// What joints transmit; those of sets that do not change as at the start.
    forces: Vec<JointForce>,
}

impl Teller<'_> {
    /// Tells of an equilibrium, from whose internal variables the path goes on; returns whether to go on, and has said so in the report where not.
    fn tell(&mut self, tracer: &mut Tracer, found: &Found, report: &mut PathReport) -> bool {
        tracer.balance.stand(&found.place, found.place.time);
        tracer.balance.component.end_laws();
        tracer.balance.component.store_state(self.state, &self.members, 0);
        self.state.velocities.fill(nalgebra::Vector3::zeros());
        self.state.angular_velocities.fill(nalgebra::Vector3::zeros());
        tracer.balance.component.store_joint_forces(&mut self.forces, &self.members, 0);
        let point = PathPoint { time: found.place.time, length: self.length, unstable: found.unstable };
        report.points += 1;
        let goes_on = (self.each)(&point, self.state, &self.forces);
        if !goes_on {
            report.end = PathEnd::Stopped;
        }
        goes_on
    }
}

/// Shorter steps are not taken, in the longest one's length.
const SHORTEST: f64 = 1e-6;
/// Cosine of the angle that the path turns by in a step at most, unless the step is short.
const STRAIGHT: f64 = 0.9;
/// The longest way of a step beside its length.
const FAR: f64 = 1.3;
/// A step so short that turns by more is tried as a longer one, in the longest one's length, and so many times as long.
const SHORT: f64 = 1e-2;
const LEAPS: [f64; 4] = [8.0, 16.0, 32.0, 64.0];
/// Iterations that a step should take.
const GOOD: f64 = 6.0;
/// A fold or a bifurcation is found to this share of the longest step.
const PLACE: f64 = 1e-5;

/// Follows the path from the equilibrium at time 0 at which the tracer stands.
fn follow(tracer: &mut Tracer, course: &Course, params: &PathParams, teller: &mut Teller<'_>, report: &mut PathReport) {
    let mut stretch = 0;
    // The first time brings the forces.
    let Some(first) = tracer.hold(tracer.balance.place(0.0), course.stretch(0), 1.0) else { return };
    let Some(mut here) = tracer.hold(first.place, course.stretch(0), 1.0) else { return };
    report.end = PathEnd::Points;
    if !teller.tell(tracer, &here, report) {
        return;
    }
    let has_laws = !teller.model.laws.is_empty();
    let mut step = 0.25 * params.longest_step;
    while report.points < params.most_points {
        if step < SHORTEST * params.longest_step {
            report.end = PathEnd::Lost;
            return;
        }
        let [begin, end] = course.stretch(stretch);
        // Beyond the stretch what yields may unload, and a step there would look for both.
        let ahead = here.place.time + step * here.direction.time;
        let lands = has_laws && !(begin..=end).contains(&ahead);
        let found = match lands {
            true => land(tracer, &here, step, ahead, [begin, end]),
            false => tracer.go(&here, step, [begin, end]),
        };
        let Some(mut next) = found else {
            step *= 0.5;
            continue;
        };
        let mut way = step;
        if !lands && !goes_on(tracer, &here, &next, step) {
            if step > SHORT * params.longest_step {
                step *= 0.5;
                continue;
            }
            // However short the step, it turns off: beside a bifurcation, which a longer one leaves behind.
            let leap = LEAPS.into_iter().find_map(|by| {
                let found = tracer.go(&here, by * step, [begin, end])?;
                goes_on(tracer, &here, &found, by * step).then_some((by, found))
            });
            if let Some((by, found)) = leap {
                (way, next) = (by * step, found);
            }
        }
        // A stretch of the course ends: the path stops there, and goes on with what comes next.
        let leaves = lands || next.place.time > end || next.place.time < begin;
        let forward = if lands { ahead > end } else { next.place.time > end };
        if leaves && !lands {
            let Some(landed) = land(tracer, &here, way, next.place.time, [begin, end]) else {
                step *= 0.5;
                continue;
            };
            next = landed;
        }
        let Some(events) = locate(tracer, &here, &next, [begin, end], PLACE * params.longest_step) else {
            step *= 0.5;
            continue;
        };
        let good = way * (GOOD / next.iterations as f64).clamp(0.5, 2.0);
        let passed_events = !events.is_empty();
        for [before, after] in events {
            teller.length += tracer.balance.distance(&here.place, &after.place);
            let turns = before.direction.time * after.direction.time < 0.0;
            report.events.push(PathEvent {
                kind: if turns { PathEventKind::Fold } else { PathEventKind::Bifurcation },
                time: 0.5 * (before.place.time + after.place.time),
                point: report.points,
                unstable: [before.unstable, after.unstable],
            });
            here = after;
            if !teller.tell(tracer, &here, report) {
                return;
            }
        }
        if passed_events && has_laws {
            // Internal variables are no longer those that the step began with.
            step = good.min(params.longest_step);
            continue;
        }
        let way = tracer.balance.distance(&here.place, &next.place);
        teller.length += way;
        step = good.min(params.longest_step);
        here = next;
        if way > 0.0 && !teller.tell(tracer, &here, report) {
            return;
        }
        if leaves {
            let Some(beyond) = course.beyond(stretch, forward) else {
                report.end = if forward { PathEnd::Until } else { PathEnd::Start };
                return;
            };
            stretch = beyond;
            let sign = here.direction.time.signum();
            let Some(turned) = tracer.hold(here.place.clone(), course.stretch(stretch), sign) else {
                report.end = PathEnd::Lost;
                return;
            };
            here = turned;
        }
    }
}

/// The equilibrium at the end of a stretch, where the `way` along the path would lead to a time `beyond` it.
fn land(tracer: &mut Tracer, here: &Found, way: f64, beyond: f64, [begin, end]: [f64; 2]) -> Option<Found> {
    let forward = beyond > end;
    let limit = if forward { end } else { begin };
    let passed = beyond - here.place.time;
    let share = ((limit - here.place.time) / passed).clamp(0.0, 1.0);
    let sign = if forward { 1.0 } else { -1.0 };
    let mut place = here.place.moved(&here.direction, share * way);
    place.time = limit;
    tracer.hold(place, [begin, end], sign)
}

/// Whether a step leads straight on, and not far aside.
fn goes_on(tracer: &Tracer, here: &Found, next: &Found, step: f64) -> bool {
    let Tracer { balance, .. } = tracer;
    balance.dot(&here.direction, &next.direction) >= STRAIGHT
        && balance.distance(&here.place, &next.place) <= FAR * step
}

/// The equilibria between which signs change on the way from `here` to `next`, in order, by bisection; the path goes on from
/// `next`, as beside a bifurcation its direction is lost in rounding errors. `None` where the way jumps from one path to another.
fn locate(
    tracer: &mut Tracer,
    here: &Found,
    next: &Found,
    stretch: [f64; 2],
    accuracy: f64,
) -> Option<Vec<[Found; 2]>> {
    let (mut events, mut before) = (Vec::new(), here.clone());
    while before.unstable != next.unstable {
        let mut after = next.clone();
        while tracer.balance.distance(&before.place, &after.place) > accuracy {
            // Where paths meet, there may be none in between that can be told from both.
            let Some(middle) = tracer.between(&before, &after, stretch) else { break };
            if !is_in_line(tracer, &before, &after, &middle) {
                break;
            }
            if middle.unstable == before.unstable {
                before = middle;
            } else {
                after = middle;
            }
        }
        if ![&before, &after].into_iter().all(|end| is_in_line(tracer, &before, &after, end)) {
            return None;
        }
        events.push([std::mem::replace(&mut before, after.clone()), after]);
    }
    Some(events)
}

/// Whether the path goes through an equilibrium in the direction from `before` to `after`, and no further off than they are.
fn is_in_line(tracer: &Tracer, before: &Found, after: &Found, found: &Found) -> bool {
    let way = before.place.to(&after.place);
    let Tracer { balance, .. } = tracer;
    let length = balance.dot(&way, &way).sqrt();
    balance.dot(&found.direction, &way) >= STRAIGHT * length
        && balance.distance(&before.place, &found.place) <= FAR * length
}
