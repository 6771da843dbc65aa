//! Bodies that overlap at the start: refused with names and depth, or let out at a bounded speed.

use collision::closest;
use component::{Component, Members};
use dynamics::formulation::{ContactProjection, Formulation};
use dynamics::projection::Projection;
use dynamics::simulation::{ContactParams, Overlap, Overlapped, Settings, Simulation, SimulationError};
use dynamics::step::{Status, StepParams};
use jointed::topology::Topology;
use kernels::Spatial;
use nalgebra::{Unit, Vector3};
use rod::Integrator;
use rod::{Assembly, Material, Model, Obstacle, ObstacleShape, RodSpec, State, Stretch, Surface, measure, shape};

/// Predictions in the place of solves are of Euler's rule.
const EULER: StepParams = StepParams { integrator: Integrator::Euler, ..StepParams::DEFAULT };

const RADIUS: f64 = 0.02;

/// Rods of soft rubber, a metre long, of eight segments each, from their starts along their directions.
fn rods(rods: &[([f64; 3], [f64; 3])]) -> (Model, State) {
    let rubber = Material { youngs_modulus: 1e7, torsion_modulus: 4e6, density: 1000.0 };
    let mut assembly = Assembly::new(Vector3::zeros());
    for &(start, direction) in rods {
        let nodes = shape::straight(start.into(), direction.into(), 1.0, 8);
        assembly.rod(&RodSpec::new(nodes, RADIUS, rubber));
    }
    assembly.finish()
}

/// Two rods that cross at right angles in the middle of segments 4 and 12, their axes `height` [m] apart.
fn crossing(height: f64) -> (Model, State) {
    let (mut model, state) = rods(&[([-0.5625, 0.0, 0.0], [1.0, 0.0, 0.0]), ([0.0, -0.5625, height], [0.0, 1.0, 0.0])]);
    model.contacts.between_segments = Some(Surface::default());
    (model, state)
}

/// A rod on the x axis before an obstacle.
fn beside(shape: ObstacleShape) -> (Model, State) {
    let (mut model, state) = rods(&[([0.0; 3], [1.0, 0.0, 0.0])]);
    model.contacts.obstacles.push(Obstacle::new(shape, Surface::default()));
    (model, state)
}

/// The ground, its surface at `height` [m].
fn ground(height: f64) -> ObstacleShape {
    ObstacleShape::HalfSpace { point: Vector3::z() * height, normal: Unit::new_normalize(Vector3::z()) }
}

fn start((model, state): &(Model, State)) -> Result<Simulation, SimulationError> {
    Simulation::new(model, state, &Settings::default(), None)
}

fn refused(scene: &(Model, State)) -> Overlap {
    match start(scene) {
        Err(SimulationError::Overlap(overlap)) => overlap,
        other => panic!("not refused: {:?}", other.err()),
    }
}

#[test]
fn crossing_rods_are_named_with_their_depth() {
    let found = refused(&crossing(0.03));
    assert!((found.depth - 0.01).abs() < 1e-12);
    assert_eq!((found.segment, found.rod, found.pairs), (4, 0, 1));
    assert_eq!(found.other, Overlapped::Segment { index: 12, rod: 1 });
    let text = "segment 4 (rod 0) and segment 12 (rod 1) overlap by 0.01 m at the start; move them apart, or allow it \
                (`allow_overlap`)";
    assert_eq!(found.to_string(), text);
    // Axes that cross overlap by both radii.
    assert!((refused(&crossing(0.0)).depth - 2.0 * RADIUS).abs() < 1e-12);
}

#[test]
fn obstacles_are_named_with_their_depth() {
    let (sphere, radius) = (Vector3::new(0.3, 0.0, 0.5), 0.49);
    let capsule = ObstacleShape::Capsule { start: sphere - Vector3::y(), end: sphere + Vector3::y(), radius };
    for (shape, kind, depth, segment) in [
        (ground(0.05), "plane", 0.07, 0),
        (ObstacleShape::Sphere { centre: sphere, radius }, "sphere", 0.01, 2),
        (capsule, "capsule", 0.01, 2),
    ] {
        let found = refused(&beside(shape));
        assert!((found.depth - depth).abs() < 1e-12, "{kind}: {}", found.depth);
        assert_eq!((found.segment, found.other), (segment, Overlapped::Obstacle { index: 0, kind }));
    }
    let text = refused(&beside(ground(0.05))).to_string();
    assert!(
        text.starts_with("segment 0 (rod 0) overlaps obstacle 0 (a plane) by 0.07 m at the start, and 7 other pairs")
    );
}

#[test]
fn what_touches_within_the_tolerance_may_start() {
    let tolerance = StepParams::DEFAULT.contact_tolerance * RADIUS;
    start(&crossing(2.0 * RADIUS - 0.99 * tolerance)).unwrap();
    assert!(start(&crossing(2.0 * RADIUS - 1.01 * tolerance)).is_err());
    start(&beside(ground(-RADIUS + 0.99 * tolerance))).unwrap();
    assert!(start(&beside(ground(-RADIUS + 1.01 * tolerance))).is_err());
}

#[test]
fn what_cannot_touch_does_not_overlap() {
    // No contacts between segments.
    let (mut model, state) = crossing(0.0);
    model.contacts.between_segments = None;
    start(&(model, state)).unwrap();
    // Both fixed, or fixed in the ground.
    let (mut model, state) = crossing(0.0);
    [4, 12].into_iter().for_each(|i| model.segments[i].fixed = true);
    start(&(model, state)).unwrap();
    let (mut model, state) = beside(ground(0.05));
    model.segments.iter_mut().for_each(|segment| segment.fixed = true);
    start(&(model, state)).unwrap();
    // Neighbours along a rod that is thicker than its segments are long.
    let (mut model, state) = rods(&[([0.0; 3], [1.0, 0.0, 0.0])]);
    model.segments.iter_mut().for_each(|segment| segment.radius = 0.2);
    model.contacts.between_segments = Some(Surface::default());
    start(&(model, state)).unwrap();
}

/// Predicts that nothing moves.
struct Nothing;

impl Projection for Nothing {
    fn project(&mut self, _: &Component<f64>, _: usize, _: &mut [Spatial<f64>], _: &mut [Spatial<f64>]) {}
}

#[test]
fn end_to_end_simulations_are_refused_too() {
    let (mut model, state) = crossing(0.03);
    let make = |_: &Model, _: &Members, _: &Topology| Box::new(Nothing) as Box<dyn Projection>;
    let new = |model: &Model| Simulation::end_to_end(model, &state, &EULER, &make);
    assert!(matches!(new(&model), Err(SimulationError::Overlap(_))));
    model.contacts.allow_overlap = true;
    new(&model).unwrap();
}

#[test]
fn contact_parameters_are_checked() {
    let (model, state) = crossing(0.05);
    let mut settings = Settings::default();
    settings.step.contact.active_gap = -1.0;
    let error = Simulation::new(&model, &state, &settings, None).err().unwrap();
    assert_eq!(error.to_string(), "contact parameter active_gap = -1, but it must be finite and > 0");
}

/// Deepest overlap of any two segments of different rods [m]; negative where they are apart.
fn deepest(state: &State, half: f64) -> f64 {
    let axis = |i: usize| [-half, half].map(|side| state.positions[i] + state.axis(i) * side);
    let pairs = (0..8).flat_map(|a| (8..16).map(move |b| (a, b)));
    pairs.map(|(a, b)| 2.0 * RADIUS - closest::segments(&axis(a), &axis(b)).distance).fold(f64::NEG_INFINITY, f64::max)
}

/// Speed at which overlaps go [m/s].
const SPEED: f64 = ContactParams::DEFAULT.release_speed * RADIUS;

fn kinetic(model: &Model, state: &State) -> f64 {
    measure::energy(model, state).kinetic
}

/// Kinetic energy of all segments at a speed [J].
fn all_at(model: &Model, speed: f64) -> f64 {
    0.5 * model.segments.iter().map(|segment| segment.mass()).sum::<f64>() * speed * speed
}

/// Runs `steps` steps, all of which converge, and shows `look` each state.
fn run((model, state): &(Model, State), settings: &Settings, steps: usize, mut look: impl FnMut(&State)) -> State {
    let mut simulation = Simulation::new(model, state, settings, None).unwrap();
    let mut now = state.clone();
    for step in 0..steps {
        let status = simulation.step(0.01).unwrap().status;
        assert!(status <= Status::ConvergedInSubsteps, "step {step}: {status:?}");
        simulation.store(&mut now);
        look(&now);
    }
    now
}

#[test]
fn crossing_rods_part_gently_where_that_is_allowed() {
    let all = [(Formulation::Newton, ContactProjection::Coupled), (Formulation::Xpbd, ContactProjection::Alternating)];
    for (formulation, contact_projection) in all {
        for height in [0.03, 0.001, 0.0] {
            let mut scene = crossing(height);
            scene.0.contacts.allow_overlap = true;
            // Restitution must not throw them apart, either.
            scene.0.contacts.between_segments = Some(Surface { restitution: 0.5, ..Surface::default() });
            let step = StepParams { formulation, contact_projection, ..StepParams::DEFAULT };
            let half = 0.5 * scene.0.segments[0].length;
            let mut fastest = 0.0_f64;
            let mut energy = 0.0_f64;
            let end = run(&scene, &Settings { step, ..Settings::default() }, 100, |now| {
                fastest = fastest.max(kinetic(&scene.0, now));
                // Without stretch: in joints this stiff it is the tolerance's gaps squared.
                let measure::Energy { kinetic, bend, .. } = measure::energy(&scene.0, now);
                energy = energy.max(kinetic + bend);
            });
            let bound = all_at(&scene.0, SPEED);
            let case = format!("{formulation} {contact_projection:?} {height} m");
            println!("{case}: kinetic {fastest:.2e} J, with bending {energy:.2e} J of {bound:.2e} J");
            assert!(fastest > 0.0 && fastest <= bound, "{case}");
            assert!(energy <= bound, "{case}");
            assert!(deepest(&end, half) <= step.contact_tolerance * RADIUS, "{case}: {} m", deepest(&end, half));
        }
    }
}

#[test]
fn a_rod_comes_out_of_the_ground_gently() {
    let formulation = Formulation::Newton;
    for restitution in [0.0, 1.0] {
        let mut scene = beside(ground(0.05));
        scene.0.gravity = Vector3::z() * -9.81;
        scene.0.contacts.allow_overlap = true;
        scene.0.contacts.obstacles[0].surface.restitution = restitution;
        let step = StepParams { formulation, ..StepParams::DEFAULT };
        let external = |state: &State| measure::energy(&scene.0, state).external;
        let (first, bound) = (external(&scene.1), all_at(&scene.0, SPEED));
        let mut worst = f64::NEG_INFINITY;
        let end = run(&scene, &Settings { step, ..Settings::default() }, 200, |now| {
            worst = worst.max(kinetic(&scene.0, now) - (first - external(now)).max(0.0));
        });
        println!("{formulation}, restitution {restitution}: {worst:.2e} J of {bound:.2e} J");
        assert!(worst > 0.0 && worst <= 1.01 * bound, "{formulation}: {worst} J of {bound} J");
        let lowest = end.positions.iter().map(|x| x.z).fold(f64::INFINITY, f64::min);
        let highest = end.positions.iter().map(|x| x.z).fold(f64::NEG_INFINITY, f64::max);
        let surface = 0.05 + RADIUS;
        assert!(lowest > surface - step.contact_tolerance * RADIUS, "{lowest}");
        assert!(highest < surface + 1.1 * SPEED * SPEED / (2.0 * 9.81), "{highest}");
    }
}

#[test]
fn ends_that_a_soft_joint_lets_part_touch_each_for_itself() {
    for stretch in [Stretch::ZERO_STRETCH, Stretch::Physical] {
        let foam = Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 100.0 };
        let mut assembly = Assembly::new(Vector3::z() * -9.81);
        let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 3);
        assembly.rod(&RodSpec { stretch, ..RodSpec::new(nodes, RADIUS, foam) });
        let mut scene = assembly.finish();
        scene.0.contacts.obstacles.push(Obstacle::new(ground(-0.3), Surface::default()));
        let half = 0.5 * scene.0.segments[0].length;
        let mut lowest = f64::INFINITY;
        run(&scene, &Settings::default(), 60, |now| {
            for i in 0..3 {
                let below = half * now.axis(i).z.abs();
                lowest = lowest.min(now.positions[i].z - below - RADIUS + 0.3);
            }
        });
        assert!(lowest.abs() <= 1.01 * StepParams::DEFAULT.contact_tolerance * RADIUS, "{stretch:?}: {lowest} m");
    }
}
