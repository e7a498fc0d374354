//! What a retarget is worth, on real files and on made ones: measured here, with nothing of the code that measures for users.

mod airborne;
mod animals;
mod bodies;
mod creatures;
mod determinism;
mod feet;
pub(crate) mod figure;
mod fingers;
mod gait;
mod heads;
mod invariance;
mod limbs;
mod lying;
mod made_rigs;
mod matrix;
mod near_hands;
mod onto_itself;
mod pairs;
mod properties;
mod self_contact;
mod shoulders;
mod soles;
mod spines;
mod stretched;
mod tiptoe;
mod treadmill;
mod wide_hips;
