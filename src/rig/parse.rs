//! From the bytes of a config to a [`RetargetSpec`].

use serde::de::DeserializeOwned;
use serde_json::Value;

use super::{
    error::{SpecError, SpecErrorKind, SpecField},
    ikrig,
    spec::{Op, OutputChoice, PelvisScale, ReportChoice, RetargetSpec, Threshold, UnitSpec, spec_schema},
    unknown_fields::unknown_fields,
};

/// More outputs than this are refused.
const MOST_OUTPUTS: usize = 8;

/// Reads a config: our own spec as JSON or YAML, or an ikrigretarget config. An empty document is an empty spec.
///
/// # Errors
/// When it is neither, names fields that do not exist, or has values of the wrong type or out of range.
pub fn parse_spec(bytes: &[u8]) -> Result<RetargetSpec, SpecError> {
    let document = parse_document(bytes)?;
    parse_value(document)
}

/// The same from a parsed document.
///
/// # Errors
/// As [`parse_spec`].
pub fn parse_value(document: Value) -> Result<RetargetSpec, SpecError> {
    if ikrig::is_config(&document) {
        return ikrig::convert(document);
    }
    if !document.is_object() {
        let detail = format!("the config is {} where an object is expected", kind_of(&document));
        return Err(SpecError::new(SpecErrorKind::Malformed, detail, "an empty config is {}"));
    }
    if let Some(error) = SpecError::from_fields(unknown_fields(&document, &spec_schema())) {
        return Err(error);
    }
    let spec: RetargetSpec = deserialize(document)?;
    SpecError::from_fields(out_of_range(&spec)).map_or(Ok(spec), Err)
}

/// A document as a type of ours; a value of the wrong type is named by its place.
pub(super) fn deserialize<T: DeserializeOwned>(document: Value) -> Result<T, SpecError> {
    serde_path_to_error::deserialize(document).map_err(|error| {
        let pointer = pointer_of(error.path());
        let field = SpecField::new(SpecErrorKind::InvalidValue, pointer, error.into_inner().to_string());
        SpecError::from_fields(vec![field]).unwrap_or_else(|| {
            SpecError::new(SpecErrorKind::InvalidValue, "a value is of the wrong type", String::new())
        })
    })
}

fn parse_document(bytes: &[u8]) -> Result<Value, SpecError> {
    let malformed = |detail: String| SpecError::new(SpecErrorKind::Malformed, detail, "send JSON or YAML");
    let text = std::str::from_utf8(bytes)
        .map_err(|error| malformed(format!("the config is not UTF-8 text: byte {}", error.valid_up_to())))?;
    let text = text.trim_start_matches('\u{feff}').trim();
    if text.is_empty() {
        return Ok(Value::Object(serde_json::Map::new()));
    }
    if text.starts_with(['{', '[']) {
        return serde_json::from_str(text).map_err(|error| malformed(format!("the config is not JSON: {error}")));
    }
    serde_saphyr::from_str(text).map_err(|error| {
        let first_line = error.to_string().lines().next().unwrap_or_default().to_owned();
        malformed(format!("the config is neither JSON nor YAML: {first_line}"))
    })
}

fn out_of_range(spec: &RetargetSpec) -> Vec<SpecField> {
    let mut fields = Vec::new();
    let mut require = |holds: bool, pointer: String, detail: String| {
        if !holds {
            fields.push(SpecField::new(SpecErrorKind::InvalidValue, pointer, detail));
        }
    };
    let version = spec.version.unwrap_or(1);
    require(version == 1, "/version".into(), format!("version {version} is not known; this is version 1"));
    for (side, rig) in [("source", &spec.source), ("target", &spec.target)] {
        if let Some(UnitSpec::Metres(metres)) = rig.unit {
            let detail = format!("a unit of {metres} metres is out of range; it is above 0 and finite");
            require(metres.is_finite() && metres > 0.0, format!("/{side}/unit"), detail);
        }
        if let Some(axes) = rig.axes.as_deref().filter(|axes| *axes != "auto") {
            let parsed = axes.parse::<crate::model::Axes>();
            let detail = parsed.as_ref().err().map(ToString::to_string).unwrap_or_default();
            require(parsed.is_ok(), format!("/{side}/axes"), detail);
        }
    }
    let alpha = |value: f64, most: f64| value.is_finite() && value.abs() <= most;
    for (index, map) in spec.map.iter().flatten().enumerate() {
        for (name, value) in [("rotation_alpha", map.rotation_alpha), ("translation_alpha", map.translation_alpha)] {
            let value = value.unwrap_or(1.0);
            require(alpha(value, 10.0), format!("/map/{index}/{name}"), format!("{value} is not between -10 and 10"));
        }
    }
    for (index, op) in spec.ops.iter().flatten().enumerate() {
        let (total, rotation, translation) = match op {
            Op::Pelvis(op) => (op.alpha, op.rotation_alpha, op.translation_alpha),
            Op::Fk(op) => (op.alpha, op.rotation_alpha, op.translation_alpha),
        };
        require((0.0..=1.0).contains(&total), format!("/ops/{index}/alpha"), format!("{total} is not between 0 and 1"));
        for (name, value) in [("rotation_alpha", rotation), ("translation_alpha", translation)] {
            require(alpha(value, 10.0), format!("/ops/{index}/{name}"), format!("{value} is not between -10 and 10"));
        }
        if let Op::Pelvis(op) = op {
            let scale = if let PelvisScale::Value(value) = op.scale { value } else { 1.0 };
            let named =
                [("scale", scale), ("scale_horizontal", op.scale_horizontal), ("scale_vertical", op.scale_vertical)];
            for (name, value) in named {
                require(alpha(value, 1e6), format!("/ops/{index}/{name}"), format!("{value} is out of range"));
            }
        }
    }
    if let ReportChoice::Spec(report) = &spec.report {
        for (metric, Threshold { warn_above, fail_above }) in &report.thresholds {
            let sane = *warn_above >= 0.0 && warn_above <= fail_above && fail_above.is_finite();
            let detail = format!("{warn_above} and {fail_above} are no thresholds; 0 <= warn_above <= fail_above");
            require(sane, format!("/report/thresholds/{}", metric.name()), detail);
        }
    }
    if let Some(OutputChoice::Many(outputs)) = &spec.output {
        let count = outputs.len();
        let detail = format!("{count} outputs; between 1 and {MOST_OUTPUTS} are allowed");
        require((1..=MOST_OUTPUTS).contains(&count), "/output".into(), detail);
    }
    fields
}

fn pointer_of(path: &serde_path_to_error::Path) -> String {
    use serde_path_to_error::Segment;
    let segment = |segment: &Segment| match segment {
        Segment::Seq { index } => format!("/{index}"),
        Segment::Map { key } | Segment::Enum { variant: key } => format!("/{key}"),
        Segment::Unknown => String::new(),
    };
    path.iter().map(segment).collect()
}

pub(super) fn kind_of(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "a boolean",
        Value::Number(_) => "a number",
        Value::String(_) => "a text",
        Value::Array(_) => "a list",
        Value::Object(_) => "an object",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn first_field(text: &str) -> SpecField {
        parse_spec(text.as_bytes()).expect_err("refused").fields.remove(0)
    }

    #[test]
    fn nothing_means_find_everything_out() {
        for text in ["", "{}", "  \n", "version: 1", "{\"ops\": [{\"op\": \"pelvis\"}, {\"op\": \"fk\"}]}"] {
            assert!(parse_spec(text.as_bytes()).is_ok(), "{text:?}: {:?}", parse_spec(text.as_bytes()));
        }
    }

    #[test]
    fn unknown_fields_are_named_with_their_place() {
        let field = first_field(r#"{"source": {"chians": {}}}"#);
        assert_eq!((field.pointer.as_str(), field.kind), ("/source/chians", SpecErrorKind::UnknownField), "the place");
        assert_eq!(field.did_you_mean, ["chains"], "the nearest name");
        let field = first_field(r#"{"ops": [{"op": "fk", "scale": 2}]}"#);
        assert_eq!(field.pointer, "/ops/0/scale", "the field is one of another op");
    }

    #[test]
    fn wrong_values_are_named_with_their_place() {
        let cases = [
            (r#"{"strict": 3}"#, "/strict"),
            (r#"{"version": 2}"#, "/version"),
            (r#"{"ops": [{"op": "fly"}]}"#, "/ops/0"),
            (r#"{"ops": [{"op": "fk", "rotation_alpha": 1000}]}"#, "/ops/0/rotation_alpha"),
            (r#"{"source": {"axes": "+y+y"}}"#, "/source/axes"),
            (r#"{"source": {"unit": -1}}"#, "/source/unit"),
            ("source:\n  unit: wide\n", "/source/unit"),
        ];
        for (text, pointer) in cases {
            assert!(first_field(text).pointer.starts_with(pointer), "{text}: {:?}", first_field(text));
        }
    }

    #[test]
    fn what_is_no_document_says_so() {
        for text in ["{", "[1]", "{\"a\": }", "\"text\"", "a: [b"] {
            assert_eq!(parse_spec(text.as_bytes()).expect_err(text).kind, SpecErrorKind::Malformed, "{text}");
        }
        assert!(parse_spec(b"\xff\xfe").is_err(), "not UTF-8");
    }
}
