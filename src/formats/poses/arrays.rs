//! What both codecs decode into: named arrays of numbers, not yet understood.

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::formats::FormatError;
pub(super) use crate::formats::numpy::{NumberArray, Values, invalid};

/// The arrays of numbers in the layout, each with its number of dimensions and whether single precision is enough.
pub(super) const NUMBER_KEYS: [NumberKey; 10] = [
    NumberKey { name: "parents", rank: 1, single: false, truth: false },
    NumberKey { name: "rest_translations", rank: 2, single: false, truth: false },
    NumberKey { name: "rest_rotations", rank: 2, single: false, truth: false },
    NumberKey { name: "rest_scales", rank: 2, single: false, truth: false },
    NumberKey { name: "times", rank: 1, single: false, truth: false },
    NumberKey { name: "translations", rank: 3, single: true, truth: false },
    NumberKey { name: "rotations", rank: 3, single: true, truth: false },
    NumberKey { name: "scales", rank: 3, single: true, truth: false },
    NumberKey { name: "contacts", rank: 2, single: true, truth: true },
    NumberKey { name: "morph_weights", rank: 2, single: true, truth: false },
];

/// The lists of text in the layout.
pub(super) const NAME_KEYS: [&str; 3] = ["joint_names", "contact_joints", "morph_names"];

/// An array of numbers that the layout knows.
#[derive(Clone, Copy, Debug)]
pub(super) struct NumberKey {
    pub(super) name: &'static str,
    pub(super) rank: usize,
    /// Whether the model keeps these values in single precision anyway.
    pub(super) single: bool,
    /// Whether its values may be written as true and false.
    pub(super) truth: bool,
}

/// The arrays of one file.
#[derive(Debug, Default)]
pub(super) struct Arrays {
    pub(super) names: BTreeMap<&'static str, Vec<String>>,
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

/// Compares a shape with the layout; the text is the letter that the documentation gives a dimension.
pub(super) fn require_shape(
    array: &NumberArray,
    key: &str,
    expected: &[(&str, Option<usize>)],
) -> Result<(), FormatError> {
    // An empty list of JSON has no inner lists to count.
    let empty = array.shape.first() == Some(&0) && expected[0].1 == Some(0);
    let fits = array.shape.len() == expected.len()
        && array.shape.iter().zip(expected).all(|(actual, (_, length))| length.is_none_or(|length| length == *actual));
    if fits || empty {
        return Ok(());
    }
    let words: Vec<String> = expected
        .iter()
        .map(|(letter, length)| match (letter, length) {
            (&"", Some(length)) => length.to_string(),
            (letter, Some(length)) => format!("{letter} = {length}"),
            (letter, None) => (*letter).to_owned(),
        })
        .collect();
    Err(invalid(key, format!("the shape is {:?} where [{}] is needed", array.shape, words.join(", "))))
}

pub(super) fn missing(key: &str) -> FormatError {
    invalid(key, format!("the key '{key}' is missing"))
}
