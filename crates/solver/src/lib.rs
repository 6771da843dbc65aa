//! Linear solvers for the dual system `A dlambda = b` of a graph of constraints.

pub mod sparse;
