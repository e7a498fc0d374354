//! Custom properties on their way from the source to the result.

use crate::{
    model::{Clip, Morph, MorphPlace, MorphTrack, Scene},
    retarget::{CurveDrive, carried_curves},
};

use super::{Failure, FailureCode};

/// The result with what is carried over beside the joints, and the target's scene with those curves in it; nothing where nothing is
/// carried over.
pub(super) fn with_curves(
    result: &Clip,
    clip: &Clip,
    source: &Scene,
    target: &Scene,
    drives: &[CurveDrive],
) -> Result<Option<(Scene, Clip)>, Failure> {
    if drives.is_empty() {
        return Ok(None);
    }
    let mut scene = target.clone();
    let mut tracks = result.morphs().to_vec();
    for (drive, values) in drives.iter().zip(carried_curves(clip, &source.morphs, drives)) {
        let own = scene.morphs.iter().position(|morph| morph.is_property() && morph.name == drive.name);
        let morph = own.unwrap_or(scene.morphs.len());
        if own.is_none() {
            scene.morphs.push(Morph { name: drive.name.clone(), rest: 0.0, place: MorphPlace::Property });
        }
        tracks.push(MorphTrack { morph, weights: values });
    }
    let result = result.clone().with_morphs(tracks);
    let result = result.map_err(|error| Failure::new(FailureCode::Internal, error.to_string()))?;
    Ok(Some((scene, result)))
}
