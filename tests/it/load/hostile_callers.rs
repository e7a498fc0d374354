//! What callers do who mean the service harm, or do not know better. Each goes on until its time is over and cares for no answer.

use std::{
    io::Write as _,
    net::IpAddr,
    sync::Arc,
    time::{Duration, Instant},
};

use reqwest::{Client, Method, multipart};
use serde_json::{Value, json};
use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _},
    net::{TcpListener, TcpSocket, TcpStream},
    task::JoinSet,
};

/// Somebody hostile.
pub(super) struct Hostile {
    pub(super) url: String,
    pub(super) key: String,
    /// Where it calls from, so that the service can tell callers apart.
    pub(super) from: [u8; 4],
    pub(super) until: Instant,
    client: Client,
    /// A file that it has.
    asset: String,
}

impl Hostile {
    pub(super) async fn new(url: &str, key: &str, from: [u8; 4], until: Instant) -> Arc<Self> {
        let client = Client::builder().timeout(Duration::from_secs(40)).no_proxy().local_address(IpAddr::from(from));
        let client = client.build().expect("a client");
        let mut own = Self { url: url.to_owned(), key: key.to_owned(), from, until, client, asset: String::new() };
        own.asset = own.upload("walk.glb", retargetd::samples::walk_clip()).await;
        Arc::new(own)
    }

    async fn upload(&self, name: &str, bytes: Vec<u8>) -> String {
        let answer = self.ask(Method::POST, &format!("/v1/assets?filename={name}")).body(bytes).send().await;
        let answer: Value = match answer {
            Ok(answer) => answer.json().await.unwrap_or_default(),
            Err(_) => Value::Null,
        };
        answer["id"].as_str().unwrap_or_default().to_owned()
    }

    fn ask(&self, method: Method, path: &str) -> reqwest::RequestBuilder {
        self.client.request(method, format!("{}{path}", self.url)).bearer_auth(&self.key)
    }

    fn is_over(&self) -> bool {
        Instant::now() >= self.until
    }

    async fn connect(&self) -> Option<TcpStream> {
        let socket = TcpSocket::new_v4().ok()?;
        socket.set_recv_buffer_size(4096).ok()?;
        socket.bind((IpAddr::from(self.from), 0).into()).ok()?;
        socket.connect(self.url.trim_start_matches("http://").parse().ok()?).await.ok()
    }

    /// Sends a request again and again, so many at a time.
    async fn flood(self: Arc<Self>, at_once: usize, request: impl Fn(&Self) -> reqwest::RequestBuilder) {
        let mut asked = JoinSet::new();
        while !self.is_over() {
            while asked.len() < at_once {
                asked.spawn(tokio::time::timeout_at(self.until.into(), request(&self).send()));
            }
            asked.join_next().await;
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    }

    /// Posts that again and again, twice at a time.
    fn post_again(self: Arc<Self>, path: &'static str, body: &Value) -> impl Future<Output = ()> + use<> {
        let body = body.to_string();
        self.flood(2, move |own| {
            own.ask(Method::POST, path).header("content-type", "application/json").body(body.clone())
        })
    }

    /// Opens connections, writes on each, and neither reads nor ends them; the next ones come when these are cut off.
    async fn hold(self: Arc<Self>, connections: usize, begin: String, then: String, pause: Duration) {
        let mut held = JoinSet::new();
        while !self.is_over() {
            while held.len() < connections {
                let (own, begin, then) = (Arc::clone(&self), begin.clone(), then.clone());
                held.spawn(async move {
                    let Some(mut stream) = own.connect().await else { return };
                    if stream.write_all(begin.as_bytes()).await.is_err() {
                        return;
                    }
                    while !own.is_over() && stream.write_all(then.as_bytes()).await.is_ok() {
                        tokio::time::sleep(pause).await;
                    }
                });
            }
            tokio::time::sleep(Duration::from_millis(100)).await;
            while held.try_join_next().is_some() {}
        }
    }

    fn head(&self, path: &str, more: &str) -> String {
        format!("POST {path} HTTP/1.1\r\nhost: localhost\r\nauthorization: Bearer {}\r\n{more}\r\n", self.key)
    }

    fn job(&self, config: &Value) -> Value {
        let file = json!({"asset": self.asset});
        json!({"source": file, "target": file, "config": config})
    }
}

/// A name, and what is done under it.
pub(super) type Behavior = (&'static str, fn(Arc<Hostile>, &mut JoinSet<()>));

/// A chunk of a body without an end, framed.
fn chunk() -> String {
    format!("1000\r\n{}\r\n", "x".repeat(0x1000))
}

/// How long the fast ones pause, so that it is not the test that has the machine.
const FAST: Duration = Duration::from_millis(5);

/// Everything that is done at once.
pub(super) const BEHAVIORS: [Behavior; 22] = [
    ("matrices of values", |own, all| drop(all.spawn(own.post_again("/v1/batches", &matrix(false))))),
    ("matrices of texts", |own, all| drop(all.spawn(own.post_again("/v1/batches", &matrix(true))))),
    ("defaults for a thousand items", |own, all| {
        let items = vec![json!({"labels": {}}); 1000];
        let defaults = own.job(&json!({"x": "x".repeat(60_000)}));
        let body = json!({"defaults": defaults, "items": items, "validate_only": true});
        drop(all.spawn(own.post_again("/v1/batches", &body)));
    }),
    ("endless headers of parts", |own, all| {
        let begin = "--b\r\nX: ";
        let head =
            own.head("/v1/retarget", "content-type: multipart/form-data; boundary=b\r\ntransfer-encoding: chunked\r\n");
        let begin = format!("{head}{:x}\r\n{begin}\r\n", begin.len());
        drop(all.spawn(own.hold(8, begin, chunk(), FAST)));
    }),
    ("endless preambles", |own, all| {
        let head =
            own.head("/v1/jobs", "content-type: multipart/form-data; boundary=b\r\ntransfer-encoding: chunked\r\n");
        drop(all.spawn(own.hold(8, head, chunk(), FAST)));
    }),
    ("uploads that trickle", |own, all| {
        let head = own.head("/v1/assets?filename=a.bvh", "transfer-encoding: chunked\r\n");
        drop(all.spawn(own.hold(32, head, "1\r\nx\r\n".into(), Duration::from_millis(500))));
    }),
    ("headers that trickle", |own, all| {
        drop(all.spawn(own.hold(32, "GET /livez HTTP/1.1\r\nx: ".into(), "y".into(), Duration::from_millis(200))));
    }),
    ("answers that nobody reads", |own, all| {
        let many = "GET /openapi.json HTTP/1.1\r\nhost: localhost\r\n\r\n".repeat(50);
        drop(all.spawn(own.hold(64, many, String::new(), Duration::from_secs(1))));
    }),
    ("connections without a word", |own, all| {
        drop(all.spawn(own.hold(128, String::new(), String::new(), Duration::from_secs(1))));
    }),
    ("long polls", |own, all| {
        drop(all.spawn(async move {
            let job = posted(&own, "/v1/jobs", own.job(&json!({"edit": {"fps": 1000}}))).send().await;
            let Ok(answer) = job else { return };
            let job: Value = answer.json().await.unwrap_or_default();
            let path = format!("/v1/jobs/{}", job["id"].as_str().unwrap_or("job_none"));
            own.flood(256, move |own| own.ask(Method::GET, &path).header("prefer", "wait=30")).await;
        }));
    }),
    ("event streams", |own, all| {
        drop(all.spawn(async move {
            let mut open = Vec::new();
            while !own.is_over() {
                if open.len() < 128
                    && let Ok(stream) = own.ask(Method::GET, "/v1/events").send().await
                {
                    open.push(stream);
                }
                tokio::time::sleep(Duration::from_millis(20)).await;
            }
        }));
    }),
    ("webhooks into tar", |own, all| drop(all.spawn(tarpit(own)))),
    ("archives that swell", |own, all| {
        drop(all.spawn(async move {
            let asset = own.upload("bomb.npz", swelling_archive()).await;
            own.flood(4, move |own| own.ask(Method::GET, &format!("/v1/assets/{asset}/skeleton"))).await;
        }));
    }),
    ("FBX made of chance", |own, all| {
        drop(all.spawn(own.flood(4, |own| {
            let mut bytes = b"Kaydara FBX Binary  \x00\x1a\x00\xe8\x1c\x00\x00".to_vec();
            bytes.extend((0..4096_u64).map(|place| (place.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 56) as u8));
            let part = |name: &str| multipart::Part::bytes(bytes.clone()).file_name(format!("{name}.fbx"));
            let form = multipart::Form::new().part("source", part("source")).part("target", part("target"));
            own.ask(Method::POST, "/v1/retarget").multipart(form)
        })));
    }),
    ("templates of a mebibyte", |own, all| {
        drop(all.spawn(own.flood(2, |own| {
            let names: Vec<String> = (0..20_000).map(|number| format!("joint_{number:032}")).collect();
            own.ask(Method::PUT, "/v1/rigs/huge").json(&json!({"kind": "biped", "roles": {"pelvis": names}}))
        })));
    }),
    ("jobs that are canceled at once", |own, all| {
        drop(all.spawn(async move {
            while !own.is_over() {
                let job = posted(&own, "/v1/jobs", own.job(&json!({"edit": {"fps": 240}}))).send().await;
                let Ok(answer) = job else { continue };
                let job: Value = answer.json().await.unwrap_or_default();
                if let Some(id) = job["id"].as_str() {
                    let _ = own.ask(Method::POST, &format!("/v1/jobs/{id}/cancel")).send().await;
                }
                tokio::time::sleep(Duration::from_millis(20)).await;
            }
        }));
    }),
    ("labels without number", |own, all| {
        let labels: serde_json::Map<String, Value> = (0..10_000).map(|n| (format!("l{n}"), json!("x"))).collect();
        let mut job = own.job(&json!({}));
        job["labels"] = Value::Object(labels);
        drop(all.spawn(own.post_again("/v1/jobs", &job)));
    }),
    ("edits to a thousand frames a second", |own, all| {
        let job = own.job(&json!({"edit": {"fps": 1000}}));
        drop(all.spawn(own.post_again("/v1/jobs", &job)));
    }),
    ("suggestions", |own, all| {
        drop(all.spawn(own.flood(16, |own| {
            let file = json!({"asset": own.asset});
            posted(own, "/v1/mapping-suggestions", json!({"source": file, "target": file}))
        })));
    }),
    ("configs in batches that are only checked", |own, all| {
        let items: Vec<Value> = (0..200).map(|number| own.job(&json!({"edit": {"fps": 10 + number}}))).collect();
        drop(all.spawn(own.post_again("/v1/batches", &json!({"items": items, "validate_only": true}))));
    }),
    ("lists of what waits", |own, all| {
        drop(all.spawn(own.flood(8, |own| own.ask(Method::GET, "/v1/jobs?state=queued&limit=100"))));
    }),
    ("keys that are none", |own, all| {
        drop(all.spawn(own.flood(8, |own| {
            own.client.get(format!("{}/v1/jobs", own.url)).bearer_auth("rtk_01j9z3k8m0q4r6t8v0x2y4a6c8_0000")
        })));
    }),
];

fn posted(own: &Hostile, path: &str, body: Value) -> reqwest::RequestBuilder {
    own.ask(Method::POST, path).json(&body)
}

/// About a mebibyte that asks for a thousand times as much.
fn matrix(is_text: bool) -> Value {
    let file = json!({"asset": "ast_01j9z3k8m0q4r6t8v0x2y4a6c8"});
    let config = if is_text { json!({"x": "x".repeat(1_000_000)}) } else { json!({"x": vec![0; 490_000]}) };
    json!({"matrix": {"specs": [{"config": config}], "sources": vec![&file; 32], "targets": vec![&file; 31]}})
}

/// An archive of pose arrays whose one member is a thousand times as large as the archive.
fn swelling_archive() -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Deflated);
    archive.start_file("rotations.npy", options).expect("a member");
    let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (1000000, 64), }\n";
    archive.write_all(b"\x93NUMPY\x01\x00").expect("written");
    archive.write_all(&u16::try_from(header.len()).expect("short").to_le_bytes()).expect("written");
    archive.write_all(header.as_bytes()).expect("written");
    let zeros = vec![0; 1 << 20];
    for _ in 0..64 {
        archive.write_all(&zeros).expect("written");
    }
    archive.finish().expect("an archive").into_inner()
}

/// A receiver that takes every delivery and answers none, and jobs that tell it of their ends.
async fn tarpit(own: Arc<Hostile>) {
    let Ok(listener) = TcpListener::bind("127.0.0.1:0").await else { return };
    let Ok(address) = listener.local_addr() else { return };
    let until = own.until;
    let tar = tokio::spawn(tokio::time::timeout_at(until.into(), async move {
        let mut stuck = Vec::new();
        while let Ok((mut stream, _)) = listener.accept().await {
            let mut some = [0; 64];
            let _ = stream.read(&mut some).await;
            stuck.push(stream);
        }
    }));
    for _ in 0..4 {
        let webhook = posted(&own, "/v1/webhooks", json!({"url": format!("http://{address}/")})).send().await;
        let Ok(webhook) = webhook else { continue };
        let webhook: Value = webhook.json().await.unwrap_or_default();
        let Some(id) = webhook["id"].as_str() else { continue };
        for _ in 0..8 {
            let _ = own.ask(Method::POST, &format!("/v1/webhooks/{id}/ping")).send().await;
        }
    }
    let _ = tar.await;
}
