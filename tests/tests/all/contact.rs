//! Contacts against their laws: rest, slip and rolling on an incline, momentum and restitution in collisions, no
//! penetration at speed, the same bits on any number of threads.

use acceptance::Beam;
use cosserat::assembly::{Assembly, Friction, Material, Obstacle, ObstacleShape, Surface};
use cosserat::scene;
use cosserat::simulation::{Counters, Formulation, Integrator, Settings, Simulation, Status};
use cosserat::state::{Model, State, measure};
use nalgebra::{Unit, Vector3};

const GRAVITY: f64 = 9.81;
const DT: f64 = 0.01;

fn surface(friction: f64) -> Surface {
    Surface { friction: Friction::new(friction), restitution: 0.0 }
}

/// The ground z < 0.
fn ground(surface: Surface) -> Obstacle {
    let normal = Unit::new_normalize(Vector3::z());
    Obstacle::new(ObstacleShape::HalfSpace { point: Vector3::zeros(), normal }, surface)
}

/// Runs; all steps converge, and by its own measure nothing is ever deeper than 2 % of a radius. `look` sees each state.
fn run(model: &Model, state: &State, dt: f64, steps: usize, look: impl FnMut(&State)) -> (State, Counters) {
    run_with(Formulation::default(), model, state, dt, steps, look)
}

fn run_with(
    formulation: Formulation,
    model: &Model,
    state: &State,
    dt: f64,
    steps: usize,
    mut look: impl FnMut(&State),
) -> (State, Counters) {
    let mut settings = Settings::default();
    settings.step.formulation = formulation;
    let mut simulation = Simulation::new(model, state, &settings, None).unwrap();
    let mut now = state.clone();
    for step in 0..steps {
        let report = simulation.step(dt).unwrap();
        assert!(report.status <= Status::ConvergedInSubsteps, "step {step}: {:?}", report.status);
        simulation.store(&mut now);
        look(&now);
    }
    let counters = simulation.counters();
    assert!(counters.deepest_penetration < 0.02, "{}", counters.deepest_penetration);
    (now, counters)
}

/// Gravity [m/s^2] as seen from an incline of `angle` [rad]: x goes up, z is its normal.
fn tilted(angle: f64) -> Vector3<f64> {
    Vector3::new(-angle.sin(), 0.0, -angle.cos()) * GRAVITY
}

/// What implicit Euler goes in `steps` steps under a constant acceleration from rest: `a dt^2 n (n + 1) / 2`.
fn fallen(acceleration: f64, steps: usize) -> f64 {
    acceleration * DT * DT * (steps * (steps + 1)) as f64 / 2.0
}

/// How far [m] a rod of 10 segments along the slope slides within a second.
fn slide(angle: f64, friction: f64) -> f64 {
    let beam = Beam::rubber(10);
    let mut assembly = Assembly::new(tilted(angle));
    assembly.rod(&beam.spec(Vector3::z() * beam.radius, Vector3::x()));
    let (mut model, state) = assembly.finish();
    model.contacts.obstacles.push(ground(surface(friction)));
    let (end, _) = run(&model, &state, DT, 100, |_| ());
    (end.positions[5] - state.positions[5]).norm()
}

#[test]
fn a_rod_rests_on_an_incline_below_the_angle_of_friction_and_slides_above() {
    for friction in [0.1, 0.5, 1.0] {
        let angle = |factor: f64| (friction * factor).atan();
        let (below, above) = (slide(angle(0.99), friction), slide(angle(1.01), friction));
        let theory = fallen(GRAVITY * (angle(1.01).sin() - friction * angle(1.01).cos()), 100);
        println!("mu {friction}: {below:.2e} m below; above {above:.5} m, theory {theory:.5} m");
        assert!(below < 1e-4, "{below}");
        assert!((above / theory - 1.0).abs() < 0.01, "{above} {theory}");
    }
}

/// On an incline between the angles of sliding and of static friction a rod at rest stays, one that goes down goes on with
/// `g (sin - mu cos)` of sliding friction, and one that goes up stops after `v^2 / 2 g (sin + mu cos)` and,
/// with Euler's rule, stays.
#[test]
fn between_the_two_angles_of_friction_what_rests_stays_and_what_slides_goes_on() {
    let (angle, friction) = (0.35_f64.atan(), Friction { at_rest: 0.4, sliding: 0.3 });
    let pull = |sign: f64| GRAVITY * (angle.sin() + sign * friction.sliding * angle.cos());
    for formulation in Formulation::ALL {
        for integrator in [Integrator::Euler, Integrator::Bdf2] {
            let slid = |speed: f64| {
                let beam = Beam::rubber(10);
                let mut assembly = Assembly::new(tilted(angle));
                assembly.rod(&beam.spec(Vector3::z() * beam.radius, Vector3::x()));
                let (mut model, mut state) = assembly.finish();
                model.contacts.obstacles.push(ground(Surface { friction, restitution: 0.0 }));
                state.velocities.fill(Vector3::x() * speed);
                let mut settings = Settings::default();
                (settings.step.formulation, settings.step.integrator) = (formulation, integrator);
                let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
                for _ in 0..100 {
                    assert!(simulation.step(DT).unwrap().status <= Status::ConvergedInSubsteps);
                }
                let mut end = state.clone();
                simulation.store(&mut end);
                ((end.positions[5] - state.positions[5]).x, end.velocities[5].x)
            };
            let ((rests, _), (down, _), (up, stopped)) = (slid(0.0), slid(-0.5), slid(1.0));
            let (down_theory, up_theory) = (-0.5 - 0.5 * pull(-1.0), 0.5 / pull(1.0));
            println!(
                "{formulation} {integrator}: {rests:.1e} m, {down:.4} ({down_theory:.4}), {up:.4} ({up_theory:.4}) m"
            );
            assert!(rests.abs() < 1e-4, "{formulation} {integrator}: {rests}");
            assert!((down / down_theory - 1.0).abs() < 0.01, "{formulation} {integrator}: {down} {down_theory}");
            // A step more or less of the way. BDF2 gives what stops a velocity back, which counts as sliding.
            let stays = integrator == Integrator::Bdf2 || (up - up_theory).abs() < DT && stopped.abs() < 1e-3;
            assert!(stays, "{formulation} {integrator}: {up} {stopped}");
        }
    }
}

/// How far [m] bodies of a scene on a plane slide past it within a second: where each is at the end, relative to where it was and to `carried`.
fn slipped(text: &str, dt: f64, carried: Vector3<f64>) -> f64 {
    let scene = scene::parse(text, "slip.toml").expect("a scene");
    let mut simulation = Simulation::new(&scene.model, &scene.state, &Settings::default(), None).expect("a model");
    for step in 0..(1.0 / dt).round() as usize {
        let status = simulation.step(dt).expect("a step").status;
        assert!(status <= Status::ConvergedInSubsteps, "step {step}: {status:?}");
    }
    let mut end = scene.state.clone();
    simulation.store(&mut end);
    let slips = end.positions.iter().zip(&scene.state.positions).map(|(end, start)| (end - start - carried).norm());
    slips.fold(0.0, f64::max)
}

/// Between the two angles of friction a box at rest stays on its corners, at every time step, also where those that bear little are at their limit.
#[test]
fn a_box_between_the_two_angles_of_friction_stays_at_rest() {
    for degrees in [18.0_f64, 20.0, 24.0] {
        let [x, _, z] = tilted(degrees.to_radians()).into();
        for dt in [1e-3, 2e-3, 5e-3, 1e-2] {
            let text = format!(
                "gravity_m_s2 = [{x}, 0, {z}]\n[[obstacles]]\nshape.plane = {{}}\nfriction = {{ at_rest = 0.5, sliding = 0.3 }}\n[[bodies]]\nname = \"box\"\n\
                 shape.box = {{ sides_m = [0.2, 0.2, 0.2] }}\nmass_kg = 2\nposition_m = [0, 0, 0.1]\n"
            );
            let slip = slipped(&text, dt, Vector3::zeros());
            assert!(slip < 2e-3, "{degrees} degrees, {dt} s: {slip} m");
        }
    }
}

/// A belt that begins to move with 0.4 g, of which friction at rest bears 0.5 and sliding friction 0.3, takes boxes and rods with it.
#[test]
fn a_belt_takes_along_what_rests_on_it() {
    let times: Vec<String> = (0..=100).map(|k| format!("{}", 0.01 * f64::from(k))).collect();
    let shifts: Vec<String> =
        (0..=100).map(|k| format!("[{}, 0, 0]", 0.2 * GRAVITY * (0.01 * f64::from(k)).powi(2))).collect();
    let text = format!(
        "[[obstacles]]\nshape.plane = {{}}\nfriction = {{ at_rest = 0.5, sliding = 0.3 }}\nmotion = {{ times_s = [{}], shifts_m = [{}], interpolation = \"smooth\" }}\n\
         [[rods]]\nname = \"along\"\nyoungs_modulus_pa = 1e7\ndensity_kg_m3 = 1000\nradius_m = 0.05\nshape.straight = {{ start_m = [0, 0, 0.05], length_m = 1, \
         segments = 10 }}\n[[bodies]]\nname = \"box\"\nshape.box = {{ sides_m = [0.4, 0.4, 0.02] }}\nmass_kg = 2\nposition_m = [0, -2, 0.01]\n",
        times.join(", "),
        shifts.join(", ")
    );
    for dt in [1e-3, 5e-3] {
        let slip = slipped(&text, dt, Vector3::x() * 0.2 * GRAVITY);
        assert!(slip < 2e-3, "{dt} s: {slip} m");
    }
}

/// Friction acts at its lever arm: a full cylinder rolls down with two thirds of what slides without friction.
#[test]
fn a_rod_across_the_slope_rolls() {
    let beam = Beam { radius: 0.1, ..Beam::rubber(1) };
    let angle = 0.3_f64;
    let mut assembly = Assembly::new(tilted(angle));
    assembly.rod(&beam.spec(Vector3::z() * beam.radius, Vector3::y()));
    let (mut model, state) = assembly.finish();
    model.contacts.obstacles.push(ground(surface(1.0)));
    let (end, _) = run(&model, &state, DT, 50, |_| ());
    let way = -(end.positions[0] - state.positions[0]).x;
    let theory = fallen(2.0 / 3.0 * GRAVITY * angle.sin(), 50);
    let slip = end.velocities[0].x - beam.radius * end.angular_velocities[0].y;
    println!("rolled {way:.5} m, theory {theory:.5} m, speed {:.4} m/s, slip {slip:.1e}", end.velocities[0].x);
    assert!((way / theory - 1.0).abs() < 0.02, "{way} {theory}");
    // What a contact's tolerance lets slip: a thousandth of a radius a step.
    assert!(slip.abs() < 1e-3 * beam.radius / DT, "{slip}");
    assert!((end.positions[0].z / beam.radius - 1.0).abs() < 0.02);
}

#[test]
fn a_fast_rod_stops_on_the_ground() {
    let beam = Beam::rubber(20);
    // At a speed in some 10 the steps of the crash do not converge.
    for (speed, direction) in [(52.0, Vector3::x()), (52.0, Vector3::new(1.0, 0.0, 1.0)), (1.0, Vector3::z())] {
        let mut assembly = Assembly::new(Vector3::z() * -GRAVITY);
        assembly.rod(&beam.spec(Vector3::new(0.0, 0.0, 0.5), direction));
        let (mut model, mut state) = assembly.finish();
        state.velocities.fill(Vector3::z() * -speed);
        model.contacts.obstacles.push(ground(surface(0.3)));
        model.contacts.between_segments = Some(surface(0.3));
        let mut lowest = f64::INFINITY;
        let look = |now: &State| {
            for i in 0..now.len() {
                lowest = lowest.min(now.positions[i].z - 0.5 * beam.segment_length() * now.axis(i).z.abs());
            }
        };
        let (end, counters) = run(&model, &state, 0.02, 100, look);
        println!("{speed} m/s: lowest point of the axis {lowest:.6} m, {} retries", counters.retries);
        assert!(lowest > 0.98 * beam.radius && lowest < 1.02 * beam.radius);
        assert!(end.velocities.iter().all(|v| v.z.abs() < 0.5 * speed));
    }
}

/// The thrown rod goes 25 diameters a step and would end 20 diameters past the other. Stiff rods do not fold about each
/// other, so that the order along the way is plain until they have turned far. A hit far from the middles turns them by
/// half a radian within 10 ms, which only shorter steps resolve.
#[test]
fn a_fast_thin_rod_does_not_pass_through_another() {
    let material = Material { youngs_modulus: 1e11, torsion_modulus: 4e10, density: 1000.0 };
    let beam = Beam { material, ..Beam::rubber(20) };
    for (aside, dt, steps) in [(0.0, DT, 3), (0.03, DT, 3), (0.1, DT, 3), (0.2, 1e-3, 30)] {
        let mut assembly = Assembly::new(Vector3::zeros());
        let thrown = assembly.rod(&beam.spec(Vector3::new(-0.5, aside, -1.1), Vector3::x()));
        let resting = assembly.rod(&beam.spec(Vector3::new(aside, -0.5, 0.0), Vector3::y()));
        let (mut model, mut state) = assembly.finish();
        thrown.clone().for_each(|i| state.velocities[i].z = 50.0);
        model.contacts.between_segments = Some(surface(0.3));
        let mut lead = vec![f64::INFINITY; steps];
        let mut leads = lead.iter_mut();
        let look = |now: &State| {
            let lead = leads.next().unwrap();
            // Seen along the way, one pair crosses, or two where segments meet; there the thrown rod stays behind.
            for (a, b) in thrown.clone().flat_map(|a| resting.clone().map(move |b| (a, b))) {
                let (u, v) = (now.axis(a), now.axis(b));
                let (half, apart) = (0.5 * beam.segment_length(), now.positions[b] - now.positions[a]);
                let area = |p: &Vector3<f64>, q: &Vector3<f64>| p.x * q.y - p.y * q.x;
                let (s, t) = (area(&apart, &v) / area(&u, &v), area(&apart, &u) / area(&u, &v));
                if s.abs() < 1.01 * half && t.abs() < 1.01 * half {
                    *lead = lead.min(apart.z + v.z * t - u.z * s);
                }
            }
        };
        let (end, counters) = run(&model, &state, dt, steps, look);
        let moved = resting.clone().map(|i| end.velocities[i].z).sum::<f64>() / 20.0;
        println!(
            "{aside} m, {dt} s: ahead by {:.5} m, {} retries, gained {moved:.2} m/s",
            lead[steps - 1],
            counters.retries
        );
        assert!(lead.iter().all(|&lead| lead.is_finite() && lead > 0.98 * 2.0 * beam.radius), "{lead:?}");
        assert!(moved > 5.0, "{moved}");
    }
}

#[test]
fn two_free_rods_collide_and_keep_their_momentum() {
    let beam = Beam::rubber(15);
    let formulation = Formulation::Newton;
    for restitution in [0.0, 0.5] {
        let mut assembly = Assembly::new(Vector3::zeros());
        let first = assembly.rod(&beam.spec(Vector3::zeros(), Vector3::x()));
        assembly.rod(&beam.spec(Vector3::new(0.43, -0.5, 0.2), Vector3::new(0.1, 1.0, 0.0)));
        let (mut model, mut state) = assembly.finish();
        for (i, v) in state.velocities.iter_mut().enumerate() {
            *v = if first.contains(&i) { Vector3::new(0.0, 0.3, 5.0) } else { Vector3::new(0.2, 0.0, -10.0) };
        }
        model.contacts.between_segments = Some(Surface { restitution, ..surface(0.4) });
        let energy = |state: &State| measure::energy(&model, state).total();
        let mut highest = f64::NEG_INFINITY;
        let look = |now: &State| highest = highest.max(energy(now));
        let (end, counters) = run_with(formulation, &model, &state, DT, 50, look);
        assert!(counters.contact_solves > 0);
        let change = (measure::linear_momentum(&model, &end) - measure::linear_momentum(&model, &state)).norm();
        let scale: f64 = model.segments.iter().zip(&state.velocities).map(|(s, v)| s.mass() * v.norm()).sum();
        let (change, [highest, last]) = (change / scale, [highest, energy(&end)].map(|e| e / energy(&state)));
        println!(
            "restitution {restitution}, {formulation}: momentum changes by {change:.1e}, energy at most {highest:.3} and \
            in the end {last:.3} of the first"
        );
        assert!(change < 1e-9);
        assert!(last < 0.5, "colliding rods that come to bend lose energy: {last}");
        assert!(highest < 1.0 + 1e-9, "{highest}");
        let upwards: f64 = first.clone().map(|i| end.velocities[i].z).sum();
        assert!(upwards < 0.0, "the heavier momentum turns the first rod back");
    }
}

#[test]
fn a_dropped_rod_leaves_with_its_share_of_the_speed() {
    let beam = Beam { length: 0.1, ..Beam::rubber(1) };
    for restitution in [0.0, 0.5, 1.0] {
        let mut assembly = Assembly::new(Vector3::z() * -GRAVITY);
        assembly.rod(&beam.spec(Vector3::z() * 0.5, Vector3::x()));
        let (mut model, state) = assembly.finish();
        model.contacts.obstacles.push(ground(Surface { restitution, ..surface(0.3) }));
        let mut speeds = vec![0.0];
        let (end, _) = run(&model, &state, 1e-3, 600, |now| speeds.push(now.velocities[0].z));
        let touch = speeds.windows(2).position(|pair| pair[1] > pair[0]).unwrap();
        let meets = -speeds[touch];
        let leaves = speeds[touch..].iter().copied().fold(f64::NEG_INFINITY, f64::max);
        println!("restitution {restitution}: meets at {meets:.4} m/s, leaves at {leaves:.4} m/s");
        // What a contact's tolerance leaves open: a thousandth of a radius a step.
        let slack = 1e-3 * beam.radius / 1e-3;
        assert!((meets / (2.0 * GRAVITY * (0.5 - beam.radius)).sqrt() - 1.0).abs() < 0.01);
        assert!((leaves - restitution * meets).abs() < 0.05 * restitution * meets + slack, "{leaves} {meets}");
        assert!(restitution > 0.0 || (end.positions[0].z / beam.radius - 1.0).abs() < 0.02);
    }
}

#[test]
fn threads_do_not_change_a_bit_of_colliding_rods() {
    let beam = Beam::rubber(16);
    let mut assembly = Assembly::new(Vector3::z() * -GRAVITY);
    for k in 0..10 {
        let across = 0.05 * f64::from(k) - 0.225;
        let lower = assembly.rod(&beam.spec(Vector3::new(-0.5, across, 0.0), Vector3::x()));
        assembly.fix(lower.start).fix(lower.end - 1);
        let upper = Vector3::new(across, -0.5, 0.025 + 0.002 * f64::from(k));
        let upper = assembly.rod(&beam.spec(upper, Vector3::new(0.02, 1.0, 0.0)));
        upper.for_each(|i| assembly.state_mut().velocities[i].z = -1.0);
    }
    let (mut model, state) = assembly.finish();
    assert!(model.segments.len() >= 300);
    model.contacts.between_segments = Some(surface(0.3));
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&model, &state, DT, 40, |_| ()))
    };
    let ((one, counters), (two, _)) = (on(1), on(2));
    println!("{} contacts solved for", counters.contact_solves);
    assert!(counters.contact_solves > 50 * 40);
    assert_eq!(one, two);
}

/// As many contacts as a heap must have for threads to share W and what contacts are evaluated.
#[test]
fn threads_do_not_change_a_bit_of_a_heap() {
    let heap = scene::builtin("heap-20").unwrap();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&heap.model, &heap.state, heap.run.dt, 60, |_| ()))
    };
    let ((one, counters), (two, _), (three, _)) = (on(1), on(2), on(3));
    assert!(counters.contact_solves > 400 * 60);
    assert_eq!(one, two);
    assert_eq!(one, three);
}

#[test]
fn a_model_without_contacts_spends_nothing_on_them() {
    let (assembly, _) = Beam::rubber(20).cantilever(Vector3::z() * -GRAVITY);
    let (model, state) = assembly.finish();
    let (_, counters) = run(&model, &state, DT, 20, |_| ());
    let Counters { contact_searches, contact_candidates, contact_evaluations, .. } = counters;
    assert_eq!((contact_searches, contact_candidates, contact_evaluations), (0, 0, 0));
    assert_eq!((counters.contact_solves, counters.contact_sweeps), (0, 0));
    assert_eq!((counters.worst_contact, counters.deepest_penetration), (0.0, 0.0));
    assert!(counters.times.contact.is_zero() && !counters.times.solve.is_zero());
}
