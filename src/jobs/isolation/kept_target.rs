//! The target that an engine process was sent last. The process keeps its bytes and the parent their digest, so that one character goes over
//! the pipe once for many clips.

use std::{io, sync::Arc};

use super::messages::Request;
use crate::engine::Memory;

/// Larger files are sent each time. What the engine does not keep read is not worth its bytes.
const MAX_BYTES: usize = Memory::MAX_FILE_BYTES;

/// What the parent knows of it.
#[derive(Debug, Default)]
pub(super) struct SentTarget {
    /// The SHA-256 of the target that the process keeps.
    sha256: Option<String>,
}

impl SentTarget {
    /// Whether the process keeps that one.
    pub(super) fn is(&self, sha256: &str) -> bool {
        self.sha256.as_deref() == Some(sha256)
    }

    /// Takes the bytes of the target out of what is to be sent, where the process has them; else knows that it has them from now on.
    pub(super) fn leave_out(&mut self, request: &mut Request, blobs: &mut Vec<&[u8]>, sha256: Option<&str>) {
        let Some(place) = request.place_of_target() else { return };
        if sha256.is_some_and(|sha256| self.is(sha256)) {
            request.target_is_kept = true;
            blobs.remove(place);
            return;
        }
        let is_kept = blobs.get(place).is_some_and(|target| target.len() <= MAX_BYTES);
        self.sha256 = sha256.filter(|_| is_kept).map(str::to_owned);
    }
}

/// What the process keeps.
#[derive(Debug, Default)]
pub(super) struct KeptTarget {
    bytes: Option<Arc<Vec<u8>>>,
}

impl KeptTarget {
    /// Puts the target back among the files of a request that came without it; keeps that of any other.
    ///
    /// # Errors
    /// When nothing is kept, which is a fault of the parent.
    pub(super) fn put_back(&mut self, request: &Request, blobs: Vec<Vec<u8>>) -> io::Result<Vec<Arc<Vec<u8>>>> {
        let mut blobs: Vec<Arc<Vec<u8>>> = blobs.into_iter().map(Arc::new).collect();
        let Some(place) = request.place_of_target().filter(|place| *place <= blobs.len()) else { return Ok(blobs) };
        if request.target_is_kept {
            let kept = self.bytes.as_ref().ok_or_else(|| io::Error::other("a target that was never sent"))?;
            blobs.insert(place, Arc::clone(kept));
        } else {
            self.bytes = blobs.get(place).filter(|target| target.len() <= MAX_BYTES).map(Arc::clone);
        }
        Ok(blobs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        engine::{Knowledge, Limits, NamedBytes},
        jobs::{EngineRequest, Files, Question},
    };

    const FIRST: &str = "digest of the first";
    const OTHER: &str = "digest of another";

    /// Sends a request from the one to the other; gives what was sent, and the files that the process sees.
    fn sent(
        sides: &mut (SentTarget, KeptTarget),
        source: Option<&[u8]>,
        target: Option<(&[u8], Option<&str>)>,
    ) -> (usize, Vec<Vec<u8>>) {
        let file = |bytes| NamedBytes { name: "file.glb", bytes };
        let files = Files {
            source: source.map(file),
            target: target.map(|(bytes, _)| file(bytes)),
            config: Some(file(b"{}")),
            ..Files::default()
        };
        let (knowledge, limits) = (Knowledge::default(), Limits::default());
        let asked =
            EngineRequest { question: Question::Retarget, files, formats: &[], knowledge: &knowledge, limits: &limits };
        let (mut request, mut blobs) = Request::new(&asked);
        sides.0.leave_out(&mut request, &mut blobs, target.and_then(|(_, sha256)| sha256));
        let arrived = blobs.iter().map(|blob| blob.to_vec()).collect();
        let whole = sides.1.put_back(&request, arrived).expect("it is kept");
        (blobs.len(), whole.iter().map(|blob| blob.to_vec()).collect())
    }

    #[test]
    fn a_target_is_sent_once() {
        let mut sides = (SentTarget::default(), KeptTarget::default());
        let all = |target: &[u8]| vec![b"clip".to_vec(), target.to_vec(), b"{}".to_vec()];
        let first = Some((&b"first"[..], Some(FIRST)));
        assert_eq!(sent(&mut sides, Some(b"clip"), first), (3, all(b"first")));
        assert_eq!(sent(&mut sides, Some(b"clip"), first), (2, all(b"first")), "the second time it is there");
        assert_eq!(sent(&mut sides, None, first), (1, vec![b"first".to_vec(), b"{}".to_vec()]), "wherever it stands");
        assert_eq!(sent(&mut sides, Some(b"clip"), None).0, 2, "a question without a target changes nothing");
        assert_eq!(sent(&mut sides, Some(b"clip"), first).0, 2);
        let other = Some((&b"other"[..], Some(OTHER)));
        assert_eq!(sent(&mut sides, Some(b"clip"), other), (3, all(b"other")), "another one takes its place");
        assert_eq!(sent(&mut sides, Some(b"clip"), first), (3, all(b"first")));
        let unknown = Some((&b"unknown"[..], None));
        assert_eq!(sent(&mut sides, Some(b"clip"), unknown), (3, all(b"unknown")), "so does one without a digest");
        assert_eq!(sent(&mut sides, Some(b"clip"), unknown), (3, all(b"unknown")), "which is sent each time");
        assert_eq!(sent(&mut sides, Some(b"clip"), first), (3, all(b"first")));
    }

    #[test]
    fn a_large_target_is_sent_each_time() {
        let mut sides = (SentTarget::default(), KeptTarget::default());
        let large = vec![7; MAX_BYTES + 1];
        for _ in 0..2 {
            let (count, files) = sent(&mut sides, Some(b"clip"), Some((&large, Some(FIRST))));
            assert_eq!((count, files[1].len()), (3, large.len()));
            assert!(sides.1.bytes.is_none(), "nobody keeps it");
        }
    }
}
