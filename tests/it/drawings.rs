//! `retargetd draw`: configs of Animated Drawings, by the real binary.

use std::{
    fmt::Write as _,
    path::Path,
    process::{Command, Output},
};

use crate::{
    npz,
    support::{corpus_file, shared_folder, skip},
};

const CHARACTER: &str = "width: 100
height: 200
skeleton:
- {loc: [50, 100], name: root, parent: null}
- {loc: [50, 100], name: hip, parent: root}
- {loc: [50, 40], name: torso, parent: hip}
- {loc: [70, 40], name: left_elbow, parent: torso}
- {loc: [50, 160], name: left_foot, parent: root}
";

const MOTION: &str = "filepath: motions/wave.bvh
groundplane_joint: Foot
forward_perp_joint_vectors:
- [Left, Right]
scale: 0.5
up: +y
";

const RETARGET: &str = "char_starting_location: [0.25, 0.5, 0.0]
bvh_projection_bodypart_groups:
- {bvh_joint_names: [Hips, Chest, Left, Right, Hand], method: frontal, name: upper}
- {bvh_joint_names: [Foot], method: sagittal, name: legs}
char_bodypart_groups:
- {bvh_depth_drivers: [Hips], char_joints: [torso, left_elbow, left_foot]}
char_bvh_root_offset:
  bvh_projection_bodypart_group_for_offset: legs
  bvh_joints:
  - [Hips, Foot]
  char_joints:
  - [root, left_foot]
char_joint_bvh_joints_mapping:
  left_elbow: !!python/tuple
  - Left
  - Hand
  torso: [Hips, Chest]
char_runtime_checks:
- [above, torso, left_foot, left_elbow]
";

const SCENE: &str = "scene:
  ANIMATED_CHARACTERS:
    - character_cfg: characters/one.yaml
      motion_cfg: motions/wave.yaml
      retarget_cfg: retarget.yaml
view:
  USE_MESA: true
controller:
  MODE: video_render
  OUTPUT_VIDEO_PATH: ./video.gif
";

/// A body that faces +Z, walks ahead by 1 a frame, and whose left arm is turned up by so many degrees a frame.
fn bvh() -> String {
    let end = |offset: &str| format!("End Site {{ OFFSET {offset} }}");
    let mut text = format!(
        "HIERARCHY\nROOT Hips {{ OFFSET 0 9 0 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n\
         JOINT Chest {{ OFFSET 0 4 0 CHANNELS 3 Zrotation Xrotation Yrotation\n\
         JOINT Left {{ OFFSET 1 0 0 CHANNELS 3 Zrotation Xrotation Yrotation JOINT Hand {{ OFFSET 2 0 0 CHANNELS 3 Zrotation Xrotation Yrotation {} }} }}\n\
         JOINT Right {{ OFFSET -1 0 0 CHANNELS 3 Zrotation Xrotation Yrotation {} }} }}\n\
         JOINT Foot {{ OFFSET 0 -4 0 CHANNELS 3 Zrotation Xrotation Yrotation {} }} }}\nMOTION\nFrames: 4\nFrame Time: 0.04\n",
        end("1 0 0"),
        end("-1 0 0"),
        end("0 -1 0"),
    );
    for frame in 0..4 {
        let arm = 30 * frame;
        writeln!(text, "0 4 {frame} 0 0 0  0 0 0  {arm} 0 0  0 0 0  0 0 0  0 0 0").expect("room");
    }
    text
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for part in ["characters", "motions", "config"] {
        std::fs::create_dir(folder.path().join(part)).expect("a folder");
    }
    let files = [
        ("characters/one.yaml", CHARACTER.to_owned()),
        ("motions/wave.yaml", MOTION.to_owned()),
        ("motions/wave.bvh", bvh()),
        ("retarget.yaml", RETARGET.to_owned()),
        ("config/scene.yaml", SCENE.to_owned()),
    ];
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).expect("a file");
    }
    folder
}

fn draw(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_retargetd"));
    let command = command.args(["draw", "--config", "config/scene.yaml", "--compat", "animated_drawings"]);
    command.args(arguments).current_dir(folder).output().expect("the binary runs")
}

#[test]
fn a_scene_gives_arrays_of_angles_joints_and_roots() {
    let folder = folder();
    let output = draw(folder.path(), &["--output", "poses.npz"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("USE_MESA"), "what is not used is named: {said}");
    let arrays = npz::read(&std::fs::read(folder.path().join("poses.npz")).expect("an archive"));
    let (shape, angles) = arrays.numbers("char_orientations_deg");
    assert_eq!(shape, [4, 2]);
    // Seen from ahead, the left of the body is on the right: from there the arm turns up, counterclockwise.
    for (frame, pair) in angles.chunks_exact(2).enumerate() {
        assert!((pair[0] - (270.0 + 30.0 * frame as f64) % 360.0).abs() < 1e-4, "the arm in frame {frame}: {pair:?}");
        assert!((pair[1] + 180.0).rem_euclid(360.0) - 180.0 < 1e-4, "the trunk is upright: {pair:?}");
    }
    let (shape, root) = arrays.numbers("char_root_positions");
    assert_eq!(shape, [4, 2]);
    // The drawing's leg is 0.3 of its side, that of the motion 2 where it is scaled by a half.
    assert!((root[6] - 3.0 * 0.5 * 0.3 / 2.0).abs() < 1e-6 && root[7].abs() < 1e-6, "three steps ahead: {root:?}");
    let (shape, joints) = arrays.numbers("rig_joint_xy");
    assert_eq!(shape, [4, 5, 2]);
    assert!(
        (joints[0] - 0.25).abs() < 1e-6 && (joints[1] - 0.5).abs() < 1e-6,
        "it begins where it is told: {joints:?}"
    );
}

#[test]
fn several_characters_have_names_of_their_own() {
    let folder = folder();
    let one = "    - character_cfg: characters/one.yaml\n      motion_cfg: motions/wave.yaml\n      retarget_cfg: retarget.yaml\n";
    std::fs::write(folder.path().join("config/scene.yaml"), SCENE.replace(one, &one.repeat(2))).expect("a scene");
    let output = draw(folder.path(), &["--output", "poses.npz"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let arrays = npz::read(&std::fs::read(folder.path().join("poses.npz")).expect("an archive"));
    assert_eq!(arrays.numbers("c0_rig_joint_xy"), arrays.numbers("c1_rig_joint_xy"));
}

#[test]
fn what_is_wrong_in_a_config_is_told_with_its_place() {
    let cases = [
        ("characters/one.yaml", "parent: torso", "parent: tors", "tors"),
        ("characters/one.yaml", "[70, 40]", "[170, 40]", "skeleton[3]"),
        ("characters/one.yaml", "parent: root}\n- {loc: [50, 40]", "parent: torso}\n- {loc: [50, 40]", "hip"),
        ("motions/wave.yaml", "groundplane_joint: Foot", "groundplane_joint: Fot", "Fot"),
        ("motions/wave.yaml", "scale: 0.5", "scale: 0", "scale"),
        ("motions/wave.yaml", "wave.bvh", "gone.bvh", "gone.bvh"),
        ("retarget.yaml", "- Hand\n", "- Hnd\n", "Hnd"),
        ("retarget.yaml", "method: frontal", "method: front", "front"),
        ("retarget.yaml", "for_offset: legs", "for_offset: leg", "leg"),
        ("retarget.yaml", "- [above,", "- [below,", "char_runtime_checks"),
        ("config/scene.yaml", "MODE: video_render", "MODE: film", "film"),
    ];
    for (file, from, to, says) in cases {
        let folder = folder();
        let path = folder.path().join(file);
        let text = std::fs::read_to_string(&path).expect("a config");
        assert!(text.contains(from), "{file} has {from}");
        std::fs::write(&path, text.replace(from, to)).expect("a config");
        let output = draw(folder.path(), &["--output", "poses.npz"]);
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{file} with {to}: {error}");
        let name = file.rsplit('/').next().expect("a name");
        assert!(error.contains(says) && (error.contains(name) || says == "gone.bvh"), "{file} with {to}: {error}");
        assert!(!folder.path().join("poses.npz").exists(), "nothing is written");
    }
}

#[test]
fn a_check_that_fails_leaves_its_joint_as_it_is() {
    let folder = folder();
    let upside_down =
        RETARGET.replace("[above, torso, left_foot, left_elbow]", "[above, torso, left_elbow, left_foot]");
    std::fs::write(folder.path().join("retarget.yaml"), upside_down).expect("a config");
    let output = draw(folder.path(), &["--output", "poses.npz"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("drawing_check_failed"), "{said}");
    let arrays = npz::read(&std::fs::read(folder.path().join("poses.npz")).expect("an archive"));
    assert_eq!(arrays.numbers("char_orientations_deg").0, [4, 1], "one joint is turned");
}

/// The folder that paths of the program's configs begin in, laid out of the corpus; nothing where that is not there.
fn examples() -> Option<tempfile::TempDir> {
    let folder = tempfile::tempdir().expect("a folder");
    let copy = |from: &str, to: &str| {
        let from = corpus_file(from)?;
        let to = folder.path().join("examples").join(to);
        std::fs::create_dir_all(to.parent().expect("a folder")).expect("a folder");
        std::fs::copy(from, to).ok()
    };
    copy("animated-drawings/char1/char_cfg.yaml", "characters/char1/char_cfg.yaml")?;
    copy("animated-drawings/motion/zombie.yaml", "config/motion/zombie.yaml")?;
    copy("animated-drawings/retarget/fair1_spf.yaml", "config/retarget/fair1_spf.yaml")?;
    copy("animated-drawings/mvc/export_mp4_example.yaml", "config/mvc/export_mp4_example.yaml")?;
    copy("bvh/fair1/zombie_zup.bvh", "bvh/fair1/zombie.bvh")?;
    Some(folder)
}

/// The numbers of the program itself, where they lie beside the checkout.
#[test]
fn the_numbers_are_those_of_animated_drawings() {
    let dump = shared_folder().join("parity/animated_drawings/export_mp4_example.npz");
    if !dump.exists() {
        return skip(&format!("{} is not there", dump.display()));
    }
    let Some(folder) = examples() else { return };
    let mut command = Command::new(env!("CARGO_BIN_EXE_retargetd"));
    let command = command.args(["draw", "--config", "examples/config/mvc/export_mp4_example.yaml"]);
    let command = command.args(["--compat", "animated_drawings", "--output", "poses.npz", "--mesh"]).arg(&dump);
    let output = command.current_dir(folder.path()).output().expect("the binary runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let ours = npz::read(&std::fs::read(folder.path().join("poses.npz")).expect("an archive"));
    let theirs = npz::read(&std::fs::read(dump).expect("an archive"));
    let bounds = [
        ("bvh_root_positions", 1e-5),
        ("bvh_joint_positions_normalised", 1e-5),
        ("bvh_fwd_vectors", 1e-5),
        ("bvh_joint_depths", 1e-5),
        ("char_orientations_deg", 1e-3),
        ("char_root_positions", 5e-6),
        ("rig_rest_xy", 5e-6),
        ("rig_joint_xy", 5e-6),
    ];
    for (name, bound) in bounds {
        let ((shape, ours), (their_shape, theirs)) = (ours.numbers(name), theirs.numbers(name));
        assert_eq!(shape, their_shape, "{name}");
        let is_angle = name.ends_with("_deg");
        let off = |(one, other): (&f64, &f64)| {
            let off = (one - other).abs();
            if is_angle { off.min(360.0 - off) } else { off }
        };
        let most = ours.iter().zip(&theirs).map(off).fold(0.0, f64::max);
        assert!(most <= bound, "{name} is off by {most}");
    }
    let (shape, deformed) = ours.numbers("arap_vertices");
    let (their_shape, reference) = theirs.numbers("arap_vertices");
    assert_eq!(shape[1..], their_shape[1..], "the mesh is that of the dump");
    let values = shape[1] * 2;
    let (mut sum, mut most, mut count) = (0.0, 0.0_f64, 0.0);
    for (index, frame) in theirs.whole("arap_frames").into_iter().enumerate() {
        let pairs = |all: &[f64], from: usize| all[from..from + values].to_vec();
        let (one, other) = (pairs(&deformed, frame as usize * values), pairs(&reference, index * values));
        for (one, other) in one.chunks_exact(2).zip(other.chunks_exact(2)) {
            let off = (one[0] - other[0]).hypot(one[1] - other[1]);
            (sum, most, count) = (sum + off, most.max(off), count + 1.0);
        }
    }
    let order = |arrays: &npz::Arrays, name: &str, frame: usize| {
        let (shape, groups) = arrays.numbers(name);
        groups[frame * shape[1]..][..shape[1]].to_vec()
    };
    for (index, frame) in theirs.whole("arap_frames").into_iter().enumerate() {
        let drawn = order(&ours, "bodypart_order", frame as usize);
        assert_eq!(drawn, order(&theirs, "arap_bodypart_order", index), "the order of drawing in frame {frame}");
    }
    assert_eq!(ours.numbers("arap_pin_mask"), theirs.numbers("arap_pin_mask"));
    assert!(sum / count <= 3e-4 && most <= 3e-3, "the mesh is off by {} on average, {most} at most", sum / count);
}
