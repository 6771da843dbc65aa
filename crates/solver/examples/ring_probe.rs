use nalgebra::Vector3;
use rod::*;
use solver::simulation::*;
use solver::statics::*;
fn main() {
    let mat = Material { youngs_modulus: 1e7, torsion_modulus: 4e6, density: 1000. };
    let r = 0.01;
    let m0 = mat;
    for n in [50, 100] {
        for k in [0.9, 0.97, 1.03, 1.1] {
            let mat = Material { torsion_modulus: 0.5 * m0.youngs_modulus * 3f64.sqrt() * k, ..m0 };
            let tw = std::f64::consts::TAU;
            let mut a = Assembly::new(Vector3::zeros());
            let nodes = shape::ring(Vector3::zeros(), 1.0, n);
            a.rod(&RodSpec {
                closed: true,
                twist: tw * (n as f64 - 1.) / n as f64,
                rest: RestShape::Straight,
                ..RodSpec::new(nodes, r, mat)
            });
            for (i, v) in a.state_mut().positions.iter_mut().enumerate() {
                v.z += 1e-4 * (2.0 * std::f64::consts::TAU * i as f64 / n as f64).cos();
            }
            let (m, mut s) = a.finish();
            println!("seam twist {:?}", measure::bend_strain(&m, &s, &m.joints[n - 1]));
            let t = std::time::Instant::now();
            let rep = equilibrium(&m, &mut s, &StaticParams::default()).unwrap();
            let z = s.positions.iter().map(|p| p.z.abs()).fold(0., f64::max);
            println!("n {n} k {k} {rep:?} zmax {z:.3e} E {:?} {:?}", measure::energy(&m, &s), t.elapsed());
        }
    }
    // ring under weight dynamic
    let mut a = Assembly::new(Vector3::new(0., 0., -9.81));
    let rod = a.rod(&RodSpec { closed: true, ..RodSpec::new(shape::ring(Vector3::zeros(), 1.0, 100), r, mat) });
    a.fix(rod.start);
    let (m, mut s) = a.finish();
    let mut sim = Simulation::new(&m, &s, &Settings::default(), None).unwrap();
    for _ in 0..100 {
        sim.step(0.02).unwrap();
    }
    sim.store(&mut s);
    println!("{:?} {}", sim.counters(), measure::worst_gap(&m, &s));
}
