//! Whether contacts hold: `cargo run -p evaluation --example contacts_hold -- heap-320 300` runs 300 steps of a builtin scene
//! or of a scene file, with `newton` after the steps in that formulation, and with a number after that with that contact tolerance [radii].
//!
//! Each row is about a tenth of the steps: the time at its end, wall time and the processor time of a step, outer iterations of a segment and sweeps
//! over contacts' problems a step, the upward force of obstacles over the weight of what moves (mean), the largest speed of a segment at the end, the
//! deepest penetration so far, steps halved and not converged so far, and pairs of segments that passed through each other, by brute force on
//! their swept axes in every tenth step. Last the stages' shares of the time, and the memory at its peak (Linux). `RAYON_NUM_THREADS=1` keeps it to one thread.

use std::error::Error;
use std::time::{Duration, Instant};

use cosserat::scene;
use cosserat::simulation::{Formulation, Settings, Simulation, StepParams, Touched};
use cosserat::state::measure;
use evaluation::clock::process_time;
use evaluation::passing::passing;

/// Steps from one look at swept axes to the next.
const LOOK: usize = 10;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().ok_or("say which scene, and how many steps")?;
    let steps: usize = arguments.next().ok_or("say how many steps")?.parse()?;
    let formulation: Formulation = arguments.next().map_or(Ok(Formulation::default()), |name| name.parse())?;
    let scene = if name.ends_with(".toml") { scene::load(&name)? } else { scene::builtin(&name)? };
    let model = &scene.model;
    let mut step =
        StepParams { formulation, integrator: scene.run.integrator.unwrap_or_default(), ..StepParams::default() };
    if let Some(tolerance) = arguments.next() {
        step.contact_tolerance = tolerance.parse()?;
    }
    let mut simulation = Simulation::new(model, &scene.state, &Settings { step, ..Settings::default() }, None)?;
    let weight = model.gravity.norm() * model.segments.iter().filter(|s| !s.fixed).map(|s| s.mass()).sum::<f64>();
    println!(
        "{name}: {} segments, {} steps of {} s, {}, contact tolerance {:e}",
        model.segments.len(),
        steps,
        scene.run.dt,
        formulation.name(),
        step.contact_tolerance
    );
    println!(
        "time [s]  ms        outer  sweeps  force/weight  fastest [m/s]  deepest [radii]  halved  unconverged  passed"
    );
    let (mut before, mut after, mut forces) = (scene.state.clone(), scene.state.clone(), Vec::new());
    let rows = steps.div_ceil(10).max(1);
    let (mut last, mut ms, mut cpu_ms, mut up, mut passed) = (simulation.counters(), 0.0, 0.0, 0.0, 0);
    for step in 1..=steps {
        let look = step % LOOK == 0;
        if look {
            simulation.store(&mut before);
        }
        let (start, cpu_start) = (Instant::now(), process_time());
        let status = simulation.step(scene.run.dt)?.status;
        ms += start.elapsed().as_secs_f64() * 1e3;
        let spent = process_time().zip(cpu_start).map_or(f64::NAN, |(now, before)| (now - before).as_secs_f64());
        cpu_ms += spent * 1e3;
        if !status.is_converged() {
            println!("step {step}: {}", status.name());
        }
        simulation.store_contact_forces(&mut forces);
        let obstacles = forces.iter().filter(|force| matches!(force.other, Touched::Obstacle(_)));
        up -= obstacles.map(|force| force.force.dot(&model.gravity)).sum::<f64>() / model.gravity.norm() / weight;
        if look {
            simulation.store(&mut after);
            for [a, b] in passing(model, &before, &after) {
                println!("step {step}: segments {a} and {b} pass through each other");
                passed += 1;
            }
        }
        if step % rows == 0 || step == steps {
            simulation.store(&mut after);
            let fastest = after.velocities.iter().map(|v| v.norm()).fold(0.0, f64::max);
            let now = simulation.counters();
            let count = match step % rows {
                0 => rows,
                part => part,
            } as f64;
            let outer = (now.segment_iterations - last.segment_iterations) as f64 / model.segments.len() as f64;
            let sweeps = (now.contact_sweeps - last.contact_sweeps) as f64;
            println!(
                "{:<8.3}  {:<8.2}  {:<8.2}  {:<5.2}  {:<6.0}  {:<12.4}  {:<13.3e}  {:<15.1e}  {:<6}  {:<11}  {passed}",
                step as f64 * scene.run.dt,
                ms / count,
                cpu_ms / count,
                outer / count,
                sweeps / count,
                up / count,
                fastest,
                now.deepest_penetration,
                now.retries,
                now.not_converged,
            );
            (last, ms, cpu_ms, up) = (now, 0.0, 0.0, 0.0);
        }
    }
    let times = simulation.counters().times;
    let share = |(name, time): (_, Duration)| {
        format!("{name} {:.1} %", 100.0 * time.as_secs_f64() / times.total().as_secs_f64())
    };
    println!("of the time of all stages: {}", times.by_name().map(share).join(", "));
    println!("widest gap of a joint: {:.1e} segments", measure::worst_gap(model, &after));
    if let Ok(status) = std::fs::read_to_string("/proc/self/status")
        && let Some(line) = status.lines().find(|line| line.starts_with("VmHWM"))
    {
        println!("memory at its peak: {}", line.trim_start_matches("VmHWM:").trim());
    }
    Ok(())
}
