//! What both codecs decode into: named arrays of numbers, not yet understood.

use std::collections::BTreeMap;

use serde::Deserialize;

pub(super) use crate::formats::numpy::{NumberArray, Values, invalid};

/// The arrays of numbers in the layout, each with its number of dimensions and whether single precision is enough.
pub(super) const NUMBER_KEYS: [NumberKey; 8] = [
    NumberKey { name: "parents", rank: 1, single: false },
    NumberKey { name: "rest_translations", rank: 2, single: false },
    NumberKey { name: "rest_rotations", rank: 2, single: false },
    NumberKey { name: "rest_scales", rank: 2, single: false },
    NumberKey { name: "times", rank: 1, single: false },
    NumberKey { name: "translations", rank: 3, single: true },
    NumberKey { name: "rotations", rank: 3, single: true },
    NumberKey { name: "scales", rank: 3, single: true },
];

/// An array of numbers that the layout knows.
#[derive(Clone, Copy, Debug)]
pub(super) struct NumberKey {
    pub(super) name: &'static str,
    pub(super) rank: usize,
    /// Whether the model keeps these values in single precision anyway.
    pub(super) single: bool,
}

/// The arrays of one file.
#[derive(Debug, Default)]
pub(super) struct Arrays {
    pub(super) joint_names: Option<Vec<String>>,
    pub(super) numbers: BTreeMap<&'static str, NumberArray>,
    pub(super) meta: Meta,
    /// Keys of the file that were not decoded, in its order.
    pub(super) ignored: Vec<String>,
}

/// The `meta` string, parsed.
#[derive(Debug, Default, Deserialize)]
pub(super) struct Meta {
    pub(super) name: Option<String>,
    pub(super) fps: Option<f64>,
    pub(super) axes: Option<String>,
    pub(super) unit: Option<f64>,
}
