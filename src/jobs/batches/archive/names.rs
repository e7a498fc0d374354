//! What the files of an archive are called: after their source, in a folder after their target where there are several, or as the item's
//! label `name` says. Every system can unpack them, and no two are the same on one that takes `A` for `a`.

use std::collections::{BTreeMap, BTreeSet};

use crate::{
    jobs::result_names::{clean, split},
    store::{AssetId, InputRole, JobInput, JobRecord},
};

/// The archive's own members.
pub(super) const MANIFEST: &str = "manifest.json";
/// The page.
pub(super) const PAGE: &str = "index.html";
/// The folder of the pictures.
const PREVIEWS: &str = "previews";
/// The label that names an item's files.
const LABEL: &str = "name";

/// The names that have been given.
pub(super) struct Names {
    has_folders: bool,
    taken: BTreeSet<String>,
    /// The last number that went with a name, so that equal names are not counted from the beginning again and again.
    numbers: BTreeMap<String, u64>,
}

impl Names {
    /// For the files of these jobs.
    pub(super) fn of<'a>(jobs: impl Iterator<Item = &'a JobRecord>) -> Self {
        let targets: BTreeSet<&AssetId> = jobs.filter_map(other_target).map(|target| &target.asset).collect();
        Self {
            has_folders: targets.len() > 1,
            taken: BTreeSet::from([MANIFEST, PAGE].map(str::to_owned)),
            numbers: BTreeMap::new(),
        }
    }

    /// A name for a file of a job that is called `file_name` by itself.
    pub(super) fn name(&mut self, job: &JobRecord, file_name: &str) -> String {
        let (_, ending) = split(file_name);
        let label = job.request.labels.get(LABEL).map(|label| clean(label)).filter(|label| !label.is_empty());
        let own = label.unwrap_or_else(|| clean(split(file_name_of(job, InputRole::Source)).0));
        let own = if own.is_empty() { job.id.to_string() } else { own };
        let folder = other_target(job).filter(|_| self.has_folders);
        let folder = folder.map(|target| clean(split(&target.file_name).0)).unwrap_or_default();
        let before = if folder.is_empty() { own } else { format!("{folder}/{own}") };
        let after = clean(ending);
        let after = if after.is_empty() { String::new() } else { format!(".{after}") };
        self.free(&before, &after)
    }

    /// A name for the picture of a file that has been given its name.
    pub(super) fn preview(&mut self, name: &str) -> String {
        self.free(&format!("{PREVIEWS}/{}", split(name).0), ".webp")
    }

    /// The two parts of a name, with a number between them where it has been given already.
    fn free(&mut self, before: &str, after: &str) -> String {
        let mut name = format!("{before}{after}");
        let number = self.numbers.entry(name.to_lowercase()).or_insert(1);
        while !self.taken.insert(name.to_lowercase()) {
            *number += 1;
            name = format!("{before}-{number}{after}");
        }
        name
    }
}

/// What a job puts its source onto, unless that is the source itself.
fn other_target(job: &JobRecord) -> Option<&JobInput> {
    let inputs = &job.request.inputs;
    let source = inputs.get(&InputRole::Source).map(|source| &source.asset);
    inputs.get(&InputRole::Target).filter(|target| Some(&target.asset) != source)
}

/// What the file of that role is called; nothing where there is none.
pub(super) fn file_name_of(job: &JobRecord, role: InputRole) -> &str {
    job.request.inputs.get(&role).map_or("", |input| &input.file_name)
}
