//! What the retarget gives on real and generated rigs, measured.
