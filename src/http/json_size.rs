//! How large JSON becomes when it is read, found out before it is, and how large a value is that was read.

use serde_json::{Map, Value};

use super::{code::Code, problem::Problem};
use crate::{config::Settings, engine::JsonSize};

/// What a value takes up besides its text, in round numbers.
const BYTES_PER_VALUE: u64 = 16;

/// Refuses a document that has more values than may be.
///
/// # Errors
/// When there are more than the limit `json_values`.
pub(super) fn check(text: &[u8], settings: &Settings) -> Result<(), Problem> {
    let (most, actual) = (settings.max_json_values, JsonSize::of(text).values);
    if actual <= most {
        return Ok(());
    }
    let detail = format!("the body has more values than the limit 'json_values' of {most} allows");
    Err(Problem::new(Code::BodyTooLarge, detail).about_limit("json_values", most, actual))
}

/// What a value takes up, in round numbers: its texts, and a little for each value in it.
pub(super) fn bytes_of(value: &Value) -> u64 {
    let mut bytes = 0_u64;
    let mut open = vec![value];
    while let Some(value) = open.pop() {
        bytes += BYTES_PER_VALUE;
        match value {
            Value::String(text) => bytes += text.len() as u64,
            Value::Array(items) => open.extend(items),
            Value::Object(members) => {
                bytes += members.keys().map(|name| name.len() as u64).sum::<u64>();
                open.extend(members.values());
            }
            Value::Null | Value::Bool(_) | Value::Number(_) => {}
        }
    }
    bytes
}

/// The same of an object.
pub(super) fn bytes_of_object(members: &Map<String, Value>) -> u64 {
    members.iter().map(|(name, value)| name.len() as u64 + bytes_of(value)).sum::<u64>() + BYTES_PER_VALUE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_counted_before_they_are_made() {
        assert_eq!(JsonSize::of(br#"{"a": [1, "]]]\"[[[", [2]]}"#).values, 6, "texts are not looked into");
        let settings = Settings { max_json_values: 100, ..Settings::default() };
        let list = |count: usize| format!("[{}0]", "0,".repeat(count));
        assert!(check(list(90).as_bytes(), &settings).is_ok(), "few enough");
        let problem = check(list(101).as_bytes(), &settings).expect_err("too many");
        assert!(problem.detail.contains("json_values"), "the limit is named: {}", problem.detail);
        let value: Value = serde_json::from_str(r#"{"a": ["bc", 1]}"#).expect("JSON");
        assert_eq!(bytes_of(&value), 4 * BYTES_PER_VALUE + 3, "all of it");
    }
}
