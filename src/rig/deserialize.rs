//! From a document to a type of ours, with errors in the words of users.

use std::fmt;

use serde::{
    Deserialize, Deserializer,
    de::{
        DeserializeOwned, MapAccess, SeqAccess, Visitor,
        value::{MapAccessDeserializer, SeqAccessDeserializer},
    },
};
use serde_json::Value;

use super::error::{SpecError, SpecErrorKind, SpecField};

/// A document as a type of ours; a value of the wrong type is named by its place.
pub(crate) fn deserialize<T: DeserializeOwned>(document: &Value) -> Result<T, SpecError> {
    serde_path_to_error::deserialize(document).map_err(|error| {
        let (pointer, detail) = (pointer_of(error.path()), error.into_inner().to_string());
        let pointer = narrowed::<T>(document, pointer, &detail);
        let written = document.pointer(&pointer).and_then(Value::as_str);
        let (seen, known) = words_of(&detail, written.unwrap_or_default());
        let field = SpecField::new(SpecErrorKind::InvalidValue, pointer, plain_words(&detail));
        let field = field.with_nearest(seen, known);
        SpecError::from_fields(vec![field]).unwrap_or_else(|| {
            SpecError::new(SpecErrorKind::InvalidValue, "a value is of the wrong type", String::new())
        })
    })
}

/// Reads an object or a list of them, each made into what holds both. What is wrong inside of it is told, where an untagged enum only
/// says that it is neither.
///
/// # Errors
/// When it is neither, or an object has errors.
pub(crate) fn one_or_several<'de, T, U, D>(
    deserializer: D,
    expected: &'static str,
    one: fn(T) -> U,
    several: fn(Vec<T>) -> U,
) -> Result<U, D::Error>
where
    T: Deserialize<'de>,
    D: Deserializer<'de>,
{
    struct Objects<T, U> {
        expected: &'static str,
        one: fn(T) -> U,
        several: fn(Vec<T>) -> U,
    }
    impl<'de, T: Deserialize<'de>, U> Visitor<'de> for Objects<T, U> {
        type Value = U;

        fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
            formatter.write_str(self.expected)
        }

        fn visit_map<A: MapAccess<'de>>(self, fields: A) -> Result<U, A::Error> {
            T::deserialize(MapAccessDeserializer::new(fields)).map(self.one)
        }

        fn visit_seq<A: SeqAccess<'de>>(self, items: A) -> Result<U, A::Error> {
            Vec::deserialize(SeqAccessDeserializer::new(items)).map(self.several)
        }
    }
    deserializer.deserialize_any(Objects { expected, one, several })
}

/// The field inside an object that an error is about. Serde loses the way inside tagged objects (ops); the field is the one without
/// which the error is gone, or another.
fn narrowed<T: DeserializeOwned>(document: &Value, pointer: String, detail: &str) -> String {
    /// No object of a config has more fields; more are no reason to read the document so often.
    const MAX_FIELDS: usize = 64;
    let Some(fields) = document.pointer(&pointer).and_then(Value::as_object) else { return pointer };
    // Without its tag an object is wrong in another way, which says nothing of the tag.
    let is_other = |other: &str| other != detail && !other.starts_with("missing field");
    let is_blamed = |name: &&String| {
        let mut without = document.clone();
        let object = without.pointer_mut(&pointer).and_then(Value::as_object_mut);
        object.is_some_and(|object| object.remove(*name).is_some())
            && serde_path_to_error::deserialize::<_, T>(&without)
                .map_or_else(|error| is_other(&error.into_inner().to_string()), |_| true)
    };
    let blamed = fields.keys().take(MAX_FIELDS).filter(|_| fields.len() <= MAX_FIELDS).find(is_blamed);
    blamed.map_or_else(|| pointer.clone(), |name| format!("{pointer}/{}", name.replace('~', "~0").replace('/', "~1")))
}

/// What serde says of a value, without its words for types of Rust.
fn plain_words(detail: &str) -> String {
    const WORDS: [(&str, &str); 15] = [
        ("invalid type: ", "this is "),
        ("invalid value: ", "this is "),
        ("unknown variant ", "this is "),
        (", expected one of ", " where one of these is expected: "),
        (", expected struct ", " where an object is expected: "),
        (", expected string or map", " where a word is expected"),
        (", expected a sequence", " where a list is expected"),
        (", expected a map", " where an object is expected"),
        (", expected ", " where this is expected: "),
        ("this is map", "this is an object"),
        ("this is sequence", "this is a list"),
        ("this is string ", "this is the text "),
        ("this is boolean ", "this is the boolean "),
        ("this is integer ", "this is the number "),
        ("this is floating point ", "this is the number "),
    ];
    let text = detail.replace('`', "'");
    if !text.starts_with("invalid ") && !text.starts_with("unknown variant") {
        return text;
    }
    WORDS.iter().fold(text, |text, (theirs, ours)| text.replace(theirs, ours))
}

/// Of an error about a word that is none of those known: the word, and those. Serde writes them in backticks; where a value may be
/// a word or something else, our own messages write them in quotes, and `written` is what stands at that place.
fn words_of<'a>(detail: &'a str, written: &'a str) -> (&'a str, Vec<&'a str>) {
    if detail.starts_with("expected ") {
        return (written, detail.split('"').skip(1).step_by(2).collect());
    }
    if !detail.starts_with("unknown variant") {
        return ("", Vec::new());
    }
    let mut words = detail.split('`').skip(1).step_by(2);
    (words.next().unwrap_or_default(), words.collect())
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

/// What a value of a document is called.
pub(crate) fn kind_of(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "a boolean",
        Value::Number(_) => "a number",
        Value::String(_) => "a text",
        Value::Array(_) => "a list",
        Value::Object(_) => "an object",
    }
}
