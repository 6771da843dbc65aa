//! What the paper measured (section 4 and supplement): the caller fills in what we measure.

use super::{Claim, why};

const PERFORMANCE: &str = "section 4, discretization, figure on performance";
const TEMPORAL: &str = "section 4, temporal evolution";
const STABILITY: &str = "section 4, long-term stability";
const COLLISIONS: &str = "section 4, collisions";
const TREES: &str = "section 4, complex scenarios";
const TRAINING: &str = "section 4, table 1";
const ARCHITECTURE: &str = "supplement, architecture";
const COMPARISONS: &str = "supplement, comparisons";
const SAVED: &str = "what a per cent of speed-up is, is not said; taken as time saved, (t0 - t1) / t0";
const HOURS: &str = "5 and 6 hours in the caption, 8 to 30 hours in the text: taken as the two networks used, and as the \
                     range over all architectures of the ablation";
const SIZES: &str = "for trees the gain falls with the size, for rods it grows with N; each is taken as it stands, for its \
                     own scenes. What a per cent is: time saved, (t0 - t1) / t0";

pub(super) static CLAIMS: &[Claim] = &[
    Claim::measured(["training-hours-rod", "training of the rods' network", "5 h", TRAINING])
        .read_as(HOURS)
        .because(why::EPOCHS),
    Claim::measured(["training-hours-helix", "training of the helices' network", "6 h", TRAINING])
        .read_as(HOURS)
        .because(why::EPOCHS),
    Claim::measured(["training-hours-all", "training over architectures", "8 to 30 h", "section 4"])
        .read_as(HOURS)
        .because(why::SWEEP),
    Claim::measured(["projection-rod", "rods: constraint projection's speed-up", "up to 50 %", PERFORMANCE])
        .read_as(SAVED)
        .because(why::SHORT_RODS),
    Claim::measured(["projection-helix", "helices: constraint projection's speed-up", "up to 50 %", PERFORMANCE])
        .read_as(SAVED)
        .because(why::SHORT_HELICES),
    Claim::measured(["projection-growth", "projection's speed-up over N", "more with more nodes", PERFORMANCE])
        .read_as(SIZES)
        .because(why::FAR),
    Claim::measured([
        "projection-small",
        "projection's speed-up at small N",
        "a loss with only a few nodes",
        PERFORMANCE,
    ]),
    Claim::measured([
        "projection-beyond",
        "projection's speed-up beyond the training's N",
        "a gain there, too",
        PERFORMANCE,
    ]),
    Claim::measured([
        "whole-converges",
        "whole simulation's speed-up",
        "converges to the projection's with growing N",
        PERFORMANCE,
    ])
    .because(why::LATER),
    Claim::measured(["temporal-helix-gain", "helix: speed-up beyond 50 frames", "about 50 %", TEMPORAL]).read_as(SAVED),
    Claim::measured(["temporal-rod-gain", "rod: speed-up over frames", "a gain that decreases", TEMPORAL]),
    Claim::measured(["temporal-highest", "frames of the highest speed-up", "the first 50, as in training", TEMPORAL])
        .because(why::EARLY),
    Claim::measured(["temporal-order", "helix against rod", "more gain for the helix", TEMPORAL]),
    Claim::measured([
        "stability-end-to-end",
        "length with end-to-end predictions",
        "diverges exponentially beyond 50 steps",
        STABILITY,
    ]),
    Claim::measured(["stability-guess", "length with the guess in the solver", "l / l0 stays 1", STABILITY]),
    Claim::measured(["plane-total", "helix on the plane: total speed-up", "about 10 %", COLLISIONS])
        .read_as(SAVED)
        .because(why::PLANE),
    Claim::measured(["two-rods-total", "two rods: total speed-up", "about 6 %", COLLISIONS])
        .read_as(SAVED)
        .because(why::TWO_RODS),
    Claim::measured(["trees-10-total", "trees of 10 rods: speed-up, inference included", "17.0 %", TREES])
        .read_as(SIZES)
        .because(why::TREES),
    Claim::measured(["trees-20-total", "trees of 20 rods: speed-up, inference included", "15.8 %", TREES])
        .read_as(SIZES)
        .because(why::TREES),
    Claim::measured(["trees-40-total", "trees of 40 rods: speed-up, inference included", "13.0 %", TREES])
        .read_as(SIZES)
        .because(why::TREES),
    Claim::measured(["trees-70-total", "trees of 70 rods: speed-up, inference included", "11.1 %", TREES])
        .read_as(SIZES)
        .because(why::TREES),
    Claim::measured(["trees-real-time", "trees of over 1000 nodes", "interactive rates", TREES]),
    Claim::measured(["knot-total", "knot: total speed-up", "10.4 %", "supplement, knot"])
        .read_as(SAVED)
        .because(why::KNOT),
    Claim::measured(["knot-kept", "knot in the last frame", "still a knot", "supplement, knot"]),
    Claim::measured([
        "nrmse-guess",
        "NRMSE of the guess in the solver",
        "converges to an almost correct solution",
        COMPARISONS,
    ])
    .read_as("what normalises it is not said; taken: the rod's length"),
    Claim::measured([
        "nrmse-end-to-end",
        "NRMSE of end-to-end learning, k-NN and GN",
        "large, growing with the frames",
        COMPARISONS,
    ]),
    Claim::measured([
        "dynamic-distance",
        "motion with the guess",
        "that of vanilla PBD",
        "supplement, dynamic results",
    ]),
    Claim::measured(["ablation-blocks", "more GN blocks", "better, no longer beyond 4", ARCHITECTURE])
        .because(why::SEEDS),
    Claim::measured(["ablation-layers", "more MLP layers", "no better", ARCHITECTURE]).because(why::ONE_LAYER),
    Claim::measured(["ablation-width", "greater MLP width", "better, most for the helix", ARCHITECTURE])
        .because(why::WIDTH),
];
