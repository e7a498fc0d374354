//! The HIERARCHY part: joints, offsets and channels.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::{
    formats::{Budget, FormatError, Limit},
    model::{Joint, Reporter, Transform},
};

use super::scanner::{Scanner, show};

/// The hierarchy of a file.
#[derive(Debug, Default)]
pub(super) struct Hierarchy {
    /// Joints and End Sites in the order of the file, which has parents before children.
    pub(super) joints: Vec<Joint>,
    /// The channels of each joint, in the order of their values in a row.
    pub(super) channels: Vec<Vec<Channel>>,
    /// How many values a row has.
    pub(super) channel_count: usize,
}

/// What one value of a row means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Channel {
    /// A component of the position in the parent's space, by index.
    Position(usize),
    /// A turn about an axis, by index, in degrees.
    Rotation(usize),
}

impl Channel {
    /// The channel of that name, in any letter case.
    fn from_name(name: &[u8]) -> Option<Self> {
        let axis = match name.first()?.to_ascii_lowercase() {
            b'x' => 0,
            b'y' => 1,
            b'z' => 2,
            _ => return None,
        };
        if name[1..].eq_ignore_ascii_case(b"position") {
            Some(Self::Position(axis))
        } else if name[1..].eq_ignore_ascii_case(b"rotation") {
            Some(Self::Rotation(axis))
        } else {
            None
        }
    }

    /// The name in a file.
    pub(super) fn name(self) -> String {
        let (Self::Position(axis) | Self::Rotation(axis)) = self;
        let kind = if matches!(self, Self::Position(_)) { "position" } else { "rotation" };
        format!("{}{kind}", ['X', 'Y', 'Z'][axis])
    }
}

/// A block whose closing brace has not come yet.
struct Open {
    joint: usize,
    line: usize,
    has_offset: bool,
}

/// Reads everything before MOTION, and that word itself where it is there.
///
/// # Errors
/// When the text is no hierarchy, or has more joints or levels than the budget allows.
pub(super) fn read(
    scanner: &mut Scanner<'_>,
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<Hierarchy, FormatError> {
    match scanner.next_word() {
        Some(word) if word.eq_ignore_ascii_case(b"HIERARCHY") => {}
        other => return Err(unexpected(scanner, other, "HIERARCHY")),
    }
    let mut hierarchy = Hierarchy::default();
    let mut open: Vec<Open> = Vec::new();
    loop {
        let word = scanner.next_word();
        let keyword = word.map(<[u8]>::to_ascii_uppercase);
        match keyword.as_deref() {
            Some(b"ROOT") if open.is_empty() => open.push(begin_joint(scanner, &mut hierarchy, &[], budget, reporter)?),
            Some(b"JOINT") if !open.is_empty() => {
                let joint = begin_joint(scanner, &mut hierarchy, &open, budget, reporter)?;
                open.push(joint);
            }
            Some(b"END") if !open.is_empty() => {
                let site = begin_end_site(scanner, &mut hierarchy, &open, budget)?;
                open.push(site);
            }
            Some(b"OFFSET") if !open.is_empty() => offset(scanner, &mut hierarchy, &mut open)?,
            Some(b"CHANNELS") if !open.is_empty() => channels(scanner, &mut hierarchy, &open)?,
            Some(b"}") => close(scanner, &hierarchy, &mut open, reporter)?,
            Some(b"MOTION") if open.is_empty() => break,
            None if open.is_empty() => break,
            _ => {
                let Some(block) = open.last() else { return Err(unexpected(scanner, word, "ROOT or MOTION")) };
                let name = &hierarchy.joints[block.joint].name;
                let wanted = format!("'}}' of the block of '{name}' that begins in line {}", block.line);
                return Err(unexpected(scanner, word, &wanted));
            }
        }
    }
    if hierarchy.joints.is_empty() {
        return Err(scanner.malformed("the hierarchy has no ROOT"));
    }
    warn_of_repeated_names(&hierarchy, reporter);
    Ok(hierarchy)
}

fn begin_joint(
    scanner: &mut Scanner<'_>,
    hierarchy: &mut Hierarchy,
    open: &[Open],
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<Open, FormatError> {
    let bytes = scanner.rest_of_line();
    let name = String::from_utf8_lossy(bytes).into_owned();
    if std::str::from_utf8(bytes).is_err() {
        reporter.warn(
            "name_not_utf8",
            scanner.place(),
            format!("a joint's name is not UTF-8; it was read as '{name}'"),
            "save the file as UTF-8",
        );
    }
    begin(scanner, hierarchy, open, name, true, budget)
}

fn begin_end_site(
    scanner: &mut Scanner<'_>,
    hierarchy: &mut Hierarchy,
    open: &[Open],
    budget: &mut Budget<'_>,
) -> Result<Open, FormatError> {
    scanner.rest_of_line();
    let parent = open.last().map_or("", |block| hierarchy.joints[block.joint].name.as_str());
    let name = format!("{parent}_end");
    begin(scanner, hierarchy, open, name, false, budget)
}

fn begin(
    scanner: &mut Scanner<'_>,
    hierarchy: &mut Hierarchy,
    open: &[Open],
    name: String,
    is_joint: bool,
    budget: &mut Budget<'_>,
) -> Result<Open, FormatError> {
    let line = scanner.line();
    match scanner.next_word() {
        Some(b"{") => {}
        other => return Err(unexpected(scanner, other, &format!("'{{' after '{name}'"))),
    }
    let parent = open.last().map(|block| block.joint);
    if parent.is_some_and(|parent| !hierarchy.joints[parent].is_joint) {
        return Err(scanner.malformed("an End Site cannot have joints below it"));
    }
    let joint = hierarchy.joints.len();
    budget.take(Limit::Nodes, joint as u64 + 1, &scanner.place())?;
    budget.take(Limit::HierarchyDepth, open.len() as u64 + 1, &scanner.place())?;
    budget.take_array(1, (size_of::<Joint>() + name.len()) as u64, &scanner.place())?;
    hierarchy.joints.push(Joint { name, parent, rest: Transform::IDENTITY, is_joint, node: joint });
    hierarchy.channels.push(Vec::new());
    Ok(Open { joint, line, has_offset: false })
}

fn offset(scanner: &mut Scanner<'_>, hierarchy: &mut Hierarchy, open: &mut [Open]) -> Result<(), FormatError> {
    let Some(block) = open.last_mut() else { return Ok(()) };
    let mut offset = DVec3::ZERO;
    for axis in 0..3 {
        offset[axis] = scanner.expect_number("a number of OFFSET")?;
    }
    hierarchy.joints[block.joint].rest.translation = offset;
    block.has_offset = true;
    Ok(())
}

fn channels(scanner: &mut Scanner<'_>, hierarchy: &mut Hierarchy, open: &[Open]) -> Result<(), FormatError> {
    let Some(block) = open.last() else { return Ok(()) };
    let joint = &hierarchy.joints[block.joint];
    let known = &mut hierarchy.channels[block.joint];
    if !joint.is_joint {
        return Err(scanner.malformed("an End Site cannot have channels"));
    }
    if !known.is_empty() {
        return Err(scanner.malformed(format!("'{}' has CHANNELS twice", joint.name)));
    }
    let count = scanner.expect_number("the number of CHANNELS")?;
    if count.fract() != 0.0 || !(0.0..=6.0).contains(&count) {
        let detail = format!(
            "'{}' declares {count} channels; a joint has at most three positions and three rotations",
            joint.name
        );
        return Err(scanner.malformed(detail));
    }
    for _ in 0..count as usize {
        let word = scanner.next_word();
        let Some(channel) = word.and_then(Channel::from_name) else {
            return Err(unexpected(scanner, word, "a channel such as Xposition or Zrotation"));
        };
        if known.contains(&channel) {
            return Err(scanner.malformed(format!("'{}' has the channel {} twice", joint.name, channel.name())));
        }
        known.push(channel);
    }
    if scanner.peek_word().and_then(Channel::from_name).is_some() {
        return Err(
            scanner.malformed(format!("'{}' lists more channels than the {count} that it declares", joint.name))
        );
    }
    hierarchy.channel_count += known.len();
    Ok(())
}

fn close(
    scanner: &Scanner<'_>,
    hierarchy: &Hierarchy,
    open: &mut Vec<Open>,
    reporter: &mut Reporter,
) -> Result<(), FormatError> {
    let Some(block) = open.pop() else { return Err(scanner.malformed("a '}' closes nothing")) };
    if !block.has_offset {
        reporter.warn(
            "offset_missing",
            format!("line {}", block.line),
            format!("'{}' has no OFFSET; it was placed at its parent", hierarchy.joints[block.joint].name),
            "check the export of the skeleton",
        );
    }
    Ok(())
}

fn warn_of_repeated_names(hierarchy: &Hierarchy, reporter: &mut Reporter) {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for joint in hierarchy.joints.iter().filter(|joint| joint.is_joint) {
        *counts.entry(&joint.name).or_default() += 1;
    }
    for (name, count) in counts.into_iter().filter(|(_, count)| *count > 1) {
        reporter.warn(
            "names_repeated",
            name,
            format!("{count} joints have this name; they are distinguished by their node index"),
            "rename the joints so that a mapping can name them",
        );
    }
}

fn unexpected(scanner: &Scanner<'_>, word: Option<&[u8]>, wanted: &str) -> FormatError {
    match word {
        Some(word) => scanner.malformed(format!("'{}' where {wanted} should be", show(word))),
        None => scanner
            .malformed(format!("the file ends where {wanted} should be"))
            .with_hint("check that the upload or the export was complete"),
    }
}
