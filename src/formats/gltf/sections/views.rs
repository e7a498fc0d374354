//! What a document uses beside its animation.

use std::{
    collections::{BTreeMap, BTreeSet},
    ops::Range,
};

use serde_json::{Value, json};

use super::{ALIGNMENT, WholeOnly, list, number, of_list};

/// The views that anything but the animation uses.
pub(super) fn kept_views(document: &Value) -> BTreeSet<u64> {
    let of_animation: BTreeSet<u64> = of_list(document, "animations")
        .iter()
        .flat_map(|animation| of_list(animation, "samplers"))
        .flat_map(|sampler| [number(sampler, "input"), number(sampler, "output")])
        .flatten()
        .collect();
    let mut kept = BTreeSet::new();
    let accessors = of_list(document, "accessors").iter().zip(0..);
    for (accessor, _) in accessors.filter(|(_, index)| !of_animation.contains(index)) {
        named_views(accessor, &mut kept);
    }
    let rest = document.as_object().into_iter().flatten();
    for (_, value) in rest.filter(|(name, _)| !["accessors", "animations"].contains(&name.as_str())) {
        named_views(value, &mut kept);
    }
    kept
}

/// Adds every view that is named anywhere in a value.
fn named_views(value: &Value, found: &mut BTreeSet<u64>) {
    let mut open = vec![value];
    while let Some(value) = open.pop() {
        match value {
            Value::Array(values) => open.extend(values),
            Value::Object(members) => {
                found.extend(members.get("bufferView").and_then(Value::as_u64));
                open.extend(members.values());
            }
            _ => {}
        }
    }
}

/// Has kept views lie one behind the other, and leaves all others with a byte of what lies before them. Gives what is to lie there: the bytes of
/// the file's binary chunk from one number to another. Views may share bytes, which are kept once.
pub(super) fn move_views(
    document: &mut Value,
    kept: &BTreeSet<u64>,
    binary_bytes: u64,
) -> Result<Vec<Range<u64>>, WholeOnly> {
    const OUTSIDE: WholeOnly = "a buffer view of the GLB is not inside its binary chunk";
    let (mut pieces, mut end): (Vec<Range<u64>>, u64) = (Vec::new(), ALIGNMENT);
    let mut moved: BTreeMap<(u64, u64), u64> = BTreeMap::new();
    for (view, index) in list(document, "bufferViews").iter_mut().zip(0..) {
        if !kept.contains(&index) {
            *view = json!({"buffer": 0, "byteOffset": 0, "byteLength": 1});
            continue;
        }
        // A compressed form is named by numbers of its own.
        if view.get("extensions").is_some() {
            return Err("the GLB has compressed buffer views");
        }
        let (Some(length), offset) = (number(view, "byteLength"), number(view, "byteOffset").unwrap_or(0)) else {
            return Err(OUTSIDE);
        };
        let last = offset.checked_add(length).filter(|last| number(view, "buffer") == Some(0) && *last <= binary_bytes);
        let last = last.ok_or(OUTSIDE)?;
        let at = *moved.entry((offset, length)).or_insert_with(|| {
            let at = end;
            pieces.push(offset..last);
            end = (at + length).next_multiple_of(ALIGNMENT);
            at
        });
        view["byteOffset"] = json!(at);
    }
    Ok(pieces)
}
