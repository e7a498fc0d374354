//! Numbers of a document that are outside of the ranges of its JSON Schema.
//!
//! The schema comes from the spec's own types, so a new field needs nothing here.

use serde_json::Value;

use super::{
    error::{SpecErrorKind, SpecField},
    unknown_fields::{MAX_TOLD, walk},
};

/// The numbers of `document` that are below the schema's minimum or above its maximum for them; the first [`MAX_TOLD`].
pub(crate) fn out_of_ranges(document: &Value, schema: &Value) -> Vec<SpecField> {
    let mut found = Vec::new();
    walk(document, schema, |pointer, value, node| {
        if let (Some(number), Some((least, most))) = (value.as_f64(), range(node)) {
            let above = least.is_none_or(|least| number >= least);
            let below = most.is_none_or(|most| number <= most);
            if !(above && below) && found.len() < MAX_TOLD {
                let bound = |bound: Option<f64>| bound.map_or("any number".to_owned(), |bound| bound.to_string());
                let detail = format!("{number} is not between {} and {}", bound(least), bound(most));
                found.push(SpecField::new(SpecErrorKind::InvalidValue, pointer, detail));
            }
        }
    });
    found.sort_by(|first, second| first.pointer.cmp(&second.pointer));
    found
}

/// The range of a node, or of the number among its alternatives.
fn range(node: &Value) -> Option<(Option<f64>, Option<f64>)> {
    let own = |node: &Value| {
        let bound = |name: &str| node.get(name).and_then(Value::as_f64);
        let bounds = (bound("minimum"), bound("maximum"));
        (bounds != (None, None)).then_some(bounds)
    };
    let alternatives = ["anyOf", "oneOf"].iter().filter_map(|key| node.get(key).and_then(Value::as_array)).flatten();
    own(node).or_else(|| alternatives.filter_map(own).next())
}
