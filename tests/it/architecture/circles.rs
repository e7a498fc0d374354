//! Circles of imports between the files of the crate.
//!
//! A file that names something of another one stands above it; a name that a folder hands on counts as one of the file that it is from.
//! What a file names of the folders that it is in does not count: a folder and its files are one thing.

use std::collections::{BTreeMap, BTreeSet};

use super::code::Code;

/// A file's path from the crate's root.
type Module = Vec<String>;

/// Handing on that is followed.
const MAX_HOPS: usize = 8;

/// What a file names, from the crate's root.
struct Named {
    path: Module,
    is_handed_on: bool,
}

/// The circles, each with its files, in their order.
pub(super) fn circles(files: &[Code]) -> Vec<Vec<String>> {
    let modules: BTreeSet<&Module> = files.iter().map(|code| &code.module).collect();
    let named: BTreeMap<&Module, Vec<Named>> = files.iter().map(|code| (&code.module, names(code, &modules))).collect();
    let origin = |path: &Module| origin(path, &modules, &named);
    let mut below: BTreeMap<&Module, BTreeSet<Module>> = BTreeMap::new();
    for (module, names) in &named {
        let used = names.iter().filter(|named| !named.is_handed_on).map(|named| origin(&named.path));
        below.insert(module, used.filter(|used| !used.is_empty() && !module.starts_with(used)).collect());
    }
    let reach: BTreeMap<&Module, BTreeSet<&Module>> =
        below.keys().map(|module| (*module, reached(module, &below))).collect();
    let mut found: BTreeSet<Vec<String>> = BTreeSet::new();
    for (module, reached) in &reach {
        let both_ways = |other: &&&Module| reach.get(**other).is_some_and(|back| back.contains(*module));
        let circle: Vec<String> = reached.iter().filter(both_ways).map(|other| other.join("::")).collect();
        if circle.len() > 1 {
            found.insert(circle);
        }
    }
    found.into_iter().collect()
}

/// Everything that a file names outside its tests.
fn names(code: &Code, modules: &BTreeSet<&Module>) -> Vec<Named> {
    let own = &code.module;
    let is_inside = |module: &&&Module| module.len() == own.len() + 1 && module.starts_with(own);
    let inside = modules.iter().filter(is_inside).filter_map(|module| module.last());
    let first_words = ["crate", "self", "super"].into_iter().chain(inside.map(String::as_str));
    let mut names = Vec::new();
    for place in first_words.flat_map(|word| code.paths(word)).filter(|place| !place.in_test) {
        let segments = place.segments();
        let ups = segments.iter().take_while(|segment| *segment == "super").count();
        let above = match segments[0].as_str() {
            "crate" => 0,
            _ => own.len().saturating_sub(ups),
        };
        let skipped = if matches!(segments[0].as_str(), "crate" | "self") { 1 } else { ups };
        let path = own[..above].iter().chain(&segments[skipped..]).cloned().collect();
        names.push(Named { path, is_handed_on: place.is_handed_on });
    }
    names
}

/// The file that a name is from.
fn origin(path: &Module, modules: &BTreeSet<&Module>, named: &BTreeMap<&Module, Vec<Named>>) -> Module {
    let mut path = path.clone();
    for _ in 0..MAX_HOPS {
        let depth = (0..=path.len()).rev().find(|depth| modules.contains(&path[..*depth].to_vec())).unwrap_or(0);
        let (module, rest) = path.split_at(depth);
        let (module, rest) = (module.to_vec(), rest.to_vec());
        let handed_on = |name: &&Named| name.is_handed_on && name.path.last() == rest.first() && name.path != path;
        match named.get(&module).and_then(|names| names.iter().find(handed_on)).filter(|_| !rest.is_empty()) {
            Some(from) => path = from.path.iter().chain(&rest[1..]).cloned().collect(),
            None => return module,
        }
    }
    Module::new()
}

/// The files below a file, and those below them.
fn reached<'a>(from: &'a Module, below: &'a BTreeMap<&Module, BTreeSet<Module>>) -> BTreeSet<&'a Module> {
    let (mut open, mut found) = (vec![from], BTreeSet::new());
    while let Some(next) = open.pop() {
        open.extend(below.get(next).into_iter().flatten().filter(|module| found.insert(*module)));
    }
    found
}

#[test]
fn a_circle_is_found_through_what_a_folder_hands_on() {
    let file = |name: &str, text: &str| Code::new(text.to_owned(), std::path::Path::new(name));
    let files = [
        file("rig/mod", "mod a;\nmod b;\npub use b::{self, B};\npub(crate) use a::A;"),
        file("rig/a", "use super::B;\npub struct A;"),
        file("rig/b", "pub struct B;\nfn f() { crate::rig::A }"),
        file("rig/c", "use super::{a::A, b};\n#[cfg(test)]\nmod tests {\nuse crate::rig::d::D; }"),
        file("rig/d", "use super::c;"),
    ];
    assert_eq!(circles(&files), [["rig::a", "rig::b"]], "and neither by tests nor by what is handed on itself");
}
