//! Configs: depth, references to references, lists without end. As large as the service takes them.

use std::time::{Duration, Instant};

use retargetd::engine::{NamedBytes, check_config};

/// The service's default for documents.
const MAX_BYTES: usize = 1 << 20;
/// Debug builds on a busy machine are slow; what grows with the square of the input takes minutes.
const PATIENCE: Duration = Duration::from_secs(10);

fn references() -> String {
    let mut text = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n".to_owned();
    for level in 1..40 {
        let before = level - 1;
        text += &format!("a{level}: &a{level} [{}*a{before}]\n", format!("*a{before}, ").repeat(8));
    }
    text
}

fn filled(head: &str, piece: &str, tail: &str) -> String {
    head.to_owned() + &piece.repeat((MAX_BYTES - head.len() - tail.len()) / piece.len()) + tail
}

#[test]
fn configs_end_soon() {
    let cases = [
        ("references to references", references()),
        ("a merge of itself", "a: &a\n  <<: *a\n".to_owned()),
        ("deep lists in YAML", filled("a: ", "[", "")),
        ("deep objects in YAML", filled("a: ", "{a: ", "")),
        ("deep blocks in YAML", (0..1400).map(|level| format!("{}a:\n", " ".repeat(level))).collect()),
        ("lists of lists in YAML", filled("", "- ", "")),
        ("deep lists in JSON", filled("{\"ops\": ", "[", "")),
        ("deep objects in JSON", filled("", "{\"a\":", "")),
        (
            "many unknown fields",
            format!("{{{}\"z\": 0}}", (0..70_000).map(|index| format!("\"o{index}\": 1,")).collect::<String>()),
        ),
        ("many ops", filled("{\"ops\": [{\"op\": \"fk\"}", ",{\"op\": \"fk\"}", "]}")),
        ("many wrong ops", filled("{\"ops\": [3", ",3", "]}")),
        ("many unknown ops", filled("{\"ops\": [{\"op\": \"fk\"}", ",{\"op\": \"kf\"}", "]}")),
        ("many rows", filled("source;target\n", "a;b\n", "")),
        ("many columns", filled("source;target", ";gian", "\n")),
        ("many quotes", filled("source;target\n", "\"\"\"\"", "")),
        (
            "many bones",
            filled("", "a%False%ABSOLUTE%0.0,0.0,0.0%0.0,0.0,0.0%1.0%False%False%\nb\nFalse\nFalse\n\n", ""),
        ),
        ("a long word", filled("align: ", "x", "")),
        ("a tag that runs code", "!!python/object/apply:os.system ['true']".to_owned()),
        ("times without end", "{\"edit\": {\"fps\": 1e308, \"speed\": 1e-308, \"range\": [-1e308, 1e308]}}".to_owned()),
    ];
    for (name, text) in cases {
        let begin = Instant::now();
        let result = check_config(NamedBytes { name: "config", bytes: text.as_bytes() });
        assert!(begin.elapsed() < PATIENCE, "{name}: it takes {:?}", begin.elapsed());
        if let Err(failure) = result {
            let told = failure.detail.len() + failure.errors.iter().map(|error| error.detail.len()).sum::<usize>();
            assert!(told < 100_000, "{name}: the answer is shorter than the question, not {told} bytes");
            assert!(
                failure.errors.len() <= 100,
                "{name}: {} things that are wrong are too many to read",
                failure.errors.len()
            );
        }
    }
}
