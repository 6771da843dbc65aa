//! A running simulation in a browser: watched, taken hold of, stopped, taken back.
//!
//! [`Live::open`] starts a server on this machine alone and prints nothing; [`Live::address`] is what to open there. Each
//! [`Live::turn`] does what viewers asked for, steps the simulation if its time has come, and shows them the new state, so that a
//! program's own loop can be watched and handled; [`serve`] is that loop. All that viewers do to the motion is an [`Input`] of a
//! [`Session`], which records it: the [`Recording`] replays to the same bits ([`Replay`]).
//!
//! The page is that of the crate `view`; frames come over a WebSocket (RFC 6455). Nothing else is fetched, and nothing but this
//! machine can connect. This crate knows of no scenes, files and command lines. It is internal:
//! programs use `cosserat`.

mod broken;
mod command;
mod frame;
mod hand;
mod head;
mod hub;
mod input;
mod knobs;
mod pacer;
mod server;
mod session;
mod turn;

pub use broken::LiveError;
pub use hand::with_hands;
pub use input::{Input, Recording};
pub use knobs::{Knob, Knobs};
pub use session::{Rebuild, Replay, Session};
pub use turn::{Live, Options, Save, serve};
