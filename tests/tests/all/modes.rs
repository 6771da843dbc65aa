//! Natural frequencies against theory, N = 400 within 0.1 %, and their order of convergence.

use std::f64::consts::{PI, TAU};

use acceptance::{Beam, assert_order};
use cosserat::assembly::{Air, Assembly, Damping, InnerDamping, Material, RodSpec, Wind, shape};
use cosserat::scene;
use cosserat::simulation::{Formulation, Integrator, Settings, Simulation, Status};
use cosserat::state::{Model, State};
use cosserat::statics::{Mode, StaticParams, modes, modes_telling};
use nalgebra::Vector3;

/// Thin, so that rotary inertia and shear are nothing.
fn thin(segments: usize) -> Beam {
    Beam { radius: 1e-3, ..Beam::rubber(segments) }
}

fn found((model, mut state): (Model, State), count: usize) -> Vec<Mode> {
    let found = modes(&model, &mut state, count, &StaticParams::default()).unwrap();
    assert!(found.equilibrium.converged && found.modes.len() == count);
    for mode in &found.modes {
        assert!(mode.residual < 1e-7, "residual {:e} at {:e} Hz", mode.residual, mode.frequency());
    }
    found.modes
}

/// Asserts that frequencies are those of theory [rad/s], each as often as a round section makes it.
fn assert_near(case: &str, modes: &[Mode], theory: &[f64], copies: usize, tolerance: f64) {
    for (k, mode) in modes.iter().enumerate() {
        let (found, expected) = (mode.frequency() * TAU, theory[k / copies]);
        println!("{case}: {found} rad/s, theory {expected}, {:.4} % off", 100.0 * (found / expected - 1.0));
        assert!((found / expected - 1.0).abs() < tolerance, "{case}: {found} rad/s instead of {expected}");
    }
}

/// `beta^2 sqrt(B / rho A) / L^2`.
fn bending(beam: &Beam, betas: &[f64]) -> Vec<f64> {
    let scale = (beam.bending() / beam.line_density()).sqrt() / beam.length.powi(2);
    betas.iter().map(|beta| beta * beta * scale).collect()
}

const CANTILEVER: [f64; 5] = [1.8751040687, 4.6940911330, 7.8547574382, 10.9955407349, 14.1371683910];
const FREE: [f64; 5] = [4.7300407449, 7.8532046241, 10.9956078380, 14.1371654913, 17.2787596574];

#[test]
fn a_cantilever_has_five_pairs_of_frequencies() {
    let found = |segments: usize| found(thin(segments).cantilever(Vector3::zeros()).0.finish(), 10);
    let theory = bending(&thin(1), &CANTILEVER);
    assert_near("cantilever", &found(400), &theory, 2, 1e-3);
    let errors: Vec<f64> = [50, 100, 200].map(|n| found(n)[4].frequency() * TAU / theory[2] - 1.0).into();
    assert_order("cantilever, third frequency", &errors, 2.0);
}

/// Clamped bending is conditioned as N^4.
#[test]
fn a_cantilever_of_many_segments_keeps_its_frequencies() {
    let found = |segments: usize, count: usize| found(thin(segments).cantilever(Vector3::zeros()).0.finish(), count);
    let theory = bending(&thin(1), &CANTILEVER);
    assert_near("1,000 segments", &found(1000, 8), &theory, 2, 1e-3);
    assert_near("100,000 segments", &found(100_000, 2), &theory, 2, 1e-3);
}

/// Of what resists with the mass a mode has `c / 2 omega`, of what resists with the stiffness `tau omega / 2`.
#[test]
fn a_cantilever_is_damped_by_air_and_by_its_own_bending() {
    let beam = thin(100);
    let (rate, time) = (0.3, 0.02);
    for inner in [false, true] {
        let mut assembly = Assembly::new(Vector3::zeros());
        let none = InnerDamping::NONE;
        let inner_damping = if inner { InnerDamping { bending: time, ..none } } else { none };
        let rod = assembly.rod(&RodSpec { inner_damping, ..beam.spec(Vector3::zeros(), Vector3::x()) });
        assembly.clamp_start(&rod);
        if !inner {
            assembly.damping(Damping { linear: rate, angular: 0.0 });
        }
        for mode in found(assembly.finish(), 6) {
            let omega = mode.squared.sqrt();
            let ratio = if inner { time * omega / 2.0 } else { rate / (2.0 * omega) };
            println!("damping ratio {}, theory {ratio}", mode.damping);
            assert!((mode.damping / ratio - 1.0).abs() < 1e-3, "{} instead of {ratio}", mode.damping);
        }
    }
}

#[test]
fn a_free_beam_has_six_free_movements_first() {
    let beam = thin(400);
    let mut assembly = Assembly::new(Vector3::zeros());
    assembly.rod(&beam.spec(Vector3::zeros(), Vector3::new(1.0, 2.0, -1.0)));
    let found = found(assembly.finish(), 16);
    let theory = bending(&beam, &FREE);
    for mode in &found[..6] {
        assert!(mode.squared.abs() < 1e-6 * theory[0].powi(2), "{:e} rad^2/s^2", mode.squared);
    }
    assert_near("free beam", &found[6..], &theory, 2, 1e-3);
}

#[test]
fn a_hanging_chain_swings_at_the_zeros_of_bessels_function() {
    let material = Material { youngs_modulus: 1e8, torsion_modulus: 4e7, density: 1000.0 };
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let nodes = shape::straight(Vector3::zeros(), -Vector3::z(), 1.0, 400);
    let rod = assembly.rod(&RodSpec::new(nodes, 2e-5, material));
    assembly.clamp_start(&rod);
    let (mut model, state) = assembly.finish();
    // The joint to what holds it comes last.
    model.pin(399);
    let theory = [2.404825558, 5.520078110, 8.653727913].map(|zero| 0.5 * zero * 9.81_f64.sqrt());
    let swings: Vec<Mode> = found((model, state), 8).into_iter().filter(|mode| mode.frequency() > 1e-2).collect();
    assert_near("chain", &swings[..6], &theory, 2, 1e-3);
}

#[test]
fn a_taut_string_sounds_its_overtones() {
    let scene = scene::parse(
        "gravity_m_s2 = [0, 0, 0]\n[[rods]]\nradius_m = 0.0005\nyoungs_modulus_pa = 1e10\ndensity_kg_m3 = 1200\ntension_n = 50\nstretch = \"physical\"\n\
         shape.straight = { length_m = 1, segments = 400 }\n[[rods.grips]]\nat = \"start-face\"\njoint = \"ball\"\n[[rods.grips]]\nat = \
         \"end-face\"\njoint = \"ball\"\n",
        "string.toml",
    )
    .unwrap();
    let (area, bending) = (PI * 0.0005_f64.powi(2), 1e10 * PI * 0.0005_f64.powi(4) / 4.0);
    let overtone = |n: f64| {
        let k = n * PI;
        k * ((50.0 + bending * k * k) / (1200.0 * area) * (1.0 + 50.0 / (1e10 * area))).sqrt()
    };
    // A string that turns freely about its axis moves freely so.
    let found = found((scene.model, scene.state), 9);
    let swings: Vec<Mode> = found.into_iter().filter(|mode| mode.frequency() > 1.0).collect();
    assert_near("string", &swings[..8], &[1.0, 2.0, 3.0, 4.0].map(overtone), 2, 1e-3);
}

/// Shear is softer than stretch here: what turns the frames in which both are measured changes the frequency by up to 7 %.
#[test]
fn a_stretched_cord_has_the_frequencies_of_its_own_motion() {
    for (strain, torsion) in [(0.01, 3e5), (0.1, 3e5), (0.3, 1e6), (0.6, 1e6)] {
        let scene = scene::parse(
            &format!(
                "gravity_m_s2 = [0, 0, 0]\n[[rods]]\nradius_m = 0.002\nyoungs_modulus_pa = 1e6\ntorsion_modulus_pa = {torsion}\n\
                 density_kg_m3 = 1000\ntension_n = {}\nstretch = \"physical\"\nclamp = [\"start-face\", \"end-face\"]\n\
                 shape.straight = {{ length_m = 1, segments = 30 }}\n",
                strain * 1e6 * PI * 0.002_f64.powi(2)
            ),
            "cord.toml",
        )
        .unwrap();
        let (model, state) = (scene.model, scene.state);
        let mode = found((model.clone(), state.clone()), 1).remove(0);
        let [shift, _] = mode.largest();
        let start = mode.displaced(&state, 1e-5 / shift);
        let place = (0..start.len()).max_by(|&i, &j| mode.shifts[i].norm().total_cmp(&mode.shifts[j].norm())).unwrap();
        let dt = 1.0 / (500.0 * mode.frequency());
        let mut settings = Settings::default();
        settings.step.formulation = Formulation::Newton;
        settings.step.integrator = Integrator::Bdf2;
        (settings.step.relative_tolerance, settings.step.motion_tolerance) = (1e-9, 1e-9);
        let mut simulation = Simulation::new(&model, &start, &settings, None).unwrap();
        let rest = state.positions[place];
        let aside = mode.shifts[place].normalize();
        let (mut state, mut before, mut zeros) = (start.clone(), f64::NAN, Vec::new());
        for step in 0..1600 {
            simulation.store(&mut state);
            let now = (state.positions[place] - rest).dot(&aside);
            if before * now < 0.0 {
                zeros.push((step as f64 - now / (now - before)) * dt);
            }
            before = now;
            let status = simulation.step(dt).unwrap().status;
            assert!(status <= Status::ConvergedInSubsteps, "strain {strain}: {status:?}");
        }
        let measured = 0.5 * (zeros.len() - 1) as f64 / (zeros[zeros.len() - 1] - zeros[0]);
        println!("strain {strain}: mode {} Hz, motion {measured} Hz", mode.frequency());
        assert!((mode.frequency() / measured - 1.0).abs() < 1e-3, "{} Hz, motion {measured} Hz", mode.frequency());
    }
}

/// Love (1927), article 293: in its plane `n^2 (n^2 - 1)^2 / (n^2 + 1)`, out of it `n^2 (n^2 - 1)^2 / (n^2 + B / C)`, times
/// B / (rho A R^4).
#[test]
fn a_ring_vibrates_in_its_plane_and_out_of_it() {
    let beam = thin(400);
    let mut assembly = Assembly::new(Vector3::zeros());
    let nodes = shape::ring(Vector3::zeros(), 1.0, 400);
    assembly.rod(&RodSpec { closed: true, ..RodSpec::new(nodes, beam.radius, beam.material) });
    let found = found(assembly.finish(), 14);
    let scale = (beam.bending() / beam.line_density()).sqrt();
    let of = |n: f64, more: f64| n * (n * n - 1.0) / (n * n + more).sqrt() * scale;
    let ratio = beam.bending() / beam.torsion();
    assert!(found[5].frequency() * TAU < 1e-3 * of(2.0, 1.0));
    assert_near("ring", &found[6..], &[of(2.0, ratio), of(2.0, 1.0), of(3.0, ratio), of(3.0, 1.0)], 2, 1e-3);
}

/// Beyond Euler's load the straight column is no minimum: it is pushed out of it by nothing here, and says so.
#[test]
fn a_straight_column_beyond_its_load_has_a_negative_square() {
    let beam = thin(50);
    for (ratio, is_stable) in [(0.9, true), (1.1, false)] {
        let (mut assembly, rod) = beam.cantilever(Vector3::zeros());
        let load = ratio * PI * PI * beam.bending() / 4.0;
        assembly.load(beam.end_load(&rod, -Vector3::x() * load, Vector3::zeros()));
        let (model, mut state) = assembly.finish();
        let params = StaticParams { leave_unstable: false, ..StaticParams::default() };
        let lowest = modes(&model, &mut state, 1, &params).unwrap().modes[0].squared;
        println!("{ratio} of Euler's load: omega^2 = {lowest} rad^2/s^2");
        assert_eq!(lowest > 0.0, is_stable, "{lowest}");
    }
}

/// A count that ends among the free movements, or just beyond them, hides none of them.
#[test]
fn few_modes_of_a_free_beam_are_the_free_movements() {
    let beam = thin(40);
    for count in [4, 6, 7, 8] {
        let mut assembly = Assembly::new(Vector3::zeros());
        assembly.rod(&beam.spec(Vector3::zeros(), Vector3::new(1.0, 2.0, -1.0)));
        let found = found(assembly.finish(), count);
        let free = found.iter().filter(|mode| mode.squared.abs() < 1e-6 * bending(&beam, &FREE)[0].powi(2)).count();
        assert_eq!(free, count.min(6), "of {count}");
    }
}

#[test]
fn what_cannot_move_has_no_modes_and_torques_are_refused() {
    let beam = thin(5);
    let (mut assembly, rod) = beam.cantilever(Vector3::zeros());
    for segment in rod {
        assembly.fix(segment);
    }
    let (model, mut state) = assembly.finish();
    assert!(modes(&model, &mut state, 3, &StaticParams::default()).unwrap().modes.is_empty());
    let (mut assembly, rod) = beam.cantilever(Vector3::zeros());
    assembly.load(beam.end_load(&rod, Vector3::zeros(), Vector3::y() * 1e-6));
    let (model, mut state) = assembly.finish();
    let error = modes(&model, &mut state, 3, &StaticParams::default()).unwrap_err();
    assert!(error.to_string().contains("torques"), "{error}");
}

/// Drag is left out, and not taken for mass.
#[test]
fn a_stiff_beam_has_its_frequencies_in_wind_too() {
    let stiff = Material { youngs_modulus: 1e10, torsion_modulus: 4e9, density: 1000.0 };
    let beam = Beam { material: stiff, ..Beam::rubber(100) };
    let (mut assembly, _) = beam.cantilever(Vector3::zeros());
    let wind = Wind::new(Vector3::new(0.0, 5.0, 0.0), None, None);
    assembly.air(Air { density: 1.2, normal_drag: 1.1, tangential_drag: 0.05, wind });
    assert_near("in wind", &found(assembly.finish(), 4), &bending(&beam, &CANTILEVER), 2, 1e-3);
}

/// Every round tells how many are found; one that is stopped gives none that is not.
#[test]
fn a_search_for_modes_tells_how_far_it_is_and_can_be_stopped() {
    let beam = thin(50);
    let of = |rounds: usize| {
        let (model, mut state) = beam.cantilever(Vector3::zeros()).0.finish();
        let mut told = Vec::new();
        let mut tell = |found: usize| {
            told.push(found);
            told.len() < rounds
        };
        let found = modes_telling(&model, &mut state, 20, &StaticParams::default(), &mut tell).unwrap();
        (found.modes, told)
    };
    let (all, told) = of(usize::MAX);
    assert_eq!((all.len(), told.last()), (20, Some(&20)));
    let (some, told) = of(told.len() - 1);
    assert!(some.len() < 20 && Some(&some.len()) == told.last(), "{} of {told:?}", some.len());
    assert!(some.iter().all(|mode| mode.residual < 1e-7));
}
