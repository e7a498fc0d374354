//! What a reader of JSON or of a query says about what it cannot read, in words of the API: no types of ours and no places in our code.

/// What is wrong, and the names that would have been right.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Misread {
    pub(super) kind: Kind,
    pub(super) detail: String,
    /// The name that was seen and the names that exist, where it is one that does not.
    pub(super) seen: String,
    pub(super) known: Vec<String>,
}

/// Which kind of thing is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// A member that does not exist.
    UnknownField,
    /// A member that has to be there.
    MissingField,
    /// Everything else.
    InvalidValue,
}

/// Reads the message of a library; `whole` is what a member stands in: "the body", "the query".
pub(super) fn misread(message: &str, whole: &str) -> Misread {
    // The pointer says where, and better.
    let text = message.split(" at line ").next().unwrap_or(message);
    let quoted: Vec<String> = text.split('`').skip(1).step_by(2).map(str::to_owned).collect();
    let (seen, known) = match quoted.split_first() {
        Some((seen, known)) => (seen.clone(), known.to_vec()),
        None => (String::new(), Vec::new()),
    };
    let found = |kind, detail: String| Misread { kind, detail, seen: seen.clone(), known: known.clone() };
    if text.starts_with("unknown field") {
        let names = known.join("', '");
        let all = if names.is_empty() { "it has none".to_owned() } else { format!("there are '{names}'") };
        return found(Kind::UnknownField, format!("there is no '{}' here; {all}", shortened(&seen)));
    }
    if text.starts_with("missing field") {
        return Misread { known: Vec::new(), ..found(Kind::MissingField, format!("{whole} has no '{seen}'")) };
    }
    if text.starts_with("duplicate field") {
        return Misread { known: Vec::new(), ..found(Kind::InvalidValue, format!("'{seen}' is given twice")) };
    }
    if text.starts_with("unknown variant") {
        let detail = format!("'{}' is none of '{}'", shortened(&seen), known.join("', '"));
        return found(Kind::InvalidValue, detail);
    }
    let detail = match text.split_once(", expected ") {
        Some((is, expected)) => format!("this is {}, where {} is expected", found_words(is), expected_words(expected)),
        None => own_words(text).to_owned(),
    };
    Misread { kind: Kind::InvalidValue, detail, seen: String::new(), known: Vec::new() }
}

/// What was found, from `invalid type: integer `5``.
fn found_words(text: &str) -> String {
    let text = text.split_once(": ").map_or(text, |(_, what)| what);
    let (kind, value) = text.split_once(' ').map_or((text, ""), |(kind, value)| (kind, value));
    let value = shortened(&value.replace('`', ""));
    match kind {
        "map" => "an object".to_owned(),
        "sequence" => "a list".to_owned(),
        "unit" | "null" => "null".to_owned(),
        "boolean" => value,
        "integer" | "floating" => format!("the number {}", value.trim_start_matches("point ")),
        "string" => format!("the text {value}"),
        // A list in place of an object is counted.
        "length" | "invalid" => "a list".to_owned(),
        _ => shortened(text),
    }
}

fn expected_words(text: &str) -> &str {
    match text {
        "a sequence" => "a list",
        "a map" => "an object",
        "a string" | "a borrowed string" | "string" => "text",
        "a boolean" => "true or false",
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number from 0",
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number",
        "f32" | "f64" => "a number",
        text if text.starts_with("struct ") || text.contains(" enum ") || text.starts_with("enum ") => "an object",
        text => text,
    }
}

/// What the readers of numbers say.
fn own_words(text: &str) -> &str {
    match text {
        "invalid digit found in string" | "cannot parse integer from empty string" => "it is not a whole number from 0",
        "number too large to fit in target type" => "the number is too large",
        "number too small to fit in target type" => "the number is too small",
        "invalid float literal" | "cannot parse float from empty string" => "it is not a number",
        "provided string was not `true` or `false`" => "it is neither 'true' nor 'false'",
        text => text,
    }
}

fn shortened(text: &str) -> String {
    const MAX_LETTERS: usize = 64;
    text.chars().take(MAX_LETTERS).map(|letter| if letter.is_control() { ' ' } else { letter }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::nearest;

    #[test]
    fn libraries_are_told_in_our_words() {
        let cases = [
            (
                "invalid length 0, expected struct NewJobBody with 11 elements at line 1 column 2",
                "this is a list, where an object is expected",
            ),
            ("invalid type: map, expected a string at line 1 column 9", "this is an object, where text is expected"),
            (
                "invalid type: string \"x\", expected struct InputBody",
                "this is the text \"x\", where an object is expected",
            ),
            ("invalid type: null, expected a sequence", "this is null, where a list is expected"),
            ("invalid type: integer `5`, expected a boolean", "this is the number 5, where true or false is expected"),
            (
                "invalid type: floating point `1.5`, expected i32",
                "this is the number 1.5, where a whole number is expected",
            ),
            ("missing field `source`", "the body has no 'source'"),
            ("unknown variant `x`, expected one of `t`, `a`", "'x' is none of 't', 'a'"),
            ("invalid digit found in string", "it is not a whole number from 0"),
        ];
        for (message, expected) in cases {
            assert_eq!(misread(message, "the body").detail, expected, "{message}");
        }
        let unknown = misread("unknown field `sorce`, expected one of `source`, `target`", "the body");
        assert_eq!(
            (unknown.kind, nearest(&unknown.seen, unknown.known.iter().map(String::as_str))),
            (Kind::UnknownField, vec!["source".to_owned()]),
            "and what is like it"
        );
    }
}
