//! Two principals do everything at once that a service can be hurt by, and a third does its work: that it is served, that the service stays
//! within its memory and answers probes, and that all is at rest again when they have gone.

use std::{
    process::Command,
    sync::Arc,
    time::{Duration, Instant},
};

use reqwest::{Client, StatusCode, multipart};
use tokio::task::JoinSet;

use super::{
    hostile_callers::{BEHAVIORS, Hostile},
    support::{Answers, Pressure},
};
use crate::service_process::ServiceProcess;

/// What the service process may use.
const MAX_MEMORY_MEBIBYTES: u64 = 512;
/// Engine processes that may wait for work: one for each worker, and one more.
const MAX_IDLE: usize = 3;
/// How long everything may take to come to rest.
const REST: Duration = Duration::from_secs(60);

/// The service, under limits that make a hostile caller's patience short, and a key for each of those.
fn start(data: &std::path::Path, names: &[&str]) -> (ServiceProcess, Vec<String>) {
    let server = ServiceProcess::listening(
        Command::new(env!("CARGO_BIN_EXE_retargetd"))
            .args(["serve", "--listen", "127.0.0.1:0", "--log", "off", "--authentication", "keys", "--workers", "2"])
            .args(["--memory-budget", "512MiB", "--max-principal-jobs", "8", "--max-peer-connections", "384"])
            .args(["--header-timeout", "5s", "--upload-idle-timeout", "5s", "--answer-idle-timeout", "5s"])
            .args(["--outbound-allow", "127.0.0.0/8", "--job-timeout", "10s", "--sweep-interval", "2s", "--data"])
            .arg(data),
    );
    let key = |name: &&str| {
        let made = Command::new(env!("CARGO_BIN_EXE_retargetd"))
            .args(["keys", "create", name, "--data"])
            .arg(data)
            .output()
            .expect("it runs");
        String::from_utf8(made.stdout).expect("text").trim().to_owned()
    };
    let keys = names.iter().map(key).collect();
    (server, keys)
}

/// One after the other, as fast as they are answered: retargets of a small file. A refusal for load waits as long as it says.
async fn work(client: Client, url: String, key: String, until: Instant) -> Answers {
    let mut answers = Answers::default();
    while Instant::now() < until {
        let part = |bytes: Vec<u8>, name: &'static str| multipart::Part::bytes(bytes).file_name(name);
        let form = multipart::Form::new()
            .part("source", part(retargetd::samples::walk_clip(), "walk.glb"))
            .part("target", part(retargetd::samples::mannequin(), "mannequin.glb"))
            .part("config", part(br#"{"edit": {"fps": 5}}"#.to_vec(), "config.json"));
        let asked = Instant::now();
        let answer = client.post(format!("{url}/v1/retarget")).bearer_auth(&key).header("prefer", "wait=30");
        let answer = answer.header("cache-control", "no-cache").multipart(form).send().await.expect("an answer");
        let (status, has_advice) = (answer.status(), answer.headers().contains_key("retry-after"));
        let _ = answer.bytes().await;
        answers.add(status, asked.elapsed());
        if status == StatusCode::SERVICE_UNAVAILABLE {
            assert!(has_advice, "a refusal says when to try again");
            tokio::time::sleep(Duration::from_secs(1)).await;
        }
    }
    answers
}

/// Asks again and again whether the service is alive.
async fn probe(client: Client, url: String, until: Instant) -> Answers {
    let mut answers = Answers::default();
    while Instant::now() < until {
        let asked = Instant::now();
        let answer = client.get(format!("{url}/livez")).send().await.expect("alive");
        answers.add(answer.status(), asked.elapsed());
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    answers
}

/// Waits until processes, files and memory are what they were, and says what is not.
async fn rest(server: &ServiceProcess, before: (usize, u64, f64)) -> Result<(), String> {
    let began = Instant::now();
    loop {
        let (children, files, memory) = (server.children(), server.open_files(), server.memory_mebibytes());
        // Allocators keep some of what they had, and caches what was found out; connections to the database stay open.
        let most_memory = (before.2 * 1.2).max(before.2 + 128.0);
        if children <= before.0.max(MAX_IDLE) && files <= before.1 + 16 && memory <= most_memory {
            return Ok(());
        }
        if began.elapsed() > REST {
            return Err(format!(
                "{children} processes, {files} files, {memory:.0} MiB, where there were {}, {} and {:.0}",
                before.0, before.1, before.2
            ));
        }
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn two_hostile_principals_take_nothing_from_a_third() {
    let pressure = Pressure::of(10);
    let data = tempfile::tempdir().expect("a temporary folder");
    let (server, keys) = start(data.path(), &["mallory", "trudy", "carol"]);
    let client = Client::builder().timeout(Duration::from_secs(90)).no_proxy().build().expect("a client");
    let (url, own) = (server.url.clone(), keys[2].clone());

    let alone_for = (pressure.lasts / 4).min(Duration::from_secs(30));
    let alone = work(client.clone(), url.clone(), own.clone(), Instant::now() + alone_for).await;
    assert_eq!(alone.statuses(), [200], "alone, all is well");
    let alone = alone.count(200) as f64 / alone_for.as_secs_f64();
    let before = (server.children(), server.open_files(), server.memory_mebibytes());

    let until = Instant::now() + pressure.lasts;
    let mut hostile = JoinSet::new();
    for (key, from) in [(&keys[0], [127, 0, 0, 2]), (&keys[1], [127, 0, 0, 3])] {
        let caller = Hostile::new(&url, key, from, until).await;
        for (_, behave) in BEHAVIORS {
            behave(Arc::clone(&caller), &mut hostile);
        }
    }
    let probes = tokio::spawn(probe(client.clone(), url.clone(), until));
    let mut work = work(client.clone(), url.clone(), own, until).await;
    let mut probes = probes.await.expect("probes are answered");
    hostile.shutdown().await;

    assert!(work.statuses().iter().all(|status| [200, 202, 503].contains(status)), "served: {:?}", work.statuses());
    assert!(work.count(200) > 0, "work is done: {:?}", work.statuses());
    assert_eq!(probes.statuses(), [200], "alive all the time");
    let memory = server.most_memory_mebibytes();
    assert!(memory < MAX_MEMORY_MEBIBYTES, "{memory} MiB");
    let rested = rest(&server, before).await;
    assert!(rested.is_ok(), "{rested:?}");

    // Three share what one has alone.
    let (goodput, share) = (work.count(200) as f64 / pressure.lasts.as_secs_f64(), alone / 3.0);
    let (alive, served) = (probes.p99(200), work.p99(200));
    pressure.all_hold(&[
        (memory < MAX_MEMORY_MEBIBYTES, format!("{} behaviors from two; most memory {memory} MiB", BEHAVIORS.len())),
        (alive < Duration::from_millis(100), format!("p99 of /livez {:.1} ms", alive.as_secs_f64() * 1e3)),
        (
            goodput >= share * 0.8,
            format!(
                "{alone:.1} retargets a second alone, {goodput:.1} beside them ({:.0} % of a third); p99 {:.0} ms",
                goodput / share * 1e2,
                served.as_secs_f64() * 1e3
            ),
        ),
    ]);
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}
