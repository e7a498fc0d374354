//! A proposal as a page for a terminal.

use std::fmt;

use crate::engine::{AlignmentView, DriverView, Proposal, RigFacts, RolePair};

/// Roles that are less sure than this are shown with their reasons.
const SURE: f64 = 0.8;
/// Joints whose rest poses differ by less are not listed.
const APART_DEGREES: f64 = 1.0;

impl fmt::Display for Proposal {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = &self.counts;
        write_rig(formatter, "source", &self.rigs.source)?;
        write_rig(formatter, "target", &self.rigs.target)?;
        writeln!(
            formatter,
            "{} of {} target joints are driven; {} roles on both sides\n\nroles",
            counts.driven_joints, counts.target_joints, counts.roles_on_both_sides
        )?;
        for pair in &self.roles {
            write_role(formatter, pair)?;
        }
        writeln!(formatter, "\njoints of the target")?;
        for joint in &self.joints {
            write_joint(formatter, joint)?;
        }
        write_alignment(formatter, &self.alignment)?;
        if !self.warnings.is_empty() {
            writeln!(formatter, "\nwarnings")?;
        }
        for warning in &self.warnings {
            writeln!(formatter, "  {}: {}: {}", warning.code, warning.place, warning.detail)?;
            if !warning.hint.is_empty() {
                writeln!(formatter, "    hint: {}", warning.hint)?;
            }
        }
        Ok(())
    }
}

fn write_rig(formatter: &mut fmt::Formatter<'_>, side: &str, rig: &RigFacts) -> fmt::Result {
    let convention = rig.recognised_as.as_deref().unwrap_or("no known convention");
    let percent = rig.confidence * 100.0;
    writeln!(formatter, "{side}: {convention}, {percent:.0} % sure, rest pose from {}", rig.rest_pose_from)
}

fn write_role(formatter: &mut fmt::Formatter<'_>, pair: &RolePair) -> fmt::Result {
    let joints =
        |side: &Option<crate::engine::OneOrMore>| side.as_ref().map_or_else(|| "–".to_owned(), ToString::to_string);
    write!(formatter, "  {:<24}{} -> {}", pair.role, joints(&pair.source), joints(&pair.target))?;
    match pair.confidence {
        Some(confidence) => writeln!(formatter, "  ({:.0} %)", confidence * 100.0)?,
        None => writeln!(formatter)?,
    }
    for (side, details) in [("source", &pair.source_details), ("target", &pair.target_details)] {
        let Some(details) = details.as_ref().filter(|details| details.confidence < SURE) else { continue };
        let others: Vec<String> = details.alternatives.iter().map(ToString::to_string).collect();
        let others = if others.is_empty() { String::new() } else { format!("; or {}", others.join(" or ")) };
        writeln!(formatter, "    {side}: {}{others}", details.reasons.join("; "))?;
    }
    Ok(())
}

/// The joints whose rest poses would still differ, worst first.
fn write_alignment(formatter: &mut fmt::Formatter<'_>, alignment: &[AlignmentView]) -> fmt::Result {
    let left = |joint: &AlignmentView| {
        joint.direction_degrees.unwrap_or_default().max(joint.roll_degrees.unwrap_or_default().abs())
    };
    let mut apart: Vec<&AlignmentView> = alignment.iter().filter(|joint| left(joint) >= APART_DEGREES).collect();
    if alignment.is_empty() {
        return Ok(());
    }
    apart.sort_by(|first, second| left(second).total_cmp(&left(first)));
    let (all, count) = (alignment.len(), apart.len());
    writeln!(formatter, "\nrest poses: {} of {all} joints are aligned within {APART_DEGREES} degrees", all - count)?;
    for joint in apart {
        let angle = |what: &str, degrees: Option<f64>| match degrees {
            Some(degrees) => format!("  {what} {degrees:.1}"),
            None => String::new(),
        };
        let (direction, roll) = (angle("direction", joint.direction_degrees), angle("roll", joint.roll_degrees));
        writeln!(formatter, "  {:<24}{}{direction}{roll}  ({})", joint.role, joint.joint, joint.aligned)?;
    }
    Ok(())
}

fn write_joint(formatter: &mut fmt::Formatter<'_>, joint: &DriverView) -> fmt::Result {
    let sources: Vec<String> = joint
        .sources
        .iter()
        .map(|share| {
            let percent = share.weight * 100.0;
            if percent < 99.5 { format!("{percent:.0} % {}", share.joint) } else { share.joint.clone() }
        })
        .collect();
    let from = if sources.is_empty() { "–".to_owned() } else { sources.join(" + ") };
    let then = if joint.ops.is_empty() { String::new() } else { format!("; then {}", joint.ops.join(", ")) };
    writeln!(formatter, "  {:<28}{from:<32}  {}{then}", joint.joint, joint.reason)
}
