//! The service, by running the real binary.
