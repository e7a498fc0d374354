//! The demo command.
