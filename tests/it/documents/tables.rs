//! The tables of `docs/reference` that are made from code. `RETARGETD_UPDATE=1` writes them, otherwise they are compared.

use std::{collections::BTreeSet, fmt::Write, path::Path};

use retargetd::{
    config::{Setting, Settings},
    engine::Format,
    formats::FormatInfo,
    http::Code,
    retarget::{MetricInfo, MetricName, Threshold, parse_spec, spec_schema},
    rig::FindingCode,
};
use serde_json::Value;

use super::{root, text_of, warnings};

#[test]
fn tables_are_what_the_code_says() {
    let made = [
        ("formats", formats()),
        ("metrics", metrics()),
        ("config", config()),
        ("settings", settings()),
        ("errors", errors()),
        ("findings", findings()),
        ("warnings", warnings::table(&text_of(Path::new(warnings::PAGE)))),
    ];
    for (name, table) in &made {
        compare(name, table);
    }
}

/// Compares a table with the one of its page, or writes it there.
fn compare(name: &str, table: &str) {
    let page = Path::new("docs/reference").join(format!("{name}.md"));
    let before = text_of(&page);
    let (begin, end) = (format!("<!-- {name}: made by a test -->\n"), format!("<!-- {name}: end -->"));
    let (head, rest) = before.split_once(&begin).unwrap_or_else(|| panic!("{} has no '{begin}'", page.display()));
    let (_, tail) = rest.split_once(&end).unwrap_or_else(|| panic!("{} has no '{end}'", page.display()));
    let after = format!("{head}{begin}{table}{end}{tail}");
    #[expect(clippy::disallowed_methods, reason = "tests have no settings")]
    let update = std::env::var_os("RETARGETD_UPDATE").is_some_and(|value| value == "1");
    if update {
        std::fs::write(root().join(&page), &after).expect("the page can be written");
    }
    let stale: Vec<&str> =
        after.lines().filter(|line| line.starts_with('|') && !before.lines().any(|old| old == *line)).collect();
    let hint = "run 'RETARGETD_UPDATE=1 cargo it documents' and look at what changed";
    assert!(update || before == after, "{}: {hint}; new or changed rows:\n{}", page.display(), stale.join("\n"));
}

fn row(table: &mut String, cells: &[&str]) {
    let cells: Vec<String> = cells.iter().map(|cell| cell.trim().replace('|', "\\|").replace('\n', " ")).collect();
    writeln!(table, "| {} |", cells.join(" | ")).expect("text can be written");
}

fn header(cells: &[&str]) -> String {
    let mut table = String::new();
    row(&mut table, cells);
    row(&mut table, &vec!["---"; cells.len()]);
    table
}

fn formats() -> String {
    let mut table = header(&["name", "endings", "media type", "in", "out", "what it is"]);
    for info in Format::ALL.into_iter().map(Format::info) {
        let endings: Vec<String> = info.endings.iter().map(|ending| format!("`.{ending}`")).collect();
        let yes = |is: bool| if is { "yes" } else { "" };
        let written = |info: &FormatInfo| {
            info.feature.map_or_else(|| yes(info.writes).to_owned(), |name| format!("with feature `{name}`"))
        };
        let (name, media_type) = (format!("`{}`", info.name), format!("`{}`", info.media_type));
        row(&mut table, &[&name, &endings.join(" "), &media_type, yes(info.reads), &written(&info), info.description]);
    }
    table
}

fn metrics() -> String {
    let mut table = header(&["metric", "unit", "warns above", "fails above", "what it says"]);
    for MetricInfo { name, unit, threshold, forgives_source, about, .. } in MetricName::all().map(MetricName::info) {
        let Threshold { warn_above, fail_above } = threshold;
        let about = format!(
            "{about}{}",
            if *forgives_source {
                "; what the source itself has is forgiven, and half of what warns beside it"
            } else {
                ""
            }
        );
        row(&mut table, &[&format!("`{name}`"), unit, &warn_above.to_string(), &fail_above.to_string(), &about]);
    }
    table
}

fn settings() -> String {
    let mut table = header(&["flag of `serve`", "variable", "default", "limit", "what it decides"]);
    for setting in Settings::TABLE {
        let Setting { default, help, is_limit, .. } = setting;
        let limit = if *is_limit { format!("`{}`", setting.limit_name()) } else { String::new() };
        let [flag, variable, default] =
            [setting.flag(), setting.variable(), (*default).to_owned()].map(|text| format!("`{text}`"));
        row(&mut table, &[&flag, &variable, &default, &limit, help]);
    }
    table
}

fn errors() -> String {
    let mut table = header(&["code", "status", "try again", "what it means"]);
    for code in Code::ALL {
        let (name, status) = (format!("`{}`", code.name()), code.status().as_u16().to_string());
        row(&mut table, &[&name, &status, if code.is_retryable() { "yes" } else { "" }, code.title()]);
    }
    table
}

fn findings() -> String {
    let mut table = header(&["code", "severity", "what it means", "what to do"]);
    for code in FindingCode::ALL {
        row(&mut table, &[&format!("`{}`", code.name()), code.severity().name(), code.about(), code.fix()]);
    }
    table
}

/// One table for the document and one for each object in it, in the order in which they are met.
fn config() -> String {
    let schema = spec_schema();
    let mut text = String::new();
    let mut waiting = vec![("the document".to_owned(), schema.clone())];
    let mut met: BTreeSet<String> = BTreeSet::new();
    while !waiting.is_empty() {
        let (title, object) = waiting.remove(0);
        writeln!(text, "**{title}**\n").expect("text can be written");
        text.push_str(&header(&["field", "value", "default", "what it decides"]));
        for (field, property) in object["properties"].as_object().into_iter().flatten() {
            if property.get("const").is_some() {
                continue;
            }
            let mut kind = Kind::default();
            kind.read(property, schema);
            let default =
                property.get("default").filter(|value| value.is_string() || value.is_number() || value.is_boolean());
            let default = default.map(|value| format!("`{}`", value.to_string().trim_matches('"'))).unwrap_or_default();
            let about = property["description"].as_str().unwrap_or_default();
            let words = kind.words.iter().map(|(word, about)| format!("<br>`{word}`: {about}"));
            let about = format!("{about}{}", words.collect::<String>());
            row(&mut text, &[&format!("`{field}`"), &kind.names.join(" or "), &default, &about]);
            for (name, object) in kind.objects {
                if met.insert(name.clone()) {
                    waiting.push((name, object));
                }
            }
        }
        text.push('\n');
    }
    text
}

/// What a property may hold.
#[derive(Default)]
struct Kind {
    names: Vec<String>,
    /// Words that it may be, and what each means.
    words: Vec<(String, String)>,
    /// Objects that it may be or hold, with the names that their tables get.
    objects: Vec<(String, Value)>,
}

impl Kind {
    fn read(&mut self, property: &Value, schema: &Value) {
        let name = |kind: &str| match kind {
            "integer" => "whole number".to_owned(),
            "array" => "list".to_owned(),
            other => other.to_owned(),
        };
        if let Some(target) = property["$ref"].as_str() {
            let definition = schema.pointer(target.trim_start_matches('#')).expect("a reference leads somewhere");
            let title = target.rsplit('/').next().unwrap_or_default();
            return self.named(title, definition, schema);
        }
        for choice in ["anyOf", "oneOf", "allOf"].iter().filter_map(|key| property[key].as_array()).flatten() {
            self.read(choice, schema);
        }
        if let Some(word) = property["const"].as_str() {
            let about = property["description"].as_str().unwrap_or_default();
            self.words.push((word.to_owned(), about.to_owned()));
            self.add("a word".to_owned());
        }
        for word in property["enum"].as_array().into_iter().flatten().filter_map(Value::as_str) {
            self.words.push((word.to_owned(), String::new()));
            self.add("a word".to_owned());
        }
        let is_plain = property.get("const").is_none() && property.get("enum").is_none();
        let types: Vec<&str> = match &property["type"] {
            Value::String(one) if is_plain => vec![one],
            Value::Array(several) if is_plain => several.iter().filter_map(Value::as_str).collect(),
            _ => Vec::new(),
        };
        for kind in types.into_iter().filter(|kind| *kind != "null") {
            match kind {
                "array" => self.holding("list of", &property["items"], schema),
                "object" => self.holding("object with", &property["additionalProperties"], schema),
                kind => self.add(name(kind)),
            }
        }
    }

    fn holding(&mut self, what: &str, inner: &Value, schema: &Value) {
        let mut kind = Self::default();
        if inner.is_object() {
            kind.read(inner, schema);
        }
        let inner = if kind.names.is_empty() { "values".to_owned() } else { kind.names.join(" or ") };
        self.add(format!("{what} {inner}"));
        self.words.extend(kind.words);
        self.objects.extend(kind.objects);
    }

    fn named(&mut self, title: &str, definition: &Value, schema: &Value) {
        let tagged: Vec<(&Value, &str)> = definition["oneOf"]
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(|variant| Some((variant, variant["properties"]["op"]["const"].as_str()?)))
            .collect();
        if !tagged.is_empty() {
            self.add("op".to_owned());
            for (variant, word) in tagged {
                let object = match variant["$ref"].as_str() {
                    Some(target) => {
                        schema.pointer(target.trim_start_matches('#')).expect("a reference leads somewhere")
                    }
                    None => variant,
                };
                self.objects.push((format!("op `{word}`"), object.clone()));
            }
        } else if definition.get("properties").is_some() {
            self.add(format!("`{title}`"));
            self.objects.push((format!("`{title}`"), definition.clone()));
        } else {
            self.read(definition, schema);
        }
    }

    fn add(&mut self, name: String) {
        if !self.names.contains(&name) {
            self.names.push(name);
        }
    }
}

#[test]
fn the_document_of_defaults_is_accepted() {
    assert!(parse_spec(b"{}").is_ok(), "the documents say that an empty config finds everything out");
}
