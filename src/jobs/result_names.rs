//! What results are called: after what went in, `walk_on_hero.glb`, and no two of a batch the same.

use std::collections::BTreeMap;

use crate::store::{InputRole, JobRequest, JobTask};

/// Letters of one part of a name.
const MAX_LETTERS: usize = 100;
/// The label that names what an item of a batch gives.
const LABEL: &str = "name";

/// The name of a result of a job; `given` is what the engine calls it, which has the ending. `taken` has the names of the job's other results.
pub(super) fn name_of(request: &JobRequest, given: &str, taken: &mut Vec<String>) -> String {
    let (own, ending) = split(given);
    let after = if ending.is_empty() { String::new() } else { format!(".{ending}") };
    let before = request.result_name.clone().or_else(|| stem(request)).unwrap_or_else(|| own.to_owned());
    let mut name = format!("{before}{after}");
    let mut number = 1;
    while taken.contains(&name) {
        number += 1;
        name = format!("{before}-{number}{after}");
    }
    taken.push(name.clone());
    name
}

/// Gives requests that are made together names that differ, in their order.
pub(super) fn tell_apart<'r>(requests: impl Iterator<Item = &'r mut JobRequest>) {
    let mut numbers: BTreeMap<String, u64> = BTreeMap::new();
    for request in requests {
        let label = request.labels.get(LABEL).map(|label| clean(label)).filter(|label| !label.is_empty());
        let Some(name) = label.or_else(|| stem(request)) else { continue };
        // `Walk` and `walk` are the same file on many disks.
        let number = numbers.entry(name.to_lowercase()).or_insert(0);
        *number += 1;
        request.result_name = Some(if *number == 1 { name } else { format!("{name}-{number}") });
    }
}

/// The name without an ending; nothing where nothing that went in has one.
fn stem(request: &JobRequest) -> Option<String> {
    let input = |role| request.inputs.get(&role);
    let name = |role| input(role).map(|input| clean(split(&input.file_name).0)).filter(|name| !name.is_empty());
    let (source, target) = (name(InputRole::Source), name(InputRole::Target));
    let same =
        |one: InputRole, other: InputRole| input(one).map(|one| &one.sha256) == input(other).map(|other| &other.sha256);
    match (&request.task, source, target) {
        (JobTask::Pose { to }, source, Some(target)) => Some(match (to.as_deref(), source) {
            (Some(pose @ ("t" | "a")), _) => format!("{target}_{pose}_pose"),
            (Some("rest"), _) => format!("{target}_rest_pose"),
            (_, Some(source)) => format!("{target}_posed_as_{source}"),
            (_, None) => format!("{target}_posed"),
        }),
        (JobTask::Edit, Some(source), _) => Some(format!("{source}_edited")),
        (_, Some(source), Some(target)) if !same(InputRole::Source, InputRole::Target) => {
            Some(format!("{source}_on_{target}"))
        }
        (_, Some(name), _) | (_, None, Some(name)) => Some(name),
        (_, None, None) => None,
    }
}

/// The name without its ending, and the ending.
pub(super) fn split(file_name: &str) -> (&str, &str) {
    match file_name.rsplit_once('.') {
        Some((before, ending)) if !before.is_empty() => (before, ending),
        _ => (file_name, ""),
    }
}

/// One part of a path: without what leads out of a folder, what some system refuses, and what nobody sees.
pub(super) fn clean(text: &str) -> String {
    let keep = |letter: char| match letter {
        '/' | '\\' | ':' | '*' | '?' | '"' | '<' | '>' | '|' => '_',
        letter if letter.is_control() => '_',
        letter => letter,
    };
    let text: String = text.chars().map(keep).take(MAX_LETTERS).collect();
    let text = text.trim_matches(|letter: char| letter == '.' || letter.is_whitespace());
    let is_device = ["con", "prn", "aux", "nul"].contains(&text.to_lowercase().as_str())
        || (text.len() == 4 && ["com", "lpt"].iter().any(|name| text.to_lowercase().starts_with(name)));
    if is_device { format!("_{text}") } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::{AssetId, JobInput};

    fn request(task: JobTask, files: &[(InputRole, &str)]) -> JobRequest {
        let input = |(role, name): &(InputRole, &str)| {
            let input = JobInput { asset: AssetId::new(), sha256: (*name).to_owned(), file_name: (*name).to_owned() };
            (*role, input)
        };
        let inputs = files.iter().map(input).collect();
        JobRequest { task, inputs, ..JobRequest::default() }
    }

    #[test]
    fn results_are_called_after_what_went_in() {
        let both = [(InputRole::Source, "walk.bvh"), (InputRole::Target, "hero.glb")];
        let cases = [
            (JobTask::Retarget, &both[..], "walk_on_hero.glb"),
            (JobTask::Edit, &both[..1], "walk_edited.glb"),
            (JobTask::Pose { to: Some("t".to_owned()) }, &both[1..], "hero_t_pose.glb"),
            (JobTask::Pose { to: Some("source".to_owned()) }, &both[..], "hero_posed_as_walk.glb"),
            (JobTask::Retarget, &[(InputRole::Source, ""), (InputRole::Target, "")], "mixamo.com.glb"),
        ];
        for (task, files, expected) in cases {
            let request = request(task, files);
            assert_eq!(name_of(&request, "mixamo.com.glb", &mut Vec::new()), expected, "{request:?}");
        }
        let mut taken = Vec::new();
        let names = ["a.png", "b.png"].map(|given| name_of(&request(JobTask::Retarget, &both), given, &mut taken));
        assert_eq!(names, ["walk_on_hero.png", "walk_on_hero-2.png"], "two of one ending");
    }

    #[test]
    fn no_two_of_a_batch_are_the_same() {
        let both = [(InputRole::Source, "walk.bvh"), (InputRole::Target, "hero.glb")];
        let mut requests: Vec<JobRequest> = (0..3).map(|_| request(JobTask::Retarget, &both)).collect();
        requests[1].labels.insert("name".to_owned(), "monday".to_owned());
        tell_apart(requests.iter_mut());
        let names: Vec<_> = requests.iter().map(|request| request.result_name.as_deref().unwrap_or_default()).collect();
        assert_eq!(names, ["walk_on_hero", "monday", "walk_on_hero-2"], "in their order, and as labels say");
    }

    #[test]
    fn a_part_of_a_path_stays_in_its_folder_and_is_good_everywhere() {
        let cases = [
            ("walk", "walk"),
            ("../../etc/passwd", "_.._etc_passwd"),
            ("C:\\walk", "C__walk"),
            (" .hidden. ", "hidden"),
            ("a\nb\0c", "a_b_c"),
            ("CON", "_CON"),
            ("com1", "_com1"),
            ("command", "command"),
            ("läuft 走", "läuft 走"),
            ("..", ""),
        ];
        for (text, expected) in cases {
            assert_eq!(clean(text), expected, "{text:?}");
        }
        assert_eq!(clean(&"ä".repeat(300)).chars().count(), MAX_LETTERS, "not too long");
        assert_eq!((split("a.b.glb"), split(".glb"), split("a")), (("a.b", "glb"), (".glb", ""), ("a", "")), "endings");
    }
}
