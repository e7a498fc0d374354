//! What the engine found out lately and may need again, so that one character serves many clips, and one clip moves many characters, without
//! being read and recognized for each.

use std::sync::{Arc, Mutex, PoisonError};

use crate::{
    formats::{Format, Limits},
    model::{Reporter, Scene},
    rig::{RecognitionMemory, Recognizer, RigTemplate},
};

use super::NamedBytes;

/// What was found out lately: the last source and the last target, read, and what skeletons mean. No answer depends on it, only how long it takes.
#[derive(Debug, Default)]
pub struct Memory {
    recognitions: RecognitionMemory,
    pub(super) source: LastFile,
    pub(super) target: LastFile,
}

/// A file that has been read.
#[derive(Debug)]
pub(super) struct LoadedFile {
    pub(super) scene: Scene,
    pub(super) format: Format,
    /// How much of it was decoded, as [`Limits::decoded_bytes`] counts.
    pub(super) decoded_bytes: u64,
    /// What there is to say of it.
    pub(super) warnings: Reporter,
}

/// The last file of one side, unless it is large.
#[derive(Debug, Default)]
pub(super) struct LastFile(Mutex<Option<KeptFile>>);

/// A file that was read, and what it was read from.
#[derive(Debug)]
struct KeptFile {
    name: String,
    bytes: Vec<u8>,
    limits: Limits,
    loaded: Arc<LoadedFile>,
}

impl Memory {
    /// A larger file is not kept.
    pub const MAX_FILE_BYTES: usize = 16 << 20;
    /// Nor one of which more was decoded.
    const MAX_DECODED_BYTES: u64 = 64 << 20;

    /// What recognizes with these templates.
    pub(super) fn recognizer<'a>(&'a self, templates: &'a [RigTemplate]) -> Recognizer<'a> {
        Recognizer { templates, memory: Some(&self.recognitions) }
    }
}

impl LastFile {
    /// The file as it was read before, where it is the last one.
    pub(super) fn recall(&self, file: NamedBytes<'_>, limits: &Limits) -> Option<Arc<LoadedFile>> {
        let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let is_same = |kept: &&KeptFile| kept.name == file.name && kept.limits == *limits && kept.bytes == file.bytes;
        kept.as_ref().filter(is_same).map(|kept| Arc::clone(&kept.loaded))
    }

    /// Keeps a file in place of the last one, unless it is large.
    pub(super) fn keep(&self, file: NamedBytes<'_>, limits: &Limits, loaded: &Arc<LoadedFile>) {
        let is_small = file.bytes.len() <= Memory::MAX_FILE_BYTES && loaded.decoded_bytes <= Memory::MAX_DECODED_BYTES;
        let kept = is_small.then(|| KeptFile {
            name: file.name.to_owned(),
            bytes: file.bytes.to_vec(),
            limits: *limits,
            loaded: Arc::clone(loaded),
        });
        let before = std::mem::replace(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner), kept);
        // Outside of the lock: it may be large.
        drop(before);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        engine::{Inputs, Knowledge, Outcome, retarget_with},
        model::Control,
        samples,
    };

    fn retarget(target: NamedBytes<'_>, knowledge: &Knowledge, limits: &Limits) -> Outcome {
        let walk = samples::walk_clip();
        let inputs = Inputs {
            source: NamedBytes { name: "walk.glb", bytes: &walk },
            target,
            source_rest: None,
            target_rest: None,
            config: None,
            formats: &[],
        };
        let mut outcome = retarget_with(&inputs, knowledge, limits, &Control::new()).expect("a retarget");
        outcome.report.timings = super::super::Timings::default();
        outcome
    }

    fn text(outcome: &Outcome) -> String {
        serde_json::to_string(&outcome.report).expect("JSON")
    }

    #[test]
    fn a_target_that_comes_again_gives_the_same_bytes_and_words() {
        let bytes = samples::mannequin();
        let target = NamedBytes { name: "mannequin.glb", bytes: &bytes };
        let limits = Limits::default();
        let plain = retarget(target, &Knowledge::default(), &limits);
        let memory = Arc::new(Memory::default());
        let knowledge = Knowledge::default().remembering(Arc::clone(&memory));
        for _ in 0..3 {
            let outcome = retarget(target, &knowledge, &limits);
            assert_eq!(outcome.outputs[0].bytes, plain.outputs[0].bytes);
            assert_eq!(text(&outcome), text(&plain));
            assert_eq!(outcome.resolved_spec, plain.resolved_spec);
            assert!(memory.target.recall(target, &limits).is_some(), "it is kept");
        }
    }

    #[test]
    fn another_file_name_or_limit_is_another_target() {
        let bytes = samples::mannequin();
        let mut other = bytes.clone();
        *other.last_mut().expect("bytes") ^= 1;
        let target = NamedBytes { name: "mannequin.glb", bytes: &bytes };
        let limits = Limits::default();
        let memory = Arc::new(Memory::default());
        retarget(target, &Knowledge::default().remembering(Arc::clone(&memory)), &limits);
        assert!(memory.target.recall(target, &limits).is_some());
        assert!(memory.target.recall(NamedBytes { name: "mannequin.vrm", ..target }, &limits).is_none());
        assert!(memory.target.recall(NamedBytes { bytes: &other, ..target }, &limits).is_none());
        assert!(memory.target.recall(target, &Limits { nodes: 7, ..limits }).is_none());
        memory.target.keep(NamedBytes { bytes: &vec![0; Memory::MAX_FILE_BYTES + 1], ..target }, &limits, &{
            let kept = memory.target.recall(target, &limits);
            kept.expect("kept")
        });
        assert!(memory.target.recall(target, &limits).is_none(), "a large file takes its place and is not kept");
    }
}
