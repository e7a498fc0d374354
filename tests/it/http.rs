//! The HTTP service, from outside.

mod black_box;
mod container;
mod documents;
mod facts;
mod poses;
mod real;
mod service;
mod support;
