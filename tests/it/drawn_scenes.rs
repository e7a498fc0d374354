//! Scenes of drawn characters that are seen: those of *Animated Drawings* as they stand, and one made by code through the real binary.

use std::{path::Path, process::Command};

use retargetd::{
    engine::{DrawRequest, DrawSpec, Failure, FailureCode, FileReader, Knowledge, Limits, NamedBytes, Outcome, draw},
    formats::{Format, read_numbers},
    model::Control,
};

use crate::support::corpus_file;

/// A file by its path in the original's repository.
fn original(path: &str) -> Result<Vec<u8>, Failure> {
    let place = path
        .replace("examples/characters/", "animated-drawings/")
        .replace("examples/config/", "animated-drawings/")
        .replace("examples/bvh/cmu1/jumping_jacks.bvh", "bvh/cmu/jumping_jacks_max_names.bvh")
        .replace("examples/bvh/rokoko/", "bvh/rokoko/");
    let place = match place.strip_prefix("examples/bvh/fair1/") {
        Some(name) => format!("bvh/fair1/{}", name.replace(".bvh", "_zup.bvh")),
        None => place,
    };
    // Three characters are not in the corpus; the first stands in for them.
    let place = ["char3", "char5", "char6"].iter().fold(place, |place, absent| place.replace(absent, "char1"));
    corpus_file(&place)
        .and_then(|path| std::fs::read(path).ok())
        .ok_or_else(|| Failure::new(FailureCode::UnknownName, format!("there is no {path}")))
}

/// What a scene gives in a format, with the numbers of the original.
fn drawn(scene: NamedBytes<'_>, format: Format, read: &mut FileReader<'_>) -> Outcome {
    let formats = [format];
    let spec = DrawSpec::default().with_compat();
    let request = DrawRequest { scene: Some(scene), spec, formats: &formats, ..DrawRequest::default() };
    draw(&request, read, &Knowledge::default(), &Limits::default(), &Control::new()).expect("a scene")
}

fn numbers(archive: &[u8], name: &str) -> Vec<f64> {
    let found = read_numbers(archive, name, &Limits::default(), &Control::new()).expect("an archive");
    found.unwrap_or_else(|| panic!("there is no {name}")).1
}

#[test]
fn scenes_of_the_original_are_read_as_they_stand() {
    for name in [
        "background_example",
        "different_bvh_skeleton_example",
        "export_gif_example",
        "interactive_window_example",
        "multiple_characters_example",
        "rokoko_motion_example",
    ] {
        let file = format!("examples/config/mvc/{name}.yaml");
        let Ok(bytes) = original(&file) else { return };
        let outcome = drawn(NamedBytes { name: &file, bytes: &bytes }, Format::Poses2dNpz, &mut original);
        let count = outcome.report.drawing.expect("a report").characters.len();
        let prefix = if count > 1 { "c1_" } else { "" };
        let joints = numbers(&outcome.outputs[0].bytes, &format!("{prefix}rig_joint_xy"));
        assert!(joints.iter().all(|value| value.abs() < 10.0), "{name}");
    }
}

const BVH: &str = "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n\
JOINT L\n{\nOFFSET 1 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\nOFFSET 0 -2 0\n}\n}\n\
JOINT R\n{\nOFFSET -1 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nJOINT Hand\n{\nOFFSET -2 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n\
End Site\n{\nOFFSET -1 0 0\n}\n}\n}\n}\nMOTION\nFrames: 3\nFrame Time: 0.1\n\
0 3 0 0 0 0 0 0 0 0 0 0 0 0 0\n0 3 0 0 0 0 0 0 0 30 0 0 0 0 0\n0 4 0 0 0 0 0 0 0 60 0 0 0 0 0\n";

const RETARGET: &str = "char_starting_location: [0, 0.2, -0.5]\nbvh_projection_bodypart_groups:\n\
- {bvh_joint_names: [Hips, L, R, Hand], method: frontal, name: all}\nchar_bodypart_groups:\n\
- {bvh_depth_drivers: [Hips], char_joints: [hand]}\nchar_bvh_root_offset:\n  bvh_projection_bodypart_group_for_offset: all\n\
\x20 bvh_joints: [[R, Hand]]\n  char_joints: [[root, hand]]\nchar_joint_bvh_joints_mapping:\n  hand: !!python/tuple [R, Hand]\n";

/// A scene of a bar that a hand turns.
fn made_scene(folder: &Path) {
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).expect("a file");
    write("walk.bvh", BVH);
    write("retarget.yaml", RETARGET);
    write(
        "motion.yaml",
        "filepath: walk.bvh\ngroundplane_joint: Hips\nforward_perp_joint_vectors: [[L, R]]\nscale: 0.1\nup: +y\n",
    );
    write(
        "char_cfg.yaml",
        "width: 60\nheight: 40\nskeleton:\n- {loc: [30, 20], name: root, parent: null}\n- {loc: [8, 20], name: hand, parent: root}\n",
    );
    write(
        "scene.yaml",
        "scene:\n  ANIMATED_CHARACTERS:\n  - {character_cfg: char_cfg.yaml, motion_cfg: motion.yaml, retarget_cfg: retarget.yaml}\n\
         view: {WINDOW_DIMENSIONS: [80, 60]}\n",
    );
    for (name, is_mask) in [("texture.png", false), ("mask.png", true)] {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, 60, 40);
        encoder.set_color(png::ColorType::Rgba);
        let pixels: Vec<u8> = (0..60 * 40)
            .flat_map(|index| {
                let (x, y) = (index % 60, index / 60);
                let is_in = (4..36).contains(&x) && (14..27).contains(&y);
                if !is_mask {
                    [200, 40, 40, 255]
                } else if is_in {
                    [255; 4]
                } else {
                    [0, 0, 0, 255]
                }
            })
            .collect();
        encoder.write_header().expect("a header").write_image_data(&pixels).expect("pixels");
        std::fs::write(folder.join(name), file).expect("a picture");
    }
}

fn run(folder: &Path, output: &str) -> std::process::Output {
    Command::new(env!("CARGO_BIN_EXE_retargetd"))
        .args(["draw", "--config", "scene.yaml", "--compat", "animated_drawings", "--output", output])
        .current_dir(folder)
        .output()
        .expect("the binary runs")
}

#[test]
fn a_made_scene_moves_and_is_seen() {
    let folder = tempfile::tempdir().expect("a folder");
    made_scene(folder.path());
    let output = run(folder.path(), "poses.npz");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let poses = std::fs::read(folder.path().join("poses.npz")).expect("poses");
    let angles = numbers(&poses, "char_orientations_deg");
    for (angle, wanted) in angles.iter().zip([90.0, 120.0, 150.0]) {
        assert!((angle - wanted).abs() < 1e-4, "{angles:?}");
    }
    let output = run(folder.path(), "scene.gif");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let gif = std::fs::read(folder.path().join("scene.gif")).expect("a GIF");
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(&*gif).expect("a GIF");
    let mut delays = Vec::new();
    while let Some(frame) = decoder.read_next_frame().expect("a frame") {
        assert!(frame.buffer.chunks(4).any(|pixel| pixel[3] > 0 && pixel[0] > 150), "something red is seen");
        delays.push(frame.delay);
    }
    assert_eq!(delays, [10, 10, 10]);
}

/// A photograph that was taken with its camera on its side stands upright behind a scene.
#[test]
fn a_background_is_turned_as_its_camera_was_held() {
    let folder = tempfile::tempdir().expect("a folder");
    made_scene(folder.path());
    // Lying, the photograph is white on its left; its camera says that this is up: Exif orientation 6.
    let mut photograph = Vec::new();
    let mut encoder = png::Encoder::new(&mut photograph, 40, 20);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().expect("a header");
    let exif = b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";
    writer.write_chunk(png::chunk::eXIf, exif).expect("a chunk");
    let pixels: Vec<u8> =
        (0..40 * 20).flat_map(|index| if index % 40 < 20 { [255; 3] } else { [20, 120, 20] }).collect();
    writer.write_image_data(&pixels).expect("pixels");
    writer.finish().expect("written");
    std::fs::write(folder.path().join("photograph.png"), photograph).expect("a picture");
    let scene = std::fs::read_to_string(folder.path().join("scene.yaml")).expect("a scene");
    let scene = scene.replace("view: {", "view: {BACKGROUND_IMAGE: photograph.png, ");
    std::fs::write(folder.path().join("scene.yaml"), scene).expect("a scene");
    let output = run(folder.path(), "scene.gif");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let gif = std::fs::read(folder.path().join("scene.gif")).expect("a GIF");
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut reader = options.read_info(&gif[..]).expect("a GIF");
    let frame = reader.read_next_frame().expect("a frame").expect("one");
    let at = |column: usize, row: usize| &frame.buffer[(row * 80 + column) * 4..][..3];
    for column in [2, 77] {
        assert!(at(column, 2).iter().all(|part| *part > 240), "white above: {:?}", at(column, 2));
        assert!(at(column, 57)[0] < 60, "green below: {:?}", at(column, 57));
    }
}

#[test]
fn what_is_wrong_is_told_with_its_place() {
    for (file, from, to, told) in [
        (
            "retarget.yaml",
            "  hand: !!python/tuple [R, Hand]",
            "  hand: [R, Hend]",
            "char_joint_bvh_joints_mapping.hand",
        ),
        ("char_cfg.yaml", "parent: root", "parent: hand", "skeleton"),
        ("char_cfg.yaml", "[8, 20]", "[80, 20]", "skeleton[1].loc"),
        ("char_cfg.yaml", "width: 60", "width: 61", "width, height"),
        ("motion.yaml", "scale: 0.1", "scale: 0", "scale"),
        ("motion.yaml", "walk.bvh", "run.bvh", "run.bvh"),
        ("walk.bvh", "Frames: 3", "Frames: 4000000000", "line"),
        ("scene.yaml", "[80, 60]", "[80, 0]", "view.WINDOW_DIMENSIONS"),
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        made_scene(folder.path());
        let path = folder.path().join(file);
        let text = std::fs::read_to_string(&path).expect("a config");
        assert!(text.contains(from), "{file}");
        std::fs::write(&path, text.replace(from, to)).expect("a config");
        let output = run(folder.path(), "scene.gif");
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{error}");
        assert!(error.contains(told), "{told}: {error}");
        assert!(!folder.path().join("scene.gif").exists());
    }
}

#[test]
fn a_picture_is_the_same_every_time() {
    let folder = tempfile::tempdir().expect("a folder");
    made_scene(folder.path());
    let mut read = |name: &str| Ok(std::fs::read(folder.path().join(name)).expect("a file"));
    let bytes = read("scene.yaml").expect("a scene");
    let scene = NamedBytes { name: "scene.yaml", bytes: &bytes };
    let one = drawn(scene, Format::Webp, &mut read);
    let other = drawn(scene, Format::Webp, &mut read);
    assert_eq!(one.report.counts.frames, 3);
    assert_eq!(one.outputs, other.outputs);
}

/// A figure as the original's annotation names its joints, made of boxes, 200 pixels wide and high; its left is on the right.
fn made_drawing(folder: &Path) {
    let joints = [
        ("root", 100, 110, "null"),
        ("hip", 100, 110, "root"),
        ("torso", 100, 70, "hip"),
        ("neck", 100, 40, "torso"),
        ("right_shoulder", 85, 70, "torso"),
        ("right_elbow", 60, 70, "right_shoulder"),
        ("right_hand", 35, 70, "right_elbow"),
        ("left_shoulder", 115, 70, "torso"),
        ("left_elbow", 140, 70, "left_shoulder"),
        ("left_hand", 165, 70, "left_elbow"),
        ("right_hip", 90, 110, "root"),
        ("right_knee", 90, 140, "right_hip"),
        ("right_foot", 90, 170, "right_knee"),
        ("left_hip", 110, 110, "root"),
        ("left_knee", 110, 140, "left_hip"),
        ("left_foot", 110, 170, "left_knee"),
    ];
    let mut config = "width: 200\nheight: 200\nskeleton:\n".to_owned();
    for (name, x, y, parent) in joints {
        config += &format!("- {{loc: [{x}, {y}], name: {name}, parent: {parent}}}\n");
    }
    std::fs::create_dir_all(folder).expect("a folder");
    std::fs::write(folder.join("char_cfg.yaml"), config).expect("written");
    // Head and trunk, arms, and both legs.
    let boxes = [[85, 20, 115, 115], [25, 62, 175, 78], [82, 105, 97, 180], [103, 105, 118, 180]];
    let is_in = |x: i32, y: i32| {
        boxes.iter().any(|[left, top, right, low]| (*left..*right).contains(&x) && (*top..*low).contains(&y))
    };
    for (name, inside, outside) in
        [("texture.png", [200, 80, 40, 255], [255; 4]), ("mask.png", [255; 4], [0, 0, 0, 255])]
    {
        let pixels = (0..200 * 200).flat_map(|pixel| if is_in(pixel % 200, pixel / 200) { inside } else { outside });
        let file = std::fs::File::create(folder.join(name)).expect("a file");
        let mut encoder = png::Encoder::new(file, 200, 200);
        encoder.set_color(png::ColorType::Rgba);
        let mut writer = encoder.write_header().expect("a header");
        writer.write_image_data(&pixels.collect::<Vec<u8>>()).expect("written");
    }
}

/// `retargetd draw` of a folder `hero` with a file as its motion.
fn draw_alone(folder: &Path, motion: &str, output: &str) -> std::process::Output {
    std::process::Command::new(env!("CARGO_BIN_EXE_retargetd"))
        .args(["draw", "--drawing", "hero", "--source", motion, "--output", output])
        .current_dir(folder)
        .output()
        .expect("the binary runs")
}

/// The largest step of any driven bone from one frame to the next, in degrees.
fn largest_step(poses: &[u8], bones: usize) -> f64 {
    let degrees = numbers(poses, "char_orientations_deg");
    let step = |at: usize| (degrees[at + bones] - degrees[at] + 180.0).rem_euclid(360.0) - 180.0;
    (0..degrees.len() - bones).map(|at| step(at).abs()).fold(0.0, f64::max)
}

const BONES: usize = 10;

#[test]
fn any_motion_moves_a_drawing_with_nothing_else_given() {
    let folder = tempfile::tempdir().expect("a folder");
    made_drawing(&folder.path().join("hero"));
    std::fs::write(folder.path().join("walk.glb"), retargetd::samples::walk_clip()).expect("the walk");
    let output = draw_alone(folder.path(), "walk.glb", "poses.npz");
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{told}");
    for part in ["note: walk.glb", "15 joints of a body", "legs from the side"] {
        assert!(told.contains(part), "{part} in {told}");
    }
    let poses = std::fs::read(folder.path().join("poses.npz")).expect("poses");
    assert!(largest_step(&poses, BONES) <= 30.0, "bones do not jump: {}", largest_step(&poses, BONES));
    // Every driven bone has the angle that it is to have.
    let (joints, degrees) = (numbers(&poses, "rig_joint_xy"), numbers(&poses, "char_orientations_deg"));
    let rest = numbers(&poses, "rig_rest_xy").len();
    let place = |frame: usize, joint: usize| glam::DVec2::from_slice(&joints[frame * rest + joint * 2..]);
    // The torso is the third joint and the first driven one, and hangs on the second.
    for frame in 0..joints.len() / rest {
        let up = place(frame, 2) - place(frame, 1);
        let angle = up.y.atan2(up.x).to_degrees() - 90.0;
        let apart = (angle - degrees[frame * BONES] + 180.0).rem_euclid(360.0) - 180.0;
        assert!(apart.abs() < 0.01, "frame {frame}: {angle}, {}", degrees[frame * BONES]);
    }

    let output = draw_alone(folder.path(), "walk.glb", "walk.gif");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let gif = std::fs::read(folder.path().join("walk.gif")).expect("a picture");
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut reader = options.read_info(&gif[..]).expect("a GIF");
    let mut frames = 0;
    while let Some(frame) = reader.read_next_frame().expect("a frame") {
        let orange =
            frame.buffer.chunks_exact(4).filter(|pixel| pixel[3] > 0 && pixel[0] > 150 && pixel[2] < 100).count();
        assert!(orange > 5_000, "frame {frames}: the figure is seen, and large: {orange}");
        frames += 1;
    }
    assert!(frames > 20, "it moves: {frames}");
}

#[test]
fn drawings_and_motions_that_do_not_fit_are_refused_with_their_names() {
    let folder = tempfile::tempdir().expect("a folder");
    made_drawing(&folder.path().join("hero"));
    std::fs::write(folder.path().join("still.glb"), retargetd::samples::mannequin()).expect("written");
    std::fs::write(folder.path().join("walk.glb"), retargetd::samples::walk_clip()).expect("written");
    let told =
        |motion: &str| String::from_utf8_lossy(&draw_alone(folder.path(), motion, "out.npz").stderr).into_owned();
    assert!(told("still.glb").contains("still.glb: nothing moves in the file"), "{}", told("still.glb"));
    let config = folder.path().join("hero/char_cfg.yaml");
    let text = std::fs::read_to_string(&config).expect("text");
    let renamed = ["elbow", "knee", "foot", "hand", "torso"]
        .iter()
        .fold(text, |text, name| text.replace(name, &format!("x{name}")));
    std::fs::write(&config, renamed).expect("written");
    let other = told("walk.glb");
    assert!(other.contains("hero/char_cfg.yaml") && other.contains("1 bones of a human figure"), "{other}");
}

/// Dances, walks and arms that point at the viewer, of all formats.
#[test]
fn real_motions_move_a_drawing_without_jumps() {
    let motions = [
        "bvh/fair1/zombie_zup.bvh",
        "bvh/fair1/wave_hello_zup.bvh",
        "bvh/cmu/01_01_motionbuilder.bvh",
        "smpl/aistpp_gBR_d04_smpl24_yup.npz",
        "vrma/test_small.vrma",
    ];
    let folder = tempfile::tempdir().expect("a folder");
    made_drawing(&folder.path().join("hero"));
    for name in motions {
        let Some(motion) = crate::support::corpus_file(name) else { return };
        let output = draw_alone(folder.path(), &motion.display().to_string(), "poses.npz");
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        let poses = std::fs::read(folder.path().join("poses.npz")).expect("poses");
        let seconds = numbers(&poses, "frame_time")[0];
        let step = largest_step(&poses, BONES);
        assert!(step <= (900.0 * seconds).min(180.0) + 1e-3, "{name}: {step} degrees");
        let groups = 5;
        let order = numbers(&poses, "bodypart_order");
        let frames = order.len() / groups;
        for group in 0..groups {
            let place = |frame: usize| (0..groups).find(|at| order[frame * groups + at] == group as f64);
            let changes = (1..frames).filter(|frame| place(*frame) != place(frame - 1)).count();
            let most = 2.0 * frames as f64 * seconds + 1.0;
            assert!(
                changes as f64 <= most,
                "{name}: group {group} changes its place {changes} times in {frames} frames"
            );
        }
        std::fs::remove_file(folder.path().join("poses.npz")).expect("there");
    }
}

/// Sleeves, hair and armpits of the original's characters fold nowhere.
#[test]
fn real_drawings_have_no_triangles_that_turn_over() {
    let folder = tempfile::tempdir().expect("a folder");
    let small = r#"{"task": "draw", "view": {"size": [40, 40]}, "edit": {"range": [0, 6], "fps": 12}}"#;
    std::fs::write(folder.path().join("small.json"), small).expect("a spec");
    for (drawing, motion) in [("char1", "zombie_zup"), ("char4", "zombie_zup"), ("char2", "dab_zup")] {
        let Some(motion) = crate::support::corpus_file(&format!("bvh/fair1/{motion}.bvh")) else { return };
        let Some(config) = crate::support::corpus_file(&format!("animated-drawings/{drawing}/char_cfg.yaml")) else {
            return;
        };
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_retargetd"))
            .args(["draw", "--config", "small.json", "--output", "small.webp", "--report", "report.json"])
            .args([std::ffi::OsStr::new("--drawing"), config.parent().expect("a folder").as_os_str()])
            .args([std::ffi::OsStr::new("--source"), motion.as_os_str()])
            .current_dir(folder.path())
            .output()
            .expect("the binary runs");
        assert!(output.status.success(), "{drawing}: {}", String::from_utf8_lossy(&output.stderr));
        let report = std::fs::read(folder.path().join("report.json")).expect("a report");
        let report: serde_json::Value = serde_json::from_slice(&report).expect("a report");
        let measures = &report["drawing"]["characters"][0]["measures"];
        let mean = measures["turned_over_percent"]["value"].as_f64().expect("a value");
        let most = measures["turned_over_percent_most"].as_f64().expect("a value");
        assert!(mean <= 0.05 && most <= 0.3, "{drawing}: {mean} % on average, {most} % at most");
    }
}

#[test]
fn a_drawing_in_an_archive_gives_all_its_outputs_at_once() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("child.zip"), retargetd::samples::drawing()).expect("a drawing");
    std::fs::write(folder.path().join("walk.glb"), retargetd::samples::walk_clip()).expect("the walk");
    let wanted = r#"{"task": "draw", "view": {"size": [200, 200]}, "edit": {"range": [0, 1.3]}}"#;
    std::fs::write(folder.path().join("wanted.json"), wanted).expect("a spec");
    let outputs = ["walk.gif", "walk.png", "walk.zip", "model.glb", "poses.json", "poses.npz"];
    let mut command = Command::new(env!("CARGO_BIN_EXE_retargetd"));
    command.args(["draw", "--drawing", "child.zip", "--source", "walk.glb", "--report", "report.json"]);
    command.args(["--config", "wanted.json"]);
    for output in outputs {
        command.args(["--output", output]);
    }
    let output = command.current_dir(folder.path()).output().expect("the binary runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let file = |name: &str| std::fs::read(folder.path().join(name)).expect("a file");
    let report: serde_json::Value = serde_json::from_slice(&file("report.json")).expect("a report");
    let measures = &report["drawing"]["characters"][0]["measures"];
    let value = |name: &str| measures[name]["value"].as_f64().expect("a value");
    assert!(value("angle_error_degrees") <= 0.01, "{measures}");
    assert!(value("turned_over_percent") <= 0.05, "{measures}");
    assert!(value("slip_percent_per_second") <= 1.0, "{measures}");
    assert!(value("area_change_percent") <= 2.0, "{measures}");
    assert!(value("length_change_percent") <= 3.0, "{measures}");
    assert_ne!(report["drawing"]["verdict"], "fail", "{report}");
    // The resolved spec makes the same again.
    let spec = &report["resolved_spec"];
    assert!(spec["retarget"]["char_joint_bvh_joints_mapping"].is_array(), "what was chosen is said: {spec}");
    std::fs::write(folder.path().join("spec.json"), spec.to_string()).expect("a spec");
    let again = Command::new(env!("CARGO_BIN_EXE_retargetd"))
        .args([
            "draw",
            "--drawing",
            "child.zip",
            "--source",
            "walk.glb",
            "--config",
            "spec.json",
            "--output",
            "again.npz",
        ])
        .current_dir(folder.path())
        .output()
        .expect("the binary runs");
    assert!(again.status.success(), "{}", String::from_utf8_lossy(&again.stderr));
    assert_eq!(numbers(&file("again.npz"), "rig_joint_xy"), numbers(&file("poses.npz"), "rig_joint_xy"));
    // JSON and NPZ hold the same.
    let poses: serde_json::Value = serde_json::from_slice(&file("poses.json")).expect("poses");
    let flat = |value: &serde_json::Value| -> Vec<f64> {
        let mut open = vec![value.clone()];
        let mut found = Vec::new();
        while let Some(value) = open.pop() {
            match value {
                serde_json::Value::Array(list) => open.extend(list.into_iter().rev()),
                value => found.push(value.as_f64().expect("a number")),
            }
        }
        found
    };
    let (one, other) = (flat(&poses["rig_joint_xy"]), numbers(&file("poses.npz"), "rig_joint_xy"));
    assert_eq!(one.len(), other.len());
    assert!(one.iter().zip(&other).all(|(one, other)| (one - other).abs() < 1e-6));
    follows_the_poses(&file("model.glb"), &poses);
    let model = folder.path().join("model.glb");
    let Some(reports) = crate::support::validate_gltf(&[&model]) else { return };
    let report = &reports[model.as_path()];
    assert_eq!(report["errors"], 0, "{report}");
    assert_eq!(report["warnings"], 0, "{report}");
}

/// The bones of a model begin and end where the joints of the drawing are.
fn follows_the_poses(model: &[u8], poses: &serde_json::Value) {
    let document = crate::support::gltf_json(model);
    assert_eq!(document["extensionsUsed"], serde_json::json!(["KHR_materials_unlit"]));
    let scene = retargetd::formats::read(
        model,
        Format::Glb,
        &Limits::default(),
        &Control::new(),
        &mut retargetd::model::Reporter::new(),
    );
    let scene = scene.expect("our reader takes it");
    let names: Vec<&str> =
        poses["char_joint_names"].as_array().expect("names").iter().filter_map(|name| name.as_str()).collect();
    let place = |frame: usize, name: &str| {
        let joint = names.iter().position(|own| *own == name).expect("a joint");
        let pair = &poses["rig_joint_xy"][frame][joint];
        glam::DVec2::new(pair[0].as_f64().expect("x"), pair[1].as_f64().expect("y"))
    };
    let clip = &scene.clips[0];
    // A bone is called as the joint at its end and begins at the one before.
    let node = |name: &str| scene.skeleton.find(name).expect("a bone");
    let at = |frame: usize, name: &str| {
        let model = clip.local_pose(&scene.skeleton, frame).to_model(&scene.skeleton);
        model.transforms()[node(name)].translation.truncate()
    };
    let scale =
        at(0, "left_hand").distance(at(0, "right_hand")) / place(0, "left_elbow").distance(place(0, "right_elbow"));
    for frame in 0..clip.frame_count() {
        for (bone, begin) in [("left_hand", "left_elbow"), ("right_foot", "right_knee"), ("neck", "torso")] {
            let wanted = (place(frame, begin) - place(frame, "root")) * scale;
            let root = scene.skeleton.find("drawing_root").expect("a root");
            let pose = clip.local_pose(&scene.skeleton, frame).to_model(&scene.skeleton);
            let seen = at(frame, bone) - pose.transforms()[root].translation.truncate();
            assert!(seen.distance(wanted) < 0.01, "frame {frame}, {bone}: {seen} and {wanted}");
        }
    }
}
