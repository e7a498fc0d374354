//! What a retarget is worth, on real files and on made ones: measured here, with nothing of the code that measures for users.

mod determinism;
pub(crate) mod figure;
mod invariance;
mod matrix;
mod onto_itself;
mod pairs;
