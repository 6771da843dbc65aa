//! Nothing is allocated once solvers and guesses are set up.

use component::Members;
use dynamics::formulation::{Formulation, Tangent};
use dynamics::guess::GuessKind;
use dynamics::simulation::{Settings, Simulation};
use jointed::linear::cg::CgParams;
use jointed::linear::precondition::PreconditionerKind;
use jointed::linear::solvers::SolverKind;
use jointed::topology::Topology;
use kernels::Spatial;
use nalgebra::Vector3;
use rod::{Air, Assembly, Gusts, Material, Model, RodSpec, Wind, shape};

use crate::common::*;

fn allocations(f: impl FnOnce()) -> u64 {
    allocation_counter::measure(f).count_total
}

#[test]
fn solves_do_not_allocate() {
    let (model, state) = tree();
    let (component, members) = component_after(&model, &state, 10, Formulation::Xpbd);
    let kinds = PreconditionerKind::ALL.map(|preconditioner| CgParams { preconditioner, ..CgParams::default() });
    for kind in kinds.map(SolverKind::Cg).into_iter().chain([SolverKind::Direct]) {
        let mut solver = kind.build(&model, &members, &component.system.topology).unwrap();
        let mut x = vec![Spatial::zero(); component.system.joints.len()];
        let count = allocations(|| {
            for _ in 0..3 {
                solver.solve(&component.system, false, &mut x);
            }
        });
        assert_eq!(count, 0, "{kind}");
    }
}

#[test]
fn guesses_do_not_allocate() {
    let (model, state) = tree();
    let (mut component, members) = component_after(&model, &state, 10, Formulation::Xpbd);
    for kind in GuessKind::ALL {
        let Some(mut guess) = kind.build(&model, &members, &component.system.topology) else { continue };
        let mut x = vec![Spatial::zero(); component.system.joints.len()];
        let mut poses = component.poses.clone();
        let count = allocations(|| {
            for _ in 0..12 {
                guess.start_step(&component, &mut poses, &mut x);
                guess.start_solve(&component, 0, &mut x);
                for (joint, terms) in component.dlambda.iter_mut().zip(&component.system.joints) {
                    *joint = terms.rhs;
                }
                guess.observe_solve(&component, 0);
                guess.observe_step(&component);
            }
        });
        assert_eq!(count, 0, "{kind}");
    }
}

#[test]
fn snapshots_do_not_allocate_again() {
    let (model, state) = tree();
    for (formulation, kind, solver) in ways() {
        let build = |model: &Model, members: &Members, topology: &Topology| kind.build(model, members, topology);
        let mut simulation = Simulation::new(&model, &state, &settings(formulation, solver), Some(&build)).unwrap();
        for _ in 0..30 {
            simulation.step(DT).unwrap();
        }
        let mut snapshot = simulation.snapshot();
        let count = allocations(|| {
            simulation.restore(&snapshot).unwrap();
            simulation.snapshot_into(&mut snapshot);
        });
        assert_eq!(count, 0, "{formulation}, {kind}");
    }
}

#[test]
fn whole_steps_do_not_allocate() {
    let (tree_model, tree_state) = tree();
    let mut rods = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    for k in 0..16 {
        let nodes = shape::straight(Vector3::y() * f64::from(k), Vector3::x(), 2.0, 20);
        let material = Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 100.0 };
        let rod = rods.rod(&RodSpec::new(nodes, 0.05, material));
        rods.fix(rod.start);
    }
    let (rods_model, rods_state) = rods.finish();
    let gusts = Gusts { strength: 0.3, length: 1.0, time: 1.0, seed: 1 };
    let wind = Wind::new(Vector3::x(), Some(gusts), None);
    let mut windy_model = tree_model.clone();
    windy_model.air = Some(Air { density: 1.2, normal_drag: 1.1, tangential_drag: 0.01, wind });
    for (model, state) in [(&tree_model, &tree_state), (&windy_model, &tree_state), (&rods_model, &rods_state)] {
        for formulation in Formulation::ALL {
            let positive = [SolverKind::Direct, SolverKind::cg(PreconditionerKind::BlockJacobi)];
            let ways = positive.map(|solver| (solver, Tangent::Positive)).into_iter();
            let exact = [(SolverKind::Direct, Tangent::Exact)];
            for (solver, tangent) in ways.chain(exact.into_iter().filter(|_| formulation == Formulation::Newton)) {
                let mut settings = Settings { solver, ..Settings::default() };
                settings.step.formulation = formulation;
                settings.step.tangent = tangent;
                let mut simulation = Simulation::new(model, state, &settings, None).unwrap();
                simulation.step(0.02).unwrap();
                let count = allocations(|| {
                    for _ in 0..5 {
                        simulation.step(0.02).unwrap();
                    }
                });
                assert_eq!(count, 0, "{formulation}, {solver}, {tangent}");
            }
        }
    }
}
