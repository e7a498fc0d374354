//! Requests that a tester makes up from the OpenAPI document: none of them is a fault of the service, and every answer is as declared.
//!
//! The tester is Schemathesis; `tests/run` installs it. A short run here; a long one with
//! `RETARGETD_TEST_EXAMPLES=200 cargo nextest run -E 'test(schema_fuzz)'`.

use std::{path::Path, process::Command};

use super::support::{ServiceProcess, start_service};
use crate::support::{count_of, python_with, skip};

/// Short waits, and nowhere to go: made-up webhooks are at made-up places, which may be somebody's.
const PACE: [&str; 8] =
    ["--default-wait", "2s", "--max-wait", "2s", "--event-stream-period", "200ms", "--outbound-deny", "0.0.0.0/0,::/0"];

/// What is not held against the service. A document cannot say which files exist and of which formats they are, so that what fits it may
/// still be refused; the hooks check instead that it is not refused for its form. And what may be left out is taken as left out where it is
/// null, which the document does not advertise: many languages write what is not there so.
const LEFT_OUT: &str = "positive_data_acceptance,negative_data_rejection";

/// Runs the tester, with these flags besides.
fn assert_conforms(server: &ServiceProcess, flags: &[&str]) {
    let Some(python) = python_with("schemathesis") else {
        return skip("requests made from the OpenAPI document, because Schemathesis is not installed");
    };
    let tools = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tools/schemathesis");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let examples = count_of("RETARGETD_TEST_EXAMPLES", 8).to_string();
    let output = Command::new(python)
        .args(["-m", "schemathesis.cli", "run", &format!("{}/openapi.json", server.url)])
        .args(["--exclude-checks", LEFT_OUT, "--max-examples", &examples, "--seed", "1", "--no-color"])
        // More workers than one trip over Python's own parser, which fails now and then in several threads.
        .args(["--workers", "1", "--request-timeout", "60"])
        .args(flags)
        .env("SCHEMATHESIS_HOOKS", "hooks")
        .env("PYTHONPATH", tools)
        .current_dir(folder.path())
        .output()
        .expect("the tester runs");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}\n{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.contains("generated"), "it has tried something: {text}");
}

#[test]
fn made_up_requests_meet_no_fault() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &PACE);
    assert_conforms(&server, &[]);
    assert_eq!(server.terminate(), Some(0), "and it is well afterwards");
}

#[test]
fn made_up_requests_with_a_key_meet_no_fault() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[&["--authentication", "keys"], &PACE[..]].concat());
    let key = Command::new(env!("CARGO_BIN_EXE_retargetd"))
        .args(["keys", "create", "tester", "--scope", "read", "--scope", "write", "--scope", "admin", "--data"])
        .arg(data.path())
        .output()
        .expect("it runs");
    let header = format!("Authorization: Bearer {}", String::from_utf8_lossy(&key.stdout).trim());
    // Else it finds its own key in the list and revokes it, and everything after that is a 401.
    assert_conforms(&server, &["--header", &header, "--exclude-operation-id", "revoke_key"]);
    assert_eq!(server.terminate(), Some(0), "and it is well afterwards");
}
