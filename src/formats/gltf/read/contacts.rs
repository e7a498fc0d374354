//! When joints rest on something, where an output of ours notes it in `asset.extras.retargetd.contacts`: for its first animation.
//!
//! Extras are anybody's. What does not look as our writer leaves it is somebody else's, and not read.

use serde_json::Value;

use crate::{
    formats::{Budget, FormatError},
    model::{Clip, JointContacts, Skeleton},
};

/// Times closer than this are the same, in seconds: key times are single precision in a file.
const SAME_TIME: f64 = 1e-4;

/// The clips, the first of them with its contacts.
pub(super) fn with_contacts(
    mut clips: Vec<Clip>,
    document: &Value,
    skeleton: &Skeleton,
    budget: &mut Budget<'_>,
) -> Result<Vec<Clip>, FormatError> {
    let noted = document["asset"]["extras"]["retargetd"]["contacts"].as_array().filter(|noted| !noted.is_empty());
    let Some((noted, clip)) = noted.zip(clips.first()) else { return Ok(clips) };
    let mut tracks: Vec<JointContacts> = Vec::new();
    for contact in noted {
        budget.check_canceled()?;
        let joint =
            contact["joint"].as_str().and_then(|name| (0..skeleton.len()).find(|joint| skeleton.label(*joint) == name));
        let Some((joint, spans)) = joint.zip(spans(&contact["seconds"])) else { continue };
        budget.take_array(clip.frame_count() as u64, size_of::<bool>() as u64, "/asset/extras")?;
        let is_within = |time: &f64| spans.iter().any(|[from, to]| (from - SAME_TIME..=to + SAME_TIME).contains(time));
        let touches: Vec<bool> = clip.times_seconds().iter().map(is_within).collect();
        match tracks.iter_mut().find(|track| track.joint == joint) {
            Some(track) => track.touches.iter_mut().zip(&touches).for_each(|(known, touches)| *known |= touches),
            None => tracks.push(JointContacts { joint, touches }),
        }
    }
    let first = clips.remove(0);
    // As long as the clip, so it fits.
    clips.insert(0, first.clone().with_contacts(tracks).unwrap_or(first));
    Ok(clips)
}

/// Pairs of finite numbers, where all elements are some.
fn spans(values: &Value) -> Option<Vec<[f64; 2]>> {
    let pair = |value: &Value| match value.as_array()?.as_slice() {
        [from, to] => Some([from.as_f64()?, to.as_f64()?]),
        _ => None,
    };
    values.as_array()?.iter().map(pair).collect()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::{
        formats::Limits,
        model::{Control, Joint, JointTracks, Transform},
    };

    fn read(document: &Value) -> Vec<JointContacts> {
        let joint = Joint { name: "foot".into(), parent: None, rest: Transform::IDENTITY, is_joint: true, node: 0 };
        let skeleton = Skeleton::new(vec![joint]).expect("a skeleton");
        let clip = Clip::new("walk".into(), vec![0.0, 0.5, 1.0], vec![JointTracks::default()]).expect("a clip");
        let (limits, control) = (Limits::default(), Control::new());
        let mut budget = Budget::new(&limits, &control);
        let clips = with_contacts(vec![clip], document, &skeleton, &mut budget).expect("clips");
        clips[0].contacts().to_vec()
    }

    fn noted(contacts: &Value) -> Value {
        json!({"asset": {"extras": {"retargetd": {"contacts": contacts}}}})
    }

    #[test]
    fn what_an_output_notes_is_read() {
        let found = read(&noted(&json!([{"joint": "foot", "frames": [[1, 2]], "seconds": [[0.500_01, 1.0]]}])));
        assert_eq!(found, [JointContacts { joint: 0, touches: vec![false, true, true] }], "to single precision");
    }

    #[test]
    fn what_is_somebody_elses_is_left_alone() {
        for contacts in [
            json!([{"joint": "foot", "frames": [[0, 1]]}]),
            json!([{"joint": "hand", "seconds": [[0.0, 1.0]]}]),
            json!([{"joint": "foot", "seconds": [[0.0]]}]),
            json!([3, null]),
            json!("no"),
        ] {
            assert_eq!(read(&noted(&contacts)), [], "{contacts}");
        }
    }
}
