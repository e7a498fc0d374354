//! A server that webhooks are told at: it does what a script says, and remembers what it heard.

use std::{
    collections::{BTreeMap, VecDeque},
    io::{BufRead, BufReader, Read, Write},
    net::{TcpListener, TcpStream},
    sync::{Arc, Mutex},
    thread,
    time::{Duration, Instant},
};

use serde_json::Value;

use super::support::PATIENCE;

/// How one request is answered.
#[derive(Clone, Debug)]
pub(crate) enum Reply {
    /// With that status and that header (or an empty one).
    Status(u16, &'static str),
    /// With 200 and that body.
    File(String),
    /// Not at all, for as long as somebody waits.
    Silence,
    /// With a status at once, and a body that never ends.
    EndlessBody,
}

/// A request as it was heard.
#[derive(Clone, Debug)]
pub(crate) struct Heard {
    pub(crate) path: String,
    pub(crate) headers: BTreeMap<String, String>,
    pub(crate) body: String,
    pub(crate) at: Instant,
}

impl Heard {
    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.body).expect("JSON")
    }

    pub(crate) fn id(&self) -> &str {
        &self.headers["webhook-id"]
    }
}

#[derive(Debug, Default)]
struct Script {
    replies: VecDeque<Reply>,
    heard: Vec<Heard>,
}

/// The server; everything behind the end of its script is answered with 204.
pub(crate) struct Receiver {
    /// Where it listens.
    pub(crate) url: String,
    script: Arc<Mutex<Script>>,
}

impl Receiver {
    pub(crate) fn start(replies: &[Reply]) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let url = format!("http://{}/hook", listener.local_addr().expect("an address"));
        let script = Arc::new(Mutex::new(Script { replies: replies.iter().cloned().collect(), heard: Vec::new() }));
        let shared = Arc::clone(&script);
        thread::spawn(move || {
            for stream in listener.incoming().map_while(Result::ok) {
                let script = Arc::clone(&shared);
                thread::spawn(move || answer(stream, &script));
            }
        });
        Self { url, script }
    }

    pub(crate) fn heard(&self) -> Vec<Heard> {
        self.script.lock().expect("nobody panics").heard.clone()
    }

    /// Everything that was heard, when it is that much.
    pub(crate) async fn hears(&self, count: usize) -> Vec<Heard> {
        let began = Instant::now();
        loop {
            let heard = self.heard();
            if heard.len() >= count {
                return heard;
            }
            assert!(began.elapsed() < PATIENCE, "{count} messages come, not {}", heard.len());
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    }
}

/// Hears requests on one connection, and answers them.
fn answer(mut stream: TcpStream, script: &Mutex<Script>) {
    let mut reader = BufReader::new(stream.try_clone().expect("a socket"));
    while let Some(heard) = read(&mut reader) {
        let reply = {
            let mut script = script.lock().expect("nobody panics");
            script.heard.push(heard);
            script.replies.pop_front().unwrap_or(Reply::Status(204, ""))
        };
        let done = match reply {
            Reply::Status(status, header) => {
                let header = if header.is_empty() { String::new() } else { format!("{header}\r\n") };
                stream.write_all(format!("HTTP/1.1 {status} X\r\n{header}content-length: 0\r\n\r\n").as_bytes())
            }
            Reply::File(body) => {
                stream.write_all(format!("HTTP/1.1 200 X\r\ncontent-length: {}\r\n\r\n{body}", body.len()).as_bytes())
            }
            // Until the other side goes away.
            Reply::Silence => {
                let _ = reader.read(&mut [0]);
                return;
            }
            Reply::EndlessBody => {
                let mut done = stream.write_all(b"HTTP/1.1 200 X\r\ntransfer-encoding: chunked\r\n\r\n");
                while done.is_ok() {
                    done = stream.write_all(b"1\r\nx\r\n");
                    thread::sleep(Duration::from_millis(10));
                }
                done
            }
        };
        if done.is_err() {
            return;
        }
    }
}

fn read(reader: &mut BufReader<TcpStream>) -> Option<Heard> {
    let mut lines = Vec::new();
    loop {
        let mut line = String::new();
        if reader.read_line(&mut line).ok()? == 0 {
            return None;
        }
        let line = line.trim_end().to_owned();
        if line.is_empty() {
            break;
        }
        lines.push(line);
    }
    let headers: BTreeMap<String, String> = lines[1..]
        .iter()
        .filter_map(|line| line.split_once(": "))
        .map(|(name, value)| (name.to_lowercase(), value.to_owned()))
        .collect();
    let length = headers.get("content-length").and_then(|text| text.parse().ok()).unwrap_or(0);
    let mut body = vec![0; length];
    reader.read_exact(&mut body).ok()?;
    let path = lines[0].split(' ').nth(1).unwrap_or_default().to_owned();
    Some(Heard { path, headers, body: String::from_utf8(body).ok()?, at: Instant::now() })
}
