//! A reader of server-sent events, by the words of the HTML standard.

use std::{pin::Pin, time::Duration};

use futures::{Stream, StreamExt};
use reqwest::{RequestBuilder, Response, StatusCode};
use serde_json::Value;

/// One event as it was heard.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Heard {
    /// The last id that was given up to here; empty where none was.
    pub(crate) id: String,
    /// What it is called.
    pub(crate) event: String,
    pub(crate) data: Value,
}

type Chunks = Pin<Box<dyn Stream<Item = reqwest::Result<Vec<u8>>> + Send>>;

/// A stream that is being read.
pub(crate) struct EventReader {
    chunks: Chunks,
    text: String,
    last_id: String,
    /// Lines that are there for the sake of the connection.
    pub(crate) comments: usize,
}

impl EventReader {
    /// Asks, and begins to read.
    pub(crate) async fn open(request: RequestBuilder, last_id: Option<&str>) -> Self {
        let request = last_id.iter().fold(request, |request, id| request.header("last-event-id", *id));
        let answer = request.send().await.expect("an answer");
        assert_eq!(answer.status(), StatusCode::OK, "it streams");
        Self::read(answer)
    }

    fn read(answer: Response) -> Self {
        let media_type = answer.headers()["content-type"].to_str().expect("text").to_owned();
        assert_eq!(media_type, "text/event-stream", "the type of a stream");
        let chunks = answer.bytes_stream().map(|chunk| chunk.map(|bytes| bytes.to_vec()));
        Self { chunks: Box::pin(chunks), text: String::new(), last_id: String::new(), comments: 0 }
    }

    /// The next event; `None` when the stream has ended or was cut.
    pub(crate) async fn next(&mut self) -> Option<Heard> {
        loop {
            while let Some((block, rest)) = self.text.split_once("\n\n") {
                let (block, rest) = (block.to_owned(), rest.to_owned());
                self.text = rest;
                if let Some(heard) = self.event(&block) {
                    return Some(heard);
                }
            }
            let chunk = tokio::time::timeout(Duration::from_secs(60), self.chunks.next()).await.expect("something");
            let Some(Ok(chunk)) = chunk else { return None };
            self.text.push_str(&String::from_utf8(chunk).expect("whole letters"));
        }
    }

    /// The events that are left, to the end of the stream.
    pub(crate) async fn rest(&mut self) -> Vec<Heard> {
        let mut all = Vec::new();
        while let Some(heard) = self.next().await {
            all.push(heard);
        }
        all
    }

    fn event(&mut self, block: &str) -> Option<Heard> {
        let (mut event, mut data) = ("message".to_owned(), String::new());
        for line in block.lines() {
            let (field, value) = line.split_once(':').unwrap_or((line, ""));
            let value = value.strip_prefix(' ').unwrap_or(value);
            match field {
                "" => self.comments += 1,
                "id" => value.clone_into(&mut self.last_id),
                "event" => value.clone_into(&mut event),
                "data" => data.push_str(value),
                _ => {}
            }
        }
        let data = (!data.is_empty()).then(|| serde_json::from_str(&data).expect("JSON"))?;
        Some(Heard { id: self.last_id.clone(), event, data })
    }
}
