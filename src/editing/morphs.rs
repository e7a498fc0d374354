//! Weights of morphs: moved over to another face, and carried along by the edits.

use std::collections::BTreeMap;

use crate::{
    model::{Clip, Morph, MorphPlace, MorphTrack, Track},
    rig::MorphMapping,
};

/// The weights of the target's morphs over the frames of a clip, whose own morphs are `source`.
///
/// Expressions of the target become the weights of the shapes that they are made of; where several move one shape, they add up, within
/// 0 and 1.
#[must_use]
pub fn moved_morphs(clip: &Clip, mapping: &MorphMapping, source: &[Morph], target: &[Morph]) -> Vec<MorphTrack> {
    let frames = clip.frame_count();
    let mut tracks: Vec<Option<&Track<f32>>> = vec![None; source.len()];
    for track in clip.morphs() {
        tracks[track.morph] = Some(&track.weights);
    }
    let mut moved: BTreeMap<usize, Vec<f32>> = BTreeMap::new();
    for drive in &mapping.drives {
        let weight = |frame: usize| {
            let of = |morph: usize| {
                let rest = source[morph].rest;
                f64::from(tracks[morph].map_or(rest, |track| track.at(frame, rest)))
            };
            drive.weight(of) as f32
        };
        let weights = (0..frames).map(weight);
        match &target[drive.target].place {
            MorphPlace::Mesh { .. } | MorphPlace::Weight | MorphPlace::Property => {
                moved.insert(drive.target, weights.collect());
            }
            MorphPlace::Expression(binds) => {
                let weights: Vec<f32> = weights.collect();
                // For files that know expressions and no meshes.
                moved.insert(drive.target, weights.clone());
                for (morph, share) in binds {
                    let shape = moved.entry(*morph).or_insert_with(|| vec![0.0; frames]);
                    for (shape, weight) in shape.iter_mut().zip(&weights) {
                        *shape = (*shape + weight * share).clamp(0.0, 1.0);
                    }
                }
            }
        }
    }
    let track = |(morph, weights)| MorphTrack { morph, weights: Track::Sampled(weights).compacted() };
    moved.into_iter().map(track).collect()
}

/// For each morph the one that it changes sides with: itself where its name has no side, or the other side is not there.
pub(super) fn twins(morphs: &[Morph], other_side: impl Fn(&str) -> Option<String>) -> Vec<usize> {
    let node = |morph: &Morph| match morph.place {
        MorphPlace::Mesh { node, .. } => Some(node),
        MorphPlace::Expression(_) | MorphPlace::Weight | MorphPlace::Property => None,
    };
    let mut by_name: BTreeMap<(Option<usize>, &str), usize> = BTreeMap::new();
    for (index, morph) in morphs.iter().enumerate() {
        by_name.entry((node(morph), &morph.name)).or_insert(index);
    }
    let twin = |(index, morph): (usize, &Morph)| {
        let other = other_side(&morph.name)?;
        by_name.get(&(node(morph), other.as_str())).copied().filter(|other| *other != index)
    };
    morphs.iter().enumerate().map(|(index, morph)| twin((index, morph)).unwrap_or(index)).collect()
}
