//! Many clips at once: a folder of them, or a list, as one batch. Every clip has results of its own, called after it.

use std::{fs, path::Path, sync::Arc, time::Duration};

use serde_json::{Value, json};
use tokio::time::sleep;

use super::{
    Arguments,
    remote::{Remote, digest_of, exit_of},
    result_of, tell_warnings,
};
use crate::{
    cli::{
        clips::{Clip, clean, clips, named},
        exit::{Exit, FAILED, INPUT_REFUSED, one_line, say},
        files::{InputFile, StagedFiles},
        outputs::{WantedFormats, report_bytes},
        rows::{self, Ended, Row},
        verdict::Judged,
        watch::ProgressWatch,
    },
    formats::Limits,
    model::Control,
};

/// What ids of batches begin with.
pub(super) const PREFIX: &str = "bat_";
/// How often to look how far a batch is.
const LOOK_AGAIN: Duration = Duration::from_millis(500);

/// Uploads the clips and asks for the batch, each item over `defaults`; gives its id. A clip that is refused is told and left out.
pub(super) async fn submit(remote: &Remote, place: &Path, defaults: &Value) -> Result<String, Exit> {
    let clips = clips(place)?;
    let mut items = Vec::with_capacity(clips.len());
    for Clip { name, path } in &clips {
        let file = InputFile::read("source", path, &Limits::default())?;
        match remote.upload("source", &file).await {
            Ok(asset) => items.push(json!({"source": {"asset": asset}, "labels": {"name": name}})),
            Err(exit) if exit.code == INPUT_REFUSED => {
                say(format_args!("warning: left out {}", one_line(&exit.message)));
            }
            Err(exit) => return Err(exit),
        }
    }
    if items.is_empty() {
        return Err(Exit::new(INPUT_REFUSED, format!("batch {}: no clip in it can be used", place.display()), ""));
    }
    remote.ask("/v1/batches", &json!({"defaults": defaults, "items": items})).await
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
    let rows = take_all(arguments, remote, &path, formats).await?;
    rows::tell(&rows)?;
    let hint = format!("POST {path}/retry-failed asks for them again, --resume {id} comes back for them");
    rows::end(&rows, arguments.judging, &hint)
}

/// Takes what each clip gave, and says what is wrong with it.
async fn take_all(
    arguments: &Arguments,
    remote: &Remote,
    path: &str,
    formats: &WantedFormats,
) -> Result<Vec<Row>, Exit> {
    let (mut rows, mut cursor) = (Vec::new(), String::new());
    loop {
        let page = remote.get(&format!("{path}/jobs?limit=100{cursor}")).await?;
        for job in page["items"].as_array().into_iter().flatten() {
            let name = name_of(job);
            let mut taken = take(arguments, remote, job, formats).await;
            if taken.is_ok() {
                taken = tell_warnings(remote, job, &format!(" of {name}")).await;
            }
            let ended = taken
                .map(|()| Ended { judged: Judged::of_job(job), warnings: job["warnings_count"].as_u64().unwrap_or(0) });
            rows.push(Row { name, ended });
        }
        let Some(next) = page["next_cursor"].as_str() else { return Ok(rows) };
        cursor = format!("&cursor={next}");
    }
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
            Some(problem) => exit_of(problem, ""),
            None => Exit::new(FAILED, format!("job {id} was {state}"), ""),
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
