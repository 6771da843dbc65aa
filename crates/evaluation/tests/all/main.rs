//! Comparisons and experiments as programs run them.

mod benchmark;
mod precision;
