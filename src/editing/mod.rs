//! Edits of a clip, with or without a retarget around them: its time, its seams, its sides.
//!
//! Every edit is a function from a clip to a clip; none changes a skeleton. Knows no file format and no retarget.

mod cycle;
mod error;
mod gaze;
mod layer;
mod looping;
mod margin;
mod mirror;
mod mirror_components;
mod mirror_rest;
mod morph_fit;
mod morphs;
mod reduce;
mod sampling;
mod schedule;
mod seams;
mod time;
mod warp;

pub use cycle::{Cycle, find_cycles};
pub use error::EditError;
pub use gaze::{Gaze, Look, is_look};
pub use layer::{Layer, LayerError, branch_weights, layered, taken_out};
pub use margin::Margin;
pub use mirror::{Mirror, Twins};
pub use mirror_components::mirror_components;
pub use morph_fit::{FitQuality, FitRule, FitSide, MorphFit};
pub use morphs::moved_morphs;
pub use reduce::{Reduction, Tolerance, reduce_keys};
pub use time::{BetweenKeys, TimeEditError, edit_time, edit_time_by};
