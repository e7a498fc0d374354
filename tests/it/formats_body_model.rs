//! Captures without a skeleton: parameters of body models, positions and features, real and hostile.

use std::process::Command;

use glam::DVec3;
use retargetd::{
    engine::{self, Inputs, NamedBytes},
    formats::{self, ErrorKind, FormatError, Limits},
    model::{Control, Reporter, Scene},
    samples,
};
use zip::{ZipWriter, write::SimpleFileOptions};

use crate::support::{corpus_file, files_below, python_with, skip};

fn read(bytes: &[u8], name: &str) -> Result<(Scene, Vec<&'static str>), FormatError> {
    let format = formats::sniff(bytes, name)?;
    let mut reporter = Reporter::new();
    let scene = formats::read(bytes, format, &Limits::default(), &Control::new(), &mut reporter)?;
    Ok((scene, reporter.into_warnings().iter().map(|warning| warning.code).collect()))
}

fn real(name: &str) -> Option<(Scene, Vec<&'static str>)> {
    let bytes = std::fs::read(corpus_file(&format!("smpl/{name}"))?).expect("a readable file");
    Some(read(&bytes, name).unwrap_or_else(|error| panic!("{name}: {error}")))
}

/// Where the joints are in a frame; meters.
fn places(scene: &Scene, frame: usize) -> Vec<DVec3> {
    let pose = scene.clips[0].local_pose(&scene.skeleton, frame).to_model(&scene.skeleton);
    pose.transforms().iter().map(|joint| joint.translation).collect()
}

/// The bytes of a NumPy array of single precision.
fn array(shape: &[usize], values: &[f32]) -> Vec<u8> {
    let shape: Vec<String> = shape.iter().map(usize::to_string).collect();
    let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({},), }}\n", shape.join(", "));
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(u16::try_from(header.len()).expect("a short header").to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    bytes
}

fn archive(members: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut zip = ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, bytes) in members {
        zip.start_file(format!("{name}.npy"), SimpleFileOptions::default()).expect("a member");
        std::io::Write::write_all(&mut zip, bytes).expect("written");
    }
    zip.finish().expect("an archive").into_inner()
}

#[test]
fn features_and_positions_of_one_clip_are_one_motion() {
    let (Some((features, _)), Some((positions, warnings))) =
        (real("humanml3d_012314_vec263.npy"), real("humanml3d_012314_joints22.npy"))
    else {
        return;
    };
    assert!(warnings.contains(&"roll_unknown") && warnings.contains(&"frame_rate_assumed"), "honest: {warnings:?}");
    let frames = positions.clips[0].frame_count();
    // The file of positions has one frame more or less than that of features, which hold steps between frames.
    assert!(features.clips[0].frame_count().abs_diff(frames) <= 1, "{frames} frames");
    assert_eq!(positions.clips[0].uniform_fps().map(f64::round), Some(20.0), "as HumanML3D has it");
    for frame in 0..features.clips[0].frame_count().min(frames) {
        let pairs = places(&features, frame).into_iter().zip(places(&positions, frame));
        let worst = pairs.map(|(one, other)| one.distance(other)).fold(0.0, f64::max);
        assert!(worst < 0.005, "frame {frame}: {worst} m apart");
    }
}

#[test]
fn positions_are_met_to_the_millimeter() {
    for name in ["humanml3d_012314_joints22.npy", "aistpp_gBR_d04_joints22_20fps_yup.npy"] {
        let Some((scene, _)) = real(name) else { return };
        let bytes = std::fs::read(corpus_file(&format!("smpl/{name}")).expect("it is there")).expect("a file");
        let data = &bytes[bytes.len() - scene.clips[0].frame_count() * 22 * 12..];
        let seen: Vec<f32> =
            data.chunks_exact(4).map(|value| f32::from_le_bytes(value.try_into().expect("four bytes"))).collect();
        let mut worst: f64 = 0.0;
        for frame in 0..scene.clips[0].frame_count() {
            for (joint, place) in places(&scene, frame).into_iter().enumerate() {
                let at = (frame * 22 + joint) * 3;
                let seen = DVec3::new(f64::from(seen[at]), f64::from(seen[at + 1]), f64::from(seen[at + 2]));
                worst = worst.max(place.distance(seen));
            }
        }
        assert!(worst < 0.02, "{name}: a joint is {worst} m off");
    }
}

#[test]
fn three_layouts_of_one_dance_are_one_dance() {
    let read = [
        "aistpp_gBR_d04_smpl24_yup.npz",
        "aistpp_gBR_d04_smplh_amass_layout_zup.npz",
        "aistpp_gBR_d04_smplx_stageii_layout_zup.npz",
    ]
    .map(real);
    let [Some((smpl, unsaid)), Some((smplh, said)), Some((smplx, _))] = read else { return };
    assert_eq!([&smpl, &smplh, &smplx].map(|scene| scene.skeleton.len()), [24, 52, 55], "joints of each family");
    assert_eq!([&smpl, &smplh, &smplx].map(|scene| scene.clips[0].frame_count()), [720; 3], "frames");
    assert!(
        unsaid.contains(&"frame_rate_assumed") && !said.contains(&"frame_rate_assumed"),
        "only AMASS says its rate"
    );
    for frame in (0..720).step_by(40) {
        let poses = [&smpl, &smplh, &smplx].map(|scene| scene.clips[0].local_pose(&scene.skeleton, frame));
        for joint in 0..22 {
            let turns = poses.each_ref().map(|pose| pose.transforms()[joint].rotation);
            let apart = turns[0].angle_between(turns[1]).max(turns[0].angle_between(turns[2])).to_degrees();
            assert!(apart < 0.01, "frame {frame}, joint {joint}: {apart} degrees between the layouts");
        }
        // The files were made from one another without regard to where the model's origin is, so only the travel is the same.
        for (scene, pose) in [(&smplh, &poses[1]), (&smplx, &poses[2])] {
            let travel = |scene: &Scene, to: DVec3| {
                to - scene.clips[0].local_pose(&scene.skeleton, 0).transforms()[0].translation
            };
            let apart = travel(scene, pose.transforms()[0].translation)
                .distance(travel(&smpl, poses[0].transforms()[0].translation));
            assert!(apart < 0.001, "frame {frame}: the pelvis is {apart} meters elsewhere");
        }
    }
}

#[test]
fn a_capture_moves_a_character() {
    for name in ["aistpp_gBR_d04_smplh_amass_layout_zup.npz", "humanml3d_012314_vec263.npy"] {
        let Some(path) = corpus_file(&format!("smpl/{name}")) else { return };
        let (source, target) = (std::fs::read(path).expect("a file"), samples::mannequin());
        let inputs = Inputs {
            source: NamedBytes { name, bytes: &source },
            target: NamedBytes { name: "mannequin.glb", bytes: &target },
            source_rest: None,
            target_rest: None,
            config: None,
            formats: &[],
        };
        let outcome = engine::retarget(&inputs, &engine::Limits::default(), &Control::new());
        let report = outcome.unwrap_or_else(|failure| panic!("{name}: {failure}")).report;
        let measures = serde_json::to_value(report.measures.expect("it is measured")).expect("JSON");
        let off = measures["limb_direction_p95_degrees"].as_f64().expect("directions are measured");
        assert!(off < 5.0, "{name}: directions are {off} degrees off");
    }
}

/// Whatever type, order and version NumPy writes, it is one motion; and what it would have to pickle is refused.
#[test]
fn all_that_numpy_saves_is_read() {
    let Some(python) = python_with("numpy") else { return skip("there is no Python with numpy") };
    // Three frames of a body that bends.
    let poses: Vec<f32> = (0..3 * 72).map(|at| if at % 72 < 9 { (at / 72) as f32 * 0.1 } else { 0.0 }).collect();
    let (bent, _) = read(&archive(&[("poses", array(&[3, 72], &poses))]), "bent.npz").expect("parameters");
    let seen: Vec<f32> = (0..3).flat_map(|frame| places(&bent, frame)).flat_map(|at| at.as_vec3().to_array()).collect();
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("positions.npy"), array(&[3, 24, 3], &seen)).expect("a file");
    std::fs::write(folder.path().join("poses.npy"), array(&[3, 72], &poses)).expect("a file");
    let script = "
import numpy, os, sys
os.chdir(sys.argv[1])
positions, poses = numpy.load('positions.npy'), numpy.load('poses.npy')
os.remove('poses.npy')
for name in ('<f2', '>f2', '<f4', '>f4', '<f8', '>f8'):
    numpy.save('p_%s.npy' % (name[1:] + ('l' if name[0] == '<' else 'b')), positions.astype(name))
numpy.save('p_f.npy', numpy.asfortranarray(positions))
numpy.save('p_strided.npy', numpy.repeat(positions, 2, axis=0)[::2])
for version in (1, 2, 3):
    with open('p_v%d.npy' % version, 'wb') as file:
        numpy.lib.format.write_array(file, positions, version=(version, 0))
numpy.savez('m_plain.npz', poses=poses, gender='neutral', mocap_framerate=30)
numpy.savez_compressed('m_packed.npz', poses=poses.astype('>f8'), mocap_framerate=numpy.array(30.0))
numpy.savez('x_pickled.npz', poses=poses, betas=numpy.array([{'a': 1}], dtype=object))
numpy.save('x_pickled.npy', numpy.array([{'a': 1}, None], dtype=object))
";
    let output = Command::new(python).args(["-c", script]).arg(folder.path()).output().expect("python runs");
    assert!(output.status.success(), "numpy: {}", String::from_utf8_lossy(&output.stderr));
    let mut read_files = 0;
    for path in files_below(folder.path()) {
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        let result = read(&std::fs::read(&path).expect("a file"), &name);
        if name == "x_pickled.npy" {
            assert!(result.expect_err("objects").to_string().contains("pickled"));
            continue;
        }
        let (scene, codes) = result.unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(scene.clips[0].frame_count(), 3, "{name}: and what nobody asks for is left alone, whatever it is");
        if name.starts_with("m_") {
            assert_eq!(scene.clips[0].uniform_fps().map(f64::round), Some(30.0), "{name}: {codes:?}");
        }
        // Half precision has a millimeter at two meters.
        let most = if name.contains("f2") { 3e-3 } else { 1e-3 };
        for frame in 0..3 {
            // Positions say nothing of where the model's origin is.
            for (found, expected) in places(&scene, frame).into_iter().zip(places(&bent, frame)) {
                assert!(found.distance(expected) < most, "{name}: frame {frame}: {found}, not {expected}");
            }
        }
        read_files += 1;
    }
    assert_eq!(read_files, 15, "all of them, and what they were made from");
}

#[test]
fn what_is_no_capture_is_refused_with_the_shape() {
    let frames = |width: usize| array(&[2, width], &vec![0.1; 2 * width]);
    let refused = |bytes: &[u8], name: &str| {
        let error = read(bytes, name).expect_err("no capture");
        assert!(!error.hint.is_empty(), "what to do: {error}");
        error.to_string()
    };
    assert!(refused(&archive(&[("poses", frames(70))]), "a.npz").contains("[2, 70]"), "no multiple of three");
    assert!(refused(&archive(&[("poses", frames(69))]), "a.npz").contains("23 joints"), "no such body");
    assert!(
        refused(&archive(&[("poses", frames(72)), ("trans", array(&[3, 3], &[0.0; 9]))]), "a.npz").contains("trans"),
        "as many places as poses"
    );
    assert!(
        refused(&archive(&[("root_orient", frames(3)), ("pose_body", frames(60))]), "a.npz").contains("20 joints"),
        "a joint is missing"
    );
    assert!(refused(&array(&[2, 21, 3], &[0.0; 126]), "a.npy").contains("[2, 21, 3]"), "not SMPL's joints");
    assert!(refused(&array(&[2, 22, 3], &[0.0; 132]), "a.npy").contains("one place"), "no body");
    assert!(refused(&array(&[2, 22, 3], &[f32::NAN; 132]), "a.npy").contains("not a finite number"), "no number");
    assert!(refused(&array(&[1 << 40, 22, 3], &[]), "a.npy").contains("decoded_bytes"), "paid for before it is read");
    assert!(refused(&array(&[usize::MAX, 22, 3], &[]), "a.npy").contains("memory"), "no wrap around");
    assert!(refused(&array(&[4, 22, 3], &[0.0; 132]), "a.npy").contains("holds"), "cut short");
    let zero = archive(&[("poses", frames(72)), ("mocap_framerate", array(&[1], &[0.0]))]);
    assert!(refused(&zero, "a.npz").contains("frame rate"), "no rate");
    let pickle = read(b"\x80\x04\x95", "dance.pkl").expect_err("a pickle");
    assert!(
        pickle.kind == ErrorKind::UnsupportedFormat && pickle.detail.contains("run code"),
        "never decoded: {pickle}"
    );
    let mut objects = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
    objects.extend(format!("{:<117}\n", "{'descr': '|O', 'fortran_order': False, 'shape': (), }").as_bytes());
    assert!(refused(&objects, "results.npy").contains("pickled"), "never decoded");
    assert!(refused(&archive(&[("poses", array(&[0, 72], &[]))]), "a.npz").contains("no frame"), "nothing moves");
}

#[test]
fn hostile_archives_of_the_corpus_are_told_apart() {
    let expected = [
        ("bomb_100MB", Some("decompression_ratio")),
        ("framerate_missing", None),
        ("gender_unknown", None),
        ("member_path_traversal", None),
        ("pickled_object", Some("pickled")),
        ("poses_int32", None),
        ("poses_nan", Some("not a finite number")),
        ("poses_width_71", Some("71]")),
        ("poses_zero_frames", Some("no frame")),
        ("reference_ok", None),
        ("trans_frame_mismatch", Some("trans")),
        ("trans_missing", None),
    ];
    for (name, refusal) in expected {
        let Some(path) = corpus_file(&format!("hostile/npz/{name}.npz")) else { continue };
        let bytes = std::fs::read(&path).expect("a readable file");
        match (read(&bytes, name), refusal) {
            (Ok(_), None) => {}
            (Err(error), Some(part)) => assert!(error.to_string().contains(part), "{name}: {error}"),
            (answer, refusal) => panic!("{name}: {refusal:?} was expected, not {:?}", answer.map(|(_, codes)| codes)),
        }
    }
}

/// Axis angles of a body whose left elbow is bent and that stands as `root` has it.
fn bent_body(joints: usize, root: DVec3) -> Vec<f32> {
    const LEFT_ELBOW: usize = 18;
    let mut values = vec![0.0; 3 * joints];
    values[..3].copy_from_slice(&root.as_vec3().to_array());
    values[3 * LEFT_ELBOW + 1] = -1.2;
    values
}

fn matrices(vectors: &[f32]) -> Vec<f32> {
    let turns = vectors.chunks(3).map(|vector| glam::Quat::from_scaled_axis(glam::Vec3::from_slice(vector)));
    turns.flat_map(|turn| glam::Mat3::from_quat(turn).transpose().to_cols_array()).collect()
}

#[test]
fn bare_vectors_and_matrices_are_the_pose_that_they_say() {
    for joints in [22, 24, 52, 55] {
        let vector = bent_body(joints, DVec3::ZERO);
        let turns = matrices(&vector);
        let wanted = read(&archive(&[("poses", array(&[1, 3 * joints], &vector))]), "a.npz").expect("a pose").0;
        let placed: Vec<f32> = vector.iter().copied().chain([0.0; 3]).collect();
        let files = [
            ("vector.npy", array(&[3 * joints], &vector)),
            ("vectors.npy", array(&[1, 3 * joints], &vector)),
            ("placed.npy", array(&[1, 3 * joints + 3], &placed)),
            ("matrices.npy", array(&[1, joints, 3, 3], &turns)),
            ("matrix.npy", array(&[joints, 3, 3], &turns)),
            ("bare.npz", archive(&[("arr_0", array(&[3 * joints], &vector))])),
            ("flat.npz", archive(&[("poses", array(&[1, 9 * joints], &turns))])),
            ("single.npz", archive(&[("pose", array(&[joints, 3, 3], &turns))])),
        ];
        // A vector of 69 with a place could as well be 23 joints without one.
        let is_clear = |name: &str| joints != 22 || name != "placed.npy";
        for (name, bytes) in files.into_iter().filter(|(name, _)| is_clear(name)) {
            let (scene, _) = read(&bytes, name).unwrap_or_else(|error| panic!("{name} of {joints}: {error}"));
            let pairs = places(&scene, 0).into_iter().zip(places(&wanted, 0));
            let worst = pairs.map(|(one, other)| one.distance(other)).fold(0.0, f64::max);
            assert!(worst < 1e-5, "{name} of {joints}: {worst} m apart");
        }
    }
    let refused = read(&archive(&[("poses", array(&[1, 22, 3, 3], &[2.0; 198]))]), "a.npz").expect_err("no rotations");
    assert!(refused.detail.contains("not a rotation"), "{refused}");
}

#[test]
fn a_body_in_the_axes_of_a_camera_stands_upright() {
    let thetas = bent_body(24, DVec3::new(std::f64::consts::PI, 0.0, 0.0));
    let bytes = archive(&[
        ("smpl_thetas", array(&[1, 72], &thetas)),
        ("smpl_betas", array(&[1, 10], &[0.0; 10])),
        ("cam_trans", array(&[1, 3], &[0.0, 0.5, 3.0])),
    ]);
    let (scene, _) = read(&bytes, "romp.npz").expect("arrays of ROMP");
    let places = places(&scene, 0);
    assert!(places[15].y > places[0].y + 0.4, "the head is above the pelvis: {places:?}");
    assert!(places[0].y < -0.2, "down in the camera is down: {:?}", places[0]);
}

#[test]
fn what_is_no_pose_array_is_told_by_its_keys() {
    let error = read(&archive(&[("vertices", array(&[2, 3], &[0.0; 6]))]), "a.npz").expect_err("no poses");
    assert!(error.detail.contains("vertices") && !error.detail.contains("joint_names"), "{error}");
    let error = read(&archive(&[("rotations", array(&[1, 2, 4], &[0.5; 8]))]), "a.npz").expect_err("no names");
    assert!(error.detail.contains("rotations") && error.detail.contains("'joint_names' is missing"), "{error}");
}
