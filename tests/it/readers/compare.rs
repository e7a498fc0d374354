//! Where another reader and ours say different things of a file.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use retargetd::model::Clip;

use super::{Ours, Seen};

/// As a share of the figure's size.
const MAX_APART: f64 = 1e-4;
const MAX_SECONDS_APART: f64 = 1e-3;

/// What can differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Aspect {
    /// The other program cannot read the file.
    Unreadable,
    /// Which nodes there are, and their names.
    Nodes,
    /// Which node is whose.
    Parents,
    /// Where the nodes are at rest.
    Rest,
    /// How many clips there are, and their names.
    Clips,
    /// How long they are.
    Seconds,
    /// Where the nodes are in the clips.
    Positions,
}

/// What differs in a file, and how.
pub(super) type Differences = BTreeMap<Aspect, String>;

/// How nodes of the other reader are found, and what its space is.
pub(super) struct Reader<'a> {
    /// For each node of the other reader its joint of ours; nothing for nodes that are not to be compared.
    pub(super) joints: &'a [Option<usize>],
    /// Joints of ours that the other reader should have.
    pub(super) wanted: &'a BTreeSet<usize>,
    /// Our space to that of the other reader.
    pub(super) to_theirs: &'a dyn Fn(DVec3) -> DVec3,
}

/// Compares all that both say. Positions are compared for the joints that both have.
pub(super) fn differences(ours: &Ours, seen: &Seen, reader: &Reader<'_>) -> Differences {
    let mut found = Differences::new();
    if !seen.error.is_empty() {
        found.insert(Aspect::Unreadable, seen.error.clone());
        return found;
    }
    let skeleton = &ours.scene.skeleton;
    let there: BTreeSet<usize> = reader.joints.iter().flatten().copied().collect();
    if there != *reader.wanted {
        let names = |joints: Vec<&usize>| -> Vec<String> {
            joints.into_iter().take(5).map(|joint| skeleton.label(*joint)).collect()
        };
        let missing = names(reader.wanted.difference(&there).collect());
        let more = names(there.difference(reader.wanted).collect());
        found.insert(
            Aspect::Nodes,
            format!("{} of {}: lacks {missing:?}, has {more:?}", there.len(), reader.wanted.len()),
        );
    }
    for (node, joint) in reader.joints.iter().enumerate() {
        let Some(joint) = joint else { continue };
        let (mine, theirs) = (&skeleton.joints()[*joint], &seen.nodes[node]);
        if mine.name != theirs.name {
            found.entry(Aspect::Nodes).or_insert(format!("'{}' is '{}' there", mine.name, theirs.name));
        }
        // The next one above that is compared at all.
        let mut above = theirs.parent;
        while let Some(parent) = above.filter(|parent| reader.joints[*parent].is_none()) {
            above = seen.nodes[parent].parent;
        }
        let mut expected = mine.parent;
        while let Some(parent) = expected.filter(|parent| !reader.wanted.contains(parent)) {
            expected = skeleton.joints()[parent].parent;
        }
        if above.and_then(|parent| reader.joints[parent]) != expected {
            found.entry(Aspect::Parents).or_insert(format!("of '{}'", mine.name));
        }
    }
    let size = size(ours, reader);
    if let Some(apart) = farthest(&places(ours, None, reader), &seen.rest, size, reader, ours) {
        found.insert(Aspect::Rest, apart);
    }
    compare_clips(ours, seen, reader, size, &mut found);
    found
}

fn compare_clips(ours: &Ours, seen: &Seen, reader: &Reader<'_>, size: f64, found: &mut Differences) {
    let clips = &ours.scene.clips;
    if let Some(name) = seen.clip_names.iter().find(|name| !clips.iter().any(|clip| is_called(clip, name))) {
        found.insert(Aspect::Clips, format!("'{name}' is there"));
    }
    for (index, (clip, theirs)) in clips.iter().zip(&seen.clips).enumerate() {
        let Some(theirs) = theirs else {
            // A stack without any curve is a clip of one still frame for us, and none for others.
            if clip.is_animated() {
                found.insert(Aspect::Clips, format!("'{}' is not there", clip.name()));
            }
            continue;
        };
        let times = clip.times_seconds();
        let (here, there) = (times[times.len() - 1] - times[0], theirs.end - theirs.begin);
        if (here - there).abs() > MAX_SECONDS_APART {
            found.entry(Aspect::Seconds).or_insert(format!("'{}': {here} s, {there} s there", clip.name()));
        }
        let frames = &ours.frames[index];
        // For each begin that the clip may have.
        let apart = |positions: &[Vec<[f64; 3]>]| {
            let pairs = frames.iter().zip(positions);
            let worst = pairs.filter_map(|(frame, positions)| {
                farthest(&places(ours, Some((index, *frame)), reader), positions, size, reader, ours)
                    .map(|apart| format!("{apart} of '{}', frame {frame}", clip.name()))
            });
            worst.max()
        };
        let each: Vec<Option<String>> = theirs.positions.chunks(frames.len()).map(apart).collect();
        if let Some(Some(apart)) = each.iter().min() {
            found.entry(Aspect::Positions).or_insert_with(|| apart.clone());
        }
    }
}

/// Clips without a name get one from whoever reads them.
fn is_called(clip: &Clip, name: &str) -> bool {
    clip.name().is_empty() || clip.name() == name
}

/// Where our joints are, in the other reader's space.
fn places(ours: &Ours, at: Option<(usize, usize)>, reader: &Reader<'_>) -> Vec<DVec3> {
    let skeleton = &ours.scene.skeleton;
    let local = match at {
        Some((clip, frame)) => ours.scene.clips[clip].local_pose(skeleton, frame),
        None => skeleton.rest_pose(),
    };
    let model = local.to_model(skeleton);
    model.transforms().iter().map(|transform| (reader.to_theirs)(transform.translation)).collect()
}

/// The extent of all that is compared, at rest and in the clips.
fn size(ours: &Ours, reader: &Reader<'_>) -> f64 {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let frames =
        ours.frames.iter().enumerate().flat_map(|(clip, frames)| frames.iter().map(move |frame| Some((clip, *frame))));
    for at in std::iter::once(None).chain(frames) {
        let places = places(ours, at, reader);
        for joint in reader.joints.iter().flatten() {
            low = low.min(places[*joint]);
            high = high.max(places[*joint]);
        }
    }
    let size = (high - low).max_element();
    // One joint has no size; then its distance from the origin has to do.
    if size > 1e-6 && size.is_finite() { size } else { high.length().max(1e-3) }
}

/// The joint that is farthest from where it is there, where that is too far.
fn farthest(places: &[DVec3], theirs: &[[f64; 3]], size: f64, reader: &Reader<'_>, ours: &Ours) -> Option<String> {
    let mut worst: Option<(f64, usize)> = None;
    for (joint, place) in reader.joints.iter().zip(theirs) {
        let Some(joint) = joint else { continue };
        let apart = places[*joint].distance(DVec3::from_array(*place)) / size;
        // Single precision far from the origin is not better.
        let least = MAX_APART.max(places[*joint].length() / size * 1e-6);
        // No number is nowhere.
        let apart = if apart.is_nan() { f64::INFINITY } else { apart };
        if apart > least && worst.is_none_or(|(most, _)| apart > most) {
            worst = Some((apart, *joint));
        }
    }
    worst.map(|(apart, joint)| format!("{apart:.6} at '{}'", ours.scene.skeleton.label(joint)))
}

/// What another reader does otherwise: files, by the beginnings of their names; what differs; and why.
pub(super) type Exceptions<'a> = &'a [(&'a [&'a str], &'a [Aspect], &'a str)];

/// Fails where something differs that is no exception, and where an exception is none any more. With `--no-capture`, says how many files
/// differ in what.
#[expect(clippy::print_stderr, reason = "figures for whoever asks")]
pub(super) fn judge(found: &[(&str, Differences)], exceptions: Exceptions<'_>) {
    let mut problems = Vec::new();
    let mut used: BTreeSet<(&str, Aspect)> = BTreeSet::new();
    for (name, differences) in found {
        for (aspect, detail) in differences {
            let rows = exceptions.iter().filter(|(_, aspects, _)| aspects.contains(aspect));
            let files = rows.flat_map(|(files, ..)| files.iter()).filter(|file| name.starts_with(**file));
            let known: Vec<(&str, Aspect)> = files.map(|file| (*file, *aspect)).collect();
            if known.is_empty() {
                problems.push(format!("{name}: {aspect:?}: {detail}"));
            }
            used.extend(known);
        }
    }
    for (files, aspects, why) in exceptions {
        for file in files.iter().filter(|file| !aspects.iter().any(|aspect| used.contains(&(**file, *aspect)))) {
            problems.push(format!("{file} differs in none of {aspects:?}, so that '{why}' is not so"));
        }
    }
    let same = found.iter().filter(|(_, differences)| differences.is_empty()).count();
    let mut by_aspect: BTreeMap<Aspect, usize> = BTreeMap::new();
    for aspect in found.iter().flat_map(|(_, differences)| differences.keys()) {
        *by_aspect.entry(*aspect).or_default() += 1;
    }
    eprintln!("{} files, {same} the same in everything; files that differ: {by_aspect:?}", found.len());
    assert!(problems.is_empty(), "{} problems:\n{}", problems.len(), problems.join("\n"));
}
