//! Changes to the values of a JSON document, which stays one.

use serde_json::{Value, json};

use super::Random;

/// A document that grows beyond this is left as it is.
const MAX_VALUES: usize = 20_000;

/// The document with one value changed; nothing where the bytes are none.
pub(super) fn mutate(input: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    let mut document: Value = serde_json::from_slice(input).ok()?;
    let places = places(&document);
    if places.len() > MAX_VALUES {
        return None;
    }
    let other = document.pointer(random.one_of(&places)?)?.clone();
    let value = document.pointer_mut(random.one_of(&places)?)?;
    match random.below(5) {
        0 => *value = other,
        1 => change_members(value, other, random),
        _ => *value = extreme(random),
    }
    // Trailing spaces, as the chunk of a GLB has them.
    let mut bytes = document.to_string().into_bytes();
    bytes.resize(bytes.len().next_multiple_of(4), b' ');
    Some(bytes)
}

/// Pointers to all values.
fn places(document: &Value) -> Vec<String> {
    let mut found = vec![String::new()];
    let mut at = 0;
    while let Some(place) = found.get(at).filter(|_| found.len() <= MAX_VALUES).cloned() {
        at += 1;
        match document.pointer(&place) {
            Some(Value::Array(values)) => found.extend((0..values.len()).map(|index| format!("{place}/{index}"))),
            Some(Value::Object(members)) => {
                found
                    .extend(members.keys().map(|key| format!("{place}/{}", key.replace('~', "~0").replace('/', "~1"))));
            }
            _ => {}
        }
    }
    found
}

fn change_members(value: &mut Value, other: Value, random: &mut Random) {
    match value {
        Value::Array(values) => {
            let Some(index) = random.index(values.len()) else { return values.push(other) };
            match random.below(3) {
                0 => drop(values.swap_remove(index)),
                1 => values.push(other),
                _ => {
                    let again = vec![values[index].clone(); 1 + random.below(16)];
                    values.splice(index..index, again);
                }
            }
        }
        Value::Object(members) => {
            let Some(index) = random.index(members.len()) else { return };
            let Some(key) = members.keys().nth(index).cloned() else { return };
            if random.one_in(2) {
                members.remove(&key);
            } else {
                members.insert(key, other);
            }
        }
        Value::String(text) => text.push_str(&text.clone()),
        Value::Number(number) => {
            let number = number.as_f64().unwrap_or_default();
            *value = [json!(number + 1.0), json!(-number), json!(number * 1e6), json!((number as i64).wrapping_add(1))]
                [random.below(4)]
            .clone();
        }
        Value::Bool(flag) => *flag = !*flag,
        Value::Null => *value = other,
    }
}

fn extreme(random: &mut Random) -> Value {
    let deep = || (0..100).fold(json!(0), |inner, _| json!([inner]));
    match random.below(20) {
        0 => Value::Null,
        1 => json!(true),
        2 => json!(-1),
        3 => json!(0),
        4 => json!(1),
        5 => json!(0.5),
        6 => json!(5126),
        7 => json!(i32::MAX),
        8 => json!(u32::MAX),
        9 => json!(u64::MAX),
        10 => json!(9_007_199_254_740_993_u64),
        11 => json!(1e-320),
        12 => json!(3.5e38),
        13 => json!(f64::MAX),
        14 => json!(""),
        15 => json!("\0"),
        16 => json!([]),
        17 => json!({}),
        18 => json!("data:,"),
        _ => deep(),
    }
}
