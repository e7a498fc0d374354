//! The pure half of the service by itself, under the service's name.
//!
//! It knows no runtime, file system, network or clock, so it needs none of the crates that do: it compiles in a fraction of the time, and
//! nothing but readers and algorithms is instrumented.

#[macro_use]
#[path = "../../../src/named.rs"]
mod named;

#[path = "../../../src/drawing/mod.rs"]
pub mod drawing;
#[path = "../../../src/editing/mod.rs"]
pub mod editing;
#[path = "../../../src/engine/mod.rs"]
pub mod engine;
#[path = "../../../src/formats/mod.rs"]
pub mod formats;
#[path = "../../../src/model/mod.rs"]
pub mod model;
#[path = "../../../src/picture/mod.rs"]
pub mod picture;
#[path = "../../../src/retarget/mod.rs"]
pub mod retarget;
#[path = "../../../src/rig/mod.rs"]
pub mod rig;
#[path = "../../../src/samples/mod.rs"]
pub mod samples;
