//! What a static analysis refuses.

use nalgebra::Vector3;
use rod::{Assembly, Material, Model, RodSpec, State, shape};
use statics::{StaticError, StaticParams, equilibrium};

/// A rod along x whose first segment is fixed.
fn rod() -> (Model, State) {
    let material = Material { youngs_modulus: 1e6, torsion_modulus: 1e6, density: 1000.0 };
    let mut rods = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 3);
    let rod = rods.rod(&RodSpec::new(nodes, 0.02, material));
    rods.fix(rod.start);
    rods.finish()
}

#[test]
fn parameters_of_static_analyses_are_checked() {
    let (model, state) = rod();
    let default = StaticParams::default();
    let error = |params: StaticParams| {
        let mut found = state.clone();
        match equilibrium(&model, &mut found, &params) {
            Err(error @ StaticError::Params(_)) => {
                assert_eq!(found, state);
                error.to_string()
            }
            Err(error) => panic!("another error: {error}"),
            Ok(_) => String::new(),
        }
    };
    for x in [0.0, -1e-9, f64::NAN, f64::INFINITY] {
        let allowed = "but it must be finite and > 0";
        assert_eq!(
            error(StaticParams { tolerance: x, ..default }),
            format!("static parameter tolerance = {x}, {allowed}")
        );
        assert_eq!(
            error(StaticParams { first_dt: x, ..default }),
            format!("static parameter first_dt = {x}, {allowed}")
        );
    }
    assert_eq!(error(StaticParams { max_steps: 0, ..default }), "static parameter max_steps = 0, but it must be >= 1");
    for allowed in [default, StaticParams { max_steps: 1, ..default }] {
        assert_eq!(error(allowed), "");
    }
}

#[test]
fn contacts_are_refused_where_nothing_knows_them() {
    let (mut model, mut state) = rod();
    model.contacts.between_segments = Some(rod::Surface::default());
    let params = StaticParams::default();
    let still = equilibrium(&model, &mut state, &params).map(|_| ());
    let expected = "static analysis knows contacts with planes, spheres and capsules, but none between segments";
    assert_eq!(still.unwrap_err().to_string(), expected);
}
