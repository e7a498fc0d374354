//! One public entry for each format and each body of a request that is read by the pure half.

use std::{io::Cursor, sync::LazyLock};

use retargetd::{
    engine::{
        self, DrawInputs, EditInputs, Failure, FailureCode, Format, Inputs, Knowledge, Limits, NamedBytes, Outcome,
        PoseChoice, PoseInputs, Task, check_config, check_preset, check_rig, merge_config,
    },
    formats::{self, ErrorKind, Sectioned},
    model::{Appearance, Control, Paint, Reporter},
    picture,
    retarget::parse_document,
};

use super::{checks, seeds};

/// What is fuzzed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    /// FBX, binary and text.
    Fbx,
    /// glTF and VRM in one file.
    Glb,
    /// glTF as JSON.
    Gltf,
    /// VRM animations.
    Vrma,
    /// An archive of a model and what it points to.
    Zip,
    /// Pose arrays in a NumPy archive.
    PosesNpz,
    /// Pose arrays in JSON.
    PosesJson,
    /// Parameters of body models.
    BodyModel,
    /// Joint positions and features in one NumPy array.
    JointPositions,
    /// BVH.
    Bvh,
    /// An image, by itself and as a texture.
    Image,
    /// A picture of a figure, and the mask of one.
    Annotation,
    /// Finding out what a file is, and all that `inspect` says of it.
    Sniff,
    /// A config of any shape, checked and laid over a preset.
    Spec,
    /// A rig template.
    RigTemplate,
    /// A config of a retarget, which is run.
    Retarget,
    /// A config of an edit, which is run.
    Edit,
    /// A config of a pose, which is taken.
    Pose,
    /// A config of a proposal, which is made.
    Proposal,
    /// A file of any format as source and as target of a retarget.
    Engine,
    /// A drawing, or a scene of drawings, in an archive.
    Drawing,
    /// A config of a drawing that moves, which does.
    Draw,
}

impl Target {
    pub(crate) const ALL: [Self; 22] = [
        Self::Fbx,
        Self::Glb,
        Self::Gltf,
        Self::Vrma,
        Self::Zip,
        Self::PosesNpz,
        Self::PosesJson,
        Self::BodyModel,
        Self::JointPositions,
        Self::Bvh,
        Self::Sniff,
        Self::Spec,
        Self::RigTemplate,
        Self::Retarget,
        Self::Edit,
        Self::Pose,
        Self::Proposal,
        Self::Engine,
        Self::Image,
        Self::Drawing,
        Self::Draw,
        Self::Annotation,
    ];

    /// Its name on the command line.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Fbx => "fbx",
            Self::Glb => "glb",
            Self::Gltf => "gltf",
            Self::Vrma => "vrma",
            Self::Zip => "zip",
            Self::PosesNpz => "poses_npz",
            Self::PosesJson => "poses_json",
            Self::BodyModel => "body_model",
            Self::JointPositions => "joint_positions",
            Self::Bvh => "bvh",
            Self::Sniff => "sniff",
            Self::Spec => "spec",
            Self::RigTemplate => "rig_template",
            Self::Retarget => "retarget",
            Self::Edit => "edit",
            Self::Pose => "pose",
            Self::Proposal => "proposal",
            Self::Engine => "engine",
            Self::Image => "image",
            Self::Drawing => "drawing",
            Self::Draw => "draw",
            Self::Annotation => "annotation",
        }
    }

    /// Gives an input to the target. Any result is good that is whole and finite, and any error that is not our own mistake.
    ///
    /// # Panics
    /// When something else comes out.
    pub(crate) fn run(self, bytes: &[u8]) {
        match self {
            Self::Fbx => read(bytes, Format::Fbx),
            Self::Glb => {
                read(bytes, Format::Vrm);
                read_in_sections(bytes);
            }
            Self::Gltf => read(bytes, Format::Gltf),
            Self::Vrma => read(bytes, Format::Vrma),
            Self::Zip => read(bytes, Format::Zip),
            Self::PosesNpz => read(bytes, Format::PosesNpz),
            Self::PosesJson => read(bytes, Format::PosesJson),
            Self::BodyModel => read(bytes, Format::BodyModel),
            Self::JointPositions => read(bytes, Format::JointPositions),
            Self::Bvh => {
                read(bytes, Format::Bvh);
                read_in_sections(bytes);
            }
            Self::Image => image(bytes),
            Self::Drawing => {
                draw(bytes, br#"{"task": "draw", "view": {"size": [40, 40]}}"#);
                draw(bytes, br#"{"task": "draw", "scene": "mvc.yaml", "compat": "animated_drawings"}"#);
            }
            Self::Draw => draw(&DRAWING, bytes),
            Self::Annotation => annotation(bytes),
            Self::Sniff => {
                judge(engine::inspect(NamedBytes { name: "file", bytes }, &Limits::default(), &Control::new()));
            }
            Self::Spec => check(bytes),
            Self::RigTemplate => {
                let document = parse_document(bytes).unwrap_or_default();
                judge(check_rig("template", document));
                judge(
                    std::str::from_utf8(bytes)
                        .map_or_else(|_| Ok(()), |text| engine::Knowledge::read([text]).map(drop)),
                );
            }
            Self::Retarget => retarget(&CLIP, &FIGURE, Some(bytes)),
            Self::Edit => edit(bytes),
            Self::Pose => {
                for to in [PoseChoice::T, PoseChoice::Source] {
                    pose(to, bytes);
                }
            }
            Self::Proposal => {
                let inputs = inputs(&CLIP, &FIGURE, Some(bytes));
                judge(engine::propose(&inputs, &Knowledge::default(), &Limits::default(), &Control::new()));
            }
            Self::Engine => {
                retarget(bytes, &FIGURE, None);
                retarget(&CLIP, bytes, None);
            }
        }
    }
}

/// Decodes an image in its own size and as a texture, which is made smaller as it is decoded.
fn image(bytes: &[u8]) {
    if let Ok(picture) = picture::read_picture(bytes) {
        assert_eq!(picture.pixels.len(), picture.width * picture.height, "every pixel is there");
    }
    let paint = Paint { image: Some(0), ..Paint::default() };
    let appearance = Appearance { paints: vec![paint], images: vec![bytes.to_vec()], ..Appearance::default() };
    assert!(picture::Figure::new(appearance).is_ok(), "an image that is broken leaves its surfaces plain");
}

/// Annotates a picture, and one whose mask it is.
fn annotation(bytes: &[u8]) {
    let file = |bytes| NamedBytes { name: "picture", bytes };
    let figure = seeds::drawn_figure();
    for (picture, mask) in [(bytes, None), (&*figure, Some(file(bytes)))] {
        let Some(drawing) = judge(engine::annotate_drawing(file(picture), mask, None, None, &Control::new())) else {
            continue;
        };
        let view = drawing.view();
        let is_inside = |loc: [usize; 2]| loc[0] < view.size[0] && loc[1] < view.size[1];
        assert!(view.skeleton.iter().all(|joint| is_inside(joint.loc)), "joints are in the texture");
        assert!((0.0..=1.0).contains(&view.confidence), "a confidence that is one");
        assert!(drawing.archive().is_ok_and(|archive| !archive.is_empty()), "it can be written");
    }
}

/// The clip and the figure that configs are tried on.
static CLIP: LazyLock<Vec<u8>> = LazyLock::new(seeds::clip);
static FIGURE: LazyLock<Vec<u8>> = LazyLock::new(seeds::figure);
static DRAWING: LazyLock<Vec<u8>> = LazyLock::new(seeds::drawing);

fn read(bytes: &[u8], format: Format) {
    let (limits, control) = (Limits::default(), Control::new());
    match formats::read(bytes, format, &limits, &control, &mut Reporter::new()) {
        Ok(scene) => checks::scene(&scene),
        Err(error) => {
            assert!(!error.detail.is_empty(), "an error says what is wrong: {error:?}");
            assert!(error.kind != ErrorKind::Canceled, "nobody canceled");
        }
    }
}

/// Reads the beginning and the end of a clip as files of their own.
fn read_in_sections(bytes: &[u8]) {
    let (limits, control) = (Limits::default(), Control::new());
    let opened = formats::open_in_sections(Box::new(Cursor::new(bytes.to_vec())), &limits, &control);
    let Ok(Sectioned::File(mut file)) = opened else { return };
    let frames = file.times().frames();
    for section in [0..frames.min(3), frames.saturating_sub(2)..frames] {
        if let Ok(section) = file.section(section, &control) {
            read(&section, file.format());
        }
    }
}

fn check(bytes: &[u8]) {
    let config = NamedBytes { name: "config", bytes };
    if let Some(resolved) = judge(check_config(config)) {
        let again = resolved.to_string();
        let again = check_config(NamedBytes { name: "config", bytes: again.as_bytes() });
        assert_eq!(again.as_ref(), Ok(&resolved), "a spec as it is understood is understood as it is");
        judge(check_preset("preset", resolved));
    }
    judge(merge_config(&serde_json::json!({"ops": [{"op": "fk"}], "edit": {"fps": 30}}), Some(config)));
}

fn edit(config: &[u8]) {
    let given = Some(NamedBytes { name: "config", bytes: config });
    let source = NamedBytes { name: "file", bytes: &CLIP };
    let inputs = EditInputs { source, source_rest: None, unread_target: false, config: given, formats: &[] };
    if let Some(outcome) = judge(engine::edit(&inputs, &Limits::default(), &Control::new())) {
        check_outputs(&outcome);
    }
}

fn pose(to: PoseChoice, config: &[u8]) {
    let file = |bytes| NamedBytes { name: "file", bytes };
    let task = Task::Pose(PoseInputs {
        target: file(&FIGURE),
        target_rest: None,
        source: Some(file(&CLIP)),
        source_rest: None,
        to: Some(to),
        config: Some(file(config)),
        formats: &[],
    });
    if let Some(outcome) = judge(engine::run(&task, &engine::Knowledge::default(), &Limits::default(), &Control::new()))
    {
        check_outputs(&outcome);
    }
}

fn draw(drawing: &[u8], config: &[u8]) {
    let file = |bytes| NamedBytes { name: "file", bytes };
    let task = Task::Draw(DrawInputs {
        source: Some(file(&CLIP)),
        drawing: file(drawing),
        scene: None,
        config: Some(file(config)),
        formats: &[Format::Poses2dJson, Format::Glb],
    });
    if let Some(outcome) = judge(engine::run(&task, &engine::Knowledge::default(), &Limits::default(), &Control::new()))
    {
        check_outputs(&outcome);
    }
}

fn inputs<'a>(source: &'a [u8], target: &'a [u8], config: Option<&'a [u8]>) -> Inputs<'a> {
    Inputs {
        source: NamedBytes { name: "file", bytes: source },
        target: NamedBytes { name: "file", bytes: target },
        source_rest: None,
        target_rest: None,
        config: config.map(|bytes| NamedBytes { name: "config", bytes }),
        formats: &[],
    }
}

fn retarget(source: &[u8], target: &[u8], config: Option<&[u8]>) {
    let outcome = engine::retarget(&inputs(source, target, config), &Limits::default(), &Control::new());
    if let Some(outcome) = judge(outcome) {
        check_outputs(&outcome);
    }
}

/// What is written can be read, which no file can that holds a number which is none.
fn check_outputs(outcome: &Outcome) {
    for output in &outcome.outputs {
        let info = output.format.info();
        if !info.reads {
            continue;
        }
        let file = NamedBytes { name: &output.name, bytes: &output.bytes };
        if let Err(failure) = engine::inspect(file, &Limits::default(), &Control::new()) {
            assert_eq!(
                failure.code,
                FailureCode::AssetLimitExceeded,
                "what is written as {} can be read: {failure:?}",
                info.name
            );
        }
    }
}

/// What came out, unless it failed; a failure is never our own mistake.
fn judge<T>(result: Result<T, Failure>) -> Option<T> {
    match result {
        Ok(value) => Some(value),
        Err(failure) => {
            assert!(
                failure.code != FailureCode::Internal && !failure.detail.is_empty(),
                "the input's fault: {failure:?}"
            );
            None
        }
    }
}
