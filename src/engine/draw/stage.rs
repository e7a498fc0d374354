//! Configs, pictures and motions to characters that move.

use crate::{
    drawing::{
        BodyMotion, CharacterSpec, DrawSpec, DrawingError, Look, MotionFile, MotionSpec, Performance, PlanarRig, Plane,
        RetargetSpec, SceneSpec, ViewSection, beyond_joints,
    },
    engine::{Failure, FailureCode, Format, Knowledge, NamedBytes, Output, RigFacts},
    formats::Limits,
    model::{Control, Reporter},
    picture::read_picture,
};

use super::{
    DrawRequest, FileReader,
    files::CHARACTER,
    motion::{Joints, drawn_motion},
};

/// A drawn character, and what it does.
#[derive(Clone, Debug)]
pub(super) struct DrawnCharacter {
    pub(super) spec: CharacterSpec,
    pub(super) rig: PlanarRig,
    pub(super) motion: BodyMotion,
    pub(super) retarget: RetargetSpec,
    /// The files of the texture and of the mask.
    pub(super) pictures: [String; 2],
    pub(super) performance: Performance,
    /// The size of the cubes by which the body is shown.
    pub(super) body_scale: f64,
}

/// A scene with everything that it names.
#[derive(Clone, Debug)]
pub(super) struct Scenery {
    /// What it is called.
    pub(super) name: String,
    pub(super) view: ViewSection,
    pub(super) has_floor: bool,
    pub(super) shows_bodies: bool,
    pub(super) look: Look,
    pub(super) foreshortens: bool,
    pub(super) is_original: bool,
    /// Its characters.
    pub(super) characters: Vec<DrawnCharacter>,
    /// What was noticed: a code and a text.
    pub(super) notes: Vec<(&'static str, String)>,
    pub(super) source_facts: RigFacts,
    /// Whether the characters come from configs that belong together.
    pub(super) is_scene: bool,
}

/// Puts together what is asked for.
pub(super) fn set(
    request: &DrawRequest<'_>,
    read: &mut FileReader<'_>,
    (knowledge, limits): (&Knowledge, &Limits),
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Scenery, Failure> {
    match request.scene {
        Some(scene) => scene_of(scene, request, read, control),
        None => alone(request, read, (knowledge, limits), control, reporter),
    }
}

/// Where a scene says that its picture goes.
///
/// # Errors
/// When it cannot be read.
pub fn place_of_scene(scene: NamedBytes<'_>) -> Result<Option<String>, Failure> {
    let spec = SceneSpec::read(text(scene.bytes, scene.name)?).map_err(|error| refused(error, scene.name))?;
    Ok(spec.controller.output_video_path)
}

fn look(spec: &DrawSpec) -> Look {
    Look {
        deformation: spec.deformation(),
        rigid: spec.drawing.rigid.clone(),
        smooth: spec.compat.is_none(),
        keep_texture: false,
    }
}

/// A scene of *Animated Drawings*, with all that it names.
fn scene_of(
    scene: NamedBytes<'_>,
    request: &DrawRequest<'_>,
    read: &mut FileReader<'_>,
    control: &Control,
) -> Result<Scenery, Failure> {
    let spec = SceneSpec::read(text(scene.bytes, scene.name)?).map_err(|error| refused(error, scene.name))?;
    let mut notes = Vec::new();
    note_not_used(&mut notes, scene.name, &spec.not_used());
    let mut characters = Vec::new();
    for files in &spec.scene.animated_characters {
        control.check()?;
        let mut config = |name: &str, instead: Option<NamedBytes<'_>>| -> Result<String, Failure> {
            match (read(name), instead) {
                (Ok(bytes), _) => Ok(text(&bytes, name)?.to_owned()),
                (Err(_), Some(instead)) => Ok(text(instead.bytes, instead.name)?.to_owned()),
                (Err(failure), None) => Err(failure),
            }
        };
        let (character, motion, retarget) = (&*files.character_cfg, &*files.motion_cfg, &*files.retarget_cfg);
        let own = CharacterSpec::read(&config(character, None)?).map_err(|error| refused(error, character))?;
        let rig = PlanarRig::new(&own).map_err(|error| refused(error, character))?;
        let motion_spec = MotionSpec::read(&config(motion, request.motion)?).map_err(|error| refused(error, motion))?;
        let retarget_spec =
            RetargetSpec::read(&config(retarget, request.retarget)?).map_err(|error| refused(error, retarget))?;
        let file_name = &*motion_spec.filepath;
        let file = MotionFile::read(&config(file_name, request.source)?).map_err(|error| refused(error, file_name))?;
        let body = BodyMotion::new(&file, &motion_spec).map_err(|error| refused(error, motion))?;
        let performance = Performance::new(&rig, &body, &retarget_spec, &request.spec.rules())
            .map_err(|error| refused(error, retarget))?;
        note_not_used(&mut notes, character, &own.not_used());
        note_not_used(&mut notes, motion, &motion_spec.not_used());
        note_not_used(&mut notes, retarget, &retarget_spec.not_used());
        notes.extend(performance.notes.iter().map(|(code, text)| (*code, format!("{retarget}: {text}"))));
        let folder = character.rfind('/').map_or("", |slash| &character[..=slash]);
        characters.push(DrawnCharacter {
            pictures: ["texture.png", "mask.png"].map(|name| format!("{folder}{name}")),
            spec: own,
            rig,
            motion: body,
            retarget: retarget_spec,
            performance,
            body_scale: motion_spec.scale,
        });
    }
    if request.spec.compat.is_none() {
        // Who is farther away is drawn first.
        characters.sort_by(|one, other| one.performance.start[2].total_cmp(&other.performance.start[2]));
    }
    Ok(Scenery {
        name: stem(scene.name),
        has_floor: spec.scene.add_floor,
        shows_bodies: spec.scene.add_ad_retarget_bvh,
        view: spec.view,
        look: look(&request.spec),
        foreshortens: request.spec.project.foreshorten,
        is_original: request.spec.compat.is_some(),
        characters,
        notes,
        source_facts: RigFacts::default(),
        is_scene: true,
    })
}

/// One drawing, moved by the body of any file.
fn alone(
    request: &DrawRequest<'_>,
    read: &mut FileReader<'_>,
    (knowledge, limits): (&Knowledge, &Limits),
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Scenery, Failure> {
    let (Some(folder), Some(source)) = (request.folder, request.source) else {
        return Err(Failure::new(FailureCode::InvalidValue, "there is no motion that could move the drawing")
            .in_part("source")
            .with_hint("send a file with a clip as the source, or a scene that names one"));
    };
    let beside = |name: &str| if folder.is_empty() { name.to_owned() } else { format!("{folder}/{name}") };
    let character = beside(CHARACTER);
    let own = CharacterSpec::read(text(&read(&character)?, &character)?).map_err(|error| refused(error, &character))?;
    let rig = PlanarRig::new(&own).map_err(|error| refused(error, &character))?;
    let mut notes = Vec::new();
    note_not_used(&mut notes, &character, &own.not_used());
    let (given, retarget_name) = given_retarget(request, &mut notes)?;
    let is_original = request.spec.compat.is_some();
    if is_original && (given.is_none() || request.motion.is_none()) {
        let detail =
            "the numbers of Animated Drawings follow from its motion and retarget configs, which are not given";
        return Err(Failure::new(FailureCode::InvalidValue, detail)
            .in_part("config")
            .with_hint("give both, or leave compat out"));
    }
    let (body, body_scale, source_facts) = match request.motion {
        Some(motion) => {
            let motion_spec =
                MotionSpec::read(text(motion.bytes, motion.name)?).map_err(|error| refused(error, motion.name))?;
            note_not_used(&mut notes, motion.name, &motion_spec.not_used());
            let file =
                MotionFile::read(text(source.bytes, source.name)?).map_err(|error| refused(error, source.name))?;
            let body = BodyMotion::new(&file, &motion_spec).map_err(|error| refused(error, motion.name))?;
            (body, motion_spec.scale, RigFacts::default())
        }
        None => {
            let joints = if given.is_some() { Joints::All } else { Joints::OfBody };
            let drawn = drawn_motion(source, joints, &request.spec, (knowledge, limits), control, reporter)?;
            notes.push(("drawing_motion", format!("{}: {}", source.name, drawn.chosen)));
            (drawn.body, 0.03, drawn.facts)
        }
    };
    let retarget = match given {
        Some(retarget) => retarget,
        None => RetargetSpec::of_humanoid(&rig, &body).map_err(|error| refused(error, &character))?,
    };
    let performance = Performance::new(&rig, &body, &retarget, &request.spec.rules())
        .map_err(|error| refused(error, &retarget_name.unwrap_or(character)))?;
    notes.push(("drawing_planes", planes(&retarget, &performance)));
    notes.extend(performance.notes.iter().cloned());
    let pictures = ["texture.png", "mask.png"].map(beside);
    // Poses are made without a mask as well.
    let mask = read(&pictures[1]).ok().and_then(|bytes| read_picture(&bytes).ok());
    let beyond = mask.map(|mask| beyond_joints(&mask, &rig));
    let bounds = performance.bounds(&rig, beyond);
    let around = SceneSpec::of_bounds(bounds, performance.start[2], request.spec.view.size);
    let (view, has_floor, shows_bodies) = request.spec.view.over(&around);
    let character = DrawnCharacter { pictures, spec: own, rig, motion: body, retarget, performance, body_scale };
    Ok(Scenery {
        name: stem(source.name),
        view,
        has_floor,
        shows_bodies,
        look: look(&request.spec),
        foreshortens: request.spec.project.foreshorten,
        is_original,
        characters: vec![character],
        notes,
        source_facts,
        is_scene: false,
    })
}

/// The retarget config that somebody gave, by a file or in the spec, and the name of the file.
fn given_retarget(
    request: &DrawRequest<'_>,
    notes: &mut Vec<(&'static str, String)>,
) -> Result<(Option<RetargetSpec>, Option<String>), Failure> {
    if let Some(file) = request.retarget {
        let spec = RetargetSpec::read(text(file.bytes, file.name)?).map_err(|error| refused(error, file.name))?;
        note_not_used(notes, file.name, &spec.not_used());
        return Ok((Some(spec), Some(file.name.to_owned())));
    }
    if let Some(spec) = &request.spec.retarget {
        spec.check().map_err(|error| refused(error, "config: retarget"))?;
        note_not_used(notes, "config: retarget", &spec.not_used());
        return Ok((Some(spec.clone()), Some("config: retarget".to_owned())));
    }
    Ok((None, None))
}

fn planes(retarget: &RetargetSpec, performance: &Performance) -> String {
    let planes = retarget.bvh_projection_bodypart_groups.iter().zip(&performance.planes);
    let planes: Vec<String> = planes
        .map(|(group, plane)| match plane {
            Plane::Frontal => format!("{} from the front", group.name),
            Plane::Sagittal => format!("{} from the side", group.name),
        })
        .collect();
    format!("seen are {}", planes.join(", "))
}

impl Scenery {
    /// The spec that makes the same again.
    pub(super) fn resolved(&self, asked: &DrawSpec, outputs: &[Output]) -> Result<serde_json::Value, Failure> {
        let retarget = match &self.characters[..] {
            [character] if !self.is_scene => Some(character.retarget.clone()),
            _ => asked.retarget.clone(),
        };
        let spec = DrawSpec { version: Some(1), retarget, ..asked.clone() };
        let failed =
            |error: serde_json::Error| Failure::new(FailureCode::Internal, format!("the resolved spec: {error}"));
        let mut spec = serde_json::to_value(&spec).map_err(failed)?;
        let formats: Vec<&str> = outputs.iter().map(|output: &Output| name_of(output.format)).collect();
        spec["output"] = formats.into_iter().map(|name| serde_json::json!({ "format": name })).collect();
        Ok(spec)
    }
}

const fn name_of(format: Format) -> &'static str {
    format.info().name
}

/// A file's name without folders and ending.
fn stem(name: &str) -> String {
    let last = name.rsplit(['/', '\\']).next().unwrap_or(name);
    last.rsplit_once('.').map_or(last, |(stem, _)| stem).to_owned()
}

pub(super) fn text<'bytes>(bytes: &'bytes [u8], file: &str) -> Result<&'bytes str, Failure> {
    std::str::from_utf8(bytes).map_err(|_| {
        Failure::new(FailureCode::MalformedConfig, format!("{file}: the file is not text"))
            .with_hint("save it as UTF-8")
    })
}

pub(super) fn refused(error: DrawingError, file: &str) -> Failure {
    let error = error.in_file(file);
    let (place, hint) = (error.place.clone(), error.fix.clone());
    Failure { place, ..Failure::new(FailureCode::InvalidValue, error.to_string()).with_hint(hint) }
}

fn note_not_used(notes: &mut Vec<(&'static str, String)>, file: &str, fields: &[String]) {
    if !fields.is_empty() {
        notes.push(("drawing_field_not_used", format!("{file}: nothing uses {}", fields.join(", "))));
    }
}
