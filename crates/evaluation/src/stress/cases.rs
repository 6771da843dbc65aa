//! Single rods, free, clamped, closed: stiff, slack, tiny, huge, uneven and degenerate.

use nalgebra::{UnitQuaternion, Vector3};
use rod::{Assembly, Damping, Material, RestShape, RodSpec, Stretch, shape};

use super::{Case, case};

pub(super) const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

/// The paper's default material, at Young's modulus `y` [Pa].
fn material(y: f64) -> Material {
    Material { youngs_modulus: y, torsion_modulus: y, density: 100.0 }
}

/// A rod whose first segment is fixed.
fn held(spec: &RodSpec) -> Assembly {
    let mut assembly = Assembly::new(GRAVITY);
    let rod = assembly.rod(spec);
    assembly.fix(rod.start);
    assembly
}

/// A straight rod of `segments` of `length` [m] each along x, its first segment fixed.
fn cantilever(segments: usize, length: f64, radius: f64, material: Material) -> Assembly {
    held(&RodSpec::new(straight(length * segments as f64, segments), radius, material))
}

/// Nodes along x.
fn straight(length: f64, segments: usize) -> Vec<Vector3<f64>> {
    shape::straight(Vector3::zeros(), Vector3::x(), length, segments)
}

/// All cases of single rods without contacts.
pub(super) fn all() -> Vec<Case> {
    [ranges(), sizes(), masses(), slack(), supports(), free()].into_iter().flatten().collect()
}

/// Stiffness, time step and number of segments over their ranges.
fn ranges() -> Vec<Case> {
    let mut cases = Vec::new();
    for exponent in 4..=12 {
        let rod = cantilever(30, 4.0 / 30.0, 0.05, material(10_f64.powi(exponent)));
        cases.push(case(format!("Young's modulus 1e{exponent} Pa"), rod, 0.02, 100));
    }
    for dt in [1e-4, 1e-3, 1e-2, 0.1] {
        let rod = cantilever(30, 0.1, 0.05, material(1e5));
        cases.push(case(format!("dt = {dt} s"), rod, dt, 200));
    }
    for (segments, length, steps) in
        [(1, 1.0, 100), (2, 0.5, 100), (10, 0.1, 100), (1000, 0.02, 50), (10_000, 0.02, 10), (100_000, 0.02, 5)]
    {
        let rod = cantilever(segments, length, 0.05, material(1e6));
        cases.push(case(format!("{segments} segments"), rod, 0.02, steps));
    }
    cases
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
    let mut mixed = Assembly::new(GRAVITY);
    let half = |from: f64, density: f64| {
        let nodes = shape::straight(Vector3::x() * from, Vector3::x(), 2.0, 20);
        RodSpec::new(nodes, 0.05, Material { density, ..material(1e5) })
    };
    let light = mixed.rod(&half(0.0, 1.0));
    let heavy = mixed.rod(&half(2.0, 1e6));
    mixed.fix(light.start).branch(light.end - 1, 1.0, &heavy);
    let mut reversed = Assembly::new(GRAVITY);
    let heavy = reversed.rod(&half(0.0, 1e6));
    let light = reversed.rod(&half(2.0, 1.0));
    reversed.fix(heavy.start).branch(heavy.end - 1, 1.0, &light);
    let tip = |dt: f64| {
        let mut rod = cantilever(30, 0.1, 0.05, material(1e5));
        let own = rod.model_mut().segments[29].own_mass();
        rod.add_mass(29, 1e4 * own);
        case(format!("tip mass x 1e4, dt = {dt} s"), rod, dt, 100)
    };
    vec![
        case("mass ratio 1e6, heavy end", mixed, 0.02, 100),
        case("mass ratio 1e6, light end", reversed, 0.02, 100),
        tip(0.02),
        tip(0.1),
    ]
}

fn slack() -> Vec<Case> {
    let heavy = |y| Material { youngs_modulus: y, torsion_modulus: y, density: 1000.0 };
    let helix = held(&RodSpec::new(shape::helix(Vector3::zeros(), 0.5, 0.5, 2.5, 60), 0.01, heavy(1e4)));
    // Pushed together along its axis: a buckled, loose rod that falls through its own straight line.
    let mut loose = cantilever(60, 0.05, 0.01, heavy(1e4));
    for (i, v) in loose.state_mut().velocities.iter_mut().enumerate() {
        *v = Vector3::new(-0.2 * i as f64, 0.05 * i as f64, 0.0);
    }
    vec![
        case("slack thin rod, dt = 0.1 s", cantilever(30, 0.1, 0.01, heavy(1e4)), 0.1, 100),
        case("slack thin rod, dt = 0.02 s", cantilever(60, 0.05, 0.01, heavy(1e4)), 0.02, 200),
        case("slack helix, dt = 0.1 s", helix, 0.1, 100),
        case("slack rod thrown at its clamp", loose, 0.02, 100),
    ]
}

fn supports() -> Vec<Case> {
    let rod = |y| RodSpec::new(straight(3.0, 30), 0.05, material(y));
    let with = |fixed: &[usize], y: f64| {
        let mut assembly = Assembly::new(GRAVITY);
        let range = assembly.rod(&rod(y));
        for &k in fixed {
            assembly.fix(range.start + k);
        }
        assembly
    };
    let mut faces = Assembly::new(GRAVITY);
    let range = faces.rod(&rod(1e12));
    faces.clamp_start(&range).clamp_end(&range);
    let all: Vec<usize> = (0..30).collect();
    vec![
        case("both ends fixed, 1e5 Pa", with(&[0, 29], 1e5), 0.02, 100),
        case("both ends fixed, 1e12 Pa", with(&[0, 29], 1e12), 0.02, 100),
        case("both end faces clamped, 1e12 Pa", faces, 0.02, 100),
        case("four fixed segments in a row", with(&[0, 1, 2, 3], 1e5), 0.02, 100),
        case("fixed in the middle, in a row and at an end", with(&[0, 10, 11, 12, 20], 1e5), 0.02, 100),
        case("all segments fixed", with(&all, 1e5), 0.02, 20),
    ]
}

fn free() -> Vec<Case> {
    let mut spinning = Assembly::new(Vector3::zeros());
    spinning.rod(&RodSpec::new(straight(2.0, 20), 0.05, material(1e6)));
    for i in 0..20 {
        let arm = spinning.state_mut().positions[i] - Vector3::x();
        let spin = Vector3::new(5.0, 0.0, 8.0);
        spinning.state_mut().angular_velocities[i] = spin;
        spinning.state_mut().velocities[i] = spin.cross(&arm);
    }
    let ring = |y| {
        let nodes = shape::ring(Vector3::zeros(), 0.5, 60);
        held(&RodSpec { closed: true, ..RodSpec::new(nodes, 0.02, material(y)) })
    };
    let mut still = Assembly::new(Vector3::zeros());
    still.rod(&RodSpec::new(shape::helix(Vector3::zeros(), 0.5, 0.5, 2.5, 60), 0.05, material(1e5)));
    let mut folded = cantilever(20, 0.1, 0.02, material(1e5));
    for i in 10..20 {
        // Half a turn less a little between segments 9 and 10: the quaternions are almost antiparallel.
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::PI - 1e-3);
        let state = folded.state_mut();
        state.orientations[i] = turn * state.orientations[i];
        let distance = 0.1 * (i as f64 - 9.5);
        state.positions[i] = Vector3::x() + turn * Vector3::x() * distance;
    }
    let mut flipped = cantilever(20, 0.1, 0.05, material(1e5));
    for q in flipped.state_mut().orientations.iter_mut().step_by(2) {
        *q = UnitQuaternion::new_unchecked(-q.into_inner());
    }
    let mut damped = cantilever(30, 0.1, 0.05, material(1e5));
    damped.damping(Damping { linear: 5.0, angular: 5.0 });
    let spec = RodSpec::new(straight(3.0, 30), 0.05, material(1e9));
    let physical = held(&RodSpec { stretch: Stretch::Physical, rest: RestShape::Straight, ..spec });
    vec![
        case("zero gravity, at rest", still, 0.02, 50),
        case("zero gravity, spinning", spinning, 0.02, 200),
        case("ring hung at a segment", ring(1e6), 0.02, 100),
        case("ring hung at a segment, 1e12 Pa", ring(1e12), 0.02, 100),
        case("folded back: almost antiparallel frames", folded, 0.02, 100),
        case("every second quaternion negated", flipped, 0.02, 100),
        case("damped", damped, 0.02, 100),
        case("physical stretch, 1e9 Pa", physical, 0.02, 100),
    ]
}
