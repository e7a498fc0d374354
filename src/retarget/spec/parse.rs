//! From the bytes of a config to a [`RetargetSpec`].

use serde::de::DeserializeOwned;
use serde_json::Value;

use super::{
    OutputChoice, ReportChoice, RetargetSpec, Threshold, TuneChoice,
    bone_maps::{convert, is_bmap, is_bone_map, read_bmap},
    ikrig,
    joint_table::{is_table, read_table},
    spec_schema,
};
use crate::model::no_json;
use crate::rig::deserialize::kind_of;
use crate::rig::{
    PoseEdit, UnitSpec,
    deserialize::deserialize,
    error::{SpecError, SpecErrorKind, SpecField},
    ranges::out_of_ranges,
    unknown_fields::{unknown_fields, walk, words_of},
};

/// More ops than this are refused, before time is spent on any of them.
const MAX_OPS: usize = 256;
/// More outputs than this are refused.
const MAX_OUTPUTS: usize = 8;
/// A chain that follows the mean of more is refused.
const MAX_FURTHER_CHAINS: usize = 8;
/// A search with more retargets than this is refused.
const MAX_EVALUATIONS: u32 = 500;
/// A joint is turned by no more than this at once, in degrees.
const MAX_EDIT_DEGREES: f64 = 3600.0;

/// What a config looks like.
const OBJECT_HINT: &str =
    "a config is an object in JSON or YAML, such as {\"align\": \"off\"}; GET /docs/guide/configs explains it";

/// Reads a config: our own spec as JSON or YAML, an ikrigretarget config, a joint table, or a bone map of another tool. An empty document is an empty spec.
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
    let document = if is_bone_map(&document) { convert(&document)? } else { document };
    if !document.is_object() {
        let detail = format!("the config is {} where an object is expected", kind_of(&document));
        return Err(SpecError::new(SpecErrorKind::Malformed, detail, OBJECT_HINT));
    }
    let ops = document.get("ops").and_then(Value::as_array).map_or(0, Vec::len);
    if ops > MAX_OPS {
        let detail = format!("{ops} ops are too many; at most {MAX_OPS} are taken");
        let field = SpecField::new(SpecErrorKind::InvalidValue, "/ops", detail.as_str());
        let hint = "leave out what does nothing, or run the rest on the result";
        return Err(SpecError { fields: vec![field], ..SpecError::new(SpecErrorKind::InvalidValue, detail, hint) });
    }
    parse_checked(&document, spec_schema(), out_of_range)
}

/// A document of another kind, whose schema says which fields it has and in which ranges their values are.
///
/// # Errors
/// When it is no object, has an unknown field, or a value is of the wrong type or out of range.
pub fn parse_by_schema<T: DeserializeOwned>(document: Value, schema: &Value) -> Result<T, SpecError> {
    if !document.is_object() {
        let detail = format!("the config is {} where an object is expected", kind_of(&document));
        return Err(SpecError::new(SpecErrorKind::Malformed, detail, OBJECT_HINT));
    }
    parse_checked(&document, schema, |_| Vec::new())
}

fn parse_checked<T: DeserializeOwned>(
    document: &Value,
    schema: &Value,
    further: impl FnOnce(&T) -> Vec<SpecField>,
) -> Result<T, SpecError> {
    if let Some(error) = SpecError::from_fields(unknown_fields(document, schema)) {
        return Err(error);
    }
    let ranges = out_of_ranges(document, schema);
    let spec: T = deserialize(document).map_err(|error| with_words(error, document, schema))?;
    let mut fields = further(&spec);
    let told = |range: &SpecField| fields.iter().any(|field| field.pointer == range.pointer);
    let ranges: Vec<SpecField> = ranges.into_iter().filter(|range| !told(range)).collect();
    fields.extend(ranges);
    SpecError::from_fields(fields).map_or(Ok(spec), Err)
}

/// Where any word is no answer: the words that the schema has for that place.
fn with_words(mut error: SpecError, document: &Value, schema: &Value) -> SpecError {
    const ANY_WORD: &str = "where a word is expected";
    let Some(field) = error.fields.first_mut().filter(|field| field.detail.ends_with(ANY_WORD)) else { return error };
    let mut words = Vec::new();
    walk(document, schema, |pointer, _, node| {
        if pointer == field.pointer {
            words = words_of(node).into_iter().map(str::to_owned).collect::<Vec<_>>();
        }
    });
    if !words.is_empty() {
        let listed = words.iter().map(|word| format!("'{word}'")).collect::<Vec<_>>().join(", ");
        let told = format!("where one of these is expected: {listed}");
        field.detail = field.detail.replace(ANY_WORD, &told);
        error.detail = error.detail.replace(ANY_WORD, &told);
    }
    error
}

/// Whether a document has the shape of our own spec, and is no config of another tool.
#[must_use]
pub fn is_own_shape(document: &Value) -> bool {
    document.is_object() && !ikrig::is_config(document) && !is_bone_map(document)
}

/// Reads a document of ours: JSON, YAML, or a joint table or bone map in text, which becomes the spec that it stands for. An empty one
/// is an empty object.
///
/// # Errors
/// When it is neither.
pub fn parse_document(bytes: &[u8]) -> Result<Value, SpecError> {
    let malformed = |detail: String| SpecError::new(SpecErrorKind::Malformed, detail, OBJECT_HINT);
    let text = std::str::from_utf8(bytes)
        .map_err(|error| malformed(format!("the config is not UTF-8 text: byte {}", error.valid_up_to())))?;
    let text = text.trim_start_matches('\u{feff}').trim();
    if text.is_empty() {
        return Ok(Value::Object(serde_json::Map::new()));
    }
    if text.starts_with(['{', '[']) {
        return serde_json::from_str(text)
            .map_err(|error| malformed(format!("the config is not JSON: {}", no_json(&error))));
    }
    if is_bmap(text) {
        return read_bmap(text);
    }
    if is_table(text) {
        return read_table(text);
    }
    // YAML 1.1 takes `off`, `no` and `y` for booleans; in a config they are words.
    let options = serde_saphyr::options! { strict_booleans: true };
    serde_saphyr::from_str_with_options(text, options).map_err(|error| {
        let text = error.to_string();
        let first_line = text.lines().next().unwrap_or_default();
        malformed(format!("the config is neither JSON nor YAML: {}", first_line.trim_start_matches("error: ")))
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
    for (index, entry) in spec.map.iter().flatten().enumerate() {
        let count = entry.also.len();
        let detail = format!("{count} further chains are too many; at most {MAX_FURTHER_CHAINS} are taken");
        require(count <= MAX_FURTHER_CHAINS, format!("/map/{index}/also"), detail);
    }
    for (side, rig) in [("source", &spec.source), ("target", &spec.target)] {
        if let Some(UnitSpec::Meters(meters)) = rig.unit {
            let detail = format!("a unit of {meters} meters is out of range; it is above 0 and finite");
            require(meters.is_finite() && meters > 0.0, format!("/{side}/unit"), detail);
        }
        for (index, edit) in rig.pose.iter().enumerate() {
            if let PoseEdit::Rotate(edit) = edit {
                for (axis, degrees) in edit.degrees.iter().enumerate() {
                    let holds = degrees.is_finite() && degrees.abs() <= MAX_EDIT_DEGREES;
                    let pointer = format!("/{side}/pose/{index}/degrees/{axis}");
                    require(holds, pointer, format!("{degrees}° is not between -3600 and 3600"));
                }
            }
        }
        if let Some(axes) = rig.axes.as_deref().filter(|axes| *axes != "auto") {
            let parsed = axes.parse::<crate::model::Axes>();
            let detail = parsed.as_ref().err().map(ToString::to_string).unwrap_or_default();
            require(parsed.is_ok(), format!("/{side}/axes"), detail);
        }
    }
    for (index, op) in spec.ops.iter().flatten().enumerate() {
        op.check(&mut |field, detail| require(false, format!("/ops/{index}/{field}"), detail));
        let detail = "keys are [seconds, alpha] in rising order of time, with alpha from 0 to 1; at least one";
        require(op.alpha().is_valid(), format!("/ops/{index}/alpha"), detail.into());
    }
    if let ReportChoice::Spec(report) = &spec.report {
        for (metric, Threshold { warn_above, fail_above }) in &report.thresholds {
            let sane = *warn_above >= 0.0 && warn_above <= fail_above && fail_above.is_finite();
            let detail = format!("{warn_above} and {fail_above} are no thresholds; 0 <= warn_above <= fail_above");
            require(sane, format!("/report/thresholds/{}", metric.name()), detail);
        }
    }
    if let Some(tune) = spec.tune.as_ref().and_then(TuneChoice::spec) {
        let most = tune.max_evaluations;
        let detail = format!("{most} evaluations; between 1 and {MAX_EVALUATIONS} are allowed");
        require((1..=MAX_EVALUATIONS).contains(&most), "/tune/max_evaluations".into(), detail);
        for (parameter, [low, high]) in tune.bounds.iter().flatten() {
            let sane = low < high && low.abs() <= 10.0 && high.abs() <= 10.0;
            let detail = format!(
                "[{low}, {high}] are no bounds; the first is less than the second, and both between -10 and 10"
            );
            require(sane, format!("/tune/bounds/{}", parameter.name()), detail);
        }
    }
    if let Some(OutputChoice::Many(outputs)) = &spec.output {
        let count = outputs.len();
        let detail = format!("{count} outputs; between 1 and {MAX_OUTPUTS} are allowed");
        require((1..=MAX_OUTPUTS).contains(&count), "/output".into(), detail);
    }
    fields
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
    fn fields_at_a_wrong_place_are_told_where_they_belong() {
        for (text, home) in [
            (r#"{"view": {}}"#, "'output'"),
            (r#"{"fps": 30}"#, "'edit'"),
            (r#"{"source": {"ops": []}}"#, "the top level"),
            (r#"{"output": {"camera": "front"}}"#, "'output.view'"),
        ] {
            let field = first_field(text);
            assert!(field.detail.ends_with(&format!("here; it belongs to {home}")), "{text}: {}", field.detail);
            assert!(field.did_you_mean.is_empty(), "{text}: {:?}", field.did_you_mean);
        }
        let field = first_field(r#"{"ops": [{"op": "fk", "weigth": 2}]}"#);
        let nowhere = "there is no field 'weigth' here; its fields are 'op', 'enabled', 'alpha', 'frames', 'mask', 'carry', 'rotation', \
                       'translation', 'twist', 'shoulder', 'rotation_alpha', 'translation_alpha' and 3 more";
        assert_eq!(field.detail, nowhere, "no other place has it");
    }

    /// An output may come alone or in a list; what is wrong inside of it is told all the same.
    #[test]
    fn what_is_wrong_in_an_output_is_named_with_its_place() {
        for (text, place) in [
            (r#"{"output": {"view": {"at": 0}}}"#, "/output/view/at"),
            (r#"{"output": [{"view": {"at": 0}}]}"#, "/output/0/view/at"),
            (r#"{"output": {"view": {"style": "bothx"}}}"#, "/output/view/style"),
            (r#"{"output": [{}, {"view": {"size": "big"}}]}"#, "/output/1/view/size"),
        ] {
            assert_eq!(first_field(text).pointer, place, "{text}");
        }
        let field = first_field(r#"{"output": {"view": {"style": "bothx"}}}"#);
        assert!(field.did_you_mean.iter().any(|word| word == "both"), "{field:?}");
        let field = first_field(r#"{"output": 3}"#);
        assert!(field.detail.contains("an output or a list of outputs"), "{}", field.detail);
    }

    #[test]
    fn words_of_yaml_stay_words() {
        let spec = parse_spec(b"align: off\nstrict: true\n").expect("a spec");
        assert_eq!((spec.align, spec.strict), (crate::rig::Align::Off, true), "'off' is a word, 'true' is none");
    }

    #[test]
    fn types_are_told_without_words_of_rust() {
        let cases = [
            (r#"{"target": 3}"#, "this is the number '3' where an object is expected: RigSpec"),
            (r#"{"align": "of"}"#, "this is 'of' where one of these is expected: 'auto', 'off'"),
            (r#"{"align": false}"#, "this is the boolean 'false' where one of these is expected: 'auto', 'off'"),
            (r#"{"strict": {}}"#, "this is an object where this is expected: a boolean"),
        ];
        for (text, wanted) in cases {
            let detail = first_field(text).detail;
            assert!(detail.starts_with(wanted), "{text}: {detail}");
        }
    }

    #[test]
    fn unknown_words_are_told_the_nearest() {
        let cases = [
            (r#"{"ops": [{"op": "pelvs"}]}"#, "pelvis"),
            (r#"{"align": "of"}"#, "off"),
            (r#"{"report": "ful"}"#, "full"),
            (r#"{"source": {"rest": "nods"}}"#, "nodes"),
            (r#"{"ops": [{"op": "pelvis", "scale": "hight"}]}"#, "height"),
        ];
        for (text, wanted) in cases {
            let field = first_field(text);
            assert_eq!(field.did_you_mean.first().map(String::as_str), Some(wanted), "{text}: {field:?}");
        }
    }

    #[test]
    fn of_many_words_the_nearest_are_told() {
        let detail = first_field(r#"{"ops": [{"op": "pelvos"}]}"#).detail;
        assert!(detail.starts_with("there is no op 'pelvos'; there are 'pelvis', "), "{detail}");
        assert!(detail.contains(" more") && detail.len() < 160, "a line that one can read: {detail}");
    }

    #[test]
    fn wrong_values_are_named_with_their_place() {
        let cases = [
            (r#"{"strict": 3}"#, "/strict"),
            (r#"{"version": 2}"#, "/version"),
            (r#"{"ops": [{"op": "fly"}]}"#, "/ops/0/op"),
            (r#"{"ops": [{"op": 3}]}"#, "/ops/0/op"),
            (r#"{"ops": [{"alpha": 1}]}"#, "/ops/0/op"),
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
            let error = parse_spec(text.as_bytes()).expect_err(text);
            assert_eq!(error.kind, SpecErrorKind::Malformed, "{text}");
            assert!(!error.detail.contains("error:"), "{}", error.detail);
        }
        assert!(parse_spec(b"\xff\xfe").is_err(), "not UTF-8");
    }
}
