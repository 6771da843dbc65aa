use nalgebra::Vector3;
use rod::*;
use solver::statics::*;
fn cantilever(n: usize, g: f64, load: Option<Vector3<f64>>, torque: Option<Vector3<f64>>) -> (Model, State, f64) {
    let (l, r) = (1.0, 0.01);
    let mat = Material { youngs_modulus: 1e7, torsion_modulus: 4e6, density: 1000. };
    let sec = Section { radius: r };
    let b = sec.bending_stiffness(&mat);
    let grav = g * b / (mat.density * sec.area() * l * l * l);
    let mut a = Assembly::new(Vector3::new(0., 0., -grav));
    let rod = a.rod(&RodSpec::new(shape::straight(Vector3::zeros(), Vector3::x(), l, n), r, mat));
    a.clamp_start(&rod);
    let z = Vector3::zeros();
    if load.is_some() || torque.is_some() {
        a.load(Load {
            segment: rod.end - 1,
            offset: 0.5 * l / n as f64,
            force: load.unwrap_or(z) * b,
            torque: torque.unwrap_or(z) * b,
        });
    }
    let (m, s) = a.finish();
    (m, s, b)
}
fn tip(m: &Model, s: &State) -> Vector3<f64> {
    let i = m.segments.len() - 1;
    s.positions[i] + s.axis(i) * 0.5 * m.segments[i].length
}
fn main() {
    for n in [50, 100, 200, 400] {
        for (a, d, sh) in
            [(1., 0.30172, 0.05643), (2., 0.49346, 0.16064), (5., 0.71379, 0.38763), (10., 0.81061, 0.55500)]
        {
            let (m, mut s, _) = cantilever(n, 0., Some(Vector3::new(0., 0., -a)), None);
            let t = std::time::Instant::now();
            let r = equilibrium(&m, &mut s, &StaticParams::default()).unwrap();
            let p = tip(&m, &s);
            println!("n {n} a {a} {r:?} drop err {:.2e} short err {:.2e} {:?}", -p.z - d, (1. - p.x) - sh, t.elapsed());
        }
        for (g, d, re) in
            [(1., 0.12347, 0.99125), (10., 0.70020, 0.65635), (50., 0.90792, 0.24501), (100., 0.93752, 0.15922)]
        {
            let (m, mut s, _) = cantilever(n, g, None, None);
            let t = std::time::Instant::now();
            let r = equilibrium(&m, &mut s, &StaticParams::default()).unwrap();
            let p = tip(&m, &s);
            println!("n {n} G {g} {r:?} drop err {:.2e} reach err {:.2e} {:?}", -p.z - d, p.x - re, t.elapsed());
        }
        let (m, mut s, _) = cantilever(n, 0., None, Some(Vector3::new(0., std::f64::consts::TAU, 0.)));
        let r = equilibrium(&m, &mut s, &StaticParams::default()).unwrap();
        println!("n {n} rollup {r:?} tip {:?}", tip(&m, &s));
    }
}
