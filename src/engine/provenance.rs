//! What an output says of where it came from.

use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use crate::model::{Clip, Skeleton};

/// What an output is made of.
pub(super) struct Provenance<'a> {
    /// The digest of the file with the animation.
    pub(super) source_sha256: String,
    /// The spec with everything filled in.
    pub(super) resolved_spec: &'a Value,
    /// Index of the clip of the file that the result is an edit of.
    pub(super) edited_clip: Option<usize>,
}

impl<'a> Provenance<'a> {
    /// Of a file with an animation.
    pub(super) fn of(source: &[u8], resolved_spec: &'a Value) -> Self {
        Self { source_sha256: digest_of(source), resolved_spec, edited_clip: None }
    }

    /// For the `extras` of an output: who made it, of what, by which spec, and when joints of the result rest on something.
    pub(super) fn extras(&self, clip: &Clip, skeleton: &Skeleton) -> Value {
        let mut extras = json!({
            "engine": engine(),
            "source_clip": clip.name(),
            "source_sha256": self.source_sha256,
            "spec_version": self.resolved_spec.get("version").cloned().unwrap_or_default(),
            "spec_sha256": digest_of(self.resolved_spec.to_string().as_bytes()),
        });
        let contacts: Vec<Value> = clip
            .contacts()
            .iter()
            .map(|contact| {
                let frames = spans(&contact.touches);
                let seconds = |span: &[usize; 2]| span.map(|frame| clip.times_seconds()[frame]);
                let seconds: Vec<[f64; 2]> = frames.iter().map(seconds).collect();
                json!({"joint": skeleton.label(contact.joint), "frames": frames, "seconds": seconds})
            })
            .collect();
        if !contacts.is_empty() {
            extras["contacts"] = json!(contacts);
        }
        extras
    }
}

/// Who made an output.
pub(super) fn engine() -> Value {
    json!({ "name": env!("CARGO_PKG_NAME"), "version": env!("CARGO_PKG_VERSION") })
}

/// The SHA-256 of bytes.
pub(super) fn digest_of(bytes: &[u8]) -> String {
    digest(Sha256::new_with_prefix(bytes))
}

/// The SHA-256 of all that a hasher was given.
pub(super) fn digest(hasher: Sha256) -> String {
    hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// First and last frame of every run of frames in which something is so.
fn spans(frames: &[bool]) -> Vec<[usize; 2]> {
    let mut spans: Vec<[usize; 2]> = Vec::new();
    for frame in (0..frames.len()).filter(|frame| frames[*frame]) {
        match spans.last_mut() {
            Some([_, last]) if *last + 1 == frame => *last = frame,
            _ => spans.push([frame, frame]),
        }
    }
    spans
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_frames_are_told_by_their_ends() {
        let spans = spans(&[true, true, false, true, false, false, true, true, true]);
        assert_eq!(spans, [[0, 1], [3, 3], [6, 8]], "first and last");
        assert_eq!(digest_of(b"abc").get(..8), Some("ba7816bf"), "SHA-256 as FIPS 180 gives it");
    }
}
