//! An inspection as a page for a terminal.

use std::fmt::{self, Write as _};

use super::inspect::{ClipView, FindingView, Inspection, RigView};

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
        for rig in &self.rigs {
            writeln!(formatter)?;
            write_rig(formatter, rig)?;
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

fn write_rig(formatter: &mut fmt::Formatter<'_>, rig: &RigView) -> fmt::Result {
    let convention = rig.recognised_as.as_deref().unwrap_or("no known convention");
    let percent = rig.confidence * 100.0;
    writeln!(formatter, "rig '{}': {}, {convention}, {percent:.0} % sure", rig.name, rig.kind)?;
    let mut facts = format!("  rest pose {} (from {}: {})", rig.measured_pose, rig.rest_source, rig.rest_reason);
    if let (Some(up), Some(forward)) = (rig.up, rig.forward) {
        write!(facts, ", up {up}, facing {forward}")?;
    }
    writeln!(formatter, "{facts}, {:.2} m high", rig.height_metres)?;
    for (role, joints) in &rig.roles.0 {
        writeln!(formatter, "  {role:<24}{joints}")?;
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
