//! Continuation: an easy query is solved, and brought to the one that is asked in steps, each begun at the last answer.

use equilibria::known::{Known, Previous};
use equilibria::start::Starts;
use equilibria::{Answer, Grip, Params, ParamsError, Query, QueryError, solve_from};
use nalgebra::{UnitQuaternion, Vector3};

/// Error of all answers but the last.
const ON_THE_WAY: f64 = 1e-2;
/// Distance of the grips over the length of the easy query.
const EASY: f64 = 0.95;

/// What is changed on the way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Continued {
    /// The weight, from none.
    Load,
    /// The grips, from where they pull the cable nearly straight.
    Pose,
}

impl Continued {
    /// The query at a share of the way, whose end is 1.
    fn at(self, query: &Query, share: f64) -> Query {
        let mut own = *query;
        match (self, query.end) {
            (Self::Load, _) => {
                own.cable.weight *= share;
                own.cable.carried.weight *= share;
            }
            (Self::Pose, None) => {}
            (Self::Pose, Some(end)) => {
                let chord = end.position - query.start.position;
                let far = query.start.position + chord * (EASY * query.cable.length / chord.norm().max(1e-9));
                // The first grip turned along the chord, and the second one alike.
                let axis = query.start.orientation * Vector3::z();
                let along = UnitQuaternion::rotation_between(&axis, &chord).unwrap_or_default();
                let straight = along * query.start.orientation;
                let turned = |q: &UnitQuaternion<f64>| straight.try_slerp(q, share, 1e-9).unwrap_or(*q);
                own.start.orientation = turned(&query.start.orientation);
                let position = far + (end.position - far) * share;
                own.end = Some(Grip { position, orientation: turned(&end.orientation) });
            }
        }
        own
    }
}

/// Answers of queries after so many steps, the first of which begins at `starts`. Solves of all steps count.
pub(super) fn solve(
    queries: &[Query],
    params: &Params,
    starts: &dyn Starts,
    (what, steps): (Continued, usize),
) -> Result<Vec<Result<Answer, QueryError>>, ParamsError> {
    let mut known: Vec<Known> = Vec::new();
    let mut solves = vec![0; queries.len()];
    let mut answers = Vec::new();
    for step in 1..=steps {
        let is_last = step == steps;
        let own: Vec<Query> = queries.iter().map(|query| what.at(query, step as f64 / steps as f64)).collect();
        let tolerance = if is_last { params.tolerance } else { ON_THE_WAY };
        let params = Params { tolerance, levels: Vec::new(), again: false, ..params.clone() };
        answers = if step == 1 {
            solve_from(&own, &params, starts)?
        } else {
            solve_from(&own, &params, &Previous(known.clone()))?
        };
        if step == 1 {
            // What has no first answer goes on from that of a neighbour, and fails or not.
            let other = answers.iter().zip(&own).find_map(|(answer, query)| Known::of(query, answer.as_ref().ok()?));
            known = vec![other.unwrap_or_default(); queries.len()];
            if !known[0].is_known() {
                return Ok(answers);
            }
        }
        for (k, (answer, query)) in answers.iter().zip(&own).enumerate() {
            if let Ok(answer) = answer {
                solves[k] += answer.solves;
                known[k] = Known::of(query, answer).unwrap_or_else(|| known[k].clone());
            }
        }
    }
    for (answer, solves) in answers.iter_mut().zip(solves) {
        answer.iter_mut().for_each(|answer| answer.solves = solves);
    }
    Ok(answers)
}

#[cfg(test)]
mod tests {
    use equilibria::sample::Distribution;
    use equilibria::start::Curves;

    use super::*;

    /// The way ends at the query itself, and what it finds is an equilibrium of it.
    #[test]
    fn the_way_ends_at_the_query() {
        let queries: Vec<Query> = (0..30).map(|k| Distribution::default().query(4, k)).collect();
        let params = Params { segments: 24, ..Params::default() };
        let lowest = equilibria::solve(&queries, &params).unwrap();
        for what in [Continued::Load, Continued::Pose] {
            for query in &queries {
                let (own, first) = (what.at(query, 1.0), what.at(query, 0.2));
                let off = |a: Grip, b: Grip| (a.position - b.position).norm() + a.orientation.angle_to(&b.orientation);
                assert!(off(own.start, query.start) + off(own.end.unwrap(), query.end.unwrap()) < 1e-6);
                assert_eq!(own.cable, query.cable);
                assert!(first.validate().is_ok(), "{first:?}");
            }
            let sag = Curves { hermite: false, sagging: true, both_twists: false };
            let found = solve(&queries, &params, &sag, (what, 5)).unwrap();
            let same = |(own, lowest): (&Result<Answer, QueryError>, &Result<Answer, QueryError>)| {
                let [Ok(own), Ok(lowest)] = [own, lowest] else { return false };
                assert!(own.equilibria[0].residual <= 1e-8 && own.solves >= 5);
                own.equilibria[0].energy <= lowest.equilibria[0].energy + 1e-6
            };
            let count = found.iter().zip(&lowest).filter(|pair| same(*pair)).count();
            assert!(count >= 10, "{what:?}: {count}");
        }
    }
}
