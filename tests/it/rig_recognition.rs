//! Roles found by name and by shape, on real and generated rigs.

mod calibration;
mod characters;
mod conventions;
mod corpus;
mod creatures;
mod generated;
mod hands;
mod learned;
mod random;
mod real_files;
mod schemes;
mod shapes;
mod spoken;
mod stripped;
mod varied;
