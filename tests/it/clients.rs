//! Clients of the service: `retargetd submit`, and the examples in other languages, against the real binary.

use std::{
    io::{Read, Write},
    net::{TcpListener, TcpStream},
    path::{Path, PathBuf},
    process::{Command, Output},
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

use retargetd::samples;
use tempfile::TempDir;

use crate::{service_process::ServiceProcess, support::skip};

/// A folder with the two samples, and a service beside it.
fn studio(flags: &[&str]) -> (TempDir, ServiceProcess) {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("walk & run.glb"), samples::walk_clip()).expect("the walk");
    std::fs::write(folder.path().join("mannequin.glb"), samples::mannequin()).expect("the mannequin");
    let mut command = Command::new(env!("CARGO_BIN_EXE_retargetd"));
    command.args(["serve", "--listen", "127.0.0.1:0", "--log", "warn", "--data"]).arg(folder.path().join("data"));
    let service = ServiceProcess::listening(command.args(flags));
    (folder, service)
}

fn submit(folder: &Path, url: &str, arguments: &[&str]) -> Output {
    with_key(folder, url, arguments, "")
}

fn with_key(folder: &Path, url: &str, arguments: &[&str], key: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_retargetd"))
        .args(["submit", "--service", url])
        .args(arguments)
        .env("RETARGETD_KEY", key)
        .env("NO_PROXY", "127.0.0.1")
        .current_dir(folder)
        .output()
        .expect("the binary runs")
}

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

const FILES: [&str; 4] = ["--source", "walk & run.glb", "--target", "mannequin.glb"];

/// What `retargetd retarget` makes of the same files.
fn local(folder: &Path) -> Vec<u8> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_retargetd"));
    let command = command.arg("retarget").args(FILES).args(["--output", "local.glb"]).current_dir(folder);
    assert!(command.output().expect("it runs").status.success(), "it works without a service");
    std::fs::read(folder.join("local.glb")).expect("the result")
}

#[test]
fn submit_gives_what_retarget_gives() {
    let (folder, service) = studio(&[]);
    std::fs::write(folder.path().join("config.yaml"), "align: auto\n").expect("a config");
    let asked = [
        &FILES[..],
        &["--config", "config.yaml", "--label", "shot=012", "--priority", "-5"],
        &["--output", "remote.glb", "--output", "remote.npz", "--report", "report.json"],
    ]
    .concat();
    let output = submit(folder.path(), &service.url, &asked);
    assert_eq!(output.status.code(), Some(0), "{}", told(&output));
    assert!(told(&output).contains("wrote remote.glb, remote.npz: job job_"), "says so: {}", told(&output));
    let remote = std::fs::read(folder.path().join("remote.glb")).expect("the result");
    assert!(remote == local(folder.path()), "the same bytes");
    let report = std::fs::read(folder.path().join("report.json")).expect("the report");
    let report: serde_json::Value = serde_json::from_slice(&report).expect("JSON");
    assert_eq!(report["counts"]["frames"], 121, "the report of the job");
    assert!(folder.path().join("remote.npz").exists(), "every output");
}

#[test]
fn a_job_can_be_left_and_come_back_for() {
    let (folder, service) = studio(&[]);
    let asked = [&FILES[..], &["--output", "a.bvh", "--detach"]].concat();
    let output = submit(folder.path(), &service.url, &asked);
    assert_eq!(output.status.code(), Some(0), "{}", told(&output));
    let id = String::from_utf8(output.stdout).expect("text");
    assert!(id.trim().starts_with("job_") && !folder.path().join("a.bvh").exists(), "the id alone: {id}");
    let output = submit(folder.path(), &service.url, &["--resume", id.trim(), "--output", "a.bvh"]);
    assert_eq!(output.status.code(), Some(0), "{}", told(&output));
    assert!(folder.path().join("a.bvh").exists(), "what was asked for then");
    let other = submit(folder.path(), &service.url, &["--resume", id.trim(), "--output", "a.npz"]);
    assert!(
        other.status.code() == Some(2) && told(&other).contains("its results are bvh"),
        "not asked for: {}",
        told(&other)
    );
    let both = submit(folder.path(), &service.url, &["--resume", id.trim(), "--source", "x", "--output", "a.bvh"]);
    assert_eq!(both.status.code(), Some(2), "either, not both");
}

#[test]
fn refusals_are_told_with_what_to_do() {
    let (folder, service) = studio(&["--authentication", "keys"]);
    let asked = [&FILES[..], &["--output", "a.glb"]].concat();
    let output = submit(folder.path(), &service.url, &asked);
    assert!(output.status.code() == Some(2) && told(&output).contains("RETARGETD_KEY"), "no key: {}", told(&output));
    let mut keys = Command::new(env!("CARGO_BIN_EXE_retargetd"));
    let keys = keys.args(["keys", "create", "studio", "--data"]).arg(folder.path().join("data"));
    let key = String::from_utf8(keys.output().expect("it runs").stdout).expect("text");
    let with = |arguments: &[&str]| with_key(folder.path(), &service.url, arguments, key.trim());

    std::fs::write(folder.path().join("text.glb"), "not a model").expect("a file");
    let output = with(&["--source", "text.glb", "--target", "mannequin.glb", "--output", "a.glb"]);
    assert!(output.status.code() == Some(3) && told(&output).contains("source text.glb: "), "{}", told(&output));
    std::fs::write(folder.path().join("config.json"), r#"{"target": {"root": "Hipz"}}"#).expect("a config");
    let output = with(&[&asked[..], &["--config", "config.json"]].concat());
    assert!(
        output.status.code() == Some(3) && told(&output).contains("config: "),
        "a job that fails: {}",
        told(&output)
    );
    std::fs::write(folder.path().join("config.json"), r#"{"alighn": "auto"}"#).expect("a config");
    let output = with(&[&asked[..], &["--config", "config.json"]].concat());
    assert!(output.status.code() == Some(3) && told(&output).contains("config config.json"), "{}", told(&output));
    let output = with(&["--resume", "job_00000000000000000000000000", "--output", "a.glb"]);
    assert_eq!(output.status.code(), Some(3), "no such job: {}", told(&output));
    assert_eq!(with(&[&asked[..], &["--label", "shot"]].concat()).status.code(), Some(2), "no label");
    let nowhere = submit(folder.path(), "ftp://here", &asked);
    assert_eq!(nowhere.status.code(), Some(2), "no address: {}", told(&nowhere));
    let names = std::fs::read_dir(folder.path())
        .expect("a folder")
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    assert!(!names.into_iter().any(|name| name.starts_with("a.") || name.ends_with(".part")), "nothing is left behind");
}

/// Passes on to `url`, and cuts connections: every one after so many bytes of the answer, until enough were cut.
fn breaking_proxy(url: &str, after_bytes: usize, cuts: usize) -> (String, Arc<AtomicUsize>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let address = format!("http://{}", listener.local_addr().expect("an address"));
    let target = url.trim_start_matches("http://").to_owned();
    let cut = Arc::new(AtomicUsize::new(0));
    let counter = Arc::clone(&cut);
    thread::spawn(move || {
        for client in listener.incoming() {
            let (Ok(client), Ok(server)) = (client, TcpStream::connect(&target)) else { return };
            let (mut up, mut to_server) =
                (client.try_clone().expect("a socket"), server.try_clone().expect("a socket"));
            thread::spawn(move || std::io::copy(&mut up, &mut to_server));
            let counter = Arc::clone(&counter);
            thread::spawn(move || pass_on(server, client, after_bytes, cuts, &counter));
        }
    });
    (address, cut)
}

fn pass_on(mut server: TcpStream, mut client: TcpStream, after_bytes: usize, cuts: usize, cut: &AtomicUsize) {
    let (mut buffer, mut passed) = ([0; 4096], 0);
    while let Ok(count) = server.read(&mut buffer) {
        if count == 0 || client.write_all(&buffer[..count]).is_err() {
            break;
        }
        passed += count;
        if passed > after_bytes && cut.fetch_add(1, Ordering::SeqCst) < cuts {
            break;
        }
    }
    // Both sides see that the connection is gone.
    let _ = client.shutdown(std::net::Shutdown::Both);
    let _ = server.shutdown(std::net::Shutdown::Both);
}

#[test]
fn what_breaks_on_the_way_is_taken_up_again() {
    let (folder, service) = studio(&[]);
    let (url, cut) = breaking_proxy(&service.url, 20_000, 5);
    let output = submit(folder.path(), &url, &[&FILES[..], &["--output", "remote.glb"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", told(&output));
    assert!(cut.load(Ordering::SeqCst) >= 5, "connections were cut");
    let remote = std::fs::read(folder.path().join("remote.glb")).expect("the result");
    assert!(remote == local(folder.path()), "and every byte is there");
}

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("openapi/examples").join(name)
}

fn check_example(mut command: Command) {
    let (folder, service) = studio(&[]);
    let run = |command: &mut Command, files: [&str; 3]| {
        let command =
            command.current_dir(folder.path()).env("RETARGETD_URL", &service.url).env("NO_PROXY", "127.0.0.1");
        command.args(files).output().expect("it runs")
    };
    let mut again = Command::new(command.get_program());
    again.args(command.get_args());
    let output = run(&mut command, ["walk & run.glb", "mannequin.glb", "example.glb"]);
    assert!(output.status.success(), "{}", told(&output));
    assert!(told(&output).contains("job.succeeded"), "it followed the job: {}", told(&output));
    let result = std::fs::read(folder.path().join("example.glb")).expect("the result");
    assert!(result == local(folder.path()), "the same bytes");
    std::fs::write(folder.path().join("text.glb"), "not a model").expect("a file");
    let output = run(&mut again, ["text.glb", "mannequin.glb", "other.glb"]);
    assert_eq!(output.status.code(), Some(1), "refused");
    assert!(told(&output).contains("unsupported_format"), "with its code: {}", told(&output));
}

#[test]
fn the_python_example_works() {
    let mut command = Command::new("python3");
    command.arg(example("retarget.py"));
    check_example(command);
}

#[test]
#[expect(clippy::disallowed_methods, reason = "tests have no settings")]
fn the_typescript_example_compiles_and_works() {
    if std::env::var_os("RETARGETD_SKIP_NODE").is_some_and(|value| value == "1") {
        return skip("the TypeScript example, because RETARGETD_SKIP_NODE is 1");
    }
    let modules = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tools/typescript/node_modules");
    assert!(
        modules.join("typescript").exists(),
        "TypeScript is not installed: run 'npm ci --prefix tests/tools/typescript', or set RETARGETD_SKIP_NODE=1"
    );
    let made = tempfile::tempdir().expect("a folder");
    let compiled = Command::new("node")
        .arg(modules.join("typescript/bin/tsc"))
        .args(["--strict", "--noUncheckedIndexedAccess", "--target", "es2022", "--lib", "es2023,dom,dom.asynciterable"])
        .args(["--module", "nodenext", "--erasableSyntaxOnly", "--types", "node", "--typeRoots"])
        .arg(modules.join("@types"))
        .arg("--outDir")
        .arg(made.path())
        .arg(example("retarget.mts"))
        .output()
        .expect("the compiler runs");
    assert!(compiled.status.success(), "it compiles: {}", String::from_utf8_lossy(&compiled.stdout));
    let mut command = Command::new("node");
    command.arg(made.path().join("retarget.mjs"));
    check_example(command);
}

/// A folder of clips as one batch: one of them is no clip at all, one cannot be retargeted, and the others have their results.
#[test]
fn a_folder_is_submitted_as_a_batch() {
    let (folder, service) = studio(&[]);
    let place = |name: &str| folder.path().join(name);
    for name in ["clips", "out"] {
        std::fs::create_dir(place(name)).expect("a folder");
    }
    let walk = samples::walk_clip();
    for name in ["monday.glb", "tuesday.glb"] {
        std::fs::write(place("clips").join(name), &walk).expect("a clip");
    }
    std::fs::write(place("clips/notes.txt"), "tuesday is better").expect("a note");
    let asked =
        ["--batch", "clips", "--target", "mannequin.glb", "--report", "out/{name}.json", "--output", "out/{name}.glb"];
    let output = submit(folder.path(), &service.url, &asked);
    assert_eq!(output.status.code(), Some(0), "{}", told(&output));
    assert!(
        told(&output).contains("left out clips/notes.txt") && told(&output).contains("2 of 2"),
        "{}",
        told(&output)
    );
    let remote = std::fs::read(place("out/monday.glb")).expect("the result");
    assert!(remote == local(folder.path()), "the same bytes as one by one");
    assert!(place("out/tuesday.json").exists(), "every report");

    std::fs::write(place("clips/empty.bvh"), "HIERARCHY\nROOT Hips\n").expect("a clip that breaks off");
    let detached = submit(folder.path(), &service.url, &[&asked[..4], &["--detach"]].concat());
    let id = String::from_utf8(detached.stdout).expect("text");
    assert!(id.starts_with("bat_"), "the id alone: {id}");
    std::fs::remove_file(place("out/tuesday.glb")).expect("it was there");
    let came_back = submit(folder.path(), &service.url, &["--resume", id.trim(), "--output", "out/{name}.glb"]);
    let text = told(&came_back);
    assert_eq!(came_back.status.code(), Some(3), "an input is to blame: {text}");
    assert!(text.contains("failed: empty: ") && text.contains("2 of 3"), "which, and how many: {text}");
    assert!(place("out/tuesday.glb").exists() && !place("out/empty.glb").exists(), "the others are there");

    let one =
        submit(folder.path(), &service.url, &["--batch", "clips", "--target", "mannequin.glb", "--output", "one.glb"]);
    assert!(one.status.code() == Some(2) && told(&one).contains("{name}"), "all in one file: {}", told(&one));
    let nothing = submit(folder.path(), &service.url, &["--batch", "out.txt", "--output", "out/{name}.glb"]);
    assert_eq!(nothing.status.code(), Some(3), "no such list: {}", told(&nothing));
}
