//! Engine processes: what brings one down ends its own job, and nothing else.

use std::{
    io::Read,
    path::Path,
    process::{Command, Stdio},
    time::{Duration, Instant},
};

use reqwest::Client;
use retargetd::{
    engine::{Control, Format, Inputs, Limits, NamedBytes, retarget},
    samples,
};
use serde_json::{Value, json};

use super::support::{PATIENCE, ServiceProcess, json as read, problem, taken};
use crate::{service_process::signal, support::sha256_of};

/// A service whose engine goes wild on files whose names say so.
fn wild_service(data: &Path, flags: &[&str]) -> ServiceProcess {
    ServiceProcess::listening(
        Command::new(env!("CARGO_BIN_EXE_retargetd"))
            .args(["serve", "--listen", "127.0.0.1:0", "--log", "off", "--isolation", "process", "--data"])
            .arg(data)
            .args(flags)
            .env("RETARGETD_FAILPOINT", "engine"),
    )
}

struct Studio {
    client: Client,
    url: String,
}

impl Studio {
    fn at(service: &ServiceProcess) -> Self {
        let client = Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client");
        Self { client, url: service.url.clone() }
    }

    async fn upload(&self, name: &str) -> String {
        // Each with bytes of its own, so that each is an asset of its own.
        let mut bytes = samples::walk_clip();
        let length = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes")) as usize;
        let text = String::from_utf8(bytes[20..20 + length].to_vec()).expect("JSON");
        let mut document: Value = serde_json::from_str(&text).expect("JSON");
        document["asset"]["copyright"] = json!(name);
        let mut text = document.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let rest = bytes.split_off(20 + length);
        bytes.truncate(12);
        bytes.extend((text.len() as u32).to_le_bytes());
        bytes.extend(b"JSON");
        bytes.extend(text);
        bytes.extend(rest);
        let total = bytes.len() as u32;
        bytes[8..12].copy_from_slice(&total.to_le_bytes());
        let request = self.client.post(format!("{}/v1/assets?filename={name}", self.url)).body(bytes);
        taken(request.send().await.expect("an answer")).await
    }

    async fn job(&self, asset: &str) -> String {
        let body = json!({"source": {"asset": asset}, "config": {"task": "edit"}, "output": ["bvh"]});
        let request = self.client.post(format!("{}/v1/jobs", self.url)).json(&body);
        taken(request.send().await.expect("an answer")).await
    }

    async fn end(&self, job: &str) -> Value {
        loop {
            let request = self.client.get(format!("{}/v1/jobs/{job}", self.url)).header("prefer", "wait=20");
            let job = read(request.send().await.expect("an answer")).await;
            if ["succeeded", "failed", "canceled"].contains(&job["state"].as_str().unwrap_or_default()) {
                return job;
            }
        }
    }
}

/// Ids of the processes that are of the service with that data folder, or of its engine.
fn engine_processes_of(parent: u32) -> Vec<u32> {
    let entries = std::fs::read_dir("/proc").expect("the processes");
    let ids = entries.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse::<u32>().ok());
    let is_child = |id: &u32| {
        let stat = std::fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
        // The name stands in brackets and may hold anything; the parent is the second field behind it.
        let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
        fields.get(1) == Some(&parent.to_string().as_str()) && fields.first() != Some(&"Z")
    };
    ids.filter(is_child).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn what_brings_the_engine_down_ends_its_own_job_alone() {
    let data = tempfile::tempdir().expect("a folder");
    let service = wild_service(
        data.path(),
        &["--workers", "2", "--job-timeout", "8s", "--process-memory", "256MiB", "--result-cache", "off"],
    );
    let studio = Studio::at(&service);
    let healthy = studio.upload("walk.glb").await;
    let mut asked = Vec::new();
    for (name, code, words) in [
        ("abort.glb", "engine_crashed", "SIGABRT"),
        ("overflow.glb", "engine_crashed", "stack overflowed"),
        ("eat.glb", "engine_crashed", "process_memory"),
        // Addresses alone would let it have two gibibytes more, and end it with a signal of its own.
        ("hoard.glb", "engine_crashed", "more memory than 'process_memory' allows"),
        ("spin.glb", "job_timeout", "job_timeout"),
    ] {
        let asset = studio.upload(name).await;
        asked.push((studio.job(&asset).await, Some((code, words))));
        asked.push((studio.job(&healthy).await, None));
    }
    for (job, expected) in asked {
        let job = studio.end(&job).await;
        match expected {
            None => assert_eq!(job["state"], "succeeded", "beside the others: {job}"),
            Some((code, words)) => {
                assert_eq!(job["problem"]["code"], code, "a code of its own: {job}");
                let detail = job["problem"]["detail"].as_str().unwrap_or_default();
                assert!(detail.contains(words), "how: {detail}");
                let is_hoard = words.starts_with("more memory");
                assert!(!is_hoard || detail.ends_with(words), "ended by who looks at what is in use: {detail}");
                assert_eq!(job["attempt"], 1, "and it is not tried again");
            }
        }
    }
    // Looking into a file is no job, and is guarded all the same.
    let asset = studio.upload("abort-too.glb").await;
    let look = studio.client.get(format!("{}/v1/assets/{asset}/skeleton", studio.url)).send().await;
    problem(look.expect("an answer"), 500, "engine_crashed").await;
    let look = studio.client.get(format!("{}/v1/assets/{healthy}/skeleton", studio.url)).send().await;
    assert_eq!(read(look.expect("an answer")).await["counts"]["clips"], 1, "others are looked into");
    assert_eq!(service.terminate(), Some(0), "and the service is well");
}

/// The digest of what the engine makes of the walk on that character, in this process and with nothing kept.
fn made_here(target: &[u8], config: &Value) -> String {
    let (walk, config) = (samples::walk_clip(), config.to_string());
    let inputs = Inputs {
        source: NamedBytes { name: "walk.glb", bytes: &walk },
        target: NamedBytes { name: "hero.glb", bytes: target },
        source_rest: None,
        target_rest: None,
        config: Some(NamedBytes { name: "config.json", bytes: config.as_bytes() }),
        formats: &[Format::Glb],
    };
    let made = retarget(&inputs, &Limits::default(), &Control::new()).expect("a retarget");
    sha256_of(&made.outputs[0].bytes)
}

/// An engine process keeps the last target. What it answers is what it would answer without.
#[tokio::test(flavor = "multi_thread")]
async fn a_character_that_comes_again_gives_the_same_bytes() {
    let data = tempfile::tempdir().expect("a folder");
    let service = wild_service(data.path(), &["--workers", "1", "--result-cache", "off"]);
    let studio = Studio::at(&service);
    let put = async |name: &str, bytes: &[u8]| {
        let url = format!("{}/v1/assets?filename={name}", studio.url);
        taken(studio.client.post(url).body(bytes.to_vec()).send().await.expect("an answer")).await
    };
    let walk = put("walk.glb", &samples::walk_clip()).await;
    // The second is the walk's own skeleton.
    let characters = [samples::mannequin(), samples::walk_clip()];
    let assets = [put("hero.glb", &characters[0]).await, put("hero.glb", &characters[1]).await];
    let plain = json!({"ops": [{"op": "pelvis"}, {"op": "fk"}]});
    let mut ask = Vec::new();
    for (character, config, is_killed) in [
        (0, json!({}), false),
        (0, json!({}), false),
        (0, plain.clone(), false),
        (1, json!({}), false),
        (0, json!({}), false),
        (0, json!({"target": {"rest": "bind"}}), false),
        (0, json!({}), true),
        (0, json!({}), false),
    ] {
        let body = json!({"source": {"asset": walk}, "target": {"asset": assets[character]}, "config": config, "output": ["glb"]});
        let request = studio.client.post(format!("{}/v1/jobs", studio.url)).json(&body);
        if is_killed {
            engine_processes_of(service.id()).into_iter().for_each(|process| signal(process, "KILL"));
        }
        let job = studio.end(&taken(request.send().await.expect("an answer")).await).await;
        assert_eq!(job["state"], "succeeded", "{job}");
        ask.push((job["results"][0]["sha256"].clone(), character, config));
    }
    for (index, (sha256, character, config)) in ask.into_iter().enumerate() {
        assert_eq!(sha256, made_here(&characters[character], &config), "request {index}");
    }
    assert_eq!(service.terminate(), Some(0));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_that_does_not_listen_can_be_canceled() {
    let data = tempfile::tempdir().expect("a folder");
    let service = wild_service(data.path(), &["--workers", "1"]);
    let studio = Studio::at(&service);
    let asset = studio.upload("spin.glb").await;
    let job = studio.job(&asset).await;
    while read(studio.client.get(format!("{}/v1/jobs/{job}", studio.url)).send().await.expect("ok")).await["state"]
        != "running"
    {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    studio.client.post(format!("{}/v1/jobs/{job}/cancel", studio.url)).send().await.expect("an answer");
    assert_eq!(studio.end(&job).await["state"], "canceled", "its process is ended");
    let healthy = studio.upload("walk.glb").await;
    let job = studio.job(&healthy).await;
    assert_eq!(studio.end(&job).await["state"], "succeeded", "and there is another one");
}

#[tokio::test(flavor = "multi_thread")]
async fn processes_serve_many_and_never_outlive_the_service() {
    let data = tempfile::tempdir().expect("a folder");
    let mut service =
        wild_service(data.path(), &["--workers", "1", "--result-cache", "off", "--max-process-requests", "3"]);
    let studio = Studio::at(&service);
    let healthy = studio.upload("walk.glb").await;
    let mut seen = std::collections::BTreeSet::new();
    for _ in 0..6 {
        let job = studio.job(&healthy).await;
        assert_eq!(studio.end(&job).await["state"], "succeeded", "it works");
        seen.extend(engine_processes_of(service.id()));
    }
    assert!((1..=2).contains(&seen.len()), "three jobs each, and none is kept for longer: {seen:?}");

    // At work, and with nobody left to work for.
    let asset = studio.upload("spin.glb").await;
    let job = studio.job(&asset).await;
    while read(studio.client.get(format!("{}/v1/jobs/{job}", studio.url)).send().await.expect("ok")).await["state"]
        != "running"
    {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    let began = Instant::now();
    let at_work = loop {
        let at_work = engine_processes_of(service.id());
        if !at_work.is_empty() {
            break at_work;
        }
        assert!(began.elapsed() < PATIENCE, "one works");
        tokio::time::sleep(Duration::from_millis(10)).await;
    };
    service.kill();
    let is_there = |id: &u32| {
        let stat = std::fs::read_to_string(format!("/proc/{id}/cmdline")).unwrap_or_default();
        stat.contains("engine-process")
    };
    while at_work.iter().any(is_there) {
        assert!(began.elapsed() < PATIENCE, "they end with the service, however that ends");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

/// Ctrl-C and service managers send their signals to every process of a group.
#[test]
fn an_engine_process_leaves_signals_to_the_service_and_ends_with_it() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_retargetd"))
        .args(["engine-process", "--memory-bytes", "268435456", "--output-bytes", "1048576", "--seconds", "60"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("it starts");
    let mut ready = [0; 8];
    child.stdout.as_mut().expect("a pipe").read_exact(&mut ready).expect("it says that it is ready");
    let name = std::fs::read_to_string(format!("/proc/{}/comm", child.id())).expect("its name");
    assert_eq!(name.trim(), "retargetd-work", "lists of processes say what it is, whatever file it was started from");
    for name in ["-TERM", "-INT", "-HUP"] {
        signal(child.id(), name);
    }
    std::thread::sleep(Duration::from_millis(300));
    assert!(child.try_wait().expect("it can be asked").is_none(), "what runs may go on");
    drop(child.stdin.take());
    assert!(child.wait().expect("it ends").success(), "when nobody is left to ask, it ends well");
}

/// What a process of its own costs a job. Prints figures and asserts nothing about time: run it by
/// `cargo nextest run --run-ignored all -E 'test(isolation_figures)' --no-capture`.
#[tokio::test(flavor = "multi_thread")]
#[ignore = "measures"]
#[expect(clippy::print_stdout, reason = "figures are what this is for")]
async fn isolation_figures() {
    let mut medians = Vec::new();
    for isolation in ["thread", "process", "thread", "process"] {
        let data = tempfile::tempdir().expect("a folder");
        let mut command = Command::new(env!("CARGO_BIN_EXE_retargetd"));
        command.args(["serve", "--listen", "127.0.0.1:0", "--log", "off", "--workers", "1", "--result-cache", "off"]);
        let service = ServiceProcess::listening(command.args(["--isolation", isolation, "--data"]).arg(data.path()));
        let studio = Studio::at(&service);
        let asset = studio.upload("walk.glb").await;
        let body = json!({"source": {"asset": asset}, "config": {"task": "edit"}, "output": ["bvh"]});
        let mut times = Vec::new();
        for _ in 0..200 {
            let began = Instant::now();
            let request = studio.client.post(format!("{}/v1/jobs", studio.url)).header("prefer", "wait=20").json(&body);
            let job = read(request.send().await.expect("an answer")).await;
            assert_eq!(job["state"], "succeeded", "it works: {job}");
            times.push(began.elapsed().as_secs_f64() * 1e3);
        }
        times.sort_by(f64::total_cmp);
        println!("{isolation}: median {:.2} ms, 95th percentile {:.2} ms", times[100], times[190]);
        medians.push(times[100]);
    }
    println!("cost of a process: {:.2} ms at the median", (medians[1] + medians[3] - medians[0] - medians[2]) / 2.0);
}
