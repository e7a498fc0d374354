//! What a retarget is worth, on real files and on made ones: measured here, with nothing of the code that measures for users.

mod determinism;
mod feet;
mod figure;
mod invariance;
mod onto_itself;
mod pairs;
