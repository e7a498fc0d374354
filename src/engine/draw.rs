//! Scenes of drawn characters: their configs and files to what the characters do, and that to arrays.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::{
    drawing::{
        Arap, BodyMotion, CharacterSpec, DrawingError, Manner, MotionFile, MotionSpec, Performance, PlanarRig, Plane,
        Precision, Puppet, RetargetSpec, SceneSpec,
    },
    formats::{Elements, Limits, NamedArray, read_numbers, write_arrays},
    model::Control,
    picture::{Picture, PictureError, PictureFormat, Reel, read_picture},
};

use super::{Failure, FailureCode, NamedBytes, drawn_motion::drawn_motion, preview::check_built};

/// A drawn character, and what it does.
#[derive(Clone, Debug)]
pub struct DrawnCharacter {
    spec: CharacterSpec,
    rig: PlanarRig,
    motion: BodyMotion,
    retarget: RetargetSpec,
    /// The files of the texture and of the mask.
    pictures: [String; 2],
    performance: Performance,
}

/// A scene with everything that it names.
#[derive(Clone, Debug)]
pub struct Scenery {
    /// The config of the scene.
    pub spec: SceneSpec,
    /// Its characters.
    pub characters: Vec<DrawnCharacter>,
    /// What was noticed: a code and a text.
    pub notes: Vec<(&'static str, String)>,
}

/// Reads a scene and all that it names, and lets every character move. `read` finds the files that configs name, by the names as they are
/// written.
///
/// # Errors
///
/// With the file and the field of what is wrong.
pub fn read_scenery(
    scene: NamedBytes<'_>,
    read: &mut dyn FnMut(&str) -> Result<Vec<u8>, Failure>,
    manner: Manner,
    control: &Control,
) -> Result<Scenery, Failure> {
    let text = text(scene.bytes, scene.name)?;
    let spec = SceneSpec::read(text).map_err(|error| refused(error, scene.name))?;
    let mut notes = Vec::new();
    note_not_used(&mut notes, scene.name, &spec.not_used());
    let mut characters = Vec::new();
    for files in &spec.scene.animated_characters {
        control.check().map_err(|_| Failure::new(FailureCode::Canceled, "canceled"))?;
        let mut config = |name: &str| -> Result<String, Failure> { Ok(self::text(&read(name)?, name)?.to_owned()) };
        let (character, motion, retarget) = (&*files.character_cfg, &*files.motion_cfg, &*files.retarget_cfg);
        let spec = CharacterSpec::read(&config(character)?).map_err(|error| refused(error, character))?;
        let rig = PlanarRig::new(&spec).map_err(|error| refused(error, character))?;
        let motion_spec = MotionSpec::read(&config(motion)?).map_err(|error| refused(error, motion))?;
        let retarget_spec = RetargetSpec::read(&config(retarget)?).map_err(|error| refused(error, retarget))?;
        let file_name = &*motion_spec.filepath;
        let file = MotionFile::read(&config(file_name)?).map_err(|error| refused(error, file_name))?;
        let body = BodyMotion::new(&file, &motion_spec).map_err(|error| refused(error, motion))?;
        let performance =
            Performance::new(&rig, &body, &retarget_spec, manner).map_err(|error| refused(error, retarget))?;
        note_not_used(&mut notes, character, &spec.not_used());
        note_not_used(&mut notes, motion, &motion_spec.not_used());
        note_not_used(&mut notes, retarget, &retarget_spec.not_used());
        notes.extend(performance.notes.iter().map(|(code, text)| (*code, format!("{retarget}: {text}"))));
        let folder = character.rfind('/').map_or("", |slash| &character[..=slash]);
        let pictures = ["texture.png", "mask.png"].map(|name| format!("{folder}{name}"));
        characters.push(DrawnCharacter { pictures, spec, rig, motion: body, retarget: retarget_spec, performance });
    }
    Ok(Scenery { spec, characters, notes })
}

/// Lets a drawing move as the body of any file does, with nothing else given. `folder` has `char_cfg.yaml`, `texture.png` and `mask.png`,
/// and `read` reads them; of the motion that clip is taken, or the first that moves.
///
/// # Errors
///
/// Where the drawing is no human figure, or the motion is none of a body.
pub fn stage_drawing(
    folder: &str,
    read: &mut dyn FnMut(&str) -> Result<Vec<u8>, Failure>,
    (motion, clip): (NamedBytes<'_>, Option<&str>),
    limits: &Limits,
    control: &Control,
) -> Result<Scenery, Failure> {
    let beside = |name: &str| format!("{}/{name}", folder.trim_end_matches('/'));
    let character = beside("char_cfg.yaml");
    let spec =
        CharacterSpec::read(text(&read(&character)?, &character)?).map_err(|error| refused(error, &character))?;
    let rig = PlanarRig::new(&spec).map_err(|error| refused(error, &character))?;
    let (body, chosen) = drawn_motion(motion, clip, limits, control)?;
    let retarget = RetargetSpec::of_humanoid(&rig, &body).map_err(|error| refused(error, &character))?;
    let performance =
        Performance::new(&rig, &body, &retarget, Manner::Steady).map_err(|error| refused(error, &character))?;
    let mut notes = vec![("drawing_motion", format!("{}: {chosen}", motion.name))];
    let planes = retarget.bvh_projection_bodypart_groups.iter().zip(&performance.planes);
    let planes: Vec<String> = planes
        .map(|(group, plane)| match plane {
            Plane::Frontal => format!("{} from the front", group.name),
            Plane::Sagittal => format!("{} from the side", group.name),
        })
        .collect();
    notes.push(("drawing_planes", format!("seen are {}", planes.join(", "))));
    notes.extend(performance.notes.iter().cloned());
    let pictures = ["texture.png", "mask.png"].map(beside);
    let bounds = performance.bounds(&rig);
    let character = DrawnCharacter { pictures, spec, rig, motion: body, retarget, performance };
    Ok(Scenery { spec: SceneSpec::of_bounds(bounds), characters: vec![character], notes })
}

/// What the characters of a scene do, as an archive of arrays (`.npz`). A mesh, such an archive with `mesh_rest_vertices` and
/// `mesh_triangles`, is deformed with the first character.
///
/// # Errors
///
/// Where the mesh cannot be used.
pub fn draw_poses(scenery: &Scenery, mesh: Option<&[u8]>, control: &Control) -> Result<Vec<u8>, Failure> {
    let mut arrays = Vec::new();
    for (index, character) in scenery.characters.iter().enumerate() {
        let prefix = if scenery.characters.len() > 1 { format!("c{index}_") } else { String::new() };
        let mut own = character.arrays();
        if let (0, Some(bytes)) = (index, mesh) {
            own.extend(character.deformed(bytes, control)?);
        }
        for array in own {
            arrays.push(NamedArray { name: format!("{prefix}{}", array.name), ..array });
        }
    }
    write_arrays(&arrays).map_err(|error| Failure::new(FailureCode::Internal, error.detail))
}

impl DrawnCharacter {
    /// Width and height of the drawing in pixels.
    #[must_use]
    pub const fn size(&self) -> [u32; 2] {
        [self.spec.width, self.spec.height]
    }

    fn arrays(&self) -> Vec<NamedArray> {
        let Self { rig, motion, retarget, performance, .. } = self;
        let (frames, joints) = (performance.frames, rig.rest.len());
        let groups = retarget.char_bodypart_groups.len();
        let space = |vectors: &[DVec3]| vectors.iter().flat_map(DVec3::to_array).collect::<Vec<_>>();
        let plane = |vectors: &[DVec2]| vectors.iter().flat_map(DVec2::to_array).collect::<Vec<_>>();
        let planes = performance.planes.iter().flat_map(|plane| match plane {
            Plane::Frontal => [1.0, 0.0, 0.0],
            Plane::Sagittal => [0.0, 0.0, 1.0],
        });
        let group_names: Vec<String> =
            retarget.bvh_projection_bodypart_groups.iter().map(|group| group.name.clone()).collect();
        vec![
            reals("bvh_root_positions", &[frames, 3], space(&motion.roots)),
            reals("bvh_joint_positions_normalized", &[frames, motion.joints(), 3], space(&motion.places)),
            reals("bvh_fwd_vectors", &[frames, 3], space(&motion.forwards)),
            reals(
                "char_orientations_deg",
                &[frames, performance.driven.len()],
                performance.orientations_degrees.clone(),
            ),
            reals("bvh_joint_depths", &[frames, performance.depth_joints.len()], performance.depths.clone()),
            reals("char_root_positions", &[frames, 2], plane(&performance.roots)),
            reals("char_start_loc", &[3], performance.start.to_vec()),
            reals("rig_rest_xy", &[joints, 2], plane(&rig.rest)),
            reals("rig_joint_xy", &[frames, joints, 2], plane(&performance.joints)),
            reals("projection_plane_normals", &[performance.planes.len(), 3], planes.collect()),
            reals("frame_time", &[1], vec![performance.frame_time]),
            NamedArray {
                name: "bodypart_order".to_owned(),
                shape: vec![frames, groups],
                elements: Elements::Integers(performance.order.iter().map(|&group| group as i32).collect()),
            },
            names("orientation_columns", &performance.driven),
            names("depth_columns", &performance.depth_joints),
            names("char_joint_names", &rig.joint_names),
            names("bvh_joint_names", &motion.joint_names),
            names("projection_groups", &group_names),
        ]
    }

    /// The deformed vertices at each frame.
    fn deformed(&self, mesh: &[u8], control: &Control) -> Result<Vec<NamedArray>, Failure> {
        let vertices = numbers(mesh, "mesh_rest_vertices", 2, control)?;
        let vertices: Vec<DVec2> = vertices.chunks_exact(2).map(DVec2::from_slice).collect();
        let triangles = numbers(mesh, "mesh_triangles", 3, control)?;
        // What is not the index of a vertex becomes one that does not exist.
        let corner = |value: f64| if value < 0.0 { usize::MAX } else { value as usize };
        let triangles: Vec<[usize; 3]> =
            triangles.chunks_exact(3).map(|row| [corner(row[0]), corner(row[1]), corner(row[2])]).collect();
        let arap = Arap::new(&vertices, &triangles, &self.rig.rest_in_single_precision(), Precision::Single)
            .map_err(|error| refused(error, "mesh"))?;
        let mut workspace = arap.workspace();
        let mut deformed = vec![DVec2::ZERO; vertices.len()];
        let frames = self.performance.frames;
        let mut values = Vec::with_capacity(frames * vertices.len() * 2);
        for frame in 0..frames {
            control.check().map_err(|_| Failure::new(FailureCode::Canceled, "canceled"))?;
            let (joints, root) = self.performance.joints_about_root(frame);
            arap.deform(&joints, &mut workspace, &mut deformed);
            values.extend(deformed.iter().flat_map(|&vertex| (vertex + root).to_array()));
        }
        let pinned = arap.is_pinned.iter().map(|&is| i32::from(is)).collect();
        Ok(vec![
            reals("arap_vertices", &[frames, vertices.len(), 2], values),
            NamedArray {
                name: "arap_frames".to_owned(),
                shape: vec![frames],
                elements: Elements::Integers((0..frames as i32).collect()),
            },
            NamedArray {
                name: "arap_pin_mask".to_owned(),
                shape: vec![arap.is_pinned.len()],
                elements: Elements::Integers(pinned),
            },
        ])
    }
}

/// A scene as a moving picture: its bytes, and how many frames it has. `read` finds the files.
///
/// # Errors
///
/// Where a picture is missing or does not fit.
pub fn draw_picture(
    scenery: &Scenery,
    read: &mut dyn FnMut(&str) -> Result<Vec<u8>, Failure>,
    format: PictureFormat,
    control: &Control,
) -> Result<(Vec<u8>, usize), Failure> {
    check_built(format)?;
    let view = &scenery.spec.view;
    let mut puppets = Vec::new();
    for character in &scenery.characters {
        let [texture, mask] = &character.pictures;
        let pictures = [picture(read, texture)?, picture(read, mask)?];
        let puppet = Puppet::new(&character.spec, &character.rig, &character.retarget, view, pictures)
            .map_err(|error| refused(error, texture))?;
        puppets.push((puppet, &character.performance));
    }
    let background = background(scenery, read)?;
    let seconds = puppets[0].1.frame_time;
    let longest = puppets.iter().map(|(_, performance)| performance.frames).max().unwrap_or(1);
    // A GIF shows at most fifty pictures a second.
    let most = if format == PictureFormat::Gif { 50.0 } else { 1000.0 };
    let fps = (1.0 / seconds).min(most);
    let count = ((longest as f64 * seconds * fps).round() as usize).max(1);
    let shoot = |index: usize| {
        let mut picture = background.clone();
        let frame = (index as f64 / fps / seconds).round() as usize;
        for (puppet, performance) in &puppets {
            puppet.draw(performance, frame, &mut puppet.workspace(), &mut picture);
        }
        picture
    };
    let is_transparent = background.pixels.iter().any(|pixel| pixel[3] < 255);
    let broken = |error: PictureError| Failure::new(FailureCode::UnsupportedFeature, error.to_string());
    let mut reel = Reel::new(format, view.window_dimensions, fps, count, is_transparent, shoot).map_err(broken)?;
    for begin in (0..count).step_by(16) {
        control.check().map_err(|_| Failure::new(FailureCode::Canceled, "canceled"))?;
        let pictures: Vec<Picture> = (begin..(begin + 16).min(count)).into_par_iter().map(shoot).collect();
        reel.add(&pictures).map_err(broken)?;
    }
    Ok((reel.finish().map_err(broken)?, count))
}

fn picture(read: &mut dyn FnMut(&str) -> Result<Vec<u8>, Failure>, file: &str) -> Result<Picture, Failure> {
    read_picture(&read(file)?).map_err(|error| Failure::new(FailureCode::AssetMalformed, format!("{file}: {error}")))
}

/// What is behind all characters: a color, or a picture stretched over all of it.
fn background(scenery: &Scenery, read: &mut dyn FnMut(&str) -> Result<Vec<u8>, Failure>) -> Result<Picture, Failure> {
    let view = &scenery.spec.view;
    let [width, height] = view.window_dimensions;
    let color = view.clear_color.map(|part| (part * 255.0).round() as u8);
    let mut filled = Picture::filled(width, height, color);
    if let Some(file) = &view.background_image {
        let image = picture(read, file)?;
        for (index, pixel) in filled.pixels.iter_mut().enumerate() {
            let (row, column) = (index / width * image.height / height, index % width * image.width / width);
            *pixel = image.pixels[row * image.width + column];
        }
    }
    Ok(filled)
}

fn reals(name: &str, shape: &[usize], values: Vec<f64>) -> NamedArray {
    NamedArray { name: name.to_owned(), shape: shape.to_vec(), elements: Elements::Reals(values) }
}

fn names(name: &str, names: &[String]) -> NamedArray {
    NamedArray { name: name.to_owned(), shape: vec![names.len()], elements: Elements::Names(names.to_vec()) }
}

/// An array of rows of a mesh.
fn numbers(mesh: &[u8], name: &str, width: usize, control: &Control) -> Result<Vec<f64>, Failure> {
    let found = read_numbers(mesh, name, &Limits::default(), control).map_err(|error| {
        Failure::new(FailureCode::AssetMalformed, format!("mesh: {}", error.detail)).with_hint(&*error.hint)
    })?;
    match found {
        Some((shape, values)) if shape.len() == 2 && shape[1] == width => Ok(values),
        _ => {
            let detail = format!("mesh: there is no array {name} with rows of {width}");
            let hint = "give an archive with mesh_rest_vertices and mesh_triangles";
            Err(Failure::new(FailureCode::AssetMalformed, detail).with_hint(hint))
        }
    }
}

fn text<'bytes>(bytes: &'bytes [u8], file: &str) -> Result<&'bytes str, Failure> {
    std::str::from_utf8(bytes).map_err(|_| {
        Failure::new(FailureCode::MalformedConfig, format!("{file}: the file is not UTF-8 text"))
            .with_hint("save it as UTF-8")
    })
}

fn refused(error: DrawingError, file: &str) -> Failure {
    let error = error.in_file(file);
    Failure::new(FailureCode::InvalidValue, error.to_string()).with_hint(error.fix)
}

fn note_not_used(notes: &mut Vec<(&'static str, String)>, file: &str, fields: &[String]) {
    if !fields.is_empty() {
        notes.push(("drawing_field_not_used", format!("{file}: nothing uses {}", fields.join(", "))));
    }
}
