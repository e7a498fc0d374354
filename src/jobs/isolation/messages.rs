//! What a parent asks of an engine process, and what that answers.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::sandbox::Sandbox;
use crate::{
    engine::{Limits, NamedBytes, Timings},
    jobs::{EngineRequest, Files, Question},
    store::{JobFailure, Judgment, StoredProgress},
};

/// To the process.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Message {
    /// A request. The blobs are the files that have names, in their order.
    Ask(Box<Request>),
    /// Nobody wants the answer any more.
    Cancel,
}

/// Everything that an answer depends on but the bytes of the files.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Request {
    pub(super) question: Question,
    /// Source, target, their rest poses, what goes beside a drawing, and the config: what each is called, where it is there.
    pub(super) names: [Option<String>; 6],
    /// Whether the bytes of the target are not among the blobs, since the process kept them.
    pub(super) target_is_kept: bool,
    pub(super) formats: Vec<String>,
    /// The user's own rig templates, as they are written: the process parses them.
    pub(super) rigs: Vec<String>,
    pub(super) limits: Limits,
    /// How many threads may work on it, which no answer depends on.
    pub(super) threads: usize,
}

/// From the process.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Reply {
    /// It can be asked, and has locked itself in so far.
    Ready(Sandbox),
    /// It is that far.
    Progress(StoredProgress),
    /// A retarget is done. The blobs are the report and the resolved spec, as JSON, and the outputs.
    EngineResult {
        timings: Timings,
        warnings: u64,
        judgment: Option<Judgment>,
        /// Format and name of each.
        outputs: Vec<(String, String)>,
    },
    /// The blob is a JSON document.
    Document,
    /// The blob is an encoded picture.
    Picture,
    /// The blob is a zip archive.
    Archive,
    /// The engine refuses.
    Failed(JobFailure),
    /// A fault in the engine.
    Panicked,
}

impl Request {
    /// A question, with the bytes that go with it.
    pub(super) fn new<'a>(asked: &EngineRequest<'a>) -> (Self, Vec<&'a [u8]>) {
        let Files { source, target, source_rest, target_rest, scene, config, target_sha256: _ } = asked.files;
        let files = [source, target, source_rest, target_rest, scene, config];
        let read = asked.knowledge.rigs().iter().filter_map(|rig| serde_json::to_string(rig).ok());
        let request = Self {
            question: asked.question.clone(),
            names: files.map(|file| file.map(|file| file.name.to_owned())),
            target_is_kept: false,
            formats: asked.formats.iter().map(|format| format.info().name.to_owned()).collect(),
            rigs: asked.knowledge.written().iter().cloned().chain(read).collect(),
            limits: *asked.limits,
            threads: 1,
        };
        (request, files.into_iter().flatten().map(|file| file.bytes).collect())
    }

    /// Where the target is among the blobs; nothing where there is none.
    pub(super) fn place_of_target(&self) -> Option<usize> {
        let [source, target, ..] = &self.names;
        target.as_ref().map(|_| usize::from(source.is_some()))
    }

    /// The files, as the engine takes them. All of them have to be among the blobs.
    pub(super) fn files<'a>(&'a self, blobs: &'a [Arc<Vec<u8>>]) -> Files<'a> {
        let mut blobs = blobs.iter();
        let mut file = |place: usize| {
            let name = self.names.get(place)?.as_deref()?;
            Some(NamedBytes { name, bytes: blobs.next().map_or(&[][..], |blob| blob.as_slice()) })
        };
        let (source, target, source_rest, target_rest) = (file(0), file(1), file(2), file(3));
        Files { source, target, source_rest, target_rest, scene: file(4), config: file(5), target_sha256: None }
    }
}
