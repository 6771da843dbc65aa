//! Why ours differs from the paper's, a sentence each.

pub(super) const FALLING: &str = "a falling step size came out better in the same time";
pub(super) const PROCESSOR: &str = "no graphics processor is needed: a network of this size trains in minutes";
pub(super) const RANDOM: &str = "topologies are random, and how they grow is not in the paper; ours have about as \
    many segments";
pub(super) const EPOCHS: &str = "how many epochs the paper's training took is not said; ours learns the first outer \
    iteration of each step alone, a fraction of all";
pub(super) const SWEEP: &str = "the sweep gives each architecture four epochs";
pub(super) const SHORT_RODS: &str = "as much within the training's range of N and beyond; on short rods inference \
    costs as much as a solve of so few unknowns";
pub(super) const SHORT_HELICES: &str = "as much from the middle of the training's range of N on; on short helices \
    inference costs as much as a solve of so few unknowns";
pub(super) const FAR: &str = "it grows within the training's range of N and a little beyond; far outside predictions \
    get worse";
pub(super) const LATER: &str = "a guess starts the first outer iteration of a step; the later ones begin at zero, \
    and have more to correct after a guess than after a solve from zero to the same tolerance. How many the paper \
    runs is not said: with one, the projection would be all";
pub(super) const EARLY: &str = "helices gain more later: in their first frames corrections are small, where a \
    network trained on absolute errors is presumably worse";
pub(super) const PLANE: &str = "in raw units no start converges within the cap on iterations; in block-Jacobi's most \
    of the time goes into contacts, and a better start saves outer iterations with all their contacts";
pub(super) const TWO_RODS: &str = "a solve of 50 segments takes as long as inference; and later outer iterations, \
    which begin at zero, have more left to correct after a guess";
pub(super) const TREES: &str = "most of the iterations are those of a step's later outer iterations, which begin at \
    zero; how many the paper runs is not said";
pub(super) const KNOT: &str = "after a guess to start with, conjugate gradients to 1e-4 take more iterations than \
    from zero: the networks, trained on 20 simulations as the paper's, are right in the large, and their small, \
    rough errors weigh most in the residual";
pub(super) const SEEDS: &str = "budgets are small and equal; two seeds of one architecture lie as far apart as \
    neighbours here do";
pub(super) const ONE_LAYER: &str = "a perceptron of one layer has no hidden one, and is linear; from two layers on \
    ours says the same";
pub(super) const WIDTH: &str = "better for both, about as much, with budgets that are small and equal";
