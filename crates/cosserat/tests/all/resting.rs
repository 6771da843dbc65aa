//! Slack cables that come to rest on obstacles without friction: which of them do.

use cosserat::prelude::*;

/// A cable of 50 segments between two level grips that are 0.8 m apart, of this length [m] and Young's modulus [Pa].
fn between_grips(length_m: f64, youngs_modulus_pa: f64) -> String {
    rod(
        youngs_modulus_pa,
        &format!(
            "clamp = ['start-face', 'end-face']
            shape.hung = {{ from_m = [-0.4, 0, 0], to_m = [0.4, 0, 0], length_m = {length_m}, segments = 50 }}"
        ),
    )
}

/// A cantilever of this length [m] in segments of 25 mm, level at first.
fn held_at_one_end(length_m: f64, youngs_modulus_pa: f64) -> String {
    let segments = (40.0 * length_m).round();
    rod(
        youngs_modulus_pa,
        &format!(
            "clamp = ['start-face']
            shape.straight = {{ start_m = [-0.5, 0, 0], length_m = {length_m}, segments = {segments} }}"
        ),
    )
}

fn rod(youngs_modulus_pa: f64, keys: &str) -> String {
    format!(
        "[[rods]]\nradius_m = 0.01\nyoungs_modulus_pa = {youngs_modulus_pa:e}\ndensity_kg_m3 = 1500\n{keys}\n[[obstacles]]\n"
    )
}

/// Solves that it takes to come to rest. Nothing overlaps, and what presses does so at the surface, outwards; `above` is the
/// distance of a place from the surface.
fn solves(name: &str, text: &str, above: impl Fn(Vector3<f64>) -> f64) -> Result<usize, SceneError> {
    let Scene { model, mut state, .. } = scene::parse(text, name)?;
    let report = statics::equilibrium(&model, &mut state, &StaticParams::default()).expect("contacts that are known");
    assert!(report.converged && report.stable == Some(true), "{name}: {report:?}");
    assert!(!report.contacts.is_empty(), "{name}: nothing presses");
    let lowest = state.positions.iter().map(|x| above(*x)).fold(f64::INFINITY, f64::min);
    assert!(lowest > 0.01 - 1e-8, "{name}: an axis is {lowest} m above, less than the radius");
    for contact in &report.contacts {
        assert!(above(contact.place).abs() < 1e-8, "{name}: {contact:?}");
        assert!(contact.force.dot(&contact.normal) > 0.0, "{name}: {contact:?}");
    }
    Ok(report.steps)
}

/// Of 1 MPa to 100 MPa: `rho A g L^3 / B` from 590 down to 5.9 for 1 m.
#[test]
fn slack_cables_come_to_rest_on_the_ground_on_balls_and_on_posts() -> Result<(), SceneError> {
    let ground = |height: f64| move |x: Vector3<f64>| x.z - height;
    let round = |height: f64| move |x: Vector3<f64>| (x.x.powi(2) + (x.z - height).powi(2)).sqrt() - 0.1;
    let plane = |height: f64| format!("shape.plane = {{ point_m = [0, 0, {height}] }}");
    let post = |z: f64| format!("shape.capsule = {{ start_m = [0, -1, {z}], end_m = [0, 1, {z}], radius_m = 0.1 }}");
    let ball = "shape.sphere = { centre_m = [0, 0, -0.35], radius_m = 0.1 }";
    for youngs_modulus in [1e6, 1e7, 1e8] {
        let (cable, slack) = (between_grips(1.0, youngs_modulus), between_grips(1.4, youngs_modulus));
        let [short, long] = [1.0, 2.0].map(|length| held_at_one_end(length, youngs_modulus));
        let on_ball = |x: Vector3<f64>| (x - Vector3::z() * -0.35).norm() - 0.1;
        let counts = [
            ("between grips, ground", solves("ground.toml", &(cable.clone() + &plane(-0.2)), ground(-0.2))?),
            ("between grips, slack, ground", solves("slack.toml", &(slack + &plane(-0.3)), ground(-0.3))?),
            ("between grips, ball", solves("ball.toml", &(cable.clone() + ball), on_ball)?),
            ("between grips, post", solves("post.toml", &(cable + &post(-0.35)), round(-0.35))?),
            ("cantilever, post", solves("held.toml", &(short + &post(-0.15)), round(-0.15))?),
            ("cantilever of 2 m, post", solves("long.toml", &(long.clone() + &post(-0.15)), round(-0.15))?),
            ("cantilever of 2 m, ground", solves("lies.toml", &(long + &plane(-0.3)), ground(-0.3))?),
        ];
        println!("{youngs_modulus:e} Pa: solves {counts:?}");
    }
    Ok(())
}

/// Without friction a cord slides down from a ball to either side: there is an equilibrium on top of it, but none that lasts.
#[test]
fn what_slides_off_is_not_told_to_rest_on_a_ball() -> Result<(), Box<dyn std::error::Error>> {
    let text = rod(1e6, "shape.straight = { start_m = [-0.5, 0, 0], length_m = 1, segments = 40 }")
        + "shape.sphere = { centre_m = [0, 0, -0.12], radius_m = 0.1 }";
    let Scene { model, mut state, .. } = scene::parse(&text, "free.toml")?;
    let report = statics::equilibrium(&model, &mut state, &StaticParams::default())?;
    assert!(!report.converged && report.stable.is_none(), "{report:?}");
    Ok(())
}
