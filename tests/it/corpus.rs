//! Every file of the corpus through the real binary and through the engine: nothing crashes, hangs or eats the memory, and
//! what is broken is refused as such.

use std::{
    collections::BTreeMap,
    fs,
    panic::{self, AssertUnwindSafe},
    path::Path,
};

use retargetd::{
    engine::{Failure, FailureCode, Format, Inputs, Limits, NamedBytes, Outcome, retarget},
    model::Control,
    samples,
};

use crate::{
    limited::{DONE, REFUSED, in_parallel, inspect},
    support::{corpus_file, files_below},
};

/// Files that the corpus lists as good or bad, and what we do instead.
const JUDGED_OTHERWISE: [(&str, i32, &str); 3] = [
    ("hostile/gltf-validator/buffer/valid.bin", REFUSED, "a bare buffer, which says nothing of what is in it"),
    (
        "hostile/ufbx-synthetic/synthetic_bad_inf_nan_fail_7500_ascii.fbx",
        DONE,
        "what is broken are the points of a mesh, which are not looked at",
    ),
    (
        "hostile/ufbx-synthetic/synthetic_missing_cache_fail_7500_ascii.fbx",
        DONE,
        "what is missing is a cache of deformed points, which is not looked at",
    ),
];

/// Beginnings of the names of files that are refused for another reason than that they break the rules of their format.
const OTHER_REASONS: [(&str, FailureCode); 14] = [
    ("hostile/animated-drawings/texture_1x1.png", FailureCode::FigureNotFound),
    ("hostile/animated-drawings/texture_bomb_12000x12000.png", FailureCode::AssetLimitExceeded),
    ("hostile/animated-drawings/", FailureCode::UnsupportedFormat),
    ("hostile/empty/", FailureCode::UnsupportedFormat),
    ("hostile/gltf-validator/buffer/valid.bin", FailureCode::UnsupportedFormat),
    ("hostile/mislabelled/", FailureCode::UnsupportedFormat),
    ("hostile/bvh/frames_one_billion_declared.bvh", FailureCode::AssetLimitExceeded),
    ("hostile/gltf/json_deep_nesting.gltf", FailureCode::AssetLimitExceeded),
    ("hostile/npz/header_shape_huge.npy", FailureCode::AssetLimitExceeded),
    ("hostile/gltf/uri_absolute_file.gltf", FailureCode::UnsupportedFeature),
    ("hostile/gltf/uri_http_loopback.gltf", FailureCode::UnsupportedFeature),
    ("hostile/gltf/uri_parent_directory.gltf", FailureCode::UnsupportedFeature),
    ("hostile/npz/pickled_object.npz", FailureCode::UnsupportedFeature),
    ("hostile/ufbx-synthetic/synthetic_unsupported_cube_fail_2000_binary.fbx", FailureCode::UnsupportedFeature),
];

/// Endings of files that hold a model or a motion.
const MODEL_ENDINGS: [&str; 9] = ["glb", "gltf", "vrm", "vrma", "fbx", "bvh", "npz", "npy", "json"];

#[test]
fn hostile_files_are_read_or_refused() {
    let Some(corpus) = corpus_file("") else { return };
    let files = names_below(&corpus, "hostile");
    assert!(files.len() > 400, "the corpus holds hostile files, found {}", files.len());
    let verdicts = verdicts(&corpus);
    let problems = in_parallel(&files, |name: &String| {
        let inspection = inspect(&corpus.join(name));
        let wanted = verdicts.get(name).copied();
        inspection.problem(wanted).map(|problem| format!("{name}: {problem}"))
    });
    assert!(problems.is_empty(), "{} of {} files:\n{}", problems.len(), files.len(), problems.join("\n"));
}

#[test]
fn real_files_are_read() {
    let Some(corpus) = corpus_file("") else { return };
    let mut files = names_below(&corpus, "");
    files.retain(|name| {
        let ending = Path::new(name).extension().and_then(|ending| ending.to_str()).unwrap_or("");
        MODEL_ENDINGS.contains(&ending) && !name.starts_with("hostile/")
    });
    assert!(files.len() > 200, "the corpus holds real files, found {}", files.len());
    let problems = in_parallel(&files, |name: &String| {
        let inspection = inspect(&corpus.join(name));
        inspection.problem(Some(DONE)).map(|problem| format!("{name}: {problem}"))
    });
    assert!(problems.is_empty(), "{} of {} files:\n{}", problems.len(), files.len(), problems.join("\n"));
}

#[test]
fn hostile_files_are_refused_for_what_is_wrong_with_them() {
    let Some(corpus) = corpus_file("") else { return };
    let refused = verdicts(&corpus).into_iter().filter(|(_, code)| *code == REFUSED);
    let refused: Vec<String> = refused.map(|(name, _)| name).collect();
    let problems = in_parallel(&refused, |name: &String| {
        let other = OTHER_REASONS.iter().find(|(begin, _)| name.starts_with(begin));
        let wanted = other.map_or(FailureCode::AssetMalformed, |(_, code)| *code);
        let bytes = fs::read(corpus.join(name)).expect("readable");
        match retargetd::engine::inspect(NamedBytes { name, bytes: &bytes }, &Limits::default(), &Control::new()) {
            Err(failure) if failure.code == wanted => None,
            other => Some(format!("{name}: {wanted:?} fits, not {:?}", other.map(drop))),
        }
    });
    assert!(problems.is_empty(), "{} of {} files:\n{}", problems.len(), refused.len(), problems.join("\n"));
}

/// As source and as target of an everyday job: a result, or a failure that blames the right file; never a panic, and never the
/// code for our own mistakes.
#[test]
fn hostile_files_go_through_the_engine() {
    let Some(corpus) = corpus_file("") else { return };
    let (walk, mannequin) = (samples::walk_clip(), samples::mannequin());
    let walk = NamedBytes { name: "walk.glb", bytes: &walk };
    let mannequin = NamedBytes { name: "mannequin.glb", bytes: &mannequin };
    let files = names_below(&corpus, "hostile");
    let problems = in_parallel(&files, |name: &String| {
        let bytes = fs::read(corpus.join(name)).expect("readable");
        let hostile = NamedBytes { name, bytes: &bytes };
        let as_source = attempt(hostile, mannequin, "source");
        let as_target = attempt(walk, hostile, "target");
        let problems: Vec<String> = [("source", as_source), ("target", as_target)]
            .into_iter()
            .filter_map(|(part, result)| result.err().map(|problem| format!("{name} as {part}: {problem}")))
            .collect();
        (!problems.is_empty()).then(|| problems.join("\n"))
    });
    assert!(problems.is_empty(), "{} of {} files:\n{}", problems.len(), files.len(), problems.join("\n"));
}

fn attempt(source: NamedBytes<'_>, target: NamedBytes<'_>, part: &str) -> Result<(), String> {
    let formats = [Format::Glb, Format::PosesNpz];
    let inputs = Inputs { source, target, source_rest: None, target_rest: None, config: None, formats: &formats };
    let run = || retarget(&inputs, &Limits::default(), &Control::new());
    match panic::catch_unwind(AssertUnwindSafe(run)) {
        Err(_) => Err("panics".to_owned()),
        Ok(Ok(outcome)) => check_outcome(&outcome),
        Ok(Err(failure)) => check_failure(&failure, part),
    }
}

fn check_outcome(outcome: &Outcome) -> Result<(), String> {
    for output in &outcome.outputs {
        let limits = Limits::default();
        let file = NamedBytes { name: &output.name, bytes: &output.bytes };
        retargetd::engine::inspect(file, &limits, &Control::new())
            .map_err(|failure| format!("the result cannot be read: {failure:?}"))?;
    }
    Ok(())
}

fn check_failure(failure: &Failure, part: &str) -> Result<(), String> {
    if failure.code == FailureCode::Internal {
        return Err(format!("an internal failure: {failure:?}"));
    }
    if !failure.part.is_empty() && failure.part != part {
        return Err(format!("the failure blames {}: {failure:?}", failure.part));
    }
    if failure.detail.is_empty() { Err("a failure without a word".to_owned()) } else { Ok(()) }
}

/// The exit codes that the corpus' own table asks for, where it leaves no choice, and those of [`JUDGED_OTHERWISE`].
fn verdicts(corpus: &Path) -> BTreeMap<String, i32> {
    let table = fs::read_to_string(corpus.join("README.md")).expect("the corpus describes itself");
    let mut verdicts = BTreeMap::new();
    for line in table.lines() {
        let columns: Vec<&str> = line.split('|').map(str::trim).collect();
        let [_, path, _, expected, ..] = columns[..] else { continue };
        let refused = expected.starts_with("error") && !expected.contains(" or ");
        let accepted = ["accept", "accept as a pose"].contains(&expected);
        if path.starts_with("hostile/") && (refused || accepted) {
            verdicts.insert(path.to_owned(), if refused { REFUSED } else { DONE });
        }
    }
    assert!(verdicts.len() > 60, "the table says what is expected, found {}", verdicts.len());
    for (path, code, reason) in JUDGED_OTHERWISE {
        let listed = verdicts.insert(path.to_owned(), code);
        assert!(listed.is_some_and(|listed| listed != code), "{path} is listed otherwise, so that '{reason}' is news");
    }
    verdicts
}

/// The corpus' names of all files below a folder of it.
fn names_below(corpus: &Path, folder: &str) -> Vec<String> {
    let name = |path: &Path| path.strip_prefix(corpus).expect("below the corpus").to_string_lossy().into_owned();
    files_below(&corpus.join(folder)).iter().map(|path| name(path)).collect()
}
