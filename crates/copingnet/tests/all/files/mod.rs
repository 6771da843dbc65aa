//! What the tests share.
#![allow(dead_code, unreachable_pub)]

use copingnet::{
    Card, Checkpoint, Encoding, Features, Head, Leg, Measured, NetworkConfig, Simulated, Training, Weights,
};
use graph::{Norms, Whitening};

/// A small checkpoint, with the head that fits the features best.
pub fn small(features: Features) -> Checkpoint {
    let head = match features {
        Features::Paper => Head::Full,
        Features::BodyFrame => Head::Semi,
        Features::History => Head::Turns,
    };
    let sizes = NetworkConfig { gn_blocks: 1, mlp_layers: 2, width: 4, scans: 1, ..NetworkConfig::default() };
    Checkpoint {
        card: Card {
            program_version: "0.1.0".to_owned(),
            git_revision: Some("8ddc5554".to_owned()),
            scenario: "rod".to_owned(),
            recipe: "best".to_owned(),
            data_blake3: Some(blake3::hash(b"manifest").to_hex().to_string()),
            simulated: Some(Simulated::as_in_the_paper([0.02, 0.1])),
            training: Training {
                seed: 7,
                trajectories: Some(20),
                steps: Some(50),
                epochs: 30,
                batch: 32,
                loss: "energy".to_owned(),
                learning_rate: 0.001,
                schedule: "cosine".to_owned(),
                backend: "ndarray".to_owned(),
                threads: 2,
                seconds: 12.5,
                command: "train --recipe best".to_owned(),
            },
            before: vec![leg(100.0)],
            measured: vec![Measured {
                preconditioner: "block-jacobi".to_owned(),
                tolerance: 1e-6,
                steps: "all of 10 scenes".to_owned(),
                ratio: 0.5,
            }],
        },
        encoding: Encoding {
            features,
            head,
            norms: Norms { dx: 0.1, dphi: 0.2, dlambda_stretch: 3e-5, dlambda_bend: 4e-9 },
            whitening: features.channels().map(|channels| Whitening::identity(channels.len())),
        },
        weights: Weights::random(features.configure(head, sizes), 5),
    }
}

/// An earlier training that took so long [s].
pub fn leg(seconds: f64) -> Leg {
    let training = Training {
        seed: 6,
        trajectories: None,
        steps: None,
        epochs: 3,
        batch: 16,
        loss: "mse".to_owned(),
        learning_rate: 0.01,
        schedule: "constant".to_owned(),
        backend: "flex".to_owned(),
        threads: 1,
        seconds,
        command: "train".to_owned(),
    };
    let weights_blake3 = blake3::hash(b"earlier").to_hex().to_string();
    Leg { weights_blake3, git_revision: None, data_blake3: None, training }
}

/// Sealed text that was changed, its checksum made good.
pub fn resealed(text: &str) -> Vec<u8> {
    let body = text.split_once('\n').unwrap().1;
    format!("checksum = \"{}\"\n{body}", blake3::hash(body.as_bytes()).to_hex()).into_bytes()
}
