use graph::{Graph, Lift};
use solver::component::{Component, Pose};
use solver::formulation::Formulation;
use solver::guess::{InitialGuess, StepExtrapolation};
use solver::simulation::{Settings, Simulation};
use solver::step::StepParams;
use solver::system::Six;
struct Lifted { inner: StepExtrapolation, lift: Lift, graph: Graph, mode: usize }
impl InitialGuess for Lifted {
    fn helps_steps(&self) -> bool { true }
    fn start_step(&mut self, c: &Component<f64>, poses: &mut [Pose<f64>], lambda: &mut [Six<f64>]) -> bool {
        if self.mode < 10 { let given = self.inner.start_step(c, poses, lambda); if !given { return false; } }
        self.lift.fill(&self.graph, c, poses, lambda);
        true
    }
    fn observe_step(&mut self, c: &Component<f64>) { self.inner.observe_step(c) }
}
fn main() {
    for dt in [0.02, 0.05, 0.1] { for tol in [1e-3, 1e-6] { for family in [scene::sampling::Family::Helix, scene::sampling::Family::Rod] {
        let mut row = vec![];
        for mode in [0usize, 1, 2, 3, 11, 12, 13] {
            let (mut its, mut retries, mut us) = (0u64, 0u64, 0.0);
            let mut steps = 0;
            for index in 0..12 {
                let scene = scene::sampling::Parameters::sample(family, 1, index).scene().unwrap();
                let factory = |m: &rod::Model, mem: &solver::component::Members, t: &solver::topology::Topology| -> Option<Box<dyn InitialGuess>> {
                    let g = Graph::new(m, mem, t);
                    let (b, j) = (g.nodes().len(), g.edges().len());
                    match mode { 0 => None, k @ 1..=3 => Some(Box::new(StepExtrapolation::new(k - 1, b, j))),
                      k => Some(Box::new(Lifted { inner: StepExtrapolation::new(k - 11, b, j), lift: Lift::new(&g), graph: g, mode: 0 })) }
                };
                let settings = Settings { step: StepParams { formulation: Formulation::Newton, relative_tolerance: tol, ..Default::default() }, ..Default::default() };
                let mut sim = Simulation::new(&scene.model, &scene.state, &settings, Some(&factory)).unwrap();
                for _ in 0..60 { sim.step(dt).unwrap(); }
                let c = sim.counters(); its += c.iterations; retries += c.retries; steps += 60; us += c.times.total().as_secs_f64() * 1e6;
            }
            row.push(format!("{:.2}({}) {:.0}us", its as f64 / steps as f64, retries, us / steps as f64));
        }
        println!("{family:?} dt {dt} tol {tol}: {}", row.join(" | "));
    }}}
}
