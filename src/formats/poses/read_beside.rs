//! What pose arrays hold beside joints: contacts, and the weights of morphs.

use crate::{
    formats::{Budget, FormatError, Limit},
    model::{Clip, JointContacts, Morph, MorphPlace, MorphTrack, Skeleton, Track},
};

use super::arrays::{Arrays, NumberArray, invalid, missing, require_shape};

/// The morphs that the file has weights of.
pub(super) fn morphs(arrays: &mut Arrays, budget: &mut Budget<'_>) -> Result<Vec<Morph>, FormatError> {
    let names = arrays.names.remove("morph_names").unwrap_or_default();
    budget.take_array(names.len() as u64, size_of::<Morph>() as u64, "morph_names")?;
    Ok(names.into_iter().map(|name| Morph { name, rest: 0.0, place: MorphPlace::Weight }).collect())
}

/// The clip with those weights.
pub(super) fn with_morph_weights(
    clip: Clip,
    weights: Option<&NumberArray>,
    morphs: usize,
    budget: &mut Budget<'_>,
) -> Result<Clip, FormatError> {
    let Some(weights) = weights else { return Ok(clip) };
    let frames = clip.frame_count();
    require_shape(weights, "morph_weights", &[("F", Some(frames)), ("M", Some(morphs))])?;
    weights.require_finite("morph_weights")?;
    let samples = (frames as u64).saturating_mul(morphs as u64);
    budget.take(Limit::Samples, samples, "morph_weights")?;
    budget.take_array(samples, size_of::<f32>() as u64, "morph_weights")?;
    let track = |morph: usize| {
        let values = (0..frames).map(|frame| weights.value(frame * morphs + morph) as f32).collect();
        MorphTrack { morph, weights: Track::Sampled(values).compacted() }
    };
    clip.with_morphs((0..morphs).map(track).collect()).map_err(|error| invalid("morph_weights", error.to_string()))
}

/// The clip with its contacts.
pub(super) fn with_contacts(
    clip: Clip,
    arrays: &mut Arrays,
    skeleton: &Skeleton,
    budget: &mut Budget<'_>,
) -> Result<Clip, FormatError> {
    let names = arrays.names.remove("contact_joints");
    let (names, contacts) = match (names, arrays.numbers.remove("contacts")) {
        (Some(names), Some(contacts)) => (names, contacts),
        (None, None) => return Ok(clip),
        (Some(_), None) => return Err(missing("contacts")),
        (None, Some(_)) => return Err(missing("contact_joints")),
    };
    let (frames, count) = (clip.frame_count(), names.len());
    require_shape(&contacts, "contacts", &[("F", Some(frames)), ("C", Some(count))])?;
    budget.take_array((frames as u64).saturating_mul(count as u64), size_of::<bool>() as u64, "contacts")?;
    let mut tracks = Vec::with_capacity(count);
    for (column, name) in names.iter().enumerate() {
        let joint = skeleton.joints().iter().position(|joint| joint.name == *name);
        let joint = joint.ok_or_else(|| {
            invalid(format!("contact_joints[{column}]"), format!("'{name}' is none of the joint_names"))
        })?;
        let touches = (0..frames).map(|frame| contacts.value(frame * count + column) > 0.5).collect();
        tracks.push(JointContacts { joint, touches });
    }
    clip.with_contacts(tracks).map_err(|error| invalid("contacts", error.to_string()))
}
