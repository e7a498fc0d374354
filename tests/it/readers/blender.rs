//! The corpus as Blender reads it.

use std::collections::BTreeSet;

use super::{
    Ours, Seen, answers,
    compare::{Aspect::*, Differences, Exceptions, Reader, differences, judge},
    corpus_and_files,
};
use crate::support::blender;

/// What Blender reads otherwise. Three.js reads the glTF files here as we do.
const EXCEPTIONS: Exceptions<'_> = &[
    (
        &["bvh/misc/makehuman_tpose_173joints"],
        &[Positions],
        "positions next to nothing are added to the offsets (warning positions_from_offsets): taken as they stand, as Blender \
         does, the body lies in one point",
    ),
    (&["cc0-stylised/robot_expressive"], &[Positions], "its bones cannot be scaled as the nodes of the file are"),
    (
        &["mixamo/gltf/skeleton_underscore_names"],
        &[Positions],
        "between two keys it mixes the components of rotations, where glTF asks for the arc",
    ),
    (&["fbx-semantics/"], &[Unreadable], "it does not read FBX as text, and stumbles over some that are binary"),
    (
        &["creatures/spider_noskin", "misc-rigs/animation_with_skeleton_generic_names", "misc-rigs/huesitos"],
        &[Unreadable],
        "its importer stumbles over the file; three.js reads it as we do",
    ),
    (
        &[
            "humanik-unity/viverse_mannequin_meshopt",
            "mixamo/gltf/joe_meshopt_9skins",
            "mixamo/gltf/michelle_meshopt",
            "mixamo/gltf/mousey_meshopt",
        ],
        &[Unreadable],
        "it does not know EXT_meshopt_compression; three.js reads them as we do",
    ),
    (
        &["khronos/CesiumMan", "khronos/SimpleSkin", "khronos/rigged_simple"],
        &[Clips],
        "clips without a name have one there that cannot be told beforehand; three.js reads them as we do",
    ),
    (&["fbx-semantics/", "misc-rigs/ozz_pab_walk"], &[Seconds], "its actions last from the first key to the last"),
    (&["fbx-semantics/maya_transformed_skin_7700_binary"], &[Clips], "it does not animate the node above a bone"),
    (
        &["fbx-semantics/maya_game_sausage_7500_binary_combined"],
        &[Positions],
        "it lets bones inherit scales that are not inherited in the file",
    ),
    (
        &["mixamo/fbx/samba_dancing_skin"],
        &[Positions],
        "it draws straight lines between keys of curves that are cubic, where other joints have keys between theirs",
    ),
    (&["rigify-blender/rigify_full_controls_leafbones"], &[Positions], "the file shears its joints"),
];

#[test]
fn blender_reads_the_corpus_as_we_do() {
    let Some(mut command) = blender("whole.py") else { return };
    let Some((corpus, files)) = corpus_and_files(&["glb", "gltf", "vrm", "fbx", "bvh"]) else { return };
    let seen = answers(&mut command, &corpus, &files);
    let compared = |ours: &Ours, seen: &Seen| {
        let joints = ours.scene.skeleton.joints();
        // Blender gives names that are there already a number.
        let joint_of = |name: &str| {
            let mut of_the_name = (0..joints.len()).filter(|joint| joints[*joint].name == name);
            of_the_name.next().filter(|_| of_the_name.next().is_none())
        };
        let is_wanted = |joint: &usize| joints[*joint].is_joint && joint_of(&joints[*joint].name).is_some();
        let wanted: BTreeSet<usize> = (0..joints.len()).filter(is_wanted).collect();
        let pairs = seen.nodes.iter().map(|node| joint_of(&node.name).filter(|joint| wanted.contains(joint)));
        let pairs: Vec<Option<usize>> = pairs.collect();
        differences(ours, seen, &Reader { joints: &pairs, wanted: &wanted, to_theirs: &|place| place })
    };
    let found: Vec<(&str, Differences)> =
        files.iter().zip(&seen).map(|(ours, seen)| (ours.name.as_str(), compared(ours, seen))).collect();
    judge(&found, EXCEPTIONS);
}
