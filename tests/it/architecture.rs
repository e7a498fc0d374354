//! The import law of the crate docs, and the other rules that a machine can check.

mod circles;
mod code;
mod words;

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use code::{Code, code_files};

/// The modules that know no runtime, no file system, no clock and no environment.
const PURE: [&str; 11] = [
    "model",
    "formats",
    "rig",
    "retarget",
    "editing",
    "picture",
    "drawing",
    "engine",
    "report",
    "retargeter",
    "samples",
];

/// External crates, and the only modules that may name them. `main` is the binary.
const FENCES: [(&str, &[&str]); 31] = [
    ("png", &["picture"]),
    ("gif", &["picture"]),
    ("image_webp", &["picture"]),
    ("webp", &["picture"]),
    ("zune_jpeg", &["picture"]),
    ("exif", &["picture"]),
    ("plotters", &["report"]),
    ("axum", &["http"]),
    ("hyper", &["http"]),
    ("hyper_util", &["http"]),
    ("tower_http", &["http"]),
    ("utoipa", &["http"]),
    ("utoipa_axum", &["http"]),
    ("utoipa_swagger_ui", &["http"]),
    ("sqlx", &["store"]),
    ("object_store", &["store"]),
    ("reqwest", &["cli", "identity", "outbound", "telemetry"]),
    ("opentelemetry", &["telemetry"]),
    ("opentelemetry_http", &["telemetry"]),
    ("opentelemetry_otlp", &["telemetry"]),
    ("opentelemetry_sdk", &["telemetry"]),
    ("jsonwebtoken", &["identity"]),
    ("hmac", &["jobs", "outbound"]),
    ("ipnet", &["config", "outbound"]),
    ("rustix", &["jobs", "store"]),
    ("clap", &["cli"]),
    ("clap_complete", &["cli"]),
    ("clap_mangen", &["cli"]),
    ("anstream", &["cli"]),
    ("indicatif", &["cli"]),
    ("mimalloc", &["main"]),
];

/// External crates that belong to the service half, wherever there.
const SERVICE_HALF_ONLY: [&str; 6] = ["tokio", "tokio_util", "futures", "tracing", "metrics", "jiff"];

/// Parts of the standard library that the pure half does not touch.
const IMPURE: [&str; 6] = ["std::fs", "std::env", "std::net", "std::process", "std::thread", "std::io::stdin"];

/// Names that make results depend on the clock or on the order of a hash.
const IMPURE_NAMES: [&str; 4] = ["SystemTime", "Instant", "HashMap", "HashSet"];

const MAX_LINES: usize = 600;

const MAX_LINES_OF_FUNCTION: usize = 80;

/// Files that one rotation passes from upload to download. It may only shrink: 30 would be a short walk.
const MAX_FILES_OF_WALK: usize = 58;

/// What a program sees of the library.
const MAX_PUBLIC_ITEMS: usize = 60;

/// Circles of imports that may stand: types that know one another. A line is struck when its circle has gone, and none is ever added.
const CIRCLES: [&[&str]; 4] = [
    &["formats::budget", "formats::error"],
    &["model::pose", "model::skeleton"],
    &["model::scene", "model::stretched"],
    &["rig::alignment::canonical", "rig::alignment::face", "rig::alignment::look"],
];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn sources() -> Vec<(PathBuf, Code)> {
    let files = code_files(&root().join("src"));
    assert!(files.len() > 100, "the sources are there, found {}", files.len());
    files
}

/// Everything at once, so that nobody mends one line per run.
fn none(broken: &[String], rule: &str) {
    assert!(broken.is_empty(), "{rule}:\n  {}", broken.join("\n  "));
}

/// The law: which module may import which, from the table of the crate docs.
fn law() -> BTreeMap<String, BTreeSet<String>> {
    let text = std::fs::read_to_string(root().join("src/lib.rs")).expect("the crate docs");
    let rows = text.lines().filter(|line| line.starts_with("//! | [`"));
    let mut law: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for row in rows {
        let cells: Vec<&str> = row.trim_start_matches("//! ").trim_matches(['|', ' ']).split(" | ").collect();
        let [modules, _, allowed] = cells[..] else { panic!("a row has three cells: {row}") };
        let allowed: BTreeSet<String> = match allowed.trim() {
            "nothing" => BTreeSet::new(),
            "all above" => law.keys().cloned().collect(),
            "everything" => ["*".to_owned()].into(),
            names => quoted(names),
        };
        law.extend(quoted(modules).into_iter().map(|module| (module, allowed.clone())));
    }
    law
}

fn quoted(text: &str) -> BTreeSet<String> {
    text.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

#[test]
fn the_table_of_the_crate_docs_has_every_module() {
    let text = std::fs::read_to_string(root().join("src/lib.rs")).expect("the crate docs");
    let modules: BTreeSet<&str> =
        text.lines().filter_map(|line| line.strip_prefix("pub mod ")?.strip_suffix(';')).collect();
    let law = law();
    assert_eq!(modules, law.keys().map(String::as_str).collect(), "modules of the crate against rows of the table");
    let named: BTreeSet<&String> = law.values().flatten().filter(|name| *name != "*").collect();
    assert!(named.iter().all(|name| law.contains_key(*name)), "the table names modules only: {named:?}");
}

#[test]
fn what_is_not_pure_is_behind_the_feature_service() {
    let text = std::fs::read_to_string(root().join("src/lib.rs")).expect("the crate docs");
    let lines: Vec<&str> = text.lines().collect();
    let gated = lines.windows(2).filter(|pair| pair[0] == "#[cfg(feature = \"service\")]");
    let gated: BTreeSet<&str> = gated.filter_map(|pair| pair[1].strip_prefix("pub mod ")?.strip_suffix(';')).collect();
    let law = law();
    let service: BTreeSet<&str> = law.keys().map(String::as_str).filter(|module| !PURE.contains(module)).collect();
    assert_eq!(gated, service, "modules behind the feature against those that are not pure");
}

/// The names of the root of the crate are the library's face; its modules are hidden from its documentation.
#[test]
fn the_face_of_the_library_is_small() {
    let text = std::fs::read_to_string(root().join("src/lib.rs")).expect("the crate docs");
    let code = Code::new(text, Path::new("lib"));
    let lines: Vec<&str> = code.raw.lines().collect();
    let hidden = |at: usize| {
        lines[..at]
            .iter()
            .rev()
            .take_while(|line| line.starts_with('#'))
            .any(|line| *line == "#[cfg_attr(doc, doc(hidden))]")
    };
    let is_open = |at: &usize| lines[*at].starts_with("pub mod ") && !hidden(*at);
    let open: Vec<&str> = (0..lines.len()).filter(is_open).map(|at| lines[at]).collect();
    assert_eq!(open, ["pub mod samples;"], "modules that programs may use");
    let named = PURE.iter().flat_map(|module| code.paths(module)).filter(|place| place.is_handed_on);
    let names: BTreeSet<String> = named.map(|place| place.text()).collect();
    assert!(names.contains("retargeter::Retargeter"), "the builder is among them: {names:?}");
    assert!(names.iter().all(|name| !name.ends_with('*')), "each by its name: {names:?}");
    let samples = std::fs::read_to_string(root().join("src/samples/mod.rs")).expect("the samples");
    let functions = samples.lines().filter(|line| line.starts_with("pub fn ")).count();
    let count = names.len() + open.len() + functions;
    assert!(count <= MAX_PUBLIC_ITEMS, "{count} public items, at most {MAX_PUBLIC_ITEMS}: {names:?}");
}

#[test]
fn every_import_keeps_the_law() {
    let law = law();
    let mut broken = Vec::new();
    for (path, code) in sources() {
        let Some(module) = code.module.first() else { continue };
        // `named` is a macro that imports nothing, and that everything may use.
        if module == "main" || module == "named" {
            continue;
        }
        let allowed = law.get(module).unwrap_or_else(|| panic!("{module} is in the table"));
        let is_pure = PURE.contains(&module.as_str());
        let may = |name: &str| name == module || allowed.contains("*") || allowed.contains(name);
        for place in code.paths("crate") {
            let name = place.segment(1);
            // Tests of a pure module may use samples, engine and the like: that does not bind the module.
            let is_test_of_pure = place.in_test && is_pure && PURE.contains(&name);
            if !may(name) && !is_test_of_pure {
                broken.push(format!("{}:{}: {} may not import {name}", path.display(), place.line, module));
            }
        }
        for place in code.escapes() {
            let hint = "write crate:: instead, so that the law can be checked";
            broken.push(format!("{}:{}: leaves {module} by super::; {hint}", path.display(), place));
        }
    }
    none(&broken, "imports against the table of src/lib.rs");
}

#[test]
fn imports_go_in_no_circles_but_those_that_are_known() {
    let found = circles::circles(&sources().into_iter().map(|(_, code)| code).collect::<Vec<_>>());
    let known: Vec<&[&str]> = CIRCLES.into();
    let within = |circle: &[String]| known.iter().any(|known| circle.iter().all(|file| known.contains(&file.as_str())));
    let new = found.iter().filter(|circle| !within(circle)).map(|circle| circle.join(", ")).collect::<Vec<_>>();
    none(&new, "circles; put what both files need into a file below both");
    let gone = known.into_iter().filter(|known| !found.iter().any(|circle| circle == known));
    let gone: Vec<String> = gone.map(|known| known.join(", ")).collect();
    none(&gone, "these circles are gone or smaller: strike them from the list");
}

#[test]
fn external_crates_stay_behind_their_fences() {
    let mut broken = Vec::new();
    for (path, code) in sources() {
        let module = code.module.first().map_or("lib", String::as_str);
        let is_pure = PURE.contains(&module);
        let fenced = FENCES.iter().filter(|(_, modules)| !modules.contains(&module)).map(|(name, _)| *name);
        let service = SERVICE_HALF_ONLY.iter().copied().filter(|_| is_pure);
        for name in fenced.chain(service) {
            for place in code.paths(name).into_iter().filter(|place| !place.in_test) {
                broken.push(format!("{}:{}: {module} may not name {name}", path.display(), place.line));
            }
        }
    }
    none(&broken, "external crates");
}

#[test]
fn the_pure_half_is_pure() {
    let mut broken = Vec::new();
    for (path, code) in sources() {
        if !code.module.first().is_some_and(|module| PURE.contains(&module.as_str())) {
            continue;
        }
        for place in code.paths("std").into_iter().filter(|place| !place.in_test) {
            let full = place.text();
            if IMPURE.iter().any(|banned| full == *banned || full.starts_with(&format!("{banned}::"))) {
                broken.push(format!("{}:{}: {full}", path.display(), place.line));
            }
        }
        for name in IMPURE_NAMES {
            broken.extend(code.words(name).map(|line| format!("{}:{line}: {name}", path.display())));
        }
    }
    none(&broken, "no file system, clock, environment or hash order in the pure half");
}

#[test]
fn no_shortcuts_outside_tests() {
    let mut broken = Vec::new();
    for (path, code) in sources() {
        for shortcut in [".unwrap()", "todo!(", "unimplemented!(", "dbg!("] {
            broken.extend(code.finds(shortcut).map(|line| format!("{}:{line}: {shortcut}", path.display())));
        }
    }
    none(&broken, "an error is handled, or an `expect` names the invariant");
}

#[test]
fn every_file_says_what_it_is_for_and_is_short() {
    let mut broken = Vec::new();
    let files = ["src", "tests/it", "tests/fuzz/src", "benches"].map(|folder| code_files(&root().join(folder)));
    for (path, code) in files.into_iter().flatten() {
        let first = code.raw.lines().next().unwrap_or_default();
        if !first.starts_with("//! ") || first.len() < 12 {
            broken.push(format!("{}: begins without a //! line that says what it answers", path.display()));
        }
        let lines = code.raw.lines().count();
        if lines > MAX_LINES {
            broken.push(format!("{}: {lines} lines; at most {MAX_LINES}, so split it", path.display()));
        }
    }
    none(&broken, "files");
}

#[test]
fn functions_are_short() {
    let functions = |code: &Code| -> Vec<(String, usize, usize)> {
        code.functions().into_iter().map(|(name, line, lines)| (name.to_owned(), line, lines)).collect()
    };
    let example = "fn a(x: [u8; 2]) {\n    if x { }\n}\ntrait B {\n    fn c();\n    fn d() {}\n}\n";
    let found = functions(&Code::new(example.to_owned(), Path::new("example")));
    assert_eq!(found, [("a".to_owned(), 1, 3), ("d".to_owned(), 6, 1)], "what is counted");
    let mut broken = Vec::new();
    for (path, code) in sources() {
        for (name, line, lines) in functions(&code) {
            if lines > MAX_LINES_OF_FUNCTION {
                broken.push(format!(
                    "{}:{line}: {name} has {lines} lines; at most {MAX_LINES_OF_FUNCTION}",
                    path.display()
                ));
            }
        }
    }
    none(&broken, "functions");
}

/// The table of `docs/architecture.md` is the walk; the text below it names what is passed by.
#[test]
fn the_walk_of_one_rotation_becomes_no_longer() {
    let text = std::fs::read_to_string(root().join("docs/architecture.md")).expect("the document");
    let (_, walk) = text.split_once("## The walk of one rotation\n").expect("the walk");
    let (walk, _) = walk.split_once("\n## ").expect("what follows it");
    let files_of = |lines: &mut dyn Iterator<Item = &str>| -> Vec<String> {
        lines.flat_map(quoted).filter(|name| name.ends_with(".rs")).collect()
    };
    let gone = files_of(&mut walk.lines()).into_iter().filter(|file| !root().join("src").join(file).is_file());
    none(&gone.collect::<Vec<_>>(), "files of the walk that are gone");
    let stops = files_of(&mut walk.lines().filter(|line| line.starts_with("| ")));
    let distinct: BTreeSet<&String> = stops.iter().collect();
    assert_eq!(distinct.len(), stops.len(), "nobody comes by twice");
    assert_eq!(stops.len(), MAX_FILES_OF_WALK, "files of the walk; where there are fewer, say so here");
}

#[test]
fn every_route_is_in_a_test() {
    let text = std::fs::read_to_string(root().join("openapi/openapi.json")).expect("the document");
    let document: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let tests: Vec<String> = code_files(&root().join("tests/it"))
        .into_iter()
        .filter(|(path, _)| !path.ends_with("architecture.rs"))
        .flat_map(|(_, code)| code.raw.lines().map(str::to_owned).collect::<Vec<_>>())
        .collect();
    let mut broken = Vec::new();
    for route in document["paths"].as_object().expect("paths").keys() {
        // "/v1/jobs/{id}/cancel" is in a line that has "/v1/jobs/" and, behind it, "/cancel".
        let pieces: Vec<&str> = route.split(['{', '}']).step_by(2).filter(|piece| !piece.is_empty()).collect();
        let has = |line: &String| {
            let mut rest = line.as_str();
            let in_order = pieces.iter().all(|piece| rest.split_once(piece).map(|(_, behind)| rest = behind).is_some());
            in_order && (route.ends_with('}') || rest.starts_with(['"', '?', '`', '#', ' ']))
        };
        if !tests.iter().any(has) {
            broken.push(route.clone());
        }
    }
    none(&broken, "routes that no test names");
}
