//! Webhooks of the real binary: told again by who comes after one that died, and told over HTTPS to who has a certificate of the studio's.

use std::{
    io::{BufRead, BufReader},
    path::Path,
    process::{Child, ChildStdout, Command, Stdio},
    time::Instant,
};

use reqwest::Client;
use serde_json::{Value, json};

use super::{
    studio::{CLIP, Customer, Place},
    support::{PATIENCE, ServiceProcess},
};
use crate::{
    http::receiver::{Receiver, Reply},
    support::{python_with, skip},
};

/// Receivers on this machine, and who took a message is not waited for any longer than a test can wait.
const FLAGS: [&str; 6] = ["--workers", "1", "--outbound-allow", "127.0.0.0/8", "--webhook-timeout", "2s"];

/// A service whose webhooks tell `url` of every job that succeeds, and the webhook's id.
async fn telling(place: &Place, url: &str, variables: &[(&'static str, String)]) -> (ServiceProcess, String) {
    let service = place.serve(&FLAGS, variables);
    let client = Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client");
    let body = json!({"url": url, "events": ["job.succeeded"]});
    let answer = client.post(format!("{}/v1/webhooks", service.url)).json(&body).send().await.expect("an answer");
    let webhook: Value = answer.json().await.expect("JSON");
    let id = webhook["id"].as_str().unwrap_or_else(|| panic!("it is made: {webhook}")).to_owned();
    (service, id)
}

async fn ended_job(url: &str) {
    let mut customer = Customer::new();
    let asset = customer.upload(url, CLIP).await.expect("is taken");
    assert!(customer.ask(url, &asset).await, "is taken");
    customer.collect(url).await;
}

/// The only delivery to a webhook, once that is true of it.
async fn delivery(url: &str, webhook: &str, is_so: impl Fn(&Value) -> bool) -> Value {
    let began = Instant::now();
    loop {
        let all = Customer::new().list(url, &format!("/v1/webhooks/{webhook}/deliveries")).await;
        assert!(all.len() < 2, "one end is one delivery: {all:?}");
        match all.into_iter().next() {
            Some(delivery) if is_so(&delivery) => return delivery,
            other => assert!(began.elapsed() < PATIENCE, "it comes to that: {other:?}"),
        }
        tokio::time::sleep(std::time::Duration::from_millis(50)).await;
    }
}

/// The receiver has the message, and whoever sent it is killed before that is written down: the next process tells it again.
#[tokio::test(flavor = "multi_thread")]
async fn who_dies_before_a_delivery_is_written_down_has_it_told_again() {
    let receiver = Receiver::start(&[Reply::Silence]);
    let place = Place::folder();
    let (mut service, webhook) = telling(&place, &receiver.url, &[]).await;
    ended_job(&service.url).await;
    receiver.hears(1).await;
    service.kill();
    let service = place.serve(&FLAGS, &[]);
    let heard = receiver.hears(2).await;
    assert_eq!(heard[0].id(), heard[1].id(), "the same message, by which a receiver knows it");
    assert_eq!(heard[0].json(), heard[1].json(), "word for word");
    let made = delivery(&service.url, &webhook, |delivery| delivery["state"] == "delivered").await;
    assert_eq!((&made["attempts"], &made["id"]), (&json!(2), &json!(heard[0].id())), "{made}");
    assert_eq!(receiver.heard().len(), 2, "and not once more");
}

/// A receiver over HTTPS with a certificate of an authority that only this test knows.
struct SecureReceiver {
    child: Child,
    output: BufReader<ChildStdout>,
    folder: tempfile::TempDir,
    url: String,
}

impl SecureReceiver {
    fn start() -> Option<Self> {
        let Some(python) = python_with("ssl") else {
            skip("no Python has its module 'ssl'");
            return None;
        };
        let folder = tempfile::tempdir().expect("a temporary folder");
        let new = ["req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "2"];
        openssl(
            folder.path(),
            &[&new[..], &["-subj", "/CN=studio", "-keyout", "authority.key", "-out", "authority.pem"]],
        );
        let leaf = ["-subj", "/CN=receiver", "-keyout", "receiver.key", "-out", "receiver.pem"];
        let signed = ["-CA", "authority.pem", "-CAkey", "authority.key"];
        let said = ["-addext", "subjectAltName=IP:127.0.0.1", "-addext", "basicConstraints=critical,CA:FALSE"];
        openssl(folder.path(), &[&new, &leaf, &signed, &said]);
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tools/https_receiver/receive.py");
        let mut command = Command::new(python);
        command.arg(script).args(["receiver.pem", "receiver.key"]).current_dir(folder.path()).stdout(Stdio::piped());
        let mut child = command.spawn().expect("it starts");
        let output = BufReader::new(child.stdout.take().expect("is piped"));
        let mut receiver = Self { child, output, folder, url: String::new() };
        receiver.url = format!("https://127.0.0.1:{}/hook", receiver.line().trim());
        Some(receiver)
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.output.read_line(&mut line).expect("it says something");
        line
    }

    /// Who vouches for it.
    fn authority(&self) -> String {
        self.folder.path().join("authority.pem").display().to_string()
    }
}

impl Drop for SecureReceiver {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn openssl(folder: &Path, arguments: &[&[&str]]) {
    let output = Command::new("openssl").args(arguments.concat()).current_dir(folder).output().expect("openssl runs");
    assert!(output.status.success(), "a certificate is made: {}", String::from_utf8_lossy(&output.stderr));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_receiver_with_a_certificate_of_the_studio_is_told_over_https() {
    let Some(mut receiver) = SecureReceiver::start() else { return };
    let place = Place::folder();
    let (service, webhook) = telling(&place, &receiver.url, &[]).await;
    ended_job(&service.url).await;
    let refused = delivery(&service.url, &webhook, |delivery| !delivery["last_error"].is_null()).await;
    assert_eq!((&refused["last_error"], &refused["state"]), (&json!("unreachable"), &json!("pending")), "a stranger");

    let place = Place::folder();
    let (service, webhook) = telling(&place, &receiver.url, &[("SSL_CERT_FILE", receiver.authority())]).await;
    ended_job(&service.url).await;
    let heard: Value = serde_json::from_str(&receiver.line()).expect("JSON");
    let made = delivery(&service.url, &webhook, |delivery| delivery["state"] == "delivered").await;
    assert_eq!((&heard["headers"]["webhook-id"], &heard["path"]), (&made["id"], &json!("/hook")), "{heard}");
    assert_eq!((&made["attempts"], &made["last_status"]), (&json!(1), &json!(204)), "at once: {made}");
}
