//! The HTTP service, from outside.

mod black_box;
mod container;
mod documents;
mod real;
mod service;
mod support;
