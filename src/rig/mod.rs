//! What the joints mean: roles, chains, rest pose, alignment, and the spec in which users say so.
//!
//! Knows no file format and no frame loop.

mod align;
mod auto_map;
mod error;
mod floor;
mod ikrig;
mod mapping;
mod nearest;
mod parse;
mod recognise;
mod resolve;
mod rest;
mod side;
mod spec;
mod unknown_fields;

pub use error::{SpecError, SpecErrorKind, SpecField};
pub use mapping::{ChainPair, Drive, Mapping, PelvisPair, PelvisPosition};
pub use parse::{parse_spec, parse_value};
pub use recognise::*;
pub use resolve::{Resolved, resolve};
pub use side::{RestSource, Side};
pub use spec::{
    Align, AutoWord, Carry, ChainMap, ClipChoice, FkOp, HeightRule, IncludeSpec, OneOrMany, Op, OutputChoice,
    OutputSpec, PelvisOp, PelvisScale, PelvisScaleRule, ReportDetail, RestFrame, RestRule, RestSpec, RetargetSpec,
    RigSpec, RotationMode, ScaleOrigin, TargetClipsSpec, TranslationMode, UnitSpec, spec_schema,
};
