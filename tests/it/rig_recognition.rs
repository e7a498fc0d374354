//! Roles found by name on real and generated rigs.

mod generated;
mod real_files;
mod schemes;
mod stripped;
