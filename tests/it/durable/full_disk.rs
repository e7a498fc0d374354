//! A disk that is full to the last byte: what fails then fails by itself, and when there is room again everything is as before.

use std::{
    fs::File,
    io::Write as _,
    path::{Path, PathBuf},
    process::Command,
    time::Duration,
};

use super::studio::CLIP;
use crate::{service_process::ServiceProcess, support::skip};

/// A service whose data folder is a disk of eight megabytes of its own, none of which is reserved, and that folder as it is seen from
/// outside. Nothing, said aloud, where nobody may mount one.
fn on_a_small_disk(data: &Path) -> Option<(ServiceProcess, PathBuf)> {
    const MOUNT: &str = "mount -t tmpfs -o size=8m tmpfs \"$0\"";
    let unshared = |script: &str| {
        let mut command = Command::new("unshare");
        command.args(["--mount", "sh", "-c", script]).arg(data);
        command
    };
    if !unshared(MOUNT).output().is_ok_and(|output| output.status.success()) {
        skip("a full disk, because no small one can be mounted here; root can");
        return None;
    }
    let serve = format!(
        "{MOUNT} && exec \"$1\" serve --listen 127.0.0.1:0 --log off --workers 1 --reserved-disk 0B --data \"$0\""
    );
    let service = ServiceProcess::listening(unshared(&serve).arg(env!("CARGO_BIN_EXE_retargetd")));
    let seen = PathBuf::from(format!("/proc/{}/root", service.id())).join(data.strip_prefix("/").expect("absolute"));
    Some((service, seen))
}

#[tokio::test(flavor = "multi_thread")]
async fn records_are_written_again_when_a_full_disk_has_room() {
    let data = tempfile::tempdir().expect("a folder");
    let Some((service, seen)) = on_a_small_disk(data.path()) else { return };
    let client = reqwest::Client::builder().no_proxy().timeout(Duration::from_secs(60)).build().expect("a client");
    let put = async |number: usize| {
        let preset = serde_json::json!({"output": {"clip_name": format!("{number}{}", "x".repeat(60_000))}});
        let request = client.put(format!("{}/v1/presets/preset{number}", service.url)).json(&preset);
        request.send().await.expect("an answer").status().as_u16()
    };
    assert_eq!(put(0).await, 201, "there is room");
    let mut filler = File::create(seen.join("filler")).expect("a file beside the data");
    while filler.write_all(&[1; 4096]).is_ok() {}
    drop(filler);
    let statuses: Vec<u16> = [put(1).await, put(2).await, put(3).await].into();
    assert!(statuses.iter().all(|status| [503, 507].contains(status)), "refused while it is full: {statuses:?}");
    std::fs::remove_file(seen.join("filler")).expect("removes");
    assert_eq!(put(4).await, 201, "there is room again");
    let upload = client.post(format!("{}/v1/assets?filename=a.bvh", service.url)).body(CLIP).send().await;
    assert_eq!(upload.expect("an answer").status(), 201, "files are taken");
    let kept = client.get(format!("{}/v1/presets/preset0", service.url)).send().await.expect("an answer");
    assert_eq!(kept.status(), 200, "what was there before is there");
}
