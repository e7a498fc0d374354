//! The `demo` subcommand: the main job over HTTP, on a service that starts with an empty folder.

use std::{
    fs,
    path::{Path, PathBuf},
    process::ExitCode,
    time::{Duration, Instant},
};

use anyhow::{Context as _, ensure};
use reqwest::{Client, Response};
use serde_json::{Value, json};

use crate::{app, config::Settings, samples};

use super::{
    exit::{self, print},
    manner::{is_quiet, speaks_json},
    verdict::percent,
};

/// The longest that the job may take; it takes less than a second.
const MAX_WAIT: Duration = Duration::from_secs(60);

/// Arguments of `retargetd demo`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Folder of the results [default: a new temporary folder]
    #[arg(long, value_name = "DIR")]
    output: Option<PathBuf>,
}

pub(super) fn run(arguments: Arguments) -> ExitCode {
    let runtime = match tokio::runtime::Builder::new_multi_thread().enable_all().build() {
        Ok(runtime) => runtime,
        Err(error) => return exit::refuse(exit::FAILED, &error),
    };
    match runtime.block_on(demo(arguments)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => exit::refuse(exit::FAILED, &format!("{error:#}")),
    }
}

async fn demo(arguments: Arguments) -> anyhow::Result<()> {
    let data = TemporaryFolder::new("data")?;
    let output = match arguments.output {
        Some(folder) => {
            fs::create_dir_all(&folder).with_context(|| format!("the folder {} cannot be made", folder.display()))?;
            folder
        }
        None => TemporaryFolder::new("output")?.keep(),
    };
    let settings = Settings::read(|setting| match setting.name {
        "listen" => Some("127.0.0.1:0".to_owned()),
        "data" => Some(data.path.to_string_lossy().into_owned()),
        "drain_delay" => Some("0s".to_owned()),
        _ => None,
    })?;
    let running = app::start(settings).await?;
    let url = running.url();
    tell(&format!("A service runs on {url}, with an empty data folder."))?;
    let told = main_job(&url, &output).await;
    let stopped = running.stop().await;
    told?;
    stopped
}

/// What a user of the service would do, step by step.
async fn main_job(url: &str, output: &Path) -> anyhow::Result<()> {
    let client = Client::builder().timeout(MAX_WAIT).build()?;
    let begin = Instant::now();
    let source = upload(&client, url, "walk.glb", samples::walk_clip()).await?;
    tell("Uploaded the source: a man of 1.80 m with Mixamo's joint names, in a T pose, walking for four seconds.")?;
    let target = upload(&client, url, "mannequin.glb", samples::mannequin()).await?;
    tell("Uploaded the target: a mannequin of 1.65 m with Unreal 5 joint names and bone axes, in an A pose.")?;

    let body = json!({
        "source": {"asset": source}, "target": {"asset": target}, "output": ["glb", "poses_npz"],
    });
    let request = client.post(format!("{url}/v1/jobs")).json(&body).header("prefer", "wait=20");
    let mut job = json_of(request.send().await?).await?;
    while !has_ended(&job) {
        ensure!(begin.elapsed() < MAX_WAIT, "the job has not ended after {} seconds", MAX_WAIT.as_secs());
        tokio::time::sleep(Duration::from_millis(100)).await;
        job = json_of(client.get(format!("{url}{}", text(&job, "/links/self")?)).send().await?).await?;
    }
    ensure!(job["state"] == "succeeded", "the job ended as {}: {}", job["state"], job["problem"]);
    tell("Asked for a retarget without any config: rigs, mapping and rest poses were found out.")?;

    let mut files = Vec::new();
    for result in job["results"].as_array().context("a job has a list of results")? {
        let bytes = bytes_of(client.get(format!("{url}{}", text(result, "/content")?)).send().await?).await?;
        let name = text(result, "/file_name")?;
        files.push(save(output, name, &bytes)?);
        if result["format"] == "glb" {
            let picture = format!("{url}/v1/results/{}/preview.png", text(result, "/id")?);
            let picture = bytes_of(client.get(picture).send().await?).await?;
            let name = Path::new(name).with_extension("png");
            files.push(save(output, &name.to_string_lossy(), &picture)?);
        }
    }
    let report = json_of(client.get(format!("{url}{}", text(&job, "/links/report")?)).send().await?).await?;
    files.push(save(output, "report.json", &serde_json::to_vec_pretty(&report)?)?);
    tell_result(&report, &files, begin.elapsed())
}

fn tell_result(report: &Value, files: &[PathBuf], took: Duration) -> anyhow::Result<()> {
    let counts = &report["counts"];
    tell(&format!(
        "Got {} frames; {} of the target's {} joints are driven. All of it took {:.1} s.",
        counts["frames"],
        counts["driven_joints"],
        counts["target_joints"],
        took.as_secs_f64()
    ))?;
    if let Some(limbs) = report["measures"]["limb_directions"].as_object() {
        let worst = limbs.iter().filter_map(|(limb, error)| Some((limb, error["max_degrees"].as_f64()?)));
        if let Some((limb, degrees)) = worst.max_by(|one, other| one.1.total_cmp(&other.1)) {
            tell(&format!(
                "Measured how far the target's limbs point elsewhere than the source's: at most {degrees:.1} degrees ({}).",
                limb.replace('_', " ")
            ))?;
        }
    }
    let measures = &report["measures"];
    if let (Some(verdict), Some(reason)) = (measures["verdict"].as_str(), measures["verdict_reason"].as_str()) {
        let coverage =
            measures["coverage"].as_f64().map_or_else(String::new, |share| format!("; coverage {}", percent(share)));
        tell(&format!("Verdict: {verdict}: {reason}{coverage}."))?;
    }
    let warnings = report["warnings"].as_array().map_or(0, Vec::len);
    tell(&format!("Warnings: {warnings}. Every measure is in the report. The files:"))?;
    for file in files {
        tell(&format!("  {}", file.display()))?;
    }
    exit::report(|| json!({"files": files, "verdict": measures["verdict"], "verdict_reason": measures["verdict_reason"], "coverage": measures["coverage"]}))
        .map_err(|exit| anyhow::anyhow!(exit.message))?;
    tell(
        "The .png shows a frame of it. To see it move: retargetd preview FILE.glb --output FILE.gif, or open the .glb in any glTF viewer.",
    )
}

async fn upload(client: &Client, url: &str, name: &str, bytes: Vec<u8>) -> anyhow::Result<String> {
    let request = client.post(format!("{url}/v1/assets?filename={name}")).body(bytes);
    let asset = json_of(request.header("content-type", "application/octet-stream").send().await?).await?;
    Ok(text(&asset, "/id")?.to_owned())
}

async fn json_of(response: Response) -> anyhow::Result<Value> {
    Ok(serde_json::from_slice(&bytes_of(response).await?)?)
}

/// The body, or the service's own words about what is wrong.
async fn bytes_of(response: Response) -> anyhow::Result<Vec<u8>> {
    let (status, url) = (response.status(), response.url().clone());
    let bytes = response.bytes().await?;
    ensure!(status.is_success(), "{url} answered {status}: {}", String::from_utf8_lossy(&bytes));
    Ok(bytes.to_vec())
}

fn has_ended(job: &Value) -> bool {
    matches!(job["state"].as_str(), Some("succeeded" | "failed" | "canceled"))
}

fn text<'a>(value: &'a Value, pointer: &str) -> anyhow::Result<&'a str> {
    value.pointer(pointer).and_then(Value::as_str).with_context(|| format!("the answer has no {pointer}: {value}"))
}

fn save(folder: &Path, name: &str, bytes: &[u8]) -> anyhow::Result<PathBuf> {
    let path = folder.join(Path::new(name).file_name().context("a result has a file name")?);
    fs::write(&path, bytes).with_context(|| format!("{} cannot be written", path.display()))?;
    Ok(path)
}

fn tell(line: &str) -> anyhow::Result<()> {
    if is_quiet() || speaks_json() {
        return Ok(());
    }
    print(&format!("{line}\n")).map_err(|exit| anyhow::anyhow!(exit.message))
}

/// A folder that goes when it is dropped.
struct TemporaryFolder {
    path: PathBuf,
    is_kept: bool,
}

impl TemporaryFolder {
    fn new(purpose: &str) -> anyhow::Result<Self> {
        const MAX_TRIES: u32 = 100;
        let parent = std::env::temp_dir();
        for attempt in 0..MAX_TRIES {
            let path = parent.join(format!("retargetd-demo-{purpose}-{}-{attempt}", std::process::id()));
            match fs::create_dir(&path) {
                Ok(()) => return Ok(Self { path, is_kept: false }),
                Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error).with_context(|| format!("{} cannot be made", path.display())),
            }
        }
        anyhow::bail!("{} holds {MAX_TRIES} folders of this demo already; remove some", parent.display())
    }

    fn keep(mut self) -> PathBuf {
        self.is_kept = true;
        self.path.clone()
    }
}

impl Drop for TemporaryFolder {
    fn drop(&mut self) {
        if !self.is_kept {
            // What stays behind is the system's to sweep.
            let _ = fs::remove_dir_all(&self.path);
        }
    }
}
