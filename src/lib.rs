//! `retargetd` moves character animation from any rig to any rig.
//!
//! # Map
//!
//! A **pure half** (no async runtime, no file system, no clock, no environment) under a **service half**, which the feature `service`
//! (on by default) adds. Without it, `default-features = false` in a program's `Cargo.toml`, the crate is the engine alone:
//!
//! | module | answers | may import |
//! |---|---|---|
//! | [`model`] | what a skeleton, pose, clip, scene is; spaces, axes, units, warnings | nothing |
//! | [`formats`] | bytes to model and back, under budgets | `model` |
//! | [`picture`] | seeing: camera, skinning, rasterizer, encoders of still and moving pictures | `model` |
//! | [`rig`] | what the joints mean: roles, chains, rest pose, alignment | `model` |
//! | [`retarget`] | the algorithm: the spec, its ops, a plan compiled once, then a loop over frames; and its measures | `model`, `rig`, `picture` (its words) |
//! | [`editing`] | edits of a clip: time, loops, mirror | `model`, `rig`, `retarget` (the spec) |
//! | [`drawing`] | drawn characters: their configs, projection onto planes, pose, mesh, deformation | `model`, `rig`, `retarget` (the spec), `picture` |
//! | [`engine`] | the one pure function: input bytes and spec to output bytes, warnings and report | all above |
//! | [`report`] | what the engine found out, as page, text and table | all above |
//! | [`retargeter`] | the crate for Rust programs: a builder over the engine | all above |
//! | [`store`] | durable facts: records and blobs | `config` |
//! | [`outbound`] | talking out: address guard, requests, signatures of webhooks | `config`, `telemetry` |
//! | [`jobs`] | scheduling: states, admission, queue, workers, webhooks | `engine`, `store`, `outbound`, `config`, `telemetry` |
//! | [`identity`] | who shows a token of an identity provider: its signature, its issuer's keys, what it allows | `store` (its words), `config`, `telemetry` |
//! | [`http`] | translation only: routes, views, problems | `jobs`, `identity`, `engine` (its words), `report`, `samples`, `config`, `telemetry` |
//! | [`config`], [`telemetry`] | settings; logs, metrics, traces, clock | nothing |
//! | [`samples`] | the clip, the character and the drawing that the demo and the tests use, made by code | `model`, `formats`, `picture` |
//! | [`cli`], [`app`] | subcommands; the composition root | everything |
//!
//! A test (`tests/it/architecture.rs`) reads every path that begins with `crate::` against this table, and keeps external
//! crates, the file system, the clock and the environment behind the same walls. `main` only calls [`cli`]; `named` is a macro for enums, which
//! everything may use.
//!
//! # Data flow
//!
//! ```text
//! bytes ─formats::read(budget)→ Scene ─rig::resolve(spec)→ Rig ─Plan::new→ Plan ─run(control)→ Clip ─formats::write→ bytes
//! ```
//!
//! Data changes type as it is validated, so what is not validated cannot go on. Per frame there are indices and
//! constants only: no names, no look-ups, no allocation.
//!
//! # As a library
//!
//! ```
//! use retargetd::{Asset, Retargeter, samples};
//!
//! let (walk, mannequin) = (samples::walk_clip(), samples::mannequin());
//! let outcome = Retargeter::new().retarget(Asset::new("walk.glb", &walk), Asset::new("mannequin.glb", &mannequin))?;
//! assert_eq!(outcome.report.counts.frames, 121, "as long as the walk");
//! assert!(outcome.outputs[0].bytes.starts_with(b"glTF"), "the mannequin, walking");
//! # Ok::<(), retargetd::Error>(())
//! ```
//!
//! [`Retargeter`] takes files, [`Retargeter::scenes`] scenes in memory, and [`RigPair::frames`] single poses. What the root of the crate
//! names is all that programs need; the modules are for this project and change without notice.
//!
//! # Words
//!
//! *Source* and *target* are the two sides. A *joint* is a node of a skeleton; a *chain* is a run of joints; a *role* is
//! what a joint means (`left_forearm`). A *clip* is an animation, a *frame* one of its key times, a *pose* the transforms
//! of all joints at one frame. The *rest pose* is the pose that retargeting measures from. The *root* is the top joint
//! that moves the character, the *pelvis* the joint that carries the body. *Local* is relative to the parent, *model* is
//! relative to the scene.
//!
//! # To add something
//!
//! `docs/architecture.md` has the checklists for an op, a metric, a route and a setting, `formats/mod.rs` the one for a format.
//! `openapi/` and `docs/reference` are made from the code; the tests that compare them say how to write them anew.

#[macro_use]
mod named;

#[cfg_attr(doc, doc(hidden))]
#[cfg(feature = "service")]
pub mod app;
#[cfg_attr(doc, doc(hidden))]
#[cfg(feature = "service")]
pub mod cli;
#[cfg_attr(doc, doc(hidden))]
#[cfg(feature = "service")]
pub mod config;
#[cfg_attr(doc, doc(hidden))]
pub mod drawing;
#[cfg_attr(doc, doc(hidden))]
pub mod editing;
#[cfg_attr(doc, doc(hidden))]
pub mod engine;
#[cfg_attr(doc, doc(hidden))]
pub mod formats;
#[cfg_attr(doc, doc(hidden))]
#[cfg(feature = "service")]
pub mod http;
#[cfg_attr(doc, doc(hidden))]
#[cfg(feature = "service")]
pub mod identity;
#[cfg_attr(doc, doc(hidden))]
#[cfg(feature = "service")]
pub mod jobs;
#[cfg_attr(doc, doc(hidden))]
pub mod model;
#[cfg_attr(doc, doc(hidden))]
#[cfg(feature = "service")]
pub mod outbound;
#[cfg_attr(doc, doc(hidden))]
pub mod picture;
#[cfg_attr(doc, doc(hidden))]
pub mod report;
#[cfg_attr(doc, doc(hidden))]
pub mod retarget;
#[cfg_attr(doc, doc(hidden))]
pub mod retargeter;
#[cfg_attr(doc, doc(hidden))]
pub mod rig;
pub mod samples;
#[cfg_attr(doc, doc(hidden))]
#[cfg(feature = "service")]
pub mod store;
#[cfg_attr(doc, doc(hidden))]
#[cfg(feature = "service")]
pub mod telemetry;

// The face of the library: what a program needs, and all that keeps still. The modules are for this project; they change.
pub use engine::{
    Control, Counts, DriverView, Failure, FailureCode, FieldError, Format, FormatInfo, Inspection, Knowledge, Limits,
    Outcome, Output, Phase, Progress, Proposal, Report, Timings, WarningView,
};
pub use model::{Axes, Clip, Joint, JointTracks, LocalPose, ModelPose, Scene, Skeleton, Track, Transform, Warning};
pub use retarget::{
    ChainMap, ContactTrack, EditSpec, FkOp, Measures, Metric, MetricName, Op, OutputChoice, OutputSpec, PelvisOp,
    ReportChoice, RetargetSpec, Verdict,
};
pub use retargeter::{Asset, Config, Error, FrameRetargeter, Retargeter, RigPair, SceneOutcome};
pub use rig::{Align, PoseChoice, RigSpec};

/// The examples of the guide are tests too.
#[cfg(doctest)]
#[doc = include_str!("../docs/guide/library.md")]
pub struct Guide;
