//! Callers and networks that behave badly: what they leave, and what others notice of them.

use std::{path::Path, process::Command, time::Duration};

use reqwest::{Client, StatusCode};
use serde_json::Value;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::TcpStream,
};

use super::support::{BVH, PATIENCE, ServiceProcess, problem, start_service};
use crate::support::skip;

async fn connect(server: &ServiceProcess) -> TcpStream {
    TcpStream::connect(server.url.trim_start_matches("http://")).await.expect("connects")
}

/// Whatever comes until the connection ends, however it ends.
async fn rest_of(mut stream: TcpStream) -> String {
    let mut answer = Vec::new();
    let read = tokio::time::timeout(PATIENCE, stream.read_to_end(&mut answer)).await.expect("the connection ends");
    // A reset is an end too.
    let _ = read;
    String::from_utf8_lossy(&answer).into_owned()
}

async fn is_alive(server: &ServiceProcess) -> bool {
    let client = Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client");
    client.get(format!("{}/readyz", server.url)).send().await.is_ok_and(|answer| answer.status() == StatusCode::OK)
}

/// No asset, nothing half-written, once the service has noticed what happened.
async fn assert_no_residue(data: &Path, what: &str) {
    let files = |folder: &str| std::fs::read_dir(data.join(folder)).expect("a folder").count();
    let began = std::time::Instant::now();
    while files("tmp") > 0 {
        assert!(began.elapsed() < PATIENCE, "{what}: what was half-written is removed");
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    assert_eq!(files("blobs"), 0, "{what}: nothing is kept");
}

#[tokio::test(flavor = "multi_thread")]
async fn http_2_is_spoken_without_tls_where_the_operator_says_so() {
    /// How HTTP/2 begins, and a frame of settings with none in it.
    const BEGINNING: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\x04\0\0\0\0\0";
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &["--http2", "on"]);
    let mut stream = connect(&server).await;
    stream.write_all(BEGINNING).await.expect("writes");
    let mut frame = [0; 9];
    let read = tokio::time::timeout(PATIENCE, stream.read_exact(&mut frame)).await.expect("an answer");
    assert!(read.is_ok() && frame[3] == 4, "it answers with its settings: {frame:?}");
    assert!(is_alive(&server).await, "and HTTP/1.1 is spoken on the same address");
}

#[tokio::test(flavor = "multi_thread")]
async fn uploads_that_break_off_leave_nothing() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &["--upload-idle-timeout", "2s"]);
    let upload = "POST /v1/assets?filename=a.bvh HTTP/1.1\r\nhost: localhost\r\ncontent-length: 1000\r\n\r\nHIERARCHY\nROOT Hips\n";
    let chunked = "POST /v1/assets?filename=a.bvh HTTP/1.1\r\nhost: localhost\r\ntransfer-encoding: chunked\r\n\r\n9\r\nHIERARCHY\r\n";
    let form = "POST /v1/retarget HTTP/1.1\r\nhost: localhost\r\ncontent-type: multipart/form-data; boundary=b\r\ncontent-length: \
                1000\r\n\r\n--b\r\ncontent-disposition: form-data; name=\"source\"; filename=\"a.bvh\"\r\n\r\nHIERARCHY";
    for (name, text) in [("a body with a length", upload), ("a body in chunks", chunked), ("a form", form)] {
        let mut half = connect(&server).await;
        half.write_all(text.as_bytes()).await.expect("writes");
        half.shutdown().await.expect("says that no more comes");
        let answer = rest_of(half).await;
        let is_told = answer.is_empty() || answer.starts_with("HTTP/1.1 400") || answer.starts_with("HTTP/1.1 408");
        assert!(is_told, "{name}, half closed: {answer}");
        assert_no_residue(data.path(), &format!("{name}, half closed")).await;

        let mut reset = connect(&server).await;
        reset.write_all(text.as_bytes()).await.expect("writes");
        tokio::time::sleep(Duration::from_millis(50)).await;
        #[expect(deprecated, reason = "it blocks nothing at zero seconds, and a reset is what is wanted")]
        reset.set_linger(Some(Duration::ZERO)).expect("can be set");
        drop(reset);
        assert_no_residue(data.path(), &format!("{name}, reset")).await;
        assert!(is_alive(&server).await, "{name}: the service goes on");
    }
    let nonsense: [&[u8]; 4] = [
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",
        b"GET / HTTP/1.1\r\nhost: localhost\r\ncontent-length: 5\r\ncontent-length: 7\r\n\r\n",
        b"POST /v1/assets HTTP/1.1\r\nhost: localhost\r\ncontent-length: 4\r\ntransfer-encoding: chunked\r\n\r\n0\r\n\r\nGET /livez HTTP/1.1\r\n\r\n",
        b"GET /\x00 HTTP/1.1\r\n\r\n",
    ];
    for bytes in nonsense {
        let mut stream = connect(&server).await;
        stream.write_all(bytes).await.expect("writes");
        stream.shutdown().await.expect("says that no more comes");
        let answer = rest_of(stream).await;
        assert_eq!(answer.matches("HTTP/1.1 2").count(), 0, "{bytes:?} is no request, or not two: {answer}");
    }
    assert_no_residue(data.path(), "nonsense").await;
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}

#[tokio::test(flavor = "multi_thread")]
async fn slow_callers_take_no_room_from_probes_and_not_for_long_from_others() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let flags = ["--max-connections", "32", "--header-timeout", "1s", "--probes-listen", "127.0.0.1:0"];
    let mut server = start_service(data.path(), &flags);
    let probes = server.next_url();
    let mut slow = Vec::new();
    for _ in 0..64 {
        let mut stream = connect(&server).await;
        // Those that there is no place for are closed at once.
        let _ = stream.write_all(b"GET /livez HTTP/1.1\r\nx: ").await;
        slow.push(tokio::spawn(async move {
            // One letter at a time, for as long as somebody listens.
            while stream.write_all(b"y").await.is_ok() {
                tokio::time::sleep(Duration::from_millis(50)).await;
            }
        }));
    }
    let client = Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client");
    let alive = client.get(format!("{probes}/livez")).timeout(Duration::from_millis(900)).send().await;
    assert_eq!(alive.expect("answered before any slow caller is gone").status(), StatusCode::OK, "alive");
    let began = std::time::Instant::now();
    while !is_alive(&server).await {
        assert!(began.elapsed() < PATIENCE, "others come in when the slow ones are cut off");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    for caller in slow {
        tokio::time::timeout(PATIENCE, caller).await.expect("it is cut off").expect("it ends");
    }
}

/// A service whose data folder lies on a disk of four megabytes of its own, of which one is for records, which goes with the process; nothing where this machine
/// lets nobody mount one.
fn on_a_small_disk(data: &Path) -> Option<ServiceProcess> {
    let mount = "mount -t tmpfs -o size=5m tmpfs \"$0\"";
    let unshare = |script: &str| {
        let mut command = Command::new("unshare");
        command.args(["--map-root-user", "--mount", "sh", "-c", script]).arg(data);
        command
    };
    if !unshare(mount).output().is_ok_and(|output| output.status.success()) {
        skip("a full disk, because no small one can be mounted here");
        return None;
    }
    let mut command = unshare(&format!(
        "{mount} && exec \"$1\" serve --listen 127.0.0.1:0 --log error --reserved-disk 1MiB --data \"$0\""
    ));
    Some(ServiceProcess::listening(command.arg(env!("CARGO_BIN_EXE_retargetd"))))
}

#[tokio::test(flavor = "multi_thread")]
async fn a_full_disk_is_said_and_room_is_found_again() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let Some(server) = on_a_small_disk(data.path()) else { return };
    let client = Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client");
    let upload = async |number: usize, size: usize| -> (StatusCode, Value) {
        let body = format!("{BVH}{number}{}", " ".repeat(size));
        let answer = client.post(format!("{}/v1/assets?filename=a.bvh", server.url)).body(body).send().await;
        let answer = answer.expect("an answer");
        (answer.status(), answer.json().await.expect("JSON"))
    };
    let (mut kept, mut refused) = (Vec::new(), 0);
    // Large ones until one does not fit, then many small ones.
    let sizes = std::iter::repeat_n(800_000, 4).chain(std::iter::repeat_n(20_000, 116));
    for (number, size) in sizes.enumerate() {
        let (status, body) = upload(number, size).await;
        match status {
            StatusCode::CREATED => kept.push(body["id"].as_str().expect("an id").to_owned()),
            status => {
                assert_eq!((status.as_u16(), &body["code"]), (507, &"storage_full".into()), "said as it is: {body}");
                let detail = body["detail"].as_str().unwrap_or_default();
                // The last file that began while there was room may fill what is kept.
                let is_told = detail.contains("'reserved_disk' keeps 1048576") || detail.contains("the disk is full");
                assert!(is_told, "which limit it was: {detail}");
                refused += 1;
            }
        }
    }
    assert!(refused > 10 && kept.len() > 3, "{refused} refused, {} kept", kept.len());
    let ready = client.get(format!("{}/readyz", server.url)).send().await.expect("an answer").status();
    assert_eq!(ready, StatusCode::SERVICE_UNAVAILABLE, "it can be asked, and says that it takes no more");
    for id in &kept {
        let answer = client.get(format!("{}/v1/assets/{id}/content", server.url)).send().await.expect("an answer");
        let bytes = answer.bytes().await.expect("its bytes");
        assert!(bytes.starts_with(BVH.as_bytes()), "what was acknowledged is whole");
    }
    let job = serde_json::json!({"source": {"asset": kept[0]}, "target": {"asset": kept[0]}});
    let job = client.post(format!("{}/v1/jobs", server.url)).json(&job).send().await.expect("an answer");
    problem(job, 507, "storage_full").await;
    for id in &kept {
        let answer = client.delete(format!("{}/v1/assets/{id}", server.url)).send().await.expect("an answer");
        assert!(answer.status().is_success(), "can be removed from a full disk: {}", answer.status());
    }
    let (status, body) = upload(1000, 800_000).await;
    assert_eq!(status, StatusCode::CREATED, "there is room again: {body}");
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}
