//! The stability table by its statuses: what holds in the default formulation, and where the paper's gives way.
//!
//! `evaluate stress` prints the same table.

use cosserat::simulation::{Formulation, Integrator, Settings, Simulation, Status, StepParams};
use cosserat::state::{Body, Segment, measure};
use evaluation::stress::{self, Case, CaseRun};

/// Runs every case in a formulation; the pile, which takes as long as all others, in the default one alone.
fn table(formulation: Formulation, integrator: Integrator) -> Vec<CaseRun> {
    let mut cases = stress::cases();
    cases.retain(|case| case.formulations.contains(&formulation));
    let mut settings = stress::settings(formulation);
    settings.step.integrator = integrator;
    cases.iter().map(|case| stress::run(case, &settings, None).expect("a valid case")).collect()
}

fn row<'a>(rows: &'a [CaseRun], case: &str) -> &'a CaseRun {
    rows.iter().find(|row| row.case == case).unwrap_or_else(|| panic!("no case {case}"))
}

/// Names of the rows that are as `is` says.
fn names(rows: &[CaseRun], is: impl Fn(&CaseRun) -> bool) -> Vec<&str> {
    rows.iter().filter(|row| is(row)).map(|row| row.case.as_str()).collect()
}

const PAST_HALF_TURN: &str = "joints past half a turn";

/// Finite, without energy from nowhere, of unchanged length, and converged.
fn stands(row: &CaseRun) -> bool {
    let converged = ["converged", "converged in substeps", PAST_HALF_TURN].contains(&row.status.as_str());
    converged && row.finite && row.energy_rise.is_none_or(|rise| rise <= 1e-6) && row.length_drift <= 1e-3
}

/// Checks that `newton` stands all rows but one, each to its tolerances; returns those without contacts that needed smaller steps.
fn check_newton(rows: &[CaseRun]) -> Vec<&str> {
    assert_eq!(names(rows, |row| !stands(row)), ["slack rod thrown at its clamp"]);
    let thrown = row(rows, "slack rod thrown at its clamp");
    assert_eq!(thrown.status, "out of iterations");
    // What it kept is a motion all the same.
    let gains = thrown.energy_rise.is_none_or(|rise| rise > 1e-6);
    assert!(thrown.finite && !gains && thrown.length_drift <= 1e-3, "{thrown:?}");
    for row in rows.iter().filter(|row| stands(row)) {
        // Where there are contacts, bodies may still move by a hundredth of a radius.
        let tolerance = if row.worst_contact.is_some() { 1e-4 } else { 1e-6 };
        assert!(row.steps > 0 && row.worst_stretch <= tolerance && row.worst_bend <= tolerance, "{row:?}");
        // In radii.
        let contact = StepParams::DEFAULT.contact_tolerance;
        assert!(row.deepest_penetration.is_none_or(|depth| depth <= contact), "{row:?}");
        assert!(row.worst_contact.is_none_or(|error| error > 0.0 && error <= contact), "{row:?}");
    }
    names(rows, |row| row.retries > 0 && row.worst_contact.is_none() && stands(row))
}

#[test]
fn newton_stands_every_case_but_one_and_says_so() {
    let rows = table(Formulation::Newton, Integrator::Euler);
    assert_eq!(rows.len(), stress::cases().len());
    assert_eq!(check_newton(&rows), [""; 0]);
    // It loses a turn of its twist.
    assert_eq!(names(&rows, |row| row.status == PAST_HALF_TURN), ["slack helix, dt = 0.1 s"]);
}

#[test]
fn so_it_does_with_the_second_order() {
    let rows = table(Formulation::Newton, Integrator::Bdf2);
    assert_eq!(check_newton(&rows), ["mass ratio 1e6, light end", "slack helix, dt = 0.1 s"]);
    assert_eq!(names(&rows, |row| row.status == PAST_HALF_TURN), ["slack helix, dt = 0.1 s"]);
}

/// The paper's formulation, without geometric stiffness, shows that the table tells one from the other.
#[test]
fn the_papers_formulation_gives_way_under_tension() {
    let rows = table(Formulation::Xpbd, Integrator::Euler);
    assert!(rows.iter().all(|row| row.finite), "it gives way without a number that is not finite");
    let fallen = names(&rows, |row| !stands(row));
    assert_eq!(fallen, ["mass ratio 1e6, heavy end", "tip mass x 1e4, dt = 0.1 s"]);
    for case in fallen {
        assert_eq!(row(&rows, case).status, "out of iterations");
    }
    assert_eq!(names(&rows, |row| row.status == PAST_HALF_TURN), ["slack helix, dt = 0.1 s"]);
    let heavy = row(&rows, "mass ratio 1e6, heavy end");
    assert!(heavy.length_drift > 0.1 && heavy.energy_rise.is_some_and(|rise| rise > 0.1), "{heavy:?}");
    let halved = names(&rows, |row| row.retries > 0 && stands(row));
    // And perhaps the slack thin rod at dt = 0.1 s, which takes about as many iterations as it may.
    for case in ["tip mass x 1e4, dt = 0.02 s", "slack helix, dt = 0.1 s"] {
        assert!(halved.contains(&case), "{case} stands without smaller steps: {halved:?}");
    }
}

/// Smallest and largest of some values.
fn range(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    values.into_iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
}

#[test]
fn the_table_covers_what_it_should() {
    let cases = stress::cases();
    let mut names: Vec<_> = cases.iter().map(|case| &case.name).collect();
    names.sort();
    names.dedup();
    assert_eq!(names.len(), cases.len(), "every case has a name of its own");

    for decade in 4..=12 {
        let wanted = 10_f64.powi(decade);
        let is = |case: &Case| case.model.joints.iter().any(|joint| (joint.youngs_modulus / wanted - 1.0).abs() < 1e-9);
        assert!(cases.iter().any(is), "Y = {wanted:e} Pa");
    }
    assert_eq!(range(cases.iter().map(|case| case.dt)), (1e-4, 0.1));
    assert_eq!(range(cases.iter().map(|case| case.model.segments.len() as f64)), (1.0, 100_000.0));
    let of_segments = |value: fn(&Segment) -> f64| range(cases.iter().flat_map(|c| &c.model.segments).map(value));
    let (length, radius) = (of_segments(|s| s.length), of_segments(|s| s.radius));
    assert!(length.0 < 1.01e-4 && length.1 > 4.99, "{length:?} m");
    assert!(radius.0 < 1.01e-4 && radius.1 > 0.49, "{radius:?} m");

    // Neighbours of very different mass, with the heavy one at the free end and at the clamp.
    let mass_ratio = |case: &Case| {
        let masses = range(case.model.segments.iter().map(Segment::mass));
        masses.1 / masses.0
    };
    assert!(cases.iter().filter(|case| mass_ratio(case) > 0.99e6).count() >= 2);
    assert!(cases.iter().any(|case| case.model.segments.iter().any(|s| s.added_mass > 0.99e4 * s.own_mass())));

    let any = |what: &str, is: &dyn Fn(&Case) -> bool| assert!(cases.iter().any(is), "no case with {what}");
    any("damping", &|case| case.model.damping.linear > 0.0 && case.model.damping.angular > 0.0);
    any("contacts of two rods", &|case| case.model.contacts.between_segments.is_some_and(|s| s.friction.at_rest > 0.0));
    any("an impact", &|case| !case.model.contacts.is_empty() && case.state.velocities.iter().any(|v| v.norm() >= 50.0));
    any("a pile", &|case| {
        let rods = case.model.segments.iter().map(|s| s.rod).max().map_or(0, |last| last + 1);
        rods == stress::PILE_RODS && case.model.contacts.obstacles.len() == 5
    });
    any("wind", &|case| case.model.air.is_some());
    any("no gravity", &|case| case.model.gravity.norm() == 0.0);
    any("no support", &|case| case.model.joints.len() > 1 && case.model.segments.iter().all(|s| !s.fixed));
    any("all segments fixed", &|case| case.model.segments.iter().all(|s| s.fixed));
    any("fixed segments in a row", &|case| case.model.segments.windows(3).any(|w| w.iter().all(|s| s.fixed)));
    any("clamped end faces", &|case| case.model.anchors.len() == 2);
    any("a loop", &|case| case.model.anchors.is_empty() && case.model.joints.len() >= case.model.segments.len());
    any("about a thousand branches", &|case| {
        let mut joints = vec![0_usize; case.model.segments.len()];
        for body in case.model.joints.iter().flat_map(|joint| [joint.a, joint.b]) {
            if let Body::Segment(segment) = body {
                joints[segment] += 1;
            }
        }
        joints.iter().map(|&n| n.saturating_sub(2)).sum::<usize>() >= 990
    });
    any("a bent first state", &|case| measure::energy(&case.model, &case.state).bend > 0.0);
    any("a moving first state", &|case| case.state.velocities.iter().any(|v| v.norm() > 1.0));
    let negated = |q: &[nalgebra::UnitQuaternion<f64>]| q[0].coords.dot(&q[1].coords) < -0.9;
    any("negated quaternions", &|case| case.state.orientations.windows(2).any(negated));
}

#[test]
fn a_prediction_far_off_does_not_make_a_bad_step_good_enough() {
    let case = stress::cases().into_iter().find(|case| case.name.starts_with("Young's modulus 1e5")).unwrap();
    let settings = Settings::default();
    let mut simulation = Simulation::new(&case.model, &case.state, &settings, None).unwrap();
    for _ in 0..3 {
        let report = simulation.step(1e4).unwrap();
        let counters = simulation.counters();
        let worst = counters.worst_stretch.max(counters.worst_bend);
        assert!(report.status > Status::ConvergedInSubsteps || worst <= settings.step.relative_tolerance, "{worst}");
    }
}
