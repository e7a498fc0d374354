//! What drawn characters do, as arrays.

use crate::{
    drawing::{
        CharacterFiles, DrawingError, MotionSpec, Performance, Plane, SceneSpec, read_character, read_motion,
        read_retarget, read_scene,
    },
    formats::{self, ArrayValues, Limits, NamedArray},
    model::{Control, Phase, Reporter},
};

use super::{Failure, FailureCode, NamedBytes, WarningView};

/// The files of one drawn character.
#[derive(Clone, Copy, Debug)]
pub struct DrawnCharacter<'a> {
    /// Its own config: size and joints.
    pub character: NamedBytes<'a>,
    /// The config of its motion.
    pub motion: NamedBytes<'a>,
    /// The motion itself, a BVH.
    pub bvh: NamedBytes<'a>,
    /// How the motion is put onto it.
    pub retarget: NamedBytes<'a>,
}

/// What came out.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// A NumPy archive.
    pub bytes: Vec<u8>,
    /// How many frames the first character has.
    pub frames: usize,
    /// Guesses and losses.
    pub warnings: Vec<WarningView>,
}

/// The characters of a scene, as its file names them, and fields of it that are set and not used.
///
/// # Errors
/// When the scene cannot be read.
pub fn characters_of_scene(scene: NamedBytes<'_>) -> Result<(Vec<CharacterFiles>, Vec<&'static str>), Failure> {
    let read: SceneSpec = read_scene(scene.bytes).map_err(|error| in_file(scene, error))?;
    let not_used = read.not_used();
    Ok((read.scene.animated_characters, not_used))
}

/// The path of the BVH that the config of a motion names.
///
/// # Errors
/// When the config cannot be read.
pub fn path_of_motion(motion: NamedBytes<'_>) -> Result<String, Failure> {
    Ok(spec_of_motion(motion)?.filepath)
}

/// What drawn characters do in their motions, with the numbers of Animated Drawings: a NumPy archive with, for each frame, wanted angles, the
/// places of joints and of the root, and what they are made from. Of several characters, the names begin with `c0_`, `c1_` and so on.
///
/// # Errors
/// When a file cannot be read, or a config names what is not there.
pub fn draw_poses(characters: &[DrawnCharacter<'_>], limits: &Limits, control: &Control) -> Result<Drawn, Failure> {
    let mut reporter = Reporter::new();
    let (mut arrays, mut frames) = (Vec::new(), None);
    control.enter(Phase::Retarget, characters.len() as u64);
    for (index, files) in characters.iter().enumerate() {
        control.check()?;
        let performance = performance(files, limits, control, &mut reporter)?;
        let prefix = if characters.len() > 1 { format!("c{index}_") } else { String::new() };
        for name in &performance.dropped {
            let detail = format!("'{name}' is not above its line in this drawing, so it is not turned");
            reporter.warn(
                "drawing_check_failed",
                files.character.name,
                detail,
                "move the joint, or leave the check out",
            );
        }
        frames.get_or_insert(performance.driver.frames.len());
        arrays.extend(as_arrays(&prefix, &performance));
        control.advance(1);
    }
    let bytes = formats::write_arrays(&arrays)?;
    let warnings = reporter.into_warnings().into_iter().map(WarningView::from).collect();
    Ok(Drawn { bytes, frames: frames.unwrap_or(0), warnings })
}

fn performance(
    files: &DrawnCharacter<'_>,
    limits: &Limits,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Performance, Failure> {
    let character = read_character(files.character.bytes).map_err(|error| in_file(files.character, error))?;
    let motion = spec_of_motion(files.motion)?;
    let retarget = read_retarget(files.retarget.bytes).map_err(|error| in_file(files.retarget, error))?;
    let paths = formats::joint_paths(files.bvh.bytes, limits, control, reporter)
        .map_err(|error| named(Failure::from(error), files.bvh.name))?;
    Performance::new(&character, &motion, &paths, &retarget).map_err(|error| {
        // The place says whose field it is.
        let is_of_motion = ["/groundplane", "/forward", "/start"].iter().any(|field| error.place.starts_with(field));
        in_file(if is_of_motion { files.motion } else { files.retarget }, error)
    })
}

fn spec_of_motion(motion: NamedBytes<'_>) -> Result<MotionSpec, Failure> {
    read_motion(motion.bytes).map_err(|error| in_file(motion, error))
}

fn in_file(file: NamedBytes<'_>, error: DrawingError) -> Failure {
    let detail = format!("{}: {error}", file.name);
    let failure = Failure::new(FailureCode::InvalidValue, detail);
    if error.hint.is_empty() { failure } else { failure.with_hint(error.hint) }
}

fn named(failure: Failure, name: &str) -> Failure {
    Failure { detail: format!("{name}: {}", failure.detail), ..failure }
}

fn as_arrays(prefix: &str, performance: &Performance) -> Vec<NamedArray> {
    let Performance { driver, puppet, .. } = performance;
    let (frames, joints) = (driver.frames.len(), driver.names.len());
    let array = |name: &str, shape: Vec<usize>, values: ArrayValues| NamedArray {
        name: format!("{prefix}{name}"),
        shape,
        values,
    };
    let single = |name: &str, shape: Vec<usize>, values: Vec<f64>| {
        array(name, shape, ArrayValues::Single(values.into_iter().map(|value| value as f32).collect()))
    };
    let names = |name: &str, names: Vec<String>| array(name, vec![names.len()], ArrayValues::Names(names));
    let of_frames =
        |values: fn(&crate::drawing::DriverFrame) -> Vec<f64>| driver.frames.iter().flat_map(values).collect();
    let pairs = |places: &[glam::DVec2]| places.iter().flat_map(|place| place.to_array()).collect::<Vec<f64>>();
    let depths = (0..frames).flat_map(|frame| performance.depths(frame)).collect();
    let projected = performance.projected.iter().map(|(joint, _)| driver.names[*joint].clone()).collect();
    let plane = |plane: &Plane| match plane {
        Plane::Frontal => "frontal".to_owned(),
        Plane::Sagittal => "sagittal".to_owned(),
    };
    vec![
        single("frame_time", vec![1], vec![driver.frame_seconds]),
        names("bvh_joint_names", driver.names.clone()),
        single("bvh_root_positions", vec![frames, 3], of_frames(|frame| frame.root.to_array().to_vec())),
        single("bvh_fwd_vectors", vec![frames, 3], of_frames(|frame| frame.forward.to_array().to_vec())),
        single(
            "bvh_joint_positions_normalised",
            vec![frames, joints, 3],
            of_frames(|frame| frame.joints.iter().flat_map(|joint| joint.to_array()).collect()),
        ),
        names("depth_columns", projected),
        single("bvh_joint_depths", vec![frames, performance.projected.len()], depths),
        names("projection_planes", performance.planes.iter().map(plane).collect()),
        names("orientation_columns", performance.driven.clone()),
        single("char_orientations_deg", vec![frames, performance.driven.len()], performance.wanted_degrees.concat()),
        single("char_root_positions", vec![frames, 2], pairs(&performance.root_path)),
        names("char_joint_names", puppet.names.clone()),
        single("rig_rest_xy", vec![puppet.names.len(), 2], pairs(&puppet.rest)),
        single(
            "rig_joint_xy",
            vec![frames, puppet.names.len(), 2],
            performance.joints.iter().flat_map(|frame| pairs(frame)).collect(),
        ),
    ]
}
