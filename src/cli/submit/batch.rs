//! Many clips at once: a folder of them, or a list, as one batch. Every clip has results of its own, called after it.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use serde_json::{Value, json};
use tokio::time::sleep;

use super::{
    Arguments,
    remote::{Remote, digest_of, exit_of},
    result_of, tell_verdict,
};
use crate::{
    cli::{
        exit::{BAD_USAGE, Exit, FAILED, INPUT_REFUSED, one_line, say},
        files::{InputFile, StagedFiles},
        outputs::{WantedFormats, report_bytes},
        watch::ProgressWatch,
    },
    formats::{Format, Limits},
    model::Control,
};

/// What ids of batches begin with.
pub(super) const PREFIX: &str = "bat_";
/// What stands for the name of a clip in the names of its results.
const NAME: &str = "{name}";
/// How often to look how far a batch is.
const LOOK_AGAIN: Duration = Duration::from_millis(500);

/// Clips by the names that their results have.
struct Clip {
    name: String,
    path: PathBuf,
}

/// The clips of a folder, by name, or of a list: a text with one path on each line, from the folder of the list.
fn clips(place: &Path) -> Result<Vec<Clip>, Exit> {
    let shown = place.display();
    let failed =
        |error: std::io::Error| Exit::new(INPUT_REFUSED, format!("batch {shown}: it cannot be read: {error}"), "");
    let is_folder = place.is_dir();
    let mut paths = Vec::new();
    if is_folder {
        for entry in fs::read_dir(place).map_err(failed)? {
            let path = entry.map_err(failed)?.path();
            let is_hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
            if !is_hidden && path.is_file() {
                paths.push(path);
            }
        }
        paths.sort();
    } else {
        let folder = place.parent().unwrap_or(Path::new(""));
        let text = fs::read_to_string(place).map_err(failed)?;
        let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
        paths.extend(lines.map(|line| folder.join(line)));
    }
    let mut taken = BTreeSet::new();
    let mut clips = Vec::new();
    for path in paths {
        let file_name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        if is_folder && Format::from_file_name(&file_name).is_none() {
            say(format_args!("left out {}: the ending stands for no format", one_line(&path.display().to_string())));
            continue;
        }
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        // Two that differ in their ending or their folder only keep what tells them apart.
        let whole = path.strip_prefix(place).unwrap_or(&path).to_string_lossy().into_owned();
        let name =
            [stem, file_name, whole].into_iter().map(|name| clean(&name)).find(|name| taken.insert(name.clone()));
        let Some(name) = name else {
            let message = format!("batch {shown}: {} is named twice", path.display());
            return Err(Exit::new(BAD_USAGE, message, "name every clip once"));
        };
        clips.push(Clip { name, path });
    }
    if clips.is_empty() {
        return Err(Exit::new(INPUT_REFUSED, format!("batch {shown}: there are no clips in it"), ""));
    }
    Ok(clips)
}

/// A name that stays in its folder.
fn clean(name: &str) -> String {
    let name: String = name
        .chars()
        .map(|letter| if matches!(letter, '/' | '\\') || letter.is_control() { '_' } else { letter })
        .collect();
    name.trim_start_matches('.').to_owned()
}

/// Uploads the clips and asks for the batch, each item over `defaults`; gives its id. A clip that is refused is told and left out.
pub(super) async fn submit(remote: &Remote, place: &Path, defaults: &Value) -> Result<String, Exit> {
    let clips = clips(place)?;
    let mut items = Vec::with_capacity(clips.len());
    for Clip { name, path } in &clips {
        let file = InputFile::read("source", path, &Limits::default())?;
        match remote.upload("source", &file).await {
            Ok(asset) => items.push(json!({"source": {"asset": asset}, "labels": {"name": name}})),
            Err(exit) if exit.code == INPUT_REFUSED => say(format_args!("left out {}", one_line(&exit.message))),
            Err(exit) => return Err(exit),
        }
    }
    if items.is_empty() {
        return Err(Exit::new(INPUT_REFUSED, format!("batch {}: no clip in it can be used", place.display()), ""));
    }
    remote.ask("/v1/batches", &json!({"defaults": defaults, "items": items})).await
}

/// Refuses outputs that all clips would write to.
pub(super) fn check_names(arguments: &Arguments) -> Result<(), Exit> {
    let mut outputs = arguments.output.iter().chain(&arguments.report);
    match outputs.find(|path| path.file_name().is_none_or(|name| !name.to_string_lossy().contains(NAME))) {
        None => Ok(()),
        Some(path) => {
            let message = format!("output {}: every clip of the batch would be written to it", path.display());
            Err(Exit::new(
                BAD_USAGE,
                message,
                format!("put {NAME} where the name of the clip belongs, as in out/{NAME}.glb"),
            ))
        }
    }
}

/// Follows a batch until it has ended, and takes what each clip gave. Results that are there already are left as they are.
pub(super) async fn collect(
    arguments: &Arguments,
    remote: &Remote,
    id: &str,
    formats: &WantedFormats,
) -> Result<(), Exit> {
    let control = Arc::new(Control::new());
    let watch = ProgressWatch::start(&control, arguments.progress);
    let path = format!("/v1/batches/{id}");
    loop {
        let batch = remote.get(&path).await?;
        let count = |name: &str| batch["progress"][name].as_u64().unwrap_or(0);
        control.repeat("retarget", count("done"), count("total"));
        if matches!(batch["state"].as_str(), Some("succeeded" | "failed" | "canceled")) {
            break;
        }
        sleep(LOOK_AGAIN).await;
    }
    drop(watch);
    let (mut good, mut failed) = (0, Vec::new());
    let mut cursor = String::new();
    loop {
        let page = remote.get(&format!("{path}/jobs?limit=100{cursor}")).await?;
        for job in page["items"].as_array().into_iter().flatten() {
            match take(arguments, remote, job, formats).await {
                Ok(()) => {
                    good += 1;
                    if job["verdict"] != "pass" {
                        tell_verdict(job, &format!(" of {}", name_of(job)));
                    }
                }
                Err(exit) => {
                    say(format_args!("failed: {}", one_line(&exit.message)));
                    failed.push(exit.code);
                }
            }
        }
        let Some(next) = page["next_cursor"].as_str() else { break };
        cursor = format!("&cursor={next}");
    }
    say(format_args!("wrote the results of {good} of {} clips: batch {id}", good + failed.len()));
    if failed.is_empty() {
        return Ok(());
    }
    let code = if failed.iter().all(|code| *code == INPUT_REFUSED) { INPUT_REFUSED } else { FAILED };
    let message = format!("{} clips of batch {id} have no results", failed.len());
    Err(Exit::new(
        code,
        message,
        format!("POST {path}/retry-failed asks for them again, --resume {id} comes back for them"),
    ))
}

/// What a clip's results are called after.
fn name_of(job: &Value) -> String {
    let named = job["labels"]["name"].as_str().map(clean).filter(|name| !name.is_empty());
    named.unwrap_or_else(|| job["id"].as_str().unwrap_or_default().to_owned())
}

/// Puts the results of one clip in their places, all or none.
async fn take(arguments: &Arguments, remote: &Remote, job: &Value, formats: &WantedFormats) -> Result<(), Exit> {
    let (id, name) = (job["id"].as_str().unwrap_or_default(), name_of(job));
    if job["state"] != "succeeded" {
        let state = job["state"].as_str().unwrap_or_default();
        return Err(match job.get("problem") {
            Some(problem) => exit_of(problem, &name),
            None => Exit::new(FAILED, format!("{name}: job {id} was {state}"), ""),
        });
    }
    let mut staged = StagedFiles::default();
    for (pattern, format) in arguments.output.iter().zip(&formats.of_each) {
        let (path, result) = (named(pattern, &name), result_of(job, *format)?);
        let is_there = fs::read(&path).is_ok_and(|bytes| result["sha256"] == digest_of(&bytes).as_str());
        if !is_there {
            staged.add(&path, &remote.download(result).await?)?;
        }
    }
    if let Some(pattern) = &arguments.report {
        let path = named(pattern, &name);
        let report = remote.get(&format!("/v1/jobs/{id}/report")).await?;
        staged.add(&path, &report_bytes(&report, &path, &crate::report::Illustration::default())?)?;
    }
    staged.commit()
}

fn named(pattern: &Path, name: &str) -> PathBuf {
    let file_name = pattern.file_name().map(|file_name| file_name.to_string_lossy().replace(NAME, name));
    pattern.with_file_name(file_name.unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clips_of_a_folder_and_of_a_list_have_names_of_their_own() {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["walk.bvh", "run.glb", "walk.fbx", ".hidden.glb", "notes.txt"] {
            fs::write(folder.path().join(name), "").expect("a file");
        }
        let names = |place: &Path| {
            let clips = clips(place)?;
            Ok::<_, Exit>(clips.into_iter().map(|clip| clip.name).collect::<Vec<_>>())
        };
        assert_eq!(
            names(folder.path()).expect("clips"),
            ["run", "walk", "walk.fbx"],
            "in order, and what is not a clip is left"
        );
        let list = folder.path().join("list.txt");
        fs::write(&list, "# two\nrun.glb\n\nother/run.glb\n").expect("a list");
        assert_eq!(names(&list).expect("clips"), ["run", "run.glb"], "as the list says");
        fs::write(&list, "#\n").expect("a list");
        assert_eq!(names(&list).expect_err("nothing").code, INPUT_REFUSED, "an empty list");
        assert_eq!(named(Path::new("out/{name}.glb"), "walk"), Path::new("out/walk.glb"), "called after the clip");
        assert_eq!(clean("../../etc"), "_.._etc", "and in its folder");
    }
}
