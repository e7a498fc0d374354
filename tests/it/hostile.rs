//! Files made to do harm, by code: the real binary reads them or says why not, soon and within its memory.
//!
//! The kinds are those of the corpus and more: bombs at every layer, counts and lengths that lie, cycles, depths, numbers that are none,
//! things that are there twice. Every refusal must have the code that fits.

mod archives;
mod arrays;
mod bvh;
mod configs;
mod fbx;
mod gltf;

use std::fs;

use retargetd::engine::{self, FailureCode, Limits, NamedBytes};
use retargetd::model::Control;

use crate::limited::{DONE, REFUSED, in_parallel, inspect};

/// A file and what must become of it.
struct Case {
    /// What is wrong with it; its ending is that of the file.
    name: &'static str,
    bytes: Vec<u8>,
    wanted: Wanted,
}

/// What must become of a file.
#[derive(Clone, Copy)]
enum Wanted {
    /// It is read, with warnings.
    Read,
    /// It is refused for this reason.
    Refused(FailureCode),
}

const MALFORMED: Wanted = Wanted::Refused(FailureCode::AssetMalformed);
const BEYOND_A_LIMIT: Wanted = Wanted::Refused(FailureCode::AssetLimitExceeded);
const UNSUPPORTED: Wanted = Wanted::Refused(FailureCode::UnsupportedFeature);

fn case(name: &'static str, bytes: impl Into<Vec<u8>>, wanted: Wanted) -> Case {
    Case { name, bytes: bytes.into(), wanted }
}

/// Gives them to the binary, each with its ten seconds and its gibibyte.
fn try_all(cases: &[Case]) {
    let folder = tempfile::tempdir().expect("a folder");
    let problems = in_parallel(cases, |case| {
        let path = folder.path().join(case.name.replace(' ', "_"));
        fs::write(&path, &case.bytes).expect("a file in the temporary folder");
        let wanted = if matches!(case.wanted, Wanted::Read) { DONE } else { REFUSED };
        let problem = inspect(&path).problem(Some(wanted)).or_else(|| wrong_code(case));
        problem.map(|problem| format!("{}: {problem}", case.name))
    });
    assert!(problems.is_empty(), "{} of {}:\n{}", problems.len(), cases.len(), problems.join("\n"));
}

/// The command line tells no codes; here the file has proven harmless.
fn wrong_code(case: &Case) -> Option<String> {
    let Wanted::Refused(wanted) = case.wanted else { return None };
    let file = NamedBytes { name: case.name, bytes: &case.bytes };
    match engine::inspect(file, &Limits::default(), &Control::new()) {
        Err(failure) if failure.code == wanted => None,
        other => Some(format!("{wanted:?} fits, not {:?}", other.map(drop))),
    }
}
