//! What a parent asks of an engine process, and what that answers.

use serde::{Deserialize, Serialize};

use super::sandbox::Sandbox;
use crate::{
    engine::{Format, Inputs, Knowledge, Limits, NamedBytes, Timings},
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

/// What is to be done.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Task {
    Retarget,
    Inspect,
    Propose,
    Explain { frame: usize, joint: String },
    CheckConfig,
}

/// Everything that an answer depends on but the bytes of the files.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Request {
    pub(super) task: Task,
    /// Source, target, their rest poses and the config: what each is called, where it is there.
    pub(super) names: [Option<String>; 5],
    pub(super) formats: Vec<String>,
    /// The user's own rig templates, as they are written: the process parses them.
    pub(super) rigs: Vec<String>,
    pub(super) limits: Limits,
    /// How many threads may work on it, which no answer depends on.
    pub(super) threads: usize,
}

/// From the process.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Answer {
    /// It can be asked, and has locked itself in so far.
    Ready(Sandbox),
    /// It is that far.
    Progress(StoredProgress),
    /// A retarget is done. The blobs are the report and the resolved spec, as JSON, and the outputs.
    Ran {
        timings: Timings,
        warnings: u64,
        judgment: Option<Judgment>,
        /// Format and name of each.
        outputs: Vec<(String, String)>,
    },
    /// The blob is a JSON document.
    Document,
    /// The engine refuses.
    Failed(JobFailure),
    /// A fault in the engine.
    Panicked,
}

impl Request {
    /// A request about the inputs of a job, with the bytes that go with it.
    pub(super) fn new<'a>(
        task: Task,
        inputs: &Inputs<'a>,
        knowledge: &Knowledge,
        limits: &Limits,
    ) -> (Self, Vec<&'a [u8]>) {
        let files = [Some(inputs.source), Some(inputs.target), inputs.source_rest, inputs.target_rest, inputs.config];
        let formats = inputs.formats.iter().map(|format| format.info().name.to_owned()).collect();
        Self::of(task, files, formats, knowledge, limits)
    }

    /// A request about one file.
    pub(super) fn of_one<'a>(
        task: Task,
        file: NamedBytes<'a>,
        knowledge: &Knowledge,
        limits: &Limits,
    ) -> (Self, Vec<&'a [u8]>) {
        Self::of(task, [Some(file), None, None, None, None], Vec::new(), knowledge, limits)
    }

    fn of<'a>(
        task: Task,
        files: [Option<NamedBytes<'a>>; 5],
        formats: Vec<String>,
        knowledge: &Knowledge,
        limits: &Limits,
    ) -> (Self, Vec<&'a [u8]>) {
        let names = files.map(|file| file.map(|file| file.name.to_owned()));
        let read = knowledge.rigs().iter().filter_map(|rig| serde_json::to_string(rig).ok());
        let rigs = knowledge.written().iter().cloned().chain(read).collect();
        let blobs = files.into_iter().flatten().map(|file| file.bytes).collect();
        (Self { task, names, formats, rigs, limits: *limits, threads: 1 }, blobs)
    }

    /// The files, as the engine takes them. A file that should be there and is not is empty.
    pub(super) fn inputs<'a>(&'a self, blobs: &'a [Vec<u8>], formats: &'a [Format]) -> Inputs<'a> {
        let mut blobs = blobs.iter();
        let mut file = |place: usize| {
            let name = self.names.get(place)?.as_deref()?;
            Some(NamedBytes { name, bytes: blobs.next().map_or(&[][..], Vec::as_slice) })
        };
        let empty = NamedBytes { name: "", bytes: &[] };
        let (source, target) = (file(0).unwrap_or(empty), file(1).unwrap_or(empty));
        let (source_rest, target_rest, config) = (file(2), file(3), file(4));
        Inputs { source, target, source_rest, target_rest, config, formats }
    }
}
