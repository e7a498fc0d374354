//! What the engine found out lately and may need again, so that one character serves many clips, and one clip moves many characters, without
//! being read and recognized for each.

use std::{
    collections::VecDeque,
    sync::{Arc, Mutex, PoisonError},
};

use crate::{
    formats::{Format, Limits},
    model::{Reporter, Scene},
    rig::{RecognitionMemory, Recognizer, Rig, RigSpec, RigTemplate, rig_memory::RigMemory},
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
    /// What was worked out about the rigs in it.
    pub(super) rigs: RigMemories,
}

/// What was worked out about the rigs that one file was made into, by what they were made with.
#[derive(Debug, Default)]
pub(super) struct RigMemories(Mutex<VecDeque<(String, Arc<RigMemory>)>>);

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

impl RigMemories {
    /// How many ways to make a rig of the file are told apart: with several characters in it, and with several configs.
    const MAX_KEPT: usize = 4;

    /// Gives a rig what was worked out about the same one, and keeps what will be worked out about this one. It is to rest as the file and
    /// the spec say; what a rest file makes of it is not known here.
    pub(super) fn share(&self, rig: &mut Rig<'_>, spec: &RigSpec, templates: &[RigTemplate]) {
        // A rig is made of the file, of these and of nothing else.
        let Ok(made_with) = serde_json::to_string(&(spec, templates)) else { return };
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, memory)) = kept.iter().find(|(other, _)| *other == made_with) {
            rig.memory = Arc::clone(memory);
            return;
        }
        if kept.len() == Self::MAX_KEPT {
            kept.pop_front();
        }
        kept.push_back((made_with, Arc::clone(&rig.memory)));
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
        retarget_by(target, None, knowledge, limits)
    }

    fn retarget_by(target: NamedBytes<'_>, config: Option<&str>, knowledge: &Knowledge, limits: &Limits) -> Outcome {
        let walk = samples::walk_clip();
        let inputs = Inputs {
            source: NamedBytes { name: "walk.glb", bytes: &walk },
            target,
            source_rest: None,
            target_rest: None,
            config: config.map(|text| NamedBytes { name: "config.json", bytes: text.as_bytes() }),
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
    fn what_was_worked_out_of_a_rig_is_of_that_rig_alone() {
        let bytes = samples::mannequin();
        let target = NamedBytes { name: "mannequin.glb", bytes: &bytes };
        let limits = Limits::default();
        // The same file as other rigs: larger, with a foot that is turned, without toes, and as it is posed.
        let configs = [
            None,
            Some(r#"{"target": {"unit": 0.02}}"#),
            Some(r#"{"target": {"pose": [{"edit": "rotate", "joint": "foot_l", "degrees": [20, 0, 0]}]}}"#),
            Some(r#"{"target": {"roles": {"left_toe": []}}}"#),
            Some(r#"{"target": {"rest": "solved"}}"#),
        ];
        let knowledge = Knowledge::default().remembering(Arc::new(Memory::default()));
        for round in 0..2 {
            for config in configs {
                let plain = retarget_by(target, config, &Knowledge::default(), &limits);
                let outcome = retarget_by(target, config, &knowledge, &limits);
                assert_eq!(outcome.outputs[0].bytes, plain.outputs[0].bytes, "{config:?} in round {round}");
                assert_eq!(text(&outcome), text(&plain), "{config:?} in round {round}");
            }
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
