//! An inspection as a page for a terminal.

use std::fmt::{self, Write as _};

use crate::engine::{ClipView, DrawingFacts, FindingView, Inspection, RigView};

/// Roles that are less sure than this are shown with how sure they are.
const SURE: f64 = 0.8;

impl fmt::Display for Inspection {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = &self.counts;
        writeln!(
            formatter,
            "{}: {}, {}, {}, {}",
            self.format,
            number(counts.nodes, "node"),
            number(counts.joints, "joint"),
            number(counts.skins, "skin"),
            number(counts.clips, "clip"),
        )?;
        if let Some(drawing) = &self.drawing {
            writeln!(formatter)?;
            write_drawing(formatter, drawing)?;
        }
        for rig in &self.rigs {
            writeln!(formatter)?;
            match &self.drawing {
                Some(_) => write_drawn_joints(formatter, rig)?,
                None => write_rig(formatter, rig)?,
            }
        }
        if self.rigs.is_empty() {
            writeln!(formatter, "\nno skeleton")?;
        }
        if !self.clips.is_empty() {
            writeln!(formatter, "\nclips")?;
        }
        for clip in &self.clips {
            write_clip(formatter, clip)?;
        }
        if !self.findings.is_empty() {
            writeln!(formatter, "\nfindings")?;
        }
        for finding in &self.findings {
            write_finding(formatter, finding)?;
        }
        if !self.warnings.is_empty() {
            writeln!(formatter, "\nwarnings")?;
        }
        for warning in &self.warnings {
            writeln!(formatter, "  {}: {}", warning.code, warning.detail)?;
            if !warning.hint.is_empty() {
                writeln!(formatter, "    hint: {}", warning.hint)?;
            }
        }
        Ok(())
    }
}

fn write_drawing(formatter: &mut fmt::Formatter<'_>, drawing: &DrawingFacts) -> fmt::Result {
    let [width, height] = drawing.size;
    let share = 100.0 * drawing.mask_pixels as f64 / (width * height).max(1) as f64;
    let parts = number(drawing.mask_parts, "part");
    writeln!(formatter, "drawing: {width} by {height} pixels; the mask covers {share:.0} % of it, in {parts}")?;
    writeln!(formatter, "  ends: {}", drawing.ends.join(", "))?;
    if !drawing.joints_outside.is_empty() {
        writeln!(formatter, "  outside the mask: {}", drawing.joints_outside.join(", "))?;
    }
    match drawing.annotated {
        Some(kind) => writeln!(formatter, "  mask and joints were found in the picture: {kind}"),
        None => Ok(()),
    }
}

/// The joints of a drawing, those that hang on another below it.
fn write_drawn_joints(formatter: &mut fmt::Formatter<'_>, rig: &RigView) -> fmt::Result {
    writeln!(formatter, "joints, {:.0} % sure", rig.confidence * 100.0)?;
    let depth = |joint: usize| std::iter::successors(rig.joints[joint].parent, |&at| rig.joints[at].parent).count();
    for (index, joint) in rig.joints.iter().enumerate() {
        writeln!(formatter, "  {}{}", "  ".repeat(depth(index)), joint.name)?;
    }
    Ok(())
}

fn write_rig(formatter: &mut fmt::Formatter<'_>, rig: &RigView) -> fmt::Result {
    let convention = rig.recognised_as.as_deref().unwrap_or("no known convention");
    let percent = rig.confidence * 100.0;
    let legs = rig.roles.0.iter().filter(|(role, _)| role.contains("_leg_")).count();
    let kind = if legs > 0 { format!("creature on {legs} legs") } else { rig.kind.to_owned() };
    writeln!(formatter, "rig '{}': {kind}, {convention}, {percent:.0} % sure", rig.name)?;
    // Only arms make a pose a T or an A.
    let pose =
        if rig.roles.get("left_upper_arm").is_some() { format!(" {}", rig.measured_pose) } else { String::new() };
    let mut facts = format!("  rest pose{pose} (from {}: {})", rig.rest_source, rig.rest_reason);
    if let (Some(up), Some(forward)) = (rig.up, rig.forward) {
        write!(facts, ", up {up}, facing {forward}")?;
    }
    writeln!(formatter, "{facts}, {:.2} m high", rig.height_meters)?;
    for (role, joints) in &rig.roles.0 {
        let confidence = rig.role_details.get(role).map_or(1.0, |details| details.confidence);
        let doubt = if confidence < SURE { format!(" ({:.0} % sure)", confidence * 100.0) } else { String::new() };
        writeln!(formatter, "  {role:<24}{joints}{doubt}")?;
    }
    for (index, helper) in rig.twists.iter().enumerate() {
        let title = if index == 0 { "twist helpers" } else { "" };
        let percent = helper.fraction * 100.0;
        writeln!(formatter, "  {title:<24}{} ({percent:.0} % along {})", helper.joint, helper.role)?;
    }
    for prop in &rig.props {
        writeln!(formatter, "  {:<24}{}", format!("held, {}", prop.side), prop.joint)?;
    }
    Ok(())
}

fn write_clip(formatter: &mut fmt::Formatter<'_>, clip: &ClipView) -> fmt::Result {
    let rate = clip.fps.map_or_else(|| "uneven keys".to_owned(), |fps| format!("{fps} fps"));
    let (frames, joints) = (number(clip.frames, "frame"), number(clip.animated_joints, "animated joint"));
    writeln!(formatter, "  '{}': {frames}, {rate}, {:.3} s, {joints}", clip.name, clip.duration_seconds)
}

fn write_finding(formatter: &mut fmt::Formatter<'_>, finding: &FindingView) -> fmt::Result {
    let FindingView { code, severity, place, detail, fix } = finding;
    let place = if place.is_empty() { String::new() } else { format!("'{place}': ") };
    writeln!(formatter, "  {severity}: {code}: {place}{detail}")?;
    writeln!(formatter, "    fix: {fix}")
}

fn number(count: usize, word: &str) -> String {
    if count == 1 { format!("1 {word}") } else { format!("{count} {word}s") }
}
