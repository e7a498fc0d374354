//! Faces fitted by what their meshes do.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use crate::{
    editing::{FitRule, FitSide, MorphFit},
    formats::{ErrorKind, FormatError, Limits, morph_meshes},
    model::{Canceled, Clip, Control, MorphMesh, MorphTrack, Reporter, Scene, Track},
    rig::{MorphFitSpec, Rig, SpecError, SpecErrorKind, SpecField},
};

use super::{Failure, files::in_config};

/// When more of the source's motion than this is not met, a word is due.
const MUCH_MISSED: f64 = 0.4;
/// When more than this is not met, names say more than the meshes do.
const MAX_MISSED: f64 = 0.75;
/// When corresponding points are farther apart than this share of the face, the faces may not lie over each other.
const FAR_APART: f64 = 0.05;

/// How well the target's shapes do what the source's do, where weights were fitted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FaceFitView {
    /// Shapes of the source's meshes.
    pub source_shapes: usize,
    /// Shapes of the target that were solved for; those of one name on several meshes are one.
    pub target_shapes: usize,
    /// Vertices of the target that have a place on the source's face.
    pub points: usize,
    /// Whether both meshes have the same vertices in the same order.
    pub same_topology: bool,
    /// How far apart corresponding points are on average, as a share of the target's face.
    pub mean_distance_share: f64,
    /// The displacement that the target misses over all frames, as a share of the source's: root mean squares.
    pub missed_share: f64,
    /// The frame in which most is missed.
    pub worst_frame: usize,
}

/// Weights of shapes of the target, solved frame by frame, but of those that `is_taken`; nothing, and a warning why, where the files
/// hold no two faces that can be compared, or one can do next to nothing of what the other does.
pub(super) fn fitted(
    clip: &Clip,
    (source, target): (&Rig<'_>, &Rig<'_>),
    spec: &MorphFitSpec,
    is_taken: impl Fn(usize) -> bool,
    (limits, control): (&Limits, &Control),
    reporter: &mut Reporter,
) -> Result<Option<(Vec<MorphTrack>, FaceFitView)>, Failure> {
    check(spec)?;
    let mut impossible = |side: &str, detail: String| {
        let hint = "send meshes of much the same shape with uncompressed morph targets, or leave morphs.fit out";
        reporter.warn("morphs_fit_impossible", side, detail, hint);
    };
    let mut meshes = Vec::with_capacity(2);
    for (side, rig) in [("source", source), ("target", target)] {
        match morph_meshes(rig.scene, limits, control) {
            Ok(found) if !found.is_empty() => meshes.push(found),
            Ok(_) => {
                impossible(side, format!("the {side} holds no mesh with morph targets; faces go by names"));
                return Ok(None);
            }
            Err(error) if error.kind == ErrorKind::Canceled => return Err(Canceled.into()),
            Err(FormatError { place, detail, .. }) => {
                impossible(
                    side,
                    format!("the meshes of the {side} cannot be read ({place}: {detail}); faces go by names"),
                );
                return Ok(None);
            }
        }
    }
    let [source_meshes, target_meshes] = &meshes[..] else { return Ok(None) };
    let source_shapes: Vec<Vec<usize>> = morphs_of(source_meshes).map(|morph| vec![morph]).collect();
    let target_shapes = shapes_by_name(target.scene, target_meshes, is_taken);
    let rule = FitRule { bounds: spec.bounds, regularization: spec.regularization };
    let (source_places, target_places) = (landmarks(source), landmarks(target));
    let side = |meshes, shapes, rig: &Rig<'_>, landmarks| FitSide {
        meshes,
        shapes,
        landmarks,
        turn: rig.canonical_from_scene,
    };
    let fit = MorphFit::new(
        side(source_meshes, &source_shapes, source, &source_places),
        side(target_meshes, &target_shapes, target, &target_places),
        rule,
    );
    let Some(fit) = fit else {
        impossible("target", "the two faces have no moving points in common; faces go by names".to_owned());
        return Ok(None);
    };
    let frames = solved(&fit, clip, source.scene, &source_shapes, control)?;
    let view = view(&fit, &frames, target_shapes.len());
    if view.missed_share > MAX_MISSED {
        let missed = view.missed_share * 100.0;
        impossible(
            "target",
            format!("the target's shapes miss {missed:.0} % of what the source's face does; faces go by names"),
        );
        return Ok(None);
    }
    report(&view, reporter);
    let tracks = target_shapes.iter().enumerate().flat_map(|(shape, morphs)| {
        let weights: Vec<f32> = frames.iter().map(|frame| frame.weights[shape] as f32).collect();
        let track = Track::Sampled(weights).compacted();
        morphs.iter().map(move |morph| MorphTrack { morph: *morph, weights: track.clone() })
    });
    Ok(Some((tracks.collect(), view)))
}

fn check(spec: &MorphFitSpec) -> Result<(), Failure> {
    let [least, most] = spec.bounds;
    if least.is_finite() && most.is_finite() && least <= 0.0 && most >= 0.0 && least < most {
        return Ok(());
    }
    let detail = format!("[{least}, {most}] are not bounds of weights; the lower bound comes first, and 0 lies within");
    let field = SpecField::new(SpecErrorKind::InvalidValue, "/morphs/fit/bounds", detail);
    SpecError::from_fields(vec![field]).map_or(Ok(()), |error| Err(in_config(error)))
}

/// Where the eyes are, at rest.
fn landmarks(rig: &Rig<'_>) -> Vec<(usize, DVec3)> {
    let rest = rig.skeleton().rest_pose().to_model(rig.skeleton());
    let place = |(number, role): (usize, &str)| {
        let joint = *rig.role(role).first()?;
        Some((number, rest.transforms()[joint].translation))
    };
    ["left_eye", "right_eye"].into_iter().enumerate().filter_map(place).collect()
}

fn morphs_of(meshes: &[MorphMesh]) -> impl Iterator<Item = usize> {
    meshes.iter().flat_map(|mesh| mesh.first..mesh.first + mesh.displacements.len())
}

/// The morphs of each name, which move together, in the order of the file.
fn shapes_by_name(scene: &Scene, meshes: &[MorphMesh], is_taken: impl Fn(usize) -> bool) -> Vec<Vec<usize>> {
    let mut place_of: BTreeMap<&str, usize> = BTreeMap::new();
    let mut shapes: Vec<Vec<usize>> = Vec::new();
    for morph in morphs_of(meshes).filter(|morph| !is_taken(*morph)) {
        let place = *place_of.entry(&scene.morphs[morph].name).or_insert(shapes.len());
        if place == shapes.len() {
            shapes.push(Vec::new());
        }
        shapes[place].push(morph);
    }
    shapes
}

/// What was found for one frame.
struct Solved {
    weights: Vec<f64>,
    missed: f64,
    wanted: f64,
}

fn solved(
    fit: &MorphFit,
    clip: &Clip,
    source: &Scene,
    shapes: &[Vec<usize>],
    control: &Control,
) -> Result<Vec<Solved>, Failure> {
    let mut tracks: Vec<Option<&Track<f32>>> = vec![None; source.morphs.len()];
    for track in clip.morphs() {
        tracks[track.morph] = Some(&track.weights);
    }
    let frame = |frame: usize| -> Result<Solved, Failure> {
        control.check()?;
        let weight = |morph: usize| {
            let rest = source.morphs[morph].rest;
            f64::from(tracks[morph].map_or(rest, |track| track.at(frame, rest)))
        };
        let given: Vec<f64> = shapes.iter().map(|shape| weight(shape[0])).collect();
        let weights = fit.weights(&given);
        let (missed, wanted) = fit.missed(&weights, &given);
        Ok(Solved { weights, missed, wanted })
    };
    (0..clip.frame_count()).into_par_iter().map(frame).collect()
}

fn view(fit: &MorphFit, frames: &[Solved], target_shapes: usize) -> FaceFitView {
    let (missed, wanted) = frames.iter().fold((0.0, 0.0), |sum, frame| (sum.0 + frame.missed, sum.1 + frame.wanted));
    let worst = frames
        .iter()
        .enumerate()
        .fold((0, 0.0), |worst, (index, frame)| if frame.missed > worst.1 { (index, frame.missed) } else { worst });
    FaceFitView {
        source_shapes: fit.source_count(),
        target_shapes,
        points: fit.quality.points,
        same_topology: fit.quality.is_same_topology,
        mean_distance_share: fit.quality.mean_distance_share,
        missed_share: if wanted > 0.0 { (missed / wanted).sqrt() } else { 0.0 },
        worst_frame: worst.0,
    }
}

fn report(view: &FaceFitView, reporter: &mut Reporter) {
    if view.missed_share > MUCH_MISSED || view.mean_distance_share > FAR_APART {
        reporter.warn(
            "morphs_fit_poor",
            "target",
            format!(
                "{:.0} % of what the source's face does is not met by the target's shapes, most in frame {}; corresponding points are {:.1} % of the face apart on average",
                view.missed_share * 100.0,
                view.worst_frame,
                view.mean_distance_share * 100.0
            ),
            "the target may lack shapes for it, or the faces differ too much: name what follows what in morphs.rows",
        );
    }
}
