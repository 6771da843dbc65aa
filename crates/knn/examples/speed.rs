//! Cost and worth of the guess on a data set: `speed DIRECTORY [EVERY]`.

use std::sync::Arc;
use std::time::Instant;

use cosserat::guess::InitialGuess;
use cosserat::internals::jointed::linear::LinearSolver;
use cosserat::simulation::{CgParams, PreconditionerKind, SolverKind};
use dataset::{Dataset, Split};
use knn::{Knn, KnnGuess, Params};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let dataset = Dataset::open(arguments.next().ok_or("usage: speed DIRECTORY [EVERY]")?)?;
    let every = arguments.next().map_or(Ok(8), |text| text.parse())?;
    let begin = Instant::now();
    let knn = Arc::new(Knn::new(&dataset, Params { every, ..Params::default() }));
    println!("{} points a role, built in {:.2?}", knn.len(), begin.elapsed());
    for kind in [PreconditionerKind::Raw, PreconditionerKind::Jacobi, PreconditionerKind::BlockJacobi] {
        for tolerance in [1e-2, 1e-4, 1e-6] {
            let params = CgParams { preconditioner: kind, tolerance, max_iterations: None };
            let (mut sums, mut queries, mut seconds) = ([0, 0], 0, 0.0);
            for trajectory in dataset.trajectories(Split::Validation).take(20) {
                let (model, members, topology) = (trajectory.model(), trajectory.members(), trajectory.topology());
                let mut solver: Box<dyn LinearSolver> = SolverKind::Cg(params).build(model, members, topology)?;
                let mut guess = KnnGuess::new(knn.clone(), trajectory.graph().clone(), None);
                let mut component = trajectory.component();
                let mut dlambda = component.dlambda.clone();
                for sample in trajectory.samples().filter(|sample| sample.iteration() == 0).step_by(5) {
                    sample.restore(&mut component);
                    sums[0] += solver.solve(&component.system, false, &mut dlambda).iterations;
                    let begin = Instant::now();
                    guess.start_solve(&component, 0, &mut dlambda);
                    seconds += begin.elapsed().as_secs_f64();
                    queries += 2 * dlambda.len();
                    sums[1] += solver.solve(&component.system, true, &mut dlambda).iterations;
                }
            }
            let ratio = sums[1] as f64 / sums[0] as f64;
            let cost = 1e6 * seconds / queries as f64;
            println!("{kind} {tolerance:e}: {ratio:.2} of the iterations, {cost:.1} us a query");
        }
    }
    Ok(())
}
