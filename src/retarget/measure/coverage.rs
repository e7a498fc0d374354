//! Which parts of the body drive something: limbs of the target that are left at rest while the source's move, or that the source does
//! not have.

use glam::DQuat;

use super::{
    metric::{Finding, Reading},
    motion::{Both, Performer},
};
use crate::{
    model::Clip,
    retarget::mapping::Mapping,
    rig::{Rig, Role},
};

/// Parts of the body: a name, the roles of which one is enough, how much it counts, and what is asked of it.
const PARTS: [(&str, &[&str], f64, Need); 15] = [
    ("pelvis", &["pelvis"], 1.0, Need::Target),
    ("spine", &["spine"], 1.0, Need::Both),
    ("head", &["head", "neck"], 1.0, Need::Both),
    ("left_upper_arm", &["left_upper_arm"], 1.0, Need::Either),
    ("right_upper_arm", &["right_upper_arm"], 1.0, Need::Either),
    ("left_forearm", &["left_forearm"], 1.0, Need::Either),
    ("right_forearm", &["right_forearm"], 1.0, Need::Either),
    ("left_hand", &["left_hand"], 0.5, Need::Both),
    ("right_hand", &["right_hand"], 0.5, Need::Both),
    ("left_thigh", &["left_thigh"], 1.0, Need::Either),
    ("right_thigh", &["right_thigh"], 1.0, Need::Either),
    ("left_shin", &["left_shin"], 1.0, Need::Either),
    ("right_shin", &["right_shin"], 1.0, Need::Either),
    ("left_foot", &["left_foot"], 0.5, Need::Both),
    ("right_foot", &["right_foot"], 0.5, Need::Both),
];
/// A whole leg of an animal counts as much as thigh and shin.
const WHOLE_LEG: f64 = 2.0;
/// A joint moves when it turns by more than this over a clip, degrees; it is at rest when it turns by less than the second.
const MOVES: f64 = 10.0;
const RESTS: f64 = 0.5;
/// Frames that are looked at, evenly spread.
const FRAMES_LOOKED_AT: usize = 120;
const NOTHING_MOVES: &str = "nothing of the source moves";

/// When a part counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Need {
    /// When the target has it.
    Target,
    /// When the target has it, and the source moves it.
    Both,
    /// When the target has it and the source moves it or has none, or when the target has none and the source moves it.
    Either,
}

struct Sides<'a> {
    source: Performer<'a>,
    target: Performer<'a>,
    drives: Vec<bool>,
    driven: Vec<bool>,
}

/// The share of the body that is left at rest.
pub(super) fn undriven_body(mapping: &Mapping, performers: &Both<Performer<'_>>) -> Finding {
    let sides = Sides {
        source: performers.source,
        target: performers.target,
        drives: drives(mapping),
        driven: mapping.driven(),
    };
    let mut parts: Vec<(&str, Vec<&str>, f64, Need)> =
        PARTS.iter().map(|(name, roles, weight, need)| (*name, roles.to_vec(), *weight, *need)).collect();
    let is_leg = |role: &&String| role.parse::<Role>().is_ok_and(|role| role.part.is_whole_leg());
    let legs = performers.target.rig.roles.keys().filter(is_leg);
    parts.extend(legs.map(|leg| (leg.as_str(), vec![leg.as_str()], WHOLE_LEG, Need::Both)));
    let mut reading = Reading::default();
    let (mut left, mut all) = (0.0, 0.0);
    for (name, roles, weight, need) in parts {
        let Some((is_covered, joint)) = sides.covers(&roles, need) else { continue };
        all += weight;
        if !is_covered {
            left += weight;
            reading.parts.insert(name.to_owned(), 1.0);
            reading.worst.push((0, joint.unwrap_or(0), name.to_owned(), 1.0));
        }
    }
    if all > 0.0 {
        return Ok(Reading { value: left / all, ..reading });
    }
    sides.undriven_joints().map(|value| Reading { value, ..reading }).ok_or(NOTHING_MOVES)
}

impl Sides<'_> {
    /// Whether a part is covered, and the joint of the target; nothing where it does not count.
    fn covers(&self, roles: &[&str], need: Need) -> Option<(bool, Option<usize>)> {
        let joints = |rig: &Rig<'_>| roles.iter().flat_map(|role| rig.role(role).to_vec()).collect::<Vec<usize>>();
        let (source, target) = (joints(self.source.rig), joints(self.target.rig));
        let source_moves = source.iter().any(|&joint| range_degrees(&self.source, joint) > MOVES);
        let counts = match need {
            Need::Target => !target.is_empty(),
            Need::Both => !target.is_empty() && source_moves,
            Need::Either if target.is_empty() => source_moves,
            Need::Either => source.is_empty() || source_moves,
        };
        if !counts {
            return None;
        }
        if target.is_empty() {
            return Some((source.iter().any(|&joint| self.drives[joint]), None));
        }
        let is_driven = target.iter().any(|&joint| self.driven[joint]);
        let is_left = need != Need::Target
            && source_moves
            && target.iter().all(|&joint| range_degrees(&self.target, joint) < RESTS);
        Some((is_driven && !is_left, target.first().copied()))
    }

    /// The share of the moving joints of the source that drive nothing, for rigs of which nothing is recognized.
    fn undriven_joints(&self) -> Option<f64> {
        let moving: Vec<usize> =
            (0..self.drives.len()).filter(|&joint| range_degrees(&self.source, joint) > MOVES).collect();
        let idle = moving.iter().filter(|joint| !self.drives[**joint]).count();
        (!moving.is_empty()).then(|| idle as f64 / moving.len() as f64)
    }
}

/// Which joints of the source drive something.
fn drives(mapping: &Mapping) -> Vec<bool> {
    let mut drives = vec![false; mapping.source_rest.transforms().len()];
    let chains = mapping.chains.iter();
    for &joint in chains.flat_map(|chain| chain.source.iter().chain(chain.also.iter().flat_map(|also| &also.source))) {
        drives[joint] = true;
    }
    if let Some(pelvis) = &mapping.pelvis {
        drives[pelvis.source] = true;
    }
    drives
}

/// How far a joint turns against its parent over the clip, from the first frame.
fn range_degrees(performer: &Performer<'_>, joint: usize) -> f64 {
    let Performer { rig, clip, .. } = performer;
    let rest = rig.skeleton().joints()[joint].rest.rotation;
    let rotation =
        |clip: &Clip, frame: usize| -> DQuat { clip.joints()[joint].rotation.wide_at(frame, rest).normalize() };
    if !clip.joints()[joint].rotation.is_animated() {
        return 0.0;
    }
    let first = rotation(clip, 0).conjugate();
    let step = clip.frame_count().div_ceil(FRAMES_LOOKED_AT).max(1);
    let turned = |frame: usize| crate::model::rotation::degrees(first * rotation(clip, frame));
    (0..clip.frame_count()).step_by(step).map(turned).fold(0.0, f64::max)
}
