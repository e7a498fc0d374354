//! Spines that kink: one joint that bends more than everything that the source's spine does.

use glam::DQuat;

use super::{
    metric::{Finding, Reading, Series},
    motion::{Both, Compared, Motion, Performer, Wanted},
};
use crate::{model::rotation::degrees, rig::Rig};

const NO_SPINE: &str = "no spine was recognized on both sides";

/// The line from the pelvis to the head on both sides.
pub(super) struct Spine {
    source: Vec<Link>,
    target: Vec<Link>,
}

struct Link {
    role: &'static str,
    joint: usize,
    turn: usize,
    /// From the rig's own rest pose to the pose that turns are counted from, +Y up: what alignment bent is seen as well.
    aligned: DQuat,
}

impl Spine {
    pub(super) fn find(performers: &Both<Performer<'_>>, wanted: &mut Wanted) -> Option<Self> {
        let mut side = |performer: &Performer<'_>, is_target: bool| {
            let links = line(performer.rig).into_iter().map(|(role, joint)| {
                let to_work = performer.rig.canonical_from_scene;
                let [measured, own] =
                    [performer.rest, &performer.rig.rest].map(|pose| pose.transforms()[joint].rotation);
                let aligned = to_work * measured * own.conjugate() * to_work.conjugate();
                Link { role, joint, turn: wanted.own_turn(is_target, joint), aligned }
            });
            links.collect::<Vec<Link>>()
        };
        let (source, target) = (side(&performers.source, false), side(&performers.target, true));
        (source.len() > 1 && target.len() > 1).then_some(Self { source, target })
    }

    /// The bend of each joint of the target against the one before it, less the sum of all bends of the source's line: degrees.
    pub(super) fn kink(spine: Option<&Self>, compared: &Compared) -> Finding {
        let spine = spine.ok_or(NO_SPINE)?;
        let of_source: Vec<f64> = (0..compared.len())
            .map(|frame| (1..spine.source.len()).map(|joint| bend(&spine.source, &compared.source, frame, joint)).sum())
            .collect();
        let series = |joint: usize| {
            let beyond =
                |frame: usize| (bend(&spine.target, &compared.target, frame, joint) - of_source[frame]).max(0.0);
            let Link { role, joint: index, .. } = spine.target[joint];
            let place = spine.target[..=joint].iter().filter(|link| link.role == role).count();
            let part = if place > 1 { format!("{role} {place}") } else { role.to_owned() };
            Series { part, joint: index, values: (0..compared.len()).map(beyond).collect() }
        };
        let series: Vec<Series> = (1..spine.target.len()).map(series).collect();
        Reading::of_worst_part(&series, &compared.frames.indices, 1.0).ok_or(NO_SPINE)
    }
}

/// How far a joint is turned against the one before it, beyond what it is at rest.
fn bend(links: &[Link], motion: &Motion, frame: usize, joint: usize) -> f64 {
    let turn = |link: &Link| motion.own_turn(frame, link.turn) * link.aligned;
    degrees(turn(&links[joint - 1]).conjugate() * turn(&links[joint]))
}

fn line(rig: &Rig<'_>) -> Vec<(&'static str, usize)> {
    let mut found: Vec<(&'static str, usize)> = Vec::new();
    for (role, count) in [("pelvis", 1), ("spine", usize::MAX), ("neck", usize::MAX), ("head", 1)] {
        for &joint in rig.role(role).iter().take(count) {
            if found.iter().all(|(_, other)| *other != joint) {
                found.push((role, joint));
            }
        }
    }
    found
}
