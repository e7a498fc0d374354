//! A root that nothing can be written to, as containers have it: the data folder is enough.
//!
//! `RETARGETD_TEST_JOBS=2000` with `RETARGETD_TEST_ASSETS=50000` is the long form.

use std::{
    path::Path,
    process::{Command, Stdio},
    time::Duration,
};

use jiff::Timestamp;
use retargetd::store::{AssetId, AssetRecord, Principal, Records};
use serde_json::json;

use crate::{
    durable::studio::CLIP,
    service_process::ServiceProcess,
    support::{count_of, skip},
};

/// A shell in a mount namespace of its own whose root is read-only but for that folder. `None`, said aloud, where there can be none.
fn command_below(folder: &Path) -> Option<Command> {
    const SCRIPT: &str = "set -e; mount --make-rprivate /; mount --bind \"$0\" \"$0\"; \
                          for place in / /tmp /var/tmp /usr/tmp /dev/shm /run; do \
                          if mountpoint -q $place || [ $place = / ] || [ -d $place ]; then \
                          [ $place = / ] || mount --bind $place $place; mount -o remount,bind,ro $place; fi; done; \
                          mount --bind \"$0\" \"$0\" 2>/dev/null || true; mount -o remount,bind,rw \"$0\"; \
                          cd /; exec \"$@\"";
    let unshared = |program: &str| {
        let mut command = Command::new("unshare");
        command.args(["--mount", "sh", "-c", SCRIPT]).arg(folder).arg(program);
        command.env_remove("TMPDIR").env_remove("SQLITE_TMPDIR");
        command
    };
    let probe = "touch \"$0/probe\" && rm \"$0/probe\" && ! touch /tmp/retargetd-probe 2>/dev/null && \
                 ! touch /var/tmp/retargetd-probe 2>/dev/null && ! touch /retargetd-probe 2>/dev/null";
    let works = unshared("sh").args(["-c", probe]).arg(folder).stderr(Stdio::null()).status();
    if !works.is_ok_and(|status| status.success()) {
        skip("a mount namespace with a read-only root cannot be made here; root can");
        return None;
    }
    Some(unshared(env!("CARGO_BIN_EXE_retargetd")))
}

/// Expired files enough that counting them does not fit a cache.
async fn fill(folder: &Path, assets: usize) {
    let records = Records::open(&folder.join("state.db")).await.expect("opens");
    let principal = Principal::parse("anonymous").expect("a name");
    for step in 0..assets.div_ceil(1000) {
        let asset = |number: usize| AssetRecord {
            id: AssetId::new(),
            principal: principal.clone(),
            sha256: format!("{:064x}", step * 1000 + number),
            bytes: 10,
            format: "bvh".to_owned(),
            file_name: "walk.bvh".to_owned(),
            created_at: Timestamp::UNIX_EPOCH,
            expires_at: Timestamp::from_second(4_000_000_000).expect("in the year 2096"),
        };
        let assets: Vec<AssetRecord> = (0..1000).map(asset).collect();
        records.add_assets(&assets).await.expect("writes");
    }
    records.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn nothing_but_the_data_folder_is_written_to() {
    let folder = tempfile::tempdir_in("/var/lib").or_else(|_| tempfile::tempdir()).expect("a folder");
    let Some(mut command) = command_below(folder.path()) else { return };
    fill(folder.path(), count_of("RETARGETD_TEST_ASSETS", 50_000)).await;
    command
        .args(["serve", "--listen", "127.0.0.1:0", "--log", "error", "--workers", "1", "--max-queued-jobs", "10000"])
        .args(["--max-stored-bytes", "1TiB", "--sweep-interval", "1s", "--data"])
        .arg(folder.path());
    let service = ServiceProcess::listening(&mut command);
    let client = reqwest::Client::builder().no_proxy().timeout(Duration::from_secs(120)).build().expect("a client");
    let at = |path: &str| format!("{}{path}", service.url);
    let upload = client.post(at("/v1/assets?filename=walk.bvh")).body(CLIP).send().await.expect("an answer");
    assert!(upload.status().is_success(), "files are taken: {}", upload.text().await.unwrap_or_default());
    let asset: serde_json::Value = upload.json().await.expect("JSON");
    let input = json!({"asset": asset["id"]});
    for number in 0..count_of("RETARGETD_TEST_JOBS", 400) {
        let job =
            json!({"source": input, "target": input, "config": {"output": {"clip_name": format!("clip {number}")}}});
        let answer = client.post(at("/v1/jobs")).json(&job).send().await.expect("an answer");
        assert_eq!(answer.status(), 202, "job {number} is taken: {}", answer.text().await.unwrap_or_default());
    }
    let item = |number: usize| json!({"source": input, "target": input, "labels": {"shot": format!("{number:04}")}});
    let batch = json!({"items": (0..1000).map(item).collect::<Vec<_>>()});
    let answer = client.post(at("/v1/batches")).json(&batch).send().await.expect("an answer");
    assert_eq!(answer.status(), 202, "a batch of 1,000 is taken: {}", answer.text().await.unwrap_or_default());
    let ready = client.get(at("/readyz")).send().await.expect("an answer");
    assert_eq!(ready.status(), 200, "after all that it is ready");
}
