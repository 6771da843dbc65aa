//! Rods that touch nothing, free, clamped, closed: stiff, slack, tiny, huge, uneven and degenerate; then trees, and wind.

use cosserat::assembly::{Air, Assembly, Damping, Material, RestShape, RodSpec, Stretch, Wind, shape};
use nalgebra::{UnitQuaternion, Vector3};

use super::case::{Case, case};

pub(super) const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

/// The paper's default material, at Young's modulus `y` [Pa].
fn material(y: f64) -> Material {
    Material { youngs_modulus: y, torsion_modulus: y, density: 100.0 }
}

/// A rod of which these segments are fixed.
fn held(spec: &RodSpec, fixed: &[usize]) -> Assembly {
    let mut assembly = Assembly::new(GRAVITY);
    let rod = assembly.rod(spec);
    for k in fixed {
        assembly.fix(rod.start + k);
    }
    assembly
}

/// A straight rod of `segments` of `length` [m] each along x, its first segment fixed.
fn cantilever(segments: usize, length: f64, radius: f64, material: Material) -> Assembly {
    held(&RodSpec::new(straight(length * segments as f64, segments), radius, material), &[0])
}

/// A rod without gravity and support.
fn floating(spec: &RodSpec) -> Assembly {
    let mut assembly = Assembly::new(Vector3::zeros());
    assembly.rod(spec);
    assembly
}

/// Nodes along x.
fn straight(length: f64, segments: usize) -> Vec<Vector3<f64>> {
    shape::straight(Vector3::zeros(), Vector3::x(), length, segments)
}

/// Nodes of a helix of 2.5 turns.
fn helix() -> Vec<Vector3<f64>> {
    shape::helix(Vector3::zeros(), 0.5, 0.5, 2.5, 60)
}

/// All cases without contacts.
pub(super) fn all() -> Vec<Case> {
    [ranges(), sizes(), masses(), slack(), supports(), free(), vec![branches(), storm()]]
        .into_iter()
        .flatten()
        .collect()
}

/// Stiffness, time step and number of segments over their ranges.
fn ranges() -> Vec<Case> {
    let rod = |segments, length, y| cantilever(segments, length, 0.05, material(y));
    let of_stiffness = |exponent| {
        case(format!("Young's modulus 1e{exponent} Pa"), rod(30, 4.0 / 30.0, 10_f64.powi(exponent)), 0.02, 100)
    };
    let of_step = |dt| case(format!("dt = {dt} s"), rod(30, 0.1, 1e5), dt, 200);
    let of_count = |(count, length, steps)| case(format!("{count} segments"), rod(count, length, 1e6), 0.02, steps);
    let counts =
        [(1, 1.0, 100), (2, 0.5, 100), (10, 0.1, 100), (1000, 0.02, 50), (10_000, 0.02, 10), (100_000, 0.02, 5)];
    (4..=12).map(of_stiffness).chain([1e-4, 1e-3, 1e-2, 0.1].map(of_step)).chain(counts.map(of_count)).collect()
}

fn sizes() -> Vec<Case> {
    let suture = Material { youngs_modulus: 2e9, torsion_modulus: 1e9, density: 1100.0 };
    vec![
        case("segments of 0.1 mm, radius 0.1 mm, 2 GPa", cantilever(100, 1e-4, 1e-4, suture), 1e-3, 100),
        case("segments of 1 mm, radius 0.1 mm, 2 GPa", cantilever(100, 1e-3, 1e-4, suture), 0.02, 100),
        case("radius 0.5 m, segments of 0.1 m", cantilever(50, 0.1, 0.5, material(1e6)), 0.02, 100),
        case("radius 0.5 m, segments of 5 m, 1e9 Pa", cantilever(50, 5.0, 0.5, material(1e9)), 0.02, 100),
    ]
}

fn masses() -> Vec<Case> {
    // Two halves of a rod, of these densities [kg/m^3]; the first one is held.
    let halves = |densities: [f64; 2]| {
        let mut assembly = Assembly::new(GRAVITY);
        let [first, second] = [0, 1].map(|k| {
            let nodes = shape::straight(Vector3::x() * (2.0 * k as f64), Vector3::x(), 2.0, 20);
            assembly.rod(&RodSpec::new(nodes, 0.05, Material { density: densities[k], ..material(1e5) }))
        });
        assembly.fix(first.start).branch(first.end - 1, 1.0, &second);
        assembly
    };
    let tip = |dt: f64| {
        let mut rod = cantilever(30, 0.1, 0.05, material(1e5));
        let own = rod.model_mut().segments[29].own_mass();
        rod.add_mass(29, 1e4 * own);
        case(format!("tip mass x 1e4, dt = {dt} s"), rod, dt, 100)
    };
    vec![
        case("mass ratio 1e6, heavy end", halves([1.0, 1e6]), 0.02, 100),
        case("mass ratio 1e6, light end", halves([1e6, 1.0]), 0.02, 100),
        tip(0.02),
        tip(0.1),
    ]
}

fn slack() -> Vec<Case> {
    let heavy = Material { density: 1000.0, ..material(1e4) };
    // Pushed together along its axis: a buckled, loose rod that falls through its own straight line.
    let mut loose = cantilever(60, 0.05, 0.01, heavy);
    for (i, v) in loose.state_mut().velocities.iter_mut().enumerate() {
        *v = Vector3::new(-0.2 * i as f64, 0.05 * i as f64, 0.0);
    }
    vec![
        case("slack thin rod, dt = 0.1 s", cantilever(30, 0.1, 0.01, heavy), 0.1, 100),
        case("slack thin rod, dt = 0.02 s", cantilever(60, 0.05, 0.01, heavy), 0.02, 200),
        case("slack helix, dt = 0.1 s", held(&RodSpec::new(helix(), 0.01, heavy), &[0]), 0.1, 100),
        case("slack rod thrown at its clamp", loose, 0.02, 100),
    ]
}

fn supports() -> Vec<Case> {
    let rod = |y| RodSpec::new(straight(3.0, 30), 0.05, material(y));
    let mut faces = Assembly::new(GRAVITY);
    let range = faces.rod(&rod(1e12));
    faces.clamp_start(&range).clamp_end(&range);
    vec![
        case("both ends fixed, 1e5 Pa", held(&rod(1e5), &[0, 29]), 0.02, 100),
        case("both ends fixed, 1e12 Pa", held(&rod(1e12), &[0, 29]), 0.02, 100),
        case("both end faces clamped, 1e12 Pa", faces, 0.02, 100),
        case("four fixed segments in a row", held(&rod(1e5), &[0, 1, 2, 3]), 0.02, 100),
        case("fixed in the middle, in a row and at an end", held(&rod(1e5), &[0, 10, 11, 12, 20]), 0.02, 100),
        case("all segments fixed", held(&rod(1e5), &Vec::from_iter(0..30)), 0.02, 20),
    ]
}

fn free() -> Vec<Case> {
    let mut spinning = floating(&RodSpec::new(straight(2.0, 20), 0.05, material(1e6)));
    let (state, spin) = (spinning.state_mut(), Vector3::new(5.0, 0.0, 8.0));
    for i in 0..20 {
        state.angular_velocities[i] = spin;
        state.velocities[i] = spin.cross(&(state.positions[i] - Vector3::x()));
    }
    let ring = |y| {
        let nodes = shape::ring(Vector3::zeros(), 0.5, 60);
        held(&RodSpec { closed: true, ..RodSpec::new(nodes, 0.02, material(y)) }, &[0])
    };
    // Half a turn less a little between segments 9 and 10: the quaternions are almost antiparallel.
    let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::PI - 1e-3);
    let mut folded = cantilever(20, 0.1, 0.02, material(1e5));
    let state = folded.state_mut();
    for i in 10..20 {
        state.orientations[i] = turn * state.orientations[i];
        state.positions[i] = Vector3::x() + turn * Vector3::x() * (0.1 * (i as f64 - 9.5));
    }
    let mut flipped = cantilever(20, 0.1, 0.05, material(1e5));
    for q in flipped.state_mut().orientations.iter_mut().step_by(2) {
        *q = UnitQuaternion::new_unchecked(-q.into_inner());
    }
    let mut damped = cantilever(30, 0.1, 0.05, material(1e5));
    damped.damping(Damping { linear: 5.0, angular: 5.0 });
    let spec = RodSpec::new(straight(3.0, 30), 0.05, material(1e9));
    let physical = RodSpec { stretch: Stretch::Physical, rest: RestShape::Straight, ..spec };
    vec![
        case("zero gravity, at rest", floating(&RodSpec::new(helix(), 0.05, material(1e5))), 0.02, 50),
        case("zero gravity, spinning", spinning, 0.02, 200),
        case("ring hung at a segment", ring(1e6), 0.02, 100),
        case("ring hung at a segment, 1e12 Pa", ring(1e12), 0.02, 100),
        case("folded back: almost antiparallel frames", folded, 0.02, 100),
        case("every second quaternion negated", flipped, 0.02, 100),
        case("damped", damped, 0.02, 100),
        case("physical stretch, 1e9 Pa", held(&physical, &[0]), 0.02, 100),
    ]
}

/// A trunk of 100 segments with 1,000 branches of 5 segments, 10 at each of its segments, in all directions.
fn branches() -> Case {
    let mut assembly = Assembly::new(GRAVITY);
    let wood = Material { youngs_modulus: 1e8, torsion_modulus: 4e7, density: 600.0 };
    let trunk = assembly.rod(&RodSpec::new(shape::straight(Vector3::zeros(), Vector3::z(), 10.0, 100), 0.1, wood));
    assembly.fix(trunk.start);
    for k in 0..1000 {
        let (parent, angle) = (trunk.start + k % 100, k as f64 * 2.399_963);
        let start = assembly.state_mut().positions[parent];
        let direction = Vector3::new(angle.cos(), angle.sin(), 0.5);
        let branch = assembly.rod(&RodSpec::new(shape::straight(start, direction, 1.0, 5), 0.01, wood));
        assembly.branch(parent, 0.5, &branch);
    }
    case("tree of 1,000 branches", assembly, 0.02, 50)
}

/// A tree of 70 rods: a trunk, 9 branches on it and 60 twigs on those, in wind of 60 m/s.
fn storm() -> Case {
    let mut assembly = Assembly::new(GRAVITY);
    let wood = Material { youngs_modulus: 4e9, torsion_modulus: 5e8, density: 700.0 };
    let rod = |start, direction, length: f64, radius| {
        RodSpec::new(shape::straight(start, direction, length, (length / 0.065) as usize), radius, wood)
    };
    let trunk = assembly.rod(&rod(Vector3::zeros(), Vector3::z(), 4.0, 0.03));
    assembly.clamp_start(&trunk);
    let mut parents = vec![trunk];
    for k in 1..70 {
        let parent = &parents[if k < 10 { 0 } else { k % 9 + 1 }];
        // Anywhere in the upper half of the parent.
        let on = parent.start + parent.len() / 2 + k % (parent.len() / 2);
        let angle = k as f64 * 2.399_963;
        let (length, radius) = if k < 10 { (2.0, 0.012) } else { (0.7, 0.003) };
        let state = assembly.state_mut();
        let direction = state.axis(on) + Vector3::new(angle.cos(), angle.sin(), 1.0);
        let start = state.positions[on];
        let branch = assembly.rod(&rod(start, direction, length, radius));
        assembly.branch(on, 0.5, &branch);
        parents.push(branch);
    }
    let wind = Wind::steady(Vector3::new(60.0, 0.0, 0.0));
    assembly.air(Air { density: 1.2, normal_drag: 1.1, tangential_drag: 0.01, wind });
    case("70-rod tree, wind of 60 m/s", assembly, 0.02, 100)
}
