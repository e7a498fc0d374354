//! `reach`: the ends, and which joints may turn for them.

use super::{ReachDrive, ReachEnd};
use std::collections::BTreeMap;

use glam::DVec3;

use crate::retarget::ops::{
    ReachGoal, ReachOp, ReachPlace,
    context::{Context, is_in},
};

/// Goals at most: the equations of a frame have three rows for each.
const MAX_GOALS: usize = 8;
/// Joints that may turn at most.
const MAX_JOINTS: usize = 64;
/// How stiff the joints of a spine are where nothing else is said: arms do more of the reaching than backs.
const SPINE_STIFFNESS: f64 = 0.5;

pub(in crate::retarget) fn resolve(op: &ReachOp, context: &mut Context<'_>) -> Vec<ReachDrive> {
    let masked = context.masked(&op.scope);
    if op.goals.len() > MAX_GOALS {
        context.refuse("goals", format!("{} goals; at most {MAX_GOALS} are reached for at once", op.goals.len()));
        return Vec::new();
    }
    let stiffness = stiffness(op, context);
    let mut ends = Vec::with_capacity(op.goals.len());
    for (index, goal) in op.goals.iter().enumerate() {
        let end = resolve_goal(goal, index, context).filter(|end| is_in(masked.as_ref(), end.end));
        ends.extend(end);
    }
    let mut joints: Vec<usize> = ends.iter().flat_map(|end| end.turning.iter().copied()).collect();
    joints.sort_unstable();
    joints.dedup();
    if joints.len() > MAX_JOINTS {
        context
            .refuse("goals", format!("{} joints would turn; at most {MAX_JOINTS} do, so lower a depth", joints.len()));
        return Vec::new();
    }
    if ends.is_empty() {
        return Vec::new();
    }
    let stiffness = joints.iter().map(|joint| stiffness.get(joint).copied().unwrap_or(0.0)).collect();
    let pelvis = context.target.role("pelvis").first().copied().filter(|_| op.pelvis > 0.0);
    vec![ReachDrive {
        ends,
        joints,
        stiffness,
        pelvis: pelvis.map(|pelvis| (pelvis, op.pelvis)),
        iterations: op.iterations,
        damping: op.damping,
    }]
}

fn stiffness(op: &ReachOp, context: &mut Context<'_>) -> BTreeMap<usize, f64> {
    let spine = context.target.role("spine").iter().map(|&joint| (joint, SPINE_STIFFNESS));
    let mut stiffness: BTreeMap<usize, f64> = spine.collect();
    for (name, value) in &op.stiffness {
        if !(0.0..=1.0).contains(value) {
            context.refuse(&format!("stiffness/{name}"), format!("{value} is not between 0 and 1"));
        }
        for joint in context.joints_named(name, &format!("stiffness/{name}")) {
            stiffness.insert(joint, *value);
        }
    }
    stiffness
}

fn resolve_goal(goal: &ReachGoal, index: usize, context: &mut Context<'_>) -> Option<ReachEnd> {
    let at = |field: &str| format!("goals/{index}/{field}");
    for (axis, weight) in goal.axes.iter().enumerate() {
        if !(0.0..=1.0).contains(weight) {
            context.refuse(&at(&format!("axes/{axis}")), format!("{weight} is not between 0 and 1"));
        }
    }
    let (source_rig, target_rig) = (context.source, context.target);
    let end = match target_rig.role(&goal.end).last() {
        Some(&end) => end,
        None => context.target_joint(&goal.end, &at("end"))?,
    };
    let role = target_rig.roles.iter().find(|(_, joints)| joints.contains(&end)).map(|(role, _)| role.clone());
    let source = match &goal.source {
        Some(name) => match source_rig.role(name).last() {
            Some(&joint) => joint,
            None => context.source_joint(name, &at("source"))?,
        },
        None => match role.as_deref().and_then(|role| source_rig.role(role).last()) {
            Some(&joint) => joint,
            None => {
                let detail = format!("the source has no joint of the role of '{}'; name one in 'source'", goal.end);
                context.refuse(&at("source"), detail);
                return None;
            }
        },
    };
    let pelvis = target_rig.role("pelvis").first().copied();
    let mut turning = Vec::new();
    let mut above = target_rig.skeleton().parent(end);
    // The pelvis does not turn: it carries the legs.
    while let Some(joint) = above.filter(|joint| Some(*joint) != pelvis && turning.len() < goal.depth as usize) {
        turning.push(joint);
        above = target_rig.skeleton().parent(joint);
    }
    let Some(&start) = turning.last() else {
        context.refuse(&at("end"), format!("nothing above '{}' may turn", goal.end));
        return None;
    };
    let source_start = match goal.place {
        ReachPlace::World => None,
        ReachPlace::Chain => Some(source_start(context, start, source, turning.len())),
    };
    turning.sort_unstable();
    Some(ReachEnd {
        end,
        source,
        start,
        source_start,
        turning,
        weight: DVec3::from(goal.axes) * goal.weight,
        offset: DVec3::from(goal.offset),
    })
}

/// The source's first joint of a chain: of the same role and place in it as the target's, else as many joints above the end.
fn source_start(context: &Context<'_>, start: usize, source: usize, depth: usize) -> usize {
    let by_role = context.target.roles.iter().find_map(|(role, joints)| {
        let place = joints.iter().position(|&joint| joint == start)?;
        let sources = context.source.role(role);
        let found = *sources.get(place.min(sources.len().checked_sub(1)?))?;
        (found != source && context.source.skeleton().is_ancestor_or_self(found, source)).then_some(found)
    });
    by_role
        .unwrap_or_else(|| (0..depth).fold(source, |joint, _| context.source.skeleton().parent(joint).unwrap_or(joint)))
}
