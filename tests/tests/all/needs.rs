//! What a scene does not need is not done: by the counters, never and in no time.

use cosserat::scene::{Scene, builtin, builtins};
use cosserat::simulation::Formulation;
use cosserat::state::Model;
use evaluation::needs::{Needs, measure};

fn needs(scene: &Scene, formulation: Formulation, steps: usize) -> Needs {
    measure(scene, steps, formulation, || true).unwrap().unwrap()
}

fn left_out(needs: &Needs) -> Vec<&str> {
    needs.left_out.iter().map(|part| part.what.as_str()).collect()
}

#[test]
fn what_is_left_out_is_never_done() {
    for known in builtins() {
        let scene = builtin(known.name).unwrap();
        // Eyelets and joints that are not elastic or can break are for one formulation alone.
        let Model { sliding_joints, pulleys, laws, breakable, contacts, .. } = &scene.model;
        let slides = !(sliding_joints.is_empty() && pulleys.is_empty() && contacts.sheaths.is_empty());
        let is_newton = slides || !(laws.is_empty() && breakable.is_empty());
        for formulation in Formulation::ALL.into_iter().filter(|of| of.momentum() || !is_newton) {
            let needs = needs(&scene, formulation, 2);
            let done: Vec<_> = needs.left_out.iter().filter(|part| part.count > 0).collect();
            assert!(done.is_empty(), "{}, {formulation}: {done:?}", known.name);
            let us = &needs.median_us;
            for (part, us) in [("drag", us.drag), ("contacts", us.contact), ("start", us.guess)] {
                assert!(
                    us == 0.0 || !left_out(&needs).contains(&part),
                    "{}, {formulation}: {part} {us} us",
                    known.name
                );
            }
            assert_eq!(needs.steps, 2);
            assert!(us.total > 0.0 && us.predict > 0.0 && us.assemble > 0.0);
        }
    }
}

/// The same counters are not zero where the scene has what is left out elsewhere.
#[test]
fn what_is_needed_is_done() {
    let run = |name: &str, formulation| needs(&builtin(name).unwrap(), formulation, 8);
    let tree = run("tree-10", Formulation::Newton);
    assert!(tree.work.drag_evaluations > 0 && tree.median_us.drag > 0.0);
    assert!(tree.work.branch_eliminations > 0 && tree.work.momentum_evaluations > 0);
    assert_eq!(left_out(&tree), ["loads", "damping", "contacts", "linear iterations", "lanes", "threads"]);
    let elastica = run("elastica", Formulation::Newton);
    assert!(elastica.work.load_evaluations > 0 && elastica.work.damping_evaluations > 0);
    assert!(elastica.work.momentum_evaluations > 0 && elastica.work.guesses_used > 0 && elastica.median_us.guess > 0.0);
    assert_eq!(left_out(&elastica), ["drag", "contacts", "branches", "linear iterations", "lanes", "threads"]);
    let rods = run("two-rods", Formulation::Xpbd);
    assert!(rods.work.contact_searches > 0 && rods.median_us.contact > 0.0);
    assert!(!left_out(&rods).contains(&"contacts") && left_out(&rods).contains(&"momentum residual"));
    assert_eq!((rods.sets, rods.sets_in_lanes), (2, 0));
}

#[test]
fn needs_are_data() {
    let scene = builtin("bending-rod").unwrap();
    let needs = needs(&scene, Formulation::Newton, 3);
    let text = serde_json::to_string(&needs).unwrap();
    // A time may come back with another last digit.
    let read: Needs = serde_json::from_str(&text).unwrap();
    assert!((read.median_us.total / needs.median_us.total - 1.0).abs() < 1e-12);
    // Of the work the counts are kept, without times and residuals.
    let counts = |needs: &Needs| serde_json::to_value(needs.work).unwrap();
    assert_eq!(counts(&read), counts(&needs));
    assert_eq!(Needs { median_us: needs.median_us, work: needs.work, ..read }, needs);
    assert!(needs.reason.starts_with("solver direct: "));
    assert_eq!((needs.segments, needs.sets, needs.threads), (30, 1, 1));
    let mut done = 0;
    let stopped = measure(&scene, 9, Formulation::default(), || {
        done += 1;
        done < 4
    });
    assert_eq!((stopped.unwrap(), done), (None, 4));
}
