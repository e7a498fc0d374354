//! Hints of the engine in words of the command line: nobody there sends requests, or has an operator to ask.

use super::limits::hint_for_command_line;

/// A hint for somebody who is at the command line; `message` is what it belongs to.
pub(super) fn in_words_of_commands(message: &str, hint: &str) -> String {
    let hint = hint_for_command_line(message, hint);
    let parts: Vec<String> = hint.split("; ").filter_map(of_command).collect();
    parts.join("; ")
}

/// One part of a hint; nothing where it is about requests alone.
fn of_command(part: &str) -> Option<String> {
    if let Some(page) = part.strip_prefix("GET /docs/") {
        let (page, text) = page.split_once(' ')?;
        return Some(format!("docs/{page}.md {text}"));
    }
    if ["GET ", "POST "].iter().any(|method| part.starts_with(method)) {
        return None;
    }
    let part = part.replace(" and GET /v1/assets/{id}/skeleton list ", " lists ");
    let part = part.replace("a file that GET /v1/formats lists as read", "a file of a format that can be read");
    let part = part.replace(" and send ", " and use ");
    Some(part.strip_prefix("send ").map(|rest| format!("use {rest}")).unwrap_or(part))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_at_the_command_line_is_told_of_routes() {
        let cases = [
            (
                "GET /docs/reference/config explains every field; GET /v1/schemas/retarget-spec is its JSON Schema",
                "docs/reference/config.md explains every field",
            ),
            ("unpack it with 'gunzip' and send what comes out", "unpack it with 'gunzip' and use what comes out"),
            ("send .glb or .bvh", "use .glb or .bvh"),
            ("did you mean pelvis?", "did you mean pelvis?"),
            ("GET /v1/presets lists them", ""),
        ];
        for (hint, expected) in cases {
            assert_eq!(in_words_of_commands("no limit", hint), expected, "{hint}");
        }
    }
}
