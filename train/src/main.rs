//! `train`: trains COPINGNet. See `train --help`.

mod adam;
mod cli;
mod measure;
mod objective;
mod samples;
mod trainer;

use std::sync::Arc;
use std::time::Instant;

use clap::Parser;
use copingnet::*;
use dataset::*;

fn main() -> anyhow::Result<()> {
    let cli = cli::Cli::parse();
    let plan = cli.plan();
    let threads = cli.threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, |n| n.get()));
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()?;
    let dataset = Dataset::open(cli.data.join(plan.scenario.name()))?;
    let head = plan.head;
    let mut encoding =
        Encoding { features: plan.features, head, norms: dataset.norms(), whitening: plan.features.unwhitened() };
    let t = Instant::now();
    encoding.whitening = samples::whitening(&dataset, &Arc::new(encoding.clone()), 10);
    let encoding = Arc::new(encoding);
    let samples = samples::Samples::new(&dataset, &encoding, std::env::var("FIRST").map_or(u32::MAX, |_| 1));
    println!("samples {:?} {}", t.elapsed(), samples.len());
    let mut trainer = trainer::Trainer::new(&plan, &samples, &dataset, &encoding);
    let begin = Instant::now();
    for epoch in 0..plan.epochs {
        let t = Instant::now();
        let (mut sum, mut nodes) = (0.0, 0);
        let order = trainer.order(epoch);
        for batch in order.chunks(plan.batch) {
            let (loss, n) = trainer.step(batch);
            sum += loss * batch.len() as f64;
            nodes += n;
        }
        let speed = nodes as f64 / t.elapsed().as_secs_f64();
        if (epoch + 1) % plan.measure_every == 0 {
            let m = measure::measure(&dataset, plan.scenes, &trainer.weights, &encoding);
            println!("{epoch} {:.1?} loss {:.6} {:.0} nodes/s first {:.2?} later {:.2?}", begin.elapsed(), sum / samples.len() as f64, speed, m.first, m.later);
        }
    }
    std::fs::write(format!("{}.raw", plan.out.display()), trainer.weights.values().iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>())?;
    Ok(())
}
