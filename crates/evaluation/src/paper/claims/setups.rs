//! Scenes and averages of the figures (section 4 and supplement).

use scene::sampling::{Helix, Parameters, Rod};

use super::ours::{
    count, helix_modulus, helix_on_plane, helix_segments, helix_shape, knot, nodes, parameters, rods, two_rods, varied,
};
use super::{Claim, why};
use crate::paper::{performance, speedup, stability, temporal};

const PERFORMANCE: &str = "section 4, figure on performance";
const TEMPORAL: &str = "section 4, figure on temporal evolution";
const STABILITY: &str = "section 4, long-term stability";
const COLLISIONS: &str = "section 4, collisions";
const TREES: &str = "section 4, complex scenarios";
const DYNAMIC: &str = "supplement, dynamic results";
const COMPARISONS: &str = "supplement, comparisons";
const KNOT: &str = "supplement, knot";
const VARIED: &str = "scene::sampling::supplement";
const ROD: &str = "phi_0 = 0 deg, N = 30, l = 4 m, Y = 1e5 Pa";
const HELIX: &str = "HR = 0.5 m, HH = 0.5 m, HW = 2.5, T = 1e5 Pa, N = 60";
const UNTRAINED: &str = "section 4 gives the trees a training set of their own, and a page later calls the network never \
                         trained on them; taken: the training set; the report has the networks of the rods and of the trees";

pub(super) static CLAIMS: &[Claim] = &[
    Claim::code(
        ["performance-simulations", "performance: simulations", "50", PERFORMANCE, "performance::SIMULATIONS"],
        || count(performance::SIMULATIONS),
    )
    .read_as("over N; over stiffness and tolerance, and in raw units beyond N = 105, where one takes minutes, 10"),
    Claim::code(["performance-steps", "performance: steps of each", "100", PERFORMANCE, "performance::STEPS"], || {
        count(performance::STEPS)
    }),
    Claim::code(["temporal-simulations", "temporal: simulations", "20", TEMPORAL, "temporal::SIMULATIONS"], || {
        count(temporal::SIMULATIONS)
    })
    .read_as("one scene twenty times would be twenty times the same; the others keep N and modulus, and vary the rest"),
    Claim::code(["temporal-window", "temporal: frames smoothed over", "10", TEMPORAL, "temporal::WINDOW"], || {
        count(temporal::WINDOW)
    }),
    Claim::code(
        ["temporal-trained", "temporal: frames of the training", "50", TEMPORAL, "temporal::TRAINED_STEPS"],
        || count(temporal::TRAINED_STEPS),
    ),
    Claim::code(
        ["temporal-rod", "temporal: the rod", "phi_0 = 0 deg, N = 30, l = 3 m, Y = 1e5 Pa", TEMPORAL, "temporal::rod"],
        || parameters(temporal::rod()),
    )
    .read_as("3 m here, 4 m elsewhere"),
    Claim::code(["temporal-helix", "temporal: the helix", HELIX, TEMPORAL, "temporal::helix"], || {
        parameters(temporal::helix())
    }),
    Claim::code(["stability-rod", "stability: the rod, but for Y", ROD, STABILITY, "stability::rod"], || {
        parameters(stability::rod(Rod::default().youngs_modulus))
    })
    .read_as("the values of Y are in the figure's legend alone; the supplement's (d) are taken"),
    Claim::code(
        [
            "plane-helix",
            "helix on the plane",
            "HR = 0.5 m, HH = 0.5 m, HW = 2.5, T = 1e6 Pa, N = 50",
            COLLISIONS,
            "scenes/helix-on-plane.toml",
        ],
        helix_on_plane,
    ),
    Claim::code(
        [
            "two-rods",
            "two rods",
            "phi_0 = 0 deg, N = 20 and 30, l = 4 and 4.5 m, Y = 1e6 Pa",
            COLLISIONS,
            "scenes/two-rods.toml",
        ],
        two_rods,
    ),
    Claim::caller(["trees-training", "trees: training topologies", "100", TREES, "the checkpoint's card"])
        .read_as(UNTRAINED),
    Claim::caller(["trees-training-rods", "trees: rods of each in training", "70", TREES, "the checkpoint's card"])
        .read_as(UNTRAINED),
    Claim::caller(["trees-training-nodes", "trees: mean nodes in training", "1056", TREES, "the checkpoint's card"])
        .read_as(UNTRAINED)
        .because(why::RANDOM),
    Claim::code(["trees-topologies", "trees: test topologies of a size", "30", TREES, "speedup::TOPOLOGIES"], || {
        count(speedup::TOPOLOGIES)
    }),
    Claim::code(["trees-10-rods", "trees of 10 rods: rods", "10", TREES, "scenes/tree-10.toml"], || rods("tree-10")),
    Claim::code(["trees-20-rods", "trees of 20 rods: rods", "20", TREES, "scenes/tree-20.toml"], || rods("tree-20")),
    Claim::code(["trees-40-rods", "trees of 40 rods: rods", "40", TREES, "scenes/tree-40.toml"], || rods("tree-40")),
    Claim::code(["trees-70-rods", "trees of 70 rods: rods", "70", TREES, "scenes/tree-70.toml"], || rods("tree-70")),
    Claim::code(["trees-10-nodes", "trees of 10 rods: nodes", "204", TREES, "scenes/tree-10.toml"], || {
        nodes("tree-10")
    })
    .because(why::RANDOM),
    Claim::code(["trees-20-nodes", "trees of 20 rods: nodes", "355", TREES, "scenes/tree-20.toml"], || {
        nodes("tree-20")
    }),
    Claim::code(["trees-40-nodes", "trees of 40 rods: nodes", "654", TREES, "scenes/tree-40.toml"], || {
        nodes("tree-40")
    })
    .because(why::RANDOM),
    Claim::code(["trees-70-nodes", "trees of 70 rods: nodes", "1061", TREES, "scenes/tree-70.toml"], || {
        nodes("tree-70")
    }),
    Claim::code(["dynamic-rod", "dynamic results: the rod", ROD, DYNAMIC, "scene::sampling::Rod::default"], || {
        parameters(Parameters::Rod(Rod::default()))
    }),
    Claim::code(
        ["dynamic-helix", "dynamic results: the helix", HELIX, DYNAMIC, "scene::sampling::Helix::default"],
        || parameters(Parameters::Helix(Helix::default())),
    ),
    Claim::code(["dynamic-a", "(a): angle [deg]", "0, 15, 30, 45", DYNAMIC, VARIED], || {
        varied('a', |rod| rod.angle_deg, helix_shape)
    }),
    Claim::code(["dynamic-b", "(b): N", "10, 20, 40, 60", DYNAMIC, VARIED], || {
        varied('b', |rod| rod.segments as f64, helix_shape)
    }),
    Claim::code(["dynamic-c", "(c): length [m]", "1, 2, 3, 4, 5, 6", DYNAMIC, VARIED], || {
        varied('c', |rod| rod.length, helix_shape)
    }),
    Claim::code(["dynamic-d", "(d): Young's modulus [Pa]", "2e4, 5e4, 1e5, 2e5, 5e5, 1e6", DYNAMIC, VARIED], || {
        varied('d', |rod| rod.youngs_modulus, helix_shape)
    }),
    Claim::code(
        [
            "dynamic-e",
            "(e): helix radius [m], height [m], winding number",
            "(0.4, 0.4, 2), (0.4, 0.4, 3), (0.5, 0.5, 2), (0.5, 0.5, 3)",
            DYNAMIC,
            VARIED,
        ],
        || varied('e', |rod| rod.length, helix_shape),
    ),
    Claim::code(["dynamic-f", "(f): N of the helix", "30, 60, 80, 100", DYNAMIC, VARIED], || {
        varied('f', |rod| rod.length, helix_segments)
    }),
    Claim::code(["dynamic-g", "(g): torsion modulus [Pa]", "2e4, 5e4, 1e5, 1e6", DYNAMIC, VARIED], || {
        varied('g', |rod| rod.length, helix_modulus)
    })
    .read_as("G in the text of (g), T before; the caption ends at (f), the text has (g)"),
    Claim::code(
        [
            "knot-rope",
            "knot: the rope",
            "N = 110, R = 0.01 m, l = 11 m, Y = 1e4 Pa, T = 1e4 Pa",
            KNOT,
            "scenes/knot.toml",
        ],
        knot,
    ),
    Claim::caller(["knot-training", "knot: training simulations", "20", KNOT, "the checkpoint's card"]),
    Claim::caller(["knot-training-frames", "knot: frames of each in training", "100", KNOT, "the checkpoint's card"]),
    Claim::code(["comparisons-rod", "comparisons: the rod", ROD, COMPARISONS, "scene::sampling::Rod::default"], || {
        parameters(Parameters::Rod(Rod::default()))
    }),
    Claim::code(
        ["comparisons-helix", "comparisons: the helix", HELIX, COMPARISONS, "scene::sampling::Helix::default"],
        || parameters(Parameters::Helix(Helix::default())),
    ),
];
