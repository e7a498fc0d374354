//! The corpus as three.js reads it.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
    process::Command,
};

use glam::DVec3;
use retargetd::formats::Format;

use super::{
    Ours, Seen, answers,
    compare::{Aspect::*, Differences, Exceptions, Reader, differences, judge},
    corpus_and_files, joints_by_path,
};
use crate::support::{fbx_axis, three_script};

/// What three.js reads otherwise, and what speaks for our reading: Blender where the table beside this says nothing else, for FBX
/// always the parser's own evaluation (`world_transforms_are_those_of_the_parser`).
const EXCEPTIONS: Exceptions<'_> = &[
    (
        &[
            "bvh/bandai-namco/",
            "bvh/geno/",
            "bvh/misc/hunyuan_like_20fps",
            "bvh/misc/makehuman_",
            "bvh/misc/meredith_8walk_vicon",
            "bvh/misc/mia_78joints_allpos",
            "bvh/misc/momask_template_lafan_names",
            "bvh/misc/walk01_24fps",
            "bvh/rokoko/",
            "mixamo/bvh/kate_sign_49posjoints",
            "mixamo/bvh/mousey_salsa",
            "mixamo/bvh/ortiz_salsa",
        ],
        &[Positions],
        "it adds position channels to the OFFSET, which they replace; Blender does as we do",
    ),
    (
        &["bvh/cmu/boxing_toes_row_mismatch"],
        &[Seconds, Positions],
        "it stops at the number of rows that the file declares; the file has one more, which Blender reads too",
    ),
    (&["bvh/100style/100style_character"], &[Rest], "it does not know the spherical rotation order"),
    (&["fbx-semantics/axes_"], &[Rest], "of axes it knows Y up and Z up, and no other front than the usual one"),
    (
        &["fbx-semantics/blender_340_default_unscaled"],
        &[Rest],
        "its lights stand one unit above their node before that is moved",
    ),
    (&["fbx-semantics/max_quote_7500_ascii"], &[Nodes], "it does not undo what stands for a quote in text files"),
    (
        &[
            "fbx-semantics/maya_anim_no_inherit_scale",
            "fbx-semantics/maya_scale_no_inherit",
            "fbx-semantics/maya_static_no_inherit_scale",
            "humanik-unity/maya_human_ik_unit_metre",
            "fbx-semantics/maya_game_sausage_7500_ascii_combined",
            "fbx-semantics/maya_game_sausage_7500_binary_combined",
        ],
        &[Rest, Positions],
        "a parent's scale that is not inherited is taken into account at rest only, and there in part",
    ),
    (
        &[
            "fbx-semantics/maya_anim_extrapolation",
            "fbx-semantics/motionbuilder_extrapolation",
            "fbx-semantics/maya_scale_no_inherit",
        ],
        &[Seconds, Positions],
        "it knows no extrapolation: its clips end with the last key",
    ),
    (&["fbx-semantics/maya_anim_layer"], &[Seconds, Positions], "of several layers it reads one"),
    (
        &["fbx-semantics/maya_anim_interpolation", "fbx-semantics/maya_tangent_clamped", "misc-rigs/ozz_pab_walk"],
        &[Seconds],
        "its clips last from the first key to the last, whatever the span of the stack is",
    ),
    (
        &[
            "fbx-semantics/maya_anim_linear",
            "fbx-semantics/maya_anim_pivot_rotate",
            "fbx-semantics/maya_keyframe_offset",
            "fbx-semantics/maya_transform_animation",
            "fbx-semantics/maya_transformed_skin",
            "fbx-semantics/maya_long_keyframes",
        ],
        &[Rest, Seconds, Positions],
        "keys that the axes do not share, and nodes whose resting place is only in their curves, are put together otherwise",
    ),
    (
        &["fbx-semantics/maya_auto_clamp", "fbx-semantics/maya_tangent_spline"],
        &[Seconds, Positions],
        "it draws straight lines between keys of curves that are cubic",
    ),
    (
        &[
            "misc-rigs/17_keypoints_walk",
            "misc-rigs/m2m_cmu_91_48",
            "mixamo/fbx/samba_dancing_skin",
            "smpl/text2motion_smpl_skeleton",
            "cc0-stylised/quaternius_alien",
        ],
        &[Positions],
        "it draws straight lines between keys of curves that are cubic, where other joints have keys between theirs",
    ),
    (
        &["fbx-semantics/maya_pivot_offset", "fbx-semantics/maya_zero_scale_pivot"],
        &[Seconds, Positions],
        "it forgets the pivots of what is animated",
    ),
    (
        &["fbx-semantics/maya_zero_end", "fbx-semantics/motionbuilder_pivot", "fbx-semantics/motionbuilder_tangent"],
        &[Unreadable],
        "its parser stumbles over the file",
    ),
    (&["misc-rigs/ozz_pab_walk"], &[Nodes], "the targets of cameras are no nodes for it"),
    (
        &["rigify-blender/rigify_full_controls_leafbones"],
        &[Positions],
        "the file shears its joints; in the clip they are moved as joints that keep their lengths",
    ),
];

#[test]
fn three_reads_the_corpus_as_we_do() {
    let Some((corpus, files)) = corpus_and_files(&["glb", "gltf", "vrm", "vrma", "fbx", "bvh"]) else { return };
    let Some(seen) = read(&corpus, &files) else { return };
    let found: Vec<(&str, Differences)> =
        files.iter().zip(&seen).map(|(ours, seen)| (ours.name.as_str(), compared(ours, seen, &corpus))).collect();
    judge(&found, EXCEPTIONS);
}

fn compared(ours: &Ours, seen: &Seen, corpus: &Path) -> Differences {
    let joints = ours.scene.skeleton.joints();
    let all: BTreeSet<usize> = (0..joints.len()).collect();
    match ours.format {
        Format::Fbx => {
            let names: Vec<(&str, Option<usize>)> =
                seen.nodes.iter().map(|node| (node.name.as_str(), node.parent)).collect();
            let pairs = joints_by_path(&ours.scene.skeleton, &names);
            let bytes = std::fs::read(corpus.join(&ours.name)).expect("a file");
            let to_theirs = space(&bytes);
            differences(ours, seen, &Reader { joints: &pairs, wanted: &all, to_theirs: &to_theirs })
        }
        Format::Bvh => {
            // Ends of limbs are no joints.
            let wanted: Vec<usize> = (0..joints.len()).filter(|joint| joints[*joint].is_joint).collect();
            let pairs: Vec<Option<usize>> = (0..seen.nodes.len()).map(|node| wanted.get(node).copied()).collect();
            let wanted = wanted.into_iter().collect();
            differences(ours, seen, &Reader { joints: &pairs, wanted: &wanted, to_theirs: &|place| place })
        }
        _ => {
            let joint_of: BTreeMap<usize, usize> =
                joints.iter().enumerate().map(|(index, joint)| (joint.node, index)).collect();
            let pairs: Vec<Option<usize>> = (0..seen.nodes.len()).map(|node| joint_of.get(&node).copied()).collect();
            differences(ours, seen, &Reader { joints: &pairs, wanted: &all, to_theirs: &|place| place })
        }
    }
}

/// The space of FBXLoader: that of the file, but with Y up where Z is.
fn space(bytes: &[u8]) -> impl Fn(DVec3) -> DVec3 {
    let parsed = ufbx::load_memory(bytes, ufbx::LoadOpts::default()).expect("the parser reads it");
    let (axes, unit) = (parsed.settings.axes, parsed.settings.unit_meters);
    let [right, up, front] = [axes.right, axes.up, axes.front].map(fbx_axis);
    move |place| {
        let file = (right * place.x + up * place.y + front * place.z) / unit;
        if up == DVec3::Z { DVec3::new(file.x, file.z, -file.y) } else { file }
    }
}

fn read(corpus: &Path, files: &[Ours]) -> Option<Vec<Seen>> {
    let script = three_script("whole.mjs")?;
    Some(answers(Command::new("node").arg(script), corpus, files))
}
