//! What an engine process can reach: nothing; and what is said of it, and what an operator's own bounds do to it.

use std::{process::Command, time::Duration};

use reqwest::Client;

use super::support::{ServiceProcess, form, problem, start_service};
use crate::durable::CLIP;

async fn retarget(service: &ServiceProcess) -> reqwest::StatusCode {
    let client = Client::builder().no_proxy().timeout(Duration::from_secs(120)).build().expect("a client");
    let path = format!("{}/v1/retarget", service.url);
    client.post(path).multipart(form(&[("source", CLIP), ("target", CLIP)])).send().await.expect("an answer").status()
}

/// What the kernel says of the engine processes of a service.
#[cfg(target_os = "linux")]
fn engine_status(parent: u32) -> Vec<String> {
    let is_child = |status: &String| status.lines().any(|line| line == format!("PPid:\t{parent}"));
    let processes = std::fs::read_dir("/proc").expect("processes").flatten();
    let status = |entry: std::fs::DirEntry| std::fs::read_to_string(entry.path().join("status")).ok();
    processes.filter_map(status).filter(is_child).collect()
}

#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread")]
async fn engine_processes_are_locked_in() {
    let data = tempfile::tempdir().expect("a folder");
    let service = start_service(data.path(), &["--workers", "1"]);
    assert_eq!(retarget(&service).await, 200, "it works");
    let children = engine_status(service.id());
    assert!(!children.is_empty(), "the engine has a process");
    for status in children {
        assert!(status.contains("NoNewPrivs:\t1"), "it gains no privileges: {status}");
        assert!(status.contains("Seccomp:\t2"), "it has no sockets and no other programs: {status}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn an_answer_that_is_too_large_stays_in_the_engine() {
    let data = tempfile::tempdir().expect("a folder");
    let service = start_service(data.path(), &["--workers", "1", "--max-output-bytes", "4KiB"]);
    let client = Client::builder().no_proxy().timeout(Duration::from_secs(120)).build().expect("a client");
    let path = format!("{}/v1/retarget", service.url);
    let answer = client.post(path).multipart(form(&[("source", CLIP), ("target", CLIP)])).send().await;
    let refused = problem(answer.expect("an answer"), 422, "asset_limit_exceeded").await;
    let detail = refused["detail"].as_str().unwrap_or_default();
    assert!(detail.contains("'output_bytes' of 4096"), "the limit is named: {refused}");
}

/// A limit that an operator has set and nobody may raise.
#[tokio::test(flavor = "multi_thread")]
async fn hard_limits_of_an_operator_do_not_stop_engines() {
    let data = tempfile::tempdir().expect("a folder");
    let mut command = Command::new("setpriv");
    if !command.arg("--version").output().is_ok_and(|output| output.status.success()) {
        return crate::support::skip("setpriv is not installed");
    }
    // Without the privilege to raise limits, which root would have.
    let script = "ulimit -t 3000 && ulimit -v 33554432 && exec \"$@\"";
    let mut command = Command::new("setpriv");
    command
        .args(["--bounding-set=-sys_resource", "--inh-caps=-sys_resource", "sh", "-c", script, "sh"])
        .arg(env!("CARGO_BIN_EXE_retargetd"))
        .args(["serve", "--listen", "127.0.0.1:0", "--log", "warn", "--workers", "1", "--data"])
        .arg(data.path());
    let service = ServiceProcess::listening(&mut command);
    assert_eq!(retarget(&service).await, 200, "engines start below the operator's limits");
}
