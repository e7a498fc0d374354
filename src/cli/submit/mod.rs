//! The `submit` subcommand: the work of `retarget`, done by a service. Files go up, the job is followed, results come back.
//!
//! What breaks on the way is taken up again: uploads are known by their bytes, the job by an idempotency key, its events by the last number,
//! downloads by how much is there. A job goes on when this command ends; `--resume` comes back for it.

mod batch;
mod body;
mod follow;
mod remote;

use std::{path::PathBuf, sync::Arc};

use serde_json::{Value, json};

use self::remote::Remote;
use super::{
    clips,
    exit::{self, Exit, FAILED, one_line, print, report, say},
    files::StagedFiles,
    manner::speaks_json,
    outputs::{WantedFormats, check_places, report_bytes},
    runtime,
    verdict::{Judged, Judging},
    watch::ProgressWatch,
};
use crate::{formats::Format, model::Control};

/// Arguments of `retargetd submit`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// URL of the service. The key is read from the environment variable RETARGETD_KEY
    #[arg(long, value_name = "URL", env = "RETARGETD_URL", default_value = "http://127.0.0.1:8080")]
    service: String,
    #[command(flatten)]
    asked: body::SubmissionArguments,
    /// Output file; the extension selects the format. May be repeated. With --batch, {name} stands for the name of each clip
    #[arg(long, value_name = "FILE", required_unless_present = "detach")]
    output: Vec<PathBuf>,
    /// Report file: an HTML page if the extension is .html, else JSON
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Print the id of the job or batch and do not wait; --resume fetches the results later
    #[arg(long, conflicts_with_all = ["resume", "report"])]
    detach: bool,
    /// Fetch the results of an earlier job or batch instead of starting one
    #[arg(long, value_name = "JOB", conflicts_with_all = body::ASKING)]
    resume: Option<String>,
    /// Show a progress bar even on a dumb terminal; other terminals always show it, pipes never
    #[arg(long)]
    progress: bool,
    #[command(flatten)]
    judging: Judging,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Exit> {
    runtime()?.block_on(submit(arguments))
}

async fn submit(arguments: &Arguments) -> Result<(), Exit> {
    let formats = WantedFormats::of(&arguments.output)?;
    check_places(&arguments.output, arguments.report.as_ref())?;
    #[expect(clippy::disallowed_methods, reason = "a key on the command line could be read by everyone on the machine")]
    let key = std::env::var("RETARGETD_KEY").ok();
    let remote = Remote::new(&arguments.service, key)?;
    let is_batch =
        arguments.asked.batch.is_some() || arguments.resume.as_ref().is_some_and(|id| id.starts_with(batch::PREFIX));
    if is_batch {
        clips::check_names(arguments.output.iter().chain(&arguments.report))?;
    }
    let id = match &arguments.resume {
        Some(id) => id.clone(),
        None => unless_interrupted(arguments.asked.submit(&remote, &formats.distinct), None).await?,
    };
    if arguments.detach {
        let member = if is_batch { "batch" } else { "job" };
        return if speaks_json() { report(|| json!({ member: id })) } else { print(&format!("{id}\n")) };
    }
    if is_batch {
        return unless_interrupted(batch::collect(arguments, &remote, &id, &formats), Some(&id)).await;
    }
    unless_interrupted(collect(arguments, &remote, &id, &formats), Some(&id)).await
}

/// The work, or at the first Ctrl-C the way to come back to it.
async fn unless_interrupted<T>(work: impl Future<Output = Result<T, Exit>>, job: Option<&str>) -> Result<T, Exit> {
    let hint = job.map_or_else(String::new, |id| format!("the job goes on; come back for it with --resume {id}"));
    tokio::select! {
        done = work => done,
        _ = tokio::signal::ctrl_c() => Err(Exit::new(FAILED, "interrupted", hint)),
    }
}

async fn collect(arguments: &Arguments, remote: &Remote, id: &str, formats: &WantedFormats) -> Result<(), Exit> {
    let come_back = |exit: Exit| match exit.code == FAILED && exit.hint.is_empty() {
        true => Exit { hint: format!("come back for the job with --resume {id}"), ..exit },
        false => exit,
    };
    let control = Arc::new(Control::new());
    let watch = ProgressWatch::start(&control, arguments.progress);
    let job = follow::to_its_end(remote, id, &control).await.map_err(come_back);
    drop(watch);
    let job = job?;
    if job["state"] != "succeeded" {
        return Err(ended_otherwise(id, &job));
    }
    let mut staged = StagedFiles::default();
    for (path, format) in arguments.output.iter().zip(&formats.of_each) {
        let bytes = remote.download(result_of(&job, *format)?).await.map_err(come_back)?;
        staged.add(path, &bytes)?;
    }
    if let Some(path) = &arguments.report {
        let report = remote.get(&format!("/v1/jobs/{id}/report")).await.map_err(come_back)?;
        staged.add(path, &report_bytes(&report, path, &crate::report::Illustration::default())?)?;
    }
    staged.commit()?;
    tell_warnings(remote, &job, "").await?;
    let judged = Judged::of_job(&job);
    if let Some(judged) = &judged {
        judged.tell("");
    }
    let names: Vec<String> = arguments.output.iter().map(|path| path.display().to_string()).collect();
    say(format_args!("wrote {}: job {id}, {}", names.join(", "), warnings_of(&job)));
    report(|| {
        json!({"job": id, "outputs": arguments.output, "report": arguments.report, "verdict": job["verdict"],
        "verdict_reason": job["verdict_reason"], "coverage": job["coverage"], "warnings_count": job["warnings_count"]})
    })?;
    arguments.judging.check([("the result", judged.as_ref())])
}

/// How many warnings a job has, in words.
fn warnings_of(job: &Value) -> String {
    match job["warnings_count"].as_u64().unwrap_or(0) {
        1 => "1 warning".to_owned(),
        count => format!("{count} warnings"),
    }
}

/// Says what the report of a job warns of.
async fn tell_warnings(remote: &Remote, job: &Value, of: &str) -> Result<(), Exit> {
    if job["warnings_count"].as_u64().unwrap_or(0) == 0 {
        return Ok(());
    }
    let report = remote.get(&format!("/v1/jobs/{}/report", job["id"].as_str().unwrap_or_default())).await?;
    for warning in report["warnings"].as_array().into_iter().flatten() {
        let text = |member: &str| warning[member].as_str().unwrap_or_default();
        let place = if text("place").is_empty() { String::new() } else { format!("{}: ", text("place")) };
        let hint = if text("hint").is_empty() { String::new() } else { format!(" ({})", text("hint")) };
        let told = one_line(&format!("{}: {place}{}{hint}", text("code"), text("detail")));
        say(format_args!("warning{of}: {told}"));
    }
    Ok(())
}

/// The result of that format. One that the job was not asked for is not there.
fn result_of(job: &Value, format: Format) -> Result<&Value, Exit> {
    let results = job["results"].as_array().map_or(&[][..], Vec::as_slice);
    let name = format.info().name;
    results.iter().find(|result| result["format"] == name).ok_or_else(|| {
        let there: Vec<&str> = results.iter().filter_map(|result| result["format"].as_str()).collect();
        let message = format!("job {} has no result of the format {name}", job["id"].as_str().unwrap_or_default());
        Exit::new(exit::BAD_USAGE, message, format!("its results are {}", there.join(", ")))
    })
}

fn ended_otherwise(id: &str, job: &Value) -> Exit {
    let state = job["state"].as_str().unwrap_or_default();
    match job.get("problem") {
        Some(problem) => remote::exit_of(problem, &format!("job {id} {state}")),
        None => Exit::new(FAILED, format!("job {id} was {state}"), ""),
    }
}
