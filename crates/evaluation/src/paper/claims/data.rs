//! Data, network and training (sections 3.1, 3.2 and 4, Table 1; supplement: architecture, k-nearest neighbours).

use dataset::{Config, Scenario};

use super::ours::{count, range, with_unit};
use super::{Claim, why};

const TABLE: &str = "section 4, table 1";
const GRAPH: &str = "section 3.1";
const NETWORK: &str = "section 3.2; supplement, architecture";
const TRAINING: &str = "section 4";
const RANGES: &str = "dataset::Scenario::ranges";
const CONFIG: &str = "dataset::Config::table_1";
const SIZES: &str = "copingnet::NetworkConfig";
const MODULI: &str = "the paper calls the torsion modulus T in table 1 and the supplement and G in section 4: one and the \
                      same here, and Young's modulus of a helix, which it does not give, equals it as in its knot";

pub(super) static CLAIMS: &[Claim] = &[
    Claim::code(["data-dt", "time step", "0.02 s", TABLE, CONFIG], || {
        with_unit(Config::table_1(Scenario::Rod).dt_s, "s")
    }),
    Claim::code(["data-steps", "steps of a simulation in the data", "50", TABLE, CONFIG], || {
        count(Config::table_1(Scenario::Rod).steps)
    }),
    Claim::code(["data-train", "training simulations of a scenario", "256", TABLE, CONFIG], || {
        count(Config::table_1(Scenario::Rod).train_trajectories)
    })
    .read_as("\"data points each describing the rod's dynamics\": whole simulations"),
    Claim::code(["data-validation", "validation simulations of a scenario", "100", TABLE, CONFIG], || {
        count(Config::table_1(Scenario::Rod).validation_trajectories)
    }),
    Claim::code(["rod-segments", "rods: N, uniform", "10 to 55", TABLE, RANGES], || {
        range(Scenario::Rod, "segments", "")
    }),
    Claim::code(["rod-modulus", "rods: Young's modulus, log-uniform", "1e4 to 1e6 Pa", TABLE, RANGES], || {
        range(Scenario::Rod, "youngs_modulus_pa", " Pa")
    }),
    Claim::code(["rod-angle", "rods: initial angle, uniform", "0 to 45 deg", TABLE, RANGES], || {
        range(Scenario::Rod, "initial_angle_deg", " deg")
    }),
    Claim::code(["rod-length", "rods: length, uniform", "1 to 5 m", TABLE, RANGES], || {
        range(Scenario::Rod, "length_m", " m")
    }),
    Claim::code(["helix-segments", "helices: N, uniform", "45 to 105", TABLE, RANGES], || {
        range(Scenario::Helix, "segments", "")
    }),
    Claim::code(["helix-modulus", "helices: torsion modulus, log-uniform", "1e4 to 1e6 Pa", TABLE, RANGES], || {
        range(Scenario::Helix, "torsion_modulus_pa", " Pa")
    })
    .read_as(MODULI),
    Claim::code(["helix-radius", "helices: radius, uniform", "0.4 to 0.6 m", TABLE, RANGES], || {
        range(Scenario::Helix, "helix_radius_m", " m")
    }),
    Claim::code(["helix-height", "helices: height, uniform", "0.4 to 0.6 m", TABLE, RANGES], || {
        range(Scenario::Helix, "helix_height_m", " m")
    }),
    Claim::code(["helix-winding", "helices: winding number, uniform", "2 to 3", TABLE, RANGES], || {
        range(Scenario::Helix, "winding", "")
    }),
    Claim::code(["node-inputs", "features of a node", "14", GRAPH, "graph::paper::NODE"], || count(graph::paper::NODE)),
    Claim::code(["edge-inputs", "features of an edge", "5", GRAPH, "graph::paper::EDGE"], || count(graph::paper::EDGE)),
    Claim::code(["node-outputs", "outputs of a node", "6", GRAPH, "graph::paper::NODE_TARGET"], || {
        count(graph::paper::NODE_TARGET)
    }),
    Claim::code(["edge-outputs", "outputs of an edge", "6", GRAPH, "graph::paper::EDGE_TARGET"], || {
        count(graph::paper::EDGE_TARGET)
    }),
    Claim::caller(["network-blocks", "GN blocks", "3", NETWORK, SIZES]),
    Claim::caller(["network-layers", "layers of a perceptron", "2", NETWORK, SIZES]),
    Claim::caller(["network-width", "width of a perceptron", "32", NETWORK, SIZES]),
    Claim::caller(["network-output", "range of the outputs", "[-1, 1] by tanh, times recorded norms", NETWORK, SIZES]),
    Claim::caller(["training-loss", "loss", "MSE(V) + MSE(E)", "section 3.2", "the checkpoint's card"]),
    Claim::caller(["training-rate", "learning rate", "0.001, constant", TRAINING, "the checkpoint's card"])
        .because(why::FALLING),
    Claim::caller(["training-machine", "trained on", "one NVIDIA Tesla V100", TRAINING, "the checkpoint's card"])
        .because(why::PROCESSOR),
    Claim::code(["knn-neighbours", "k-NN: k", "3", "section 3.2", "knn::Params::default"], || {
        count(knn::Params::default().neighbours)
    }),
    Claim::caller([
        "ablation-simulations",
        "ablation: test simulations",
        "50",
        "supplement, architecture",
        "the sweep",
    ]),
    Claim::caller(["ablation-steps", "ablation: steps of each", "100", "supplement, architecture", "the sweep"]),
];
