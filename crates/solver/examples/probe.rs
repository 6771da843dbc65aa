use nalgebra::Vector3;
use rod::*;
use solver::formulation::Formulation;
use solver::simulation::*;
use std::time::Instant;
fn main() {
    let n: usize = std::env::args().nth(1).map_or(30, |s| s.parse().unwrap());
    let y: f64 = std::env::args().nth(2).map_or(1e5, |s| s.parse().unwrap());
    let r: f64 = std::env::args().nth(3).map_or(0.05, |s| s.parse().unwrap());
    let rho: f64 = std::env::args().nth(4).map_or(100., |s| s.parse().unwrap());
    let dt: f64 = std::env::args().nth(5).map_or(0.02, |s| s.parse().unwrap());
    let steps: usize = std::env::args().nth(6).map_or(100, |s| s.parse().unwrap());
    let rods: usize = std::env::args().nth(7).map_or(1, |s| s.parse().unwrap());
    let mat = Material { youngs_modulus: y, torsion_modulus: y, density: rho };
    for f in Formulation::ALL {
        let mut a = Assembly::new(Vector3::new(0., 0., -9.81));
        for k in 0..rods {
            let rod = a.rod(&RodSpec::new(
                shape::straight(
                    Vector3::new(0., k as f64, 0.),
                    Vector3::x(),
                    3.0 * (n as f64 / 30.0).max(1.0).min(1e9),
                    n,
                ),
                r,
                mat,
            ));
            a.fix(rod.start);
        }
        let (m, mut s) = a.finish();
        let e0 = measure::energy(&m, &s);
        let l0 = measure::centreline_length(&m, &s);
        let mut set = Settings::default();
        set.step.formulation = f;
        let mut sim = Simulation::new(&m, &s, &set, None).unwrap();
        let t = Instant::now();
        let mut emax = f64::MIN;
        let mut worst = solver::step::Status::Converged;
        for _ in 0..steps {
            worst = worst.max(sim.step(dt).unwrap().status);
            if n < 1000 {
                sim.store(&mut s);
                emax = emax.max(measure::energy(&m, &s).total() - e0.total());
            }
        }
        let el = t.elapsed();
        let c = sim.counters();
        sim.store(&mut s);
        println!(
            "{f:15} {worst:?} its/step {:.2} steps {} retries {} notconv {} us/seg/it all {:.3} solve {:.3} asm {:.3} upd {:.3} pred/step {:.3} | wall/segit {:.4} | emax {emax:.3e} len {:.2e} tip {:?} E {:?}",
            c.iterations as f64 / steps as f64 / rods as f64,
            c.steps,
            c.retries,
            c.not_converged,
            c.times.total().as_secs_f64() * 1e6 / c.segment_iterations as f64,
            c.times.solve.as_secs_f64() * 1e6 / c.segment_iterations as f64,
            c.times.assemble.as_secs_f64() * 1e6 / c.segment_iterations as f64,
            c.times.update.as_secs_f64() * 1e6 / c.segment_iterations as f64,
            c.times.predict.as_secs_f64() * 1e6 / (steps * n * rods) as f64,
            el.as_secs_f64() * 1e6 / c.segment_iterations as f64,
            measure::centreline_length(&m, &s) / l0 - 1.0,
            s.positions[n - 1].as_slice(),
            measure::energy(&m, &s).total() - e0.total()
        );
    }
}
