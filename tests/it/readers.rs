//! Real files, as other programs read them: the same joints, the same clips, every joint in the same place.

mod blender;
mod compare;
mod three;

use std::{
    collections::{BTreeMap, VecDeque},
    fs,
    io::Write,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    thread,
};

use rayon::prelude::*;
use retargetd::{
    formats::{self, Format, Limits},
    model::{Clip, Control, Reporter, Scene, Skeleton},
};
use serde::Deserialize;
use serde_json::Value;

use crate::support::{corpus_file, files_below, with_buffers};

/// At how many times of a clip joints are compared.
const TIMES: usize = 5;

/// What another program makes of a file, as `tests/tools/three_reader/whole.mjs` and `tests/tools/blender_reader/whole.py` print it.
#[derive(Debug, Deserialize)]
struct Seen {
    #[serde(default)]
    error: String,
    #[serde(default)]
    nodes: Vec<SeenNode>,
    /// Where the nodes are at rest.
    #[serde(default)]
    rest: Vec<[f64; 3]>,
    #[serde(default)]
    clip_names: Vec<String>,
    /// Those that were asked for.
    #[serde(default)]
    clips: Vec<Option<SeenClip>>,
}

#[derive(Debug, Deserialize)]
struct SeenNode {
    name: String,
    parent: Option<usize>,
}

#[derive(Debug, Deserialize)]
struct SeenClip {
    /// Seconds of the file.
    begin: f64,
    end: f64,
    /// Where the nodes are, for each time that was asked for.
    positions: Vec<Vec<[f64; 3]>>,
}

/// A file of the corpus and what we make of it.
struct Ours {
    /// The name in the corpus.
    name: String,
    format: Format,
    scene: Scene,
    /// Frames of each clip that are compared.
    frames: Vec<Vec<usize>>,
    /// Where each clip may begin in the time of the file. FBX clips begin with their stack or with its first key.
    begins: Vec<Vec<f64>>,
}

impl Ours {
    fn read(corpus: &Path, path: &Path) -> Self {
        let name = path.strip_prefix(corpus).expect("below the corpus").to_string_lossy().into_owned();
        let bytes = fs::read(path).expect("a file");
        let format = formats::sniff(&bytes, &name).unwrap_or_else(|error| panic!("{name}: {error}"));
        let limits = Limits::default();
        let bytes = match format {
            Format::Gltf => with_buffers(&bytes, path),
            _ => bytes,
        };
        let scene = formats::read(&bytes, format, &limits, &Control::new(), &mut Reporter::new())
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        let frames = scene.clips.iter().map(|clip| five_of(clip.frame_count())).collect();
        let begins = match format {
            Format::Fbx => begins_of_stacks(&bytes),
            // These keep the file's own times.
            _ => vec![vec![0.0]; scene.clips.len()],
        };
        Self { name, format, scene, frames, begins }
    }

    /// The times in the file at which another reader is to look, all frames for each begin that the clip may have.
    fn times(&self, clip: usize) -> Vec<f64> {
        let times = self.scene.clips[clip].times_seconds();
        let frames = &self.frames[clip];
        self.begins[clip].iter().flat_map(|begin| frames.iter().map(move |frame| begin + times[*frame])).collect()
    }

    fn request(&self, corpus: &Path) -> String {
        let clip = |(index, clip): (usize, &Clip)| serde_json::json!({"name": clip.name(), "times": self.times(index)});
        let clips: Vec<Value> = self.scene.clips.iter().enumerate().map(clip).collect();
        serde_json::json!({"file": corpus.join(&self.name), "clips": clips}).to_string()
    }
}

fn five_of(frames: usize) -> Vec<usize> {
    let mut five: Vec<usize> = (0..TIMES).map(|part| part * (frames - 1) / (TIMES - 1)).collect();
    five.dedup();
    five
}

/// For every stack, its begin and its first key.
fn begins_of_stacks(bytes: &[u8]) -> Vec<Vec<f64>> {
    let parsed = ufbx::load_memory(bytes, ufbx::LoadOpts::default()).expect("the parser reads it");
    let begins = |stack: &ufbx::AnimStack| {
        let keys = stack.layers.iter().flat_map(|layer| &layer.anim_props);
        let keys =
            keys.flat_map(|property| property.anim_value.curves.iter().flatten()).flat_map(|curve| &curve.keyframes);
        let first = keys.map(|key| key.time).fold(f64::INFINITY, f64::min);
        let mut begins = vec![stack.time_begin];
        begins.extend(Some(first).filter(|first| first.is_finite() && *first != stack.time_begin));
        begins
    };
    parsed.anim_stacks.iter().map(|stack| begins(stack)).collect()
}

/// The corpus, and its files with one of the endings that are not hostile, as we read them. Nothing, said on standard error, where
/// there is no corpus.
fn corpus_and_files(endings: &[&str]) -> Option<(PathBuf, Vec<Ours>)> {
    let corpus = corpus_file("")?;
    let wanted = |path: &PathBuf| {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
        endings.contains(&ending.as_str()) && !path.starts_with(corpus.join("hostile"))
    };
    let paths: Vec<PathBuf> = files_below(&corpus).into_iter().filter(wanted).collect();
    let files = paths.par_iter().map(|path| Ours::read(&corpus, path)).collect();
    Some((corpus, files))
}

/// Asks a program for all files, and returns one answer for each.
fn answers(program: &mut Command, corpus: &Path, files: &[Ours]) -> Vec<Seen> {
    let mut child =
        program.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("the reader starts");
    let requests: String = files.iter().map(|file| file.request(corpus) + "\n").collect();
    let mut input = child.stdin.take().expect("a pipe");
    // It answers while it is being asked.
    let asking = thread::spawn(move || input.write_all(requests.as_bytes()));
    let output = child.wait_with_output().expect("the reader ends");
    asking.join().expect("no panic").expect("the reader listens");
    assert!(output.status.success(), "the reader works: {}", output.status);
    let text = String::from_utf8(output.stdout).expect("text");
    let seen: Vec<Seen> = text.lines().map(|line| serde_json::from_str(line).expect("one answer a line")).collect();
    assert_eq!(seen.len(), files.len(), "one answer for each file");
    seen
}

/// For each node of another reader, given with its parent, the joint of the same name below joints of the same names. Of
/// several, the first that is left.
fn joints_by_path(skeleton: &Skeleton, nodes: &[(&str, Option<usize>)]) -> Vec<Option<usize>> {
    let mut children: BTreeMap<(Option<usize>, &str), VecDeque<usize>> = BTreeMap::new();
    for (index, joint) in skeleton.joints().iter().enumerate() {
        children.entry((joint.parent, joint.name.as_str())).or_default().push_back(index);
    }
    let mut found: Vec<Option<usize>> = Vec::with_capacity(nodes.len());
    for (name, parent) in nodes {
        let above = parent.map(|parent| found[parent]);
        // A node whose parent is not ours cannot be either.
        let joint = match above {
            Some(None) => None,
            above => children.get_mut(&(above.flatten(), *name)).and_then(VecDeque::pop_front),
        };
        found.push(joint);
    }
    found
}
