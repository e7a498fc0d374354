//! The real binary under more than it can do, and for longer than a test: what it promises then.
//!
//! In the test command these runs are short and ask only what holds on any machine: what is answered, and that the books balance.
//! With `RETARGETD_TEST_SECONDS` they run that long and hold the service to its figures too:
//! `RETARGETD_TEST_SECONDS=60 cargo nextest run --profile long --release -E 'test(load::)' --no-capture`.

mod abuse;
mod caller;
mod hostile_callers;
mod one_shots;
mod overload;
mod soak;
mod stopping;
mod support;
