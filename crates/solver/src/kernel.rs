//! Arithmetic that runs on one rod or on several at once: the crate [`kernels`], and the blocks of a joint on it.

pub(crate) mod block;
pub(crate) mod transfer;

pub(crate) use kernels::{Spatial, dispatch, dual, flat, lane, math};
