//! All tests of the crate's public side but those that count allocations, as one program, which builds faster than one a file.

mod apart;
mod batch;
mod cg;
#[path = "../common/mod.rs"]
mod common;
mod contact_forces;
mod driven;
mod grips;
mod guess;
mod islands;
mod joint_forces;
mod lanes;
mod many_contacts;
mod materials;
mod meshes;
mod moving_obstacles;
mod multistep;
mod newton_contacts;
mod overlap;
mod own_forces;
mod prescribed;
mod projection;
mod rates;
mod snapshots;
mod solids;
mod supports;
mod tangent;
mod validation;
