//! Writes untrained checkpoints.
use std::path::Path;
use copingnet::*;
use graph::Norms;
fn main() {
    for scenario in ["rod", "helix"] {
        for (recipe, features, head, scans) in
            [("paper", Features::Paper, Head::Full, 0), ("best", Features::BodyFrame, Head::Semi, 4)]
        {
            let sizes = NetworkConfig { gn_blocks: 1, width: 8, scans, ..NetworkConfig::default() };
            let checkpoint = Checkpoint {
                card: Card {
                    program_version: env!("CARGO_PKG_VERSION").to_owned(),
                    git_revision: None,
                    scenario: scenario.to_owned(),
                    recipe: recipe.to_owned(),
                    data_blake3: None,
                    training: Training {
                        seed: 0,
                        epochs: 0,
                        batch: 0,
                        loss: "none".to_owned(),
                        learning_rate: 1e-3,
                        schedule: "none".to_owned(),
                        backend: "none".to_owned(),
                        threads: 1,
                        seconds: 0.0,
                        command: "none: untrained".to_owned(),
                    },
                    measured: vec![],
                },
                encoding: Encoding {
                    features,
                    head,
                    norms: Norms { dx: 0.1, dphi: 0.1, dlambda_stretch: 1e-2, dlambda_bend: 1e-2 },
                    whitening: features.unwhitened(),
                },
                weights: Weights::random(features.configure(head, sizes), 0),
            };
            checkpoint.save(&Path::new("checkpoints").join(format!("{scenario}-{recipe}"))).unwrap();
        }
    }
}
