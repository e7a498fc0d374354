//! What a mesh has that is not handed on, collected for a warning each.

use std::collections::{BTreeMap, BTreeSet};

use crate::model::Reporter;

/// How many names a warning has.
const MAX_NAMES: usize = 6;

#[derive(Default)]
pub(super) struct Lost {
    hidden: BTreeSet<String>,
    broken: BTreeSet<String>,
    /// What was simplified, and the names of those that have it.
    simplified: BTreeMap<&'static str, BTreeSet<String>>,
}

impl Lost {
    pub(super) fn hidden(&mut self, name: &str) {
        self.hidden.insert(name.to_owned());
    }

    pub(super) fn broken(&mut self, name: &str) {
        self.broken.insert(name.to_owned());
    }

    pub(super) fn note(&mut self, what: &'static str, name: &str) {
        self.simplified.entry(what).or_default().insert(name.to_owned());
    }

    /// Adds what another has noted.
    pub(super) fn join(&mut self, other: Self) {
        self.hidden.extend(other.hidden);
        self.broken.extend(other.broken);
        for (what, of) in other.simplified {
            self.simplified.entry(what).or_default().extend(of);
        }
    }

    pub(super) fn report(&self, reporter: &mut Reporter) {
        if !self.hidden.is_empty() {
            reporter.warn(
                "fbx_meshes_hidden",
                "Objects",
                format!("the file hides these meshes, so they are not in the output: {}", names(&self.hidden)),
                "show them before exporting where they are wanted",
            );
        }
        if !self.broken.is_empty() {
            reporter.warn(
                "fbx_meshes_empty",
                "Objects",
                format!(
                    "these meshes have no triangle, or vertices that are nowhere, so they are not in the output: {}",
                    names(&self.broken)
                ),
                "export the file again if they are missed",
            );
        }
        for (what, of) in &self.simplified {
            reporter.warn(
                "fbx_mesh_simplified",
                "Objects",
                format!("not in the output: {what}, of {}", names(of)),
                "ask for fbx where that matters",
            );
        }
    }
}

fn names(names: &BTreeSet<String>) -> String {
    let first: Vec<&str> = names.iter().take(MAX_NAMES).map(String::as_str).collect();
    let more = names.len() - first.len();
    let others = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{}{others}", first.join(", "))
}
