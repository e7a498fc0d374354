//! Drawings, scenes of drawings, and what may be wanted of them.

use retargetd::{formats::pack_files, picture::Picture};

use super::Seed;

const JOINTS: [(&str, [usize; 2], &str); 11] = [
    ("root", [16, 18], "null"),
    ("hip", [16, 18], "root"),
    ("torso", [16, 11], "hip"),
    ("neck", [16, 6], "torso"),
    ("left_elbow", [22, 11], "torso"),
    ("left_hand", [28, 11], "left_elbow"),
    ("right_elbow", [10, 11], "torso"),
    ("right_hand", [4, 11], "right_elbow"),
    ("left_hip", [19, 18], "root"),
    ("left_knee", [19, 24], "left_hip"),
    ("left_foot", [19, 29], "left_knee"),
];

const MOTION: &str =
    "filepath: walk.bvh\ngroundplane_joint: Hips\nforward_perp_joint_vectors:\n- [L, R]\nscale: 0.1\nup: +y\n";

const RETARGET: &str = "char_starting_location: [0, 0, -0.5]
bvh_projection_bodypart_groups:
- {bvh_joint_names: [Hips, L, Hand, R], method: pca, name: all}
char_bodypart_groups:
- {bvh_depth_drivers: [Hips], char_joints: [torso, neck, left_elbow, left_hand]}
char_bvh_root_offset:
  bvh_projection_bodypart_group_for_offset: all
  bvh_joints: [[L, Hand]]
  char_joints: [[left_elbow, left_hand]]
char_joint_bvh_joints_mapping:
  left_hand: !!python/tuple [L, Hand]
char_runtime_checks:
- [above, neck, left_hand, right_hand]
";

const MVC: &str = "scene:\n  ADD_FLOOR: true\n  ANIMATED_CHARACTERS:\n  - character_cfg: a/char_cfg.yaml\n    motion_cfg: motion.yaml\n    \
retarget_cfg: retarget.yaml\nview:\n  WINDOW_DIMENSIONS: [30, 20]\n  DRAW_AD_RIG: true\ncontroller:\n  MODE: video_render\n";

const BVH: &str = "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n\
JOINT L\n{\nOFFSET 1 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nJOINT Hand\n{\nOFFSET 1 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n\
End Site\n{\nOFFSET 1 0 0\n}\n}\n}\nJOINT R\n{\nOFFSET -1 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\nOFFSET -1 0 0\n}\n}\n}\n\
MOTION\nFrames: 2\nFrame Time: 0.1\n0 0 0 0 0 0 0 0 0 0 0 0 0 0 0\n0 0 1 0 0 0 40 0 0 9 0 0 0 0 0\n";

fn character() -> String {
    let mut text = "width: 32\nheight: 32\nskeleton:\n".to_owned();
    for (name, [x, y], parent) in JOINTS {
        text += &format!("- {{loc: [{x}, {y}], name: {name}, parent: {parent}}}\n");
    }
    text
}

/// Texture and mask of a figure of boxes.
fn pictures() -> [Vec<u8>; 2] {
    let boxes = [[12, 2, 20, 20], [2, 9, 30, 13], [17, 16, 21, 31]];
    let is_in = |x: usize, y: usize| {
        boxes.iter().any(|[left, top, right, low]| (left..right).contains(&&x) && (top..low).contains(&&y))
    };
    let picture = |inside: [u8; 4], outside: [u8; 4]| {
        let mut picture = Picture::filled(32, 32, outside);
        for index in (0..32 * 32).filter(|index| is_in(index % 32, index / 32)) {
            picture.pixels[index] = inside;
        }
        picture.to_png().expect("a small picture has a PNG")
    };
    [picture([200, 80, 40, 255], [255; 4]), picture([255; 4], [0, 0, 0, 255])]
}

/// A small drawing.
pub(crate) fn small() -> Vec<u8> {
    let [texture, mask] = pictures();
    let text = character();
    pack_files([("char_cfg.yaml", text.as_bytes()), ("texture.png", &*texture), ("mask.png", &*mask)])
        .expect("an archive")
}

pub(super) fn all() -> Vec<Seed> {
    let [texture, mask] = pictures();
    let text = character();
    let scene = pack_files([
        ("a/char_cfg.yaml", text.as_bytes()),
        ("a/texture.png", &*texture),
        ("a/mask.png", &*mask),
        ("motion.yaml", MOTION.as_bytes()),
        ("retarget.yaml", RETARGET.as_bytes()),
        ("mvc.yaml", MVC.as_bytes()),
        ("walk.bvh", BVH.as_bytes()),
    ]);
    vec![("drawing".to_owned(), small()), ("scene".to_owned(), scene.expect("an archive"))]
}

pub(super) fn configs() -> Vec<Seed> {
    let texts = [
        r#"{"task": "draw"}"#,
        r##"{"task": "draw", "project": {"damping": 0.1, "foreshorten": true, "turn": "mirror", "plant": false, "stay": true},
            "view": {"size": [40, 30], "background": "#ff0000", "draw": ["floor", "texture", "colors", "mesh", "rig", "source"],
            "camera": {"position": [0, 1, 3], "backward": [0, 0, 1]}}, "drawing": {"deform": "arap", "rigid": ["neck"]}}"##,
        r#"{"task": "draw", "edit": {"fps": 12, "reverse": true, "mirror": true}, "clip": 0, "output": [{"format": "glb"}]}"#,
        r#"{"task": "draw", "retarget": {"char_starting_location": [0, 0, 0],
            "bvh_projection_bodypart_groups": [{"bvh_joint_names": ["pelvis", "chest"], "method": "frontal", "name": "a"}],
            "char_bodypart_groups": [{"bvh_depth_drivers": ["pelvis"], "char_joints": ["torso"]}],
            "char_bvh_root_offset": {"bvh_joints": [["pelvis", "chest"]], "char_joints": [["root", "torso"]],
            "bvh_projection_bodypart_group_for_offset": "a"},
            "char_joint_bvh_joints_mapping": [["torso", ["pelvis", "chest"]]]}}"#,
    ];
    texts.into_iter().enumerate().map(|(number, text)| (format!("draw {number}"), text.as_bytes().to_vec())).collect()
}
