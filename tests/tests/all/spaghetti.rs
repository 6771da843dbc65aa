//! The builtin scene of a rod that breaks.

use cosserat::prelude::*;
use cosserat::scene;
use cosserat::state::{Freedom, curvature};

/// Audoly and Neukirch (2005): an arc that is let go at one end is bent by up to 1.43 times as much before it straightens, and so breaks where it holds
/// as an arc; each break lets go of another end.
#[test]
fn an_arc_that_is_let_go_at_one_end_breaks_more_than_once() {
    let Scene { mut model, mut state, run, .. } = scene::builtin("spaghetti").unwrap();
    let strength = model.breakable[0].strength.curvature;
    let bent = curvature(&model, &state, &model.joints[60]);
    assert!(strength > 1.2 * bent && strength < 1.43 * bent, "{strength} of {bent} 1/m");
    let mut simulation = Simulation::new(&model, &state, &Settings::default(), None).unwrap();
    let mut most = 0.0_f64;
    for step in 1..=run.steps {
        let status = simulation.step(run.dt).unwrap().status;
        assert!(status <= Status::ConvergedInSubsteps, "step {step}: {status:?}");
        simulation.store(&mut state);
        simulation.store_model(&mut model);
        most = model.joints.iter().map(|joint| curvature(&model, &state, joint)).fold(most, f64::max);
    }
    let breaks = simulation.breaks();
    assert!((2..20).contains(&breaks.len()), "{breaks:?}");
    assert_eq!(model.joints.iter().filter(|joint| joint.freedom == Freedom::Broken).count(), breaks.len());
    assert!(most <= strength, "{most} of {strength} 1/m");
}
