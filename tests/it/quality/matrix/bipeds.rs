//! The bipeds of the corpus, read once.

use retargetd::{
    formats::{self, Limits},
    model::{Clip, Control, Reporter, Scene, Track},
    retarget::RetargetSpec,
    rig::Rig,
};

use super::super::figure::frames_of;
use crate::support::{corpus_file, files_below};

/// Folders whose files are no characters.
const NO_CHARACTERS: [&str; 4] = ["animated-drawings", "creatures", "fbx-semantics", "hostile"];
/// Files elsewhere that are no bipeds, and why.
const NO_BIPEDS: [(&str, &str); 8] = [
    ("bvh/misc/pybvh_rotation_first_root.bvh", "four joints in a row"),
    ("cc0-stylised/kenney_platformer_noskin.glb", "six rigid parts without elbows and knees"),
    ("cc0-stylised/quaternius_alien.fbx", "a head on a body, without limbs"),
    ("khronos/SimpleSkin.gltf", "two joints"),
    ("khronos/SimpleSkinning.gltf", "three joints"),
    ("khronos/rigged_simple.gltf", "two joints"),
    ("misc-rigs/animation_with_skeleton_generic_names.fbx", "a part of a body, with joints named Bone.001"),
    ("misc-rigs/huesitos.fbx", "nine bones in two branches"),
];
/// Endings of files that hold a skeleton that is read.
const ENDINGS: [&str; 6] = ["bvh", "fbx", "glb", "gltf", "vrm", "vrma"];
/// Frames that a clip is thinned to, spread evenly.
const MAX_FRAMES: usize = 40;

/// All scenes, so that rigs can borrow them.
pub(super) struct Loaded {
    scenes: Vec<(String, Scene)>,
}

/// One character as one side of a pair.
pub(super) struct Biped<'a> {
    pub(super) name: &'a str,
    pub(super) scene: &'a Scene,
    pub(super) rig: Rig<'a>,
    pub(super) clip: Option<Clip>,
    pub(super) warnings: Vec<&'static str>,
}

impl Loaded {
    /// Nothing when there is no corpus.
    pub(super) fn read() -> Option<Self> {
        let corpus = corpus_file("")?;
        let mut scenes = Vec::new();
        for path in files_below(&corpus) {
            let name = path.strip_prefix(&corpus).expect("below the corpus").to_string_lossy().into_owned();
            let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or("");
            let is_other = NO_CHARACTERS.iter().any(|folder| name.starts_with(folder))
                || NO_BIPEDS.iter().any(|(file, _)| *file == name);
            if is_other || !ENDINGS.contains(&ending) {
                continue;
            }
            let bytes = std::fs::read(&path).expect("readable");
            let format = formats::sniff(&bytes, &name).expect("a known format");
            let read = formats::read(&bytes, format, &Limits::default(), &Control::new(), &mut Reporter::new());
            // Files whose buffers lie in other files are refused, and tested elsewhere.
            if let Ok(scene) = read {
                scenes.push((name, scene));
            }
        }
        Some(Self { scenes })
    }

    /// Every character as a source, or as a target.
    pub(super) fn bipeds(&self, side: &'static str) -> Vec<Biped<'_>> {
        self.scenes.iter().map(|(name, scene)| Biped::new(side, name, scene)).collect()
    }
}

impl<'a> Biped<'a> {
    fn new(side: &'static str, name: &'a str, scene: &'a Scene) -> Self {
        let mut reporter = Reporter::new();
        let spec = RetargetSpec::default().source;
        let rig = Rig::new(side, scene, None, &spec, &mut reporter).expect("a skeleton");
        let clip = scene.clips.iter().find(|clip| clip.is_animated()).map(thinned);
        let warnings = reporter.warnings().iter().map(|warning| warning.code).collect();
        Self { name, scene, rig, clip, warnings }
    }

    pub(super) fn moves(&self) -> bool {
        self.clip.is_some()
    }
}

fn thinned(clip: &Clip) -> Clip {
    let frames = frames_of(clip, MAX_FRAMES);
    let times = frames.iter().map(|&frame| clip.times_seconds()[frame]).collect();
    let mut joints = clip.joints().to_vec();
    for tracks in &mut joints {
        thin(&mut tracks.translation, &frames);
        thin(&mut tracks.rotation, &frames);
        thin(&mut tracks.scale, &frames);
    }
    Clip::new(clip.name().to_owned(), times, joints).expect("a valid clip")
}

fn thin<T: Copy>(track: &mut Track<T>, frames: &[usize]) {
    if let Track::Sampled(values) = track {
        *values = frames.iter().map(|&frame| values[frame]).collect();
    }
}
