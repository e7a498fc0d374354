//! What the operator decides: every setting, its default, its bounds, and what it is called on each surface.
//!
//! One table ([`settings`](Settings::TABLE)) is the only place where a setting stands. The flags of `serve`, the
//! environment variables, `/v1/limits` and the documentation are all made from it. Reading is in two steps: raw texts come
//! in, a [`Settings`] of validated types comes out, and everything that is wrong is said at once. Nothing of it reads the
//! environment or the command line; the caller hands in a look-up. Beside the settings lie the [`Failpoint`]s of debug builds.

mod contradictions;
mod failpoint;
mod memory;
mod networks;
mod settings;
mod tokens;
mod value;

pub use failpoint::{Failpoint, trigger_named};
pub use memory::MemoryBudget;
pub use networks::Networks;
pub use settings::{LimitView, Setting, SettingError, SettingErrors, Settings};
pub use tokens::{KeyPlace, Names, TokenAlgorithms, is_guarded_url, is_this_machine};
pub use value::{
    Authentication, ByteSize, HttpUrl, Isolation, LogFormat, Origins, Period, Periods, Secret, SettingValue, Switch,
    Unit, Workers,
};
