//! What a reader of JSON says is wrong, in plain words.

/// What is wrong with a text that is no JSON, and where.
#[must_use]
pub fn no_json(error: &serde_json::Error) -> String {
    let text = error.to_string();
    let what = text.split(" at line ").next().unwrap_or_default();
    let what = match what {
        what if what.starts_with("EOF") => "it ends before it is complete",
        "expected value" => "there is no value",
        "trailing characters" => "something follows its end",
        "trailing comma" => "a comma stands before a closing bracket",
        "key must be a string" => "the name of a member is not in quotation marks",
        what if what.starts_with("control character") => "a text has a line feed or a control character in it",
        what if what.starts_with("recursion limit") => "it is nested too deeply",
        what => what,
    };
    format!("{what} (line {}, column {})", error.line(), error.column())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_that_ends_early_is_told_with_its_place() {
        let error = |text: &str| no_json(&serde_json::from_str::<serde_json::Value>(text).expect_err("no JSON"));
        assert_eq!(error("{\"a\": 1"), "it ends before it is complete (line 1, column 7)", "where");
        assert_eq!(error("hello"), "there is no value (line 1, column 1)", "what");
    }
}
