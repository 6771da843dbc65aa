//! What a gradient takes of memory.

use dynamics::formulation::Formulation;
use dynamics::simulation::Settings;
use dynamics::step::StepParams;
use nalgebra::Vector3;
use rod::{Assembly, Integrator, Material, RodSpec, shape};
use sensitivity::{Recording, StateVariation, Wanted};

/// A kept step takes 152 bytes a segment (one alone 208), a checkpoint 190, with the slack of its list up to twice that. All else, the model
/// included, is what a gradient takes that keeps one of each.
#[test]
fn a_gradient_takes_little_memory() {
    let segments = 1000;
    let used = allocation_counter::measure(|| {
        let mut rods = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
        let nodes = shape::helix(Vector3::zeros(), 0.5, 3.0, 20.0, segments);
        let material = Material { youngs_modulus: 1e7, torsion_modulus: 5e6, density: 1000.0 };
        let rod = rods.rod(&RodSpec::new(nodes, 0.01, material));
        rods.fix(rod.start);
        let (model, state) = rods.finish();
        let step = StepParams {
            formulation: Formulation::Newton,
            integrator: Integrator::Euler,
            relative_tolerance: 1e-6,
            motion_tolerance: 1e-6,
            ..StepParams::DEFAULT
        };
        let settings = Settings { step, ..Settings::default() };
        let mut recording = Recording::with_checkpoints(&model, &state, &settings, 1).unwrap();
        recording.step(1e-3).unwrap();
        let mut height = StateVariation::zero(segments);
        height.positions[segments - 1].z = 1.0;
        recording.backward(&[(1, height)], Wanted::ALL).unwrap();
    });
    let each = used.bytes_max as f64 / segments as f64;
    println!("{each:.0} bytes a segment");
    assert!(each < 9200.0, "{each} bytes a segment");
}
