//! All acceptance tests as one program, which builds faster than one a file.

mod auto;
mod bdf2;
mod bodies;
mod branches;
mod cables;
mod capstan;
mod contact;
mod contact_scenes;
mod drum;
mod dynamics;
mod equilibria;
mod grips;
mod inner_damping;
mod invariance;
mod modes;
mod needs;
mod paths;
mod rest_rotation;
mod resting;
mod sections;
mod stability;
mod starts;
mod statics;
mod suture;
mod trees_and_loops;
mod wind;
