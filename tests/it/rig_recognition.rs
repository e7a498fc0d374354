//! Roles found by name on real and generated rigs.
