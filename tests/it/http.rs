//! The HTTP service, from outside.

mod black_box;
mod container;
mod documents;
mod service;
mod support;
