//! Generates one of the paper's data sets and reads it: `table_1 (rod|helix) DIRECTORY`.

use std::path::Path;
use std::time::Instant;

use dataset::{BodyFrameBatch, Config, Dataset, DatasetError, PaperBatch, Split, Workspace, generate};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, scenario, directory] = arguments.as_slice() else {
        return Err("usage: table_1 (rod|helix) DIRECTORY".into());
    };
    run(Config::table_1(scenario.parse()?), Path::new(directory))?;
    Ok(())
}

fn run(config: Config, directory: &Path) -> Result<(), DatasetError> {
    let begin = Instant::now();
    let generated = generate(directory, &config, None, &|_| ())?;
    println!("{} shards written, {} kept in {:.2?}", generated.written, generated.kept, begin.elapsed());
    let begin = Instant::now();
    let dataset = Dataset::open(directory)?;
    println!("opened in {:.2?}", begin.elapsed());
    let (mut batch, mut body_frame) = (PaperBatch::default(), BodyFrameBatch::default());
    for split in Split::ALL {
        let begin = Instant::now();
        for trajectory in dataset.trajectories(split) {
            batch.clear();
            trajectory.samples().for_each(|sample| batch.push(&sample, &dataset.norms()));
        }
        println!(
            "{}: {:?}, the paper's features in {:.2?}",
            split.name(),
            dataset.manifest().numbers(split),
            begin.elapsed()
        );
        let begin = Instant::now();
        for trajectory in dataset.trajectories(split) {
            body_frame.clear();
            let mut workspace = Workspace::new(&trajectory);
            trajectory.samples().for_each(|sample| body_frame.push(&sample, &mut workspace));
        }
        println!("{}: body-frame features in {:.2?}", split.name(), begin.elapsed());
    }
    println!("{:?}", dataset.norms());
    Ok(())
}
