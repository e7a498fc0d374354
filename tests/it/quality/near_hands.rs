//! Hands of real clips that come near each other or the head, onto a body of other proportions: with `self_contact` they come as near.
//!
//! Nothing is known of the thickness of those who were captured, so that wrists are compared: how far apart they are, as a share of
//! the way from foot to head. Of the corpus's clips these two have hands that come that near.

use retargetd::model::Clip;

use super::{
    figure::{Figure, position, world},
    properties::retargeted,
};
use crate::support::corpus_file;

/// File, and the share of the way from foot to head within which its hands touch or nearly do, wrist to wrist or to the joint of the
/// head: a boxer guards, the other one brings his together.
const CLIPS: [(&str, f64); 2] =
    [("bvh/cmu/boxing_toes_row_mismatch.bvh", 0.12), ("bvh/misc/momask_template_lafan_names.bvh", 0.08)];
const TARGET: &str = "mixamo/gltf/Xbot.glb";
const PAIRS: [[&str; 2]; 3] = [["left_hand", "right_hand"], ["left_hand", "head"], ["right_hand", "head"]];
/// Share of that way by which gaps may differ.
const APART: f64 = 0.02;
const MIN_KEPT: f64 = 0.9;
const STACK: &str =
    r#"{"op": "pelvis"}, {"op": "fk"}, {"op": "contacts"}, {"op": "ik"}, {"op": "plant"}, {"op": "floor"}"#;

/// Gaps of all pairs at all frames, as shares of the way from foot to head at rest.
fn gaps(figure: &Figure, clip: &Clip) -> Vec<f64> {
    let joint = |role: &str| figure.roles[role];
    let rest = world(figure.skeleton(), None);
    let height = position(&rest, joint("head")).distance(position(&rest, joint("left_foot")));
    let of_frame = |frame: usize| {
        let pose = world(figure.skeleton(), Some((clip, frame)));
        PAIRS.map(|pair| {
            let [first, second] = pair.map(|role| position(&pose, joint(role)));
            first.distance(second) / height
        })
    };
    (0..clip.frame_count()).flat_map(of_frame).collect()
}

#[test]
#[expect(clippy::print_stderr, reason = "the figures are worth seeing even when they pass")]
fn hands_that_come_near_come_as_near() {
    for (file, near_below) in CLIPS {
        let (Some(source), Some(target)) = (corpus_file(file), corpus_file(TARGET)) else { return };
        let (source, target) = (Figure::read(&source), Figure::read(&target));
        let clip = source.clip();
        let near: Vec<(usize, f64)> =
            gaps(&source, clip).into_iter().enumerate().filter(|&(_, gap)| gap < near_below).collect();
        let kept = |ops: &str| {
            let spec = format!(r#"{{"ops": [{ops}]}}"#);
            let result = gaps(&target, &retargeted(&spec, &source.scene, clip, &target.scene));
            let kept = near.iter().filter(|&&(at, gap)| (result[at] - gap).abs() < APART).count();
            kept as f64 / near.len().max(1) as f64
        };
        let (without, with) = (kept(STACK), kept(&format!(r#"{STACK}, {{"op": "self_contact"}}"#)));
        eprintln!("{file}: of {} gaps {:.1} % without, {:.1} % with", near.len(), without * 100.0, with * 100.0);
        assert!(!near.is_empty(), "{file}: hands come near");
        assert!(with >= MIN_KEPT && with > without, "{file}: {with} of {} gaps, {without} without the op", near.len());
    }
}
