//! What tests and benches share: generated scenes, random numbers, the folder of real data.

pub mod data;
pub mod graphs;
pub mod known;
pub mod lights;
pub mod papers;
pub mod png;
pub mod program;
pub mod random;
pub mod scenes;
pub mod spans;
pub mod town;
pub mod tree;
