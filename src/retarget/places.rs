//! Which place of a source chain each joint of a target chain follows.

use glam::{DQuat, DVec3};

use super::{
    mapping::{ChainPair, Spacing},
    spec::RotationMode,
};
use crate::model::Transform;

use super::plan::Sample;

/// Below this distance from a chain's end, a place counts as the end.
const CHAIN_END_TOLERANCE: f64 = 1e-4;

/// A place on the source chain, by position in the chain.
#[derive(Clone, Copy, Debug)]
pub(super) enum Place {
    At(usize),
    Between(usize, f64),
}

impl Place {
    pub(super) fn nearest(self) -> usize {
        match self {
            Self::At(position) => position,
            Self::Between(position, fraction) => position + usize::from(fraction >= 0.5),
        }
    }

    pub(super) fn sample(self, slot: impl Fn(usize) -> usize, first_axes: Option<DQuat>) -> Sample {
        match self {
            Self::At(position) => Sample::At(slot(position)),
            Self::Between(position, fraction) => {
                Sample::Between { first: slot(position), second: slot(position + 1), fraction, first_axes }
            }
        }
    }

    /// The transform at this place of a chain: linear in translation and scale, normalized linear the short way in rotation.
    pub(super) fn of(self, chain: &[usize], pose: &[Transform]) -> Transform {
        match self {
            Self::At(position) => pose[chain[position]],
            Self::Between(position, fraction) => {
                let (first, second) = (pose[chain[position]], pose[chain[position + 1]]);
                let sign = if first.rotation.dot(second.rotation) < 0.0 { -1.0 } else { 1.0 };
                Transform {
                    translation: first.translation.lerp(second.translation, fraction),
                    rotation: (first.rotation * (1.0 - fraction) + second.rotation * (fraction * sign)).normalize(),
                    scale: first.scale.lerp(second.scale, fraction),
                }
            }
        }
    }
}

/// For every target joint of a chain, the place on the source chain that it follows; `None` keeps it at rest.
pub(super) fn places(chain: &ChainPair, source_rest: &[Transform], target_rest: &[Transform]) -> Vec<Option<Place>> {
    let (sources, targets) = (chain.source.len(), chain.target.len());
    let at = |params: Vec<f64>, source_params: &[f64]| {
        params.into_iter().map(|param| Some(place_at(param, source_params))).collect()
    };
    match chain.spacing {
        Spacing::Length => {}
        Spacing::Led => return at(shares(&vec![1.0; targets]), &led(&vec![1.0; sources - 1])),
        Spacing::Curled => return at(shares(&curls(targets)), &led(&curls(sources - 1))),
    }
    let one_to_one = |position: usize| (position < sources).then_some(Place::At(position));
    match chain.drive.rotation {
        RotationMode::None => vec![None; targets],
        RotationMode::OneToOne => (0..targets).map(one_to_one).collect(),
        RotationMode::Auto | RotationMode::CopyLocal | RotationMode::MatchChain | RotationMode::MatchScaledChain
            if sources == targets =>
        {
            (0..targets).map(one_to_one).collect()
        }
        RotationMode::OneToOneReversed => {
            (0..targets).map(|position| (position + sources).checked_sub(targets).and_then(one_to_one)).collect()
        }
        RotationMode::Auto
        | RotationMode::Interpolated
        | RotationMode::CopyLocal
        | RotationMode::MatchChain
        | RotationMode::MatchScaledChain => {
            at(arc_lengths(&chain.target, target_rest), &arc_lengths(&chain.source, source_rest))
        }
    }
}

/// How much the joints of a finger bend, from the knuckle: 1 : 1.1 : 0.7, and 1 : 1.2 for two. Joints beyond are tips, which
/// do not bend.
fn curls(joints: usize) -> Vec<f64> {
    let natural: &[f64] = if joints == 2 { &[1.0, 1.2] } else { &[1.0, 1.1, 0.7] };
    (0..joints).map(|joint| natural.get(joint).copied().unwrap_or(0.0)).collect()
}

/// What share of a chain's whole bend is reached at each joint.
fn shares(weights: &[f64]) -> Vec<f64> {
    let total: f64 = weights.iter().sum();
    let mut so_far = 0.0;
    let reached = weights.iter().map(|weight| {
        so_far += weight;
        so_far / total
    });
    reached.collect()
}

/// The same after a joint that does not bend.
fn led(weights: &[f64]) -> Vec<f64> {
    std::iter::once(0.0).chain(shares(weights)).collect()
}

fn place_at(param: f64, params: &[f64]) -> Place {
    let last = params.len() - 1;
    if last == 0 || param < CHAIN_END_TOLERANCE {
        return Place::At(0);
    }
    if param > 1.0 - CHAIN_END_TOLERANCE {
        return Place::At(last);
    }
    let position = params.iter().rposition(|start| *start <= param).unwrap_or(0).min(last - 1);
    let length = params[position + 1] - params[position];
    let fraction = if length > 0.0 { (param - params[position]) / length } else { 0.0 };
    Place::Between(position, fraction)
}

/// Normalized arc length of each joint along a chain at rest: 0 to 1; a single joint is at 1. A chain without length is
/// spread evenly.
fn arc_lengths(chain: &[usize], rest: &[Transform]) -> Vec<f64> {
    let position = |joint: usize| -> DVec3 { rest[joint].translation };
    let mut lengths = vec![0.0];
    for pair in chain.windows(2) {
        let so_far = lengths[lengths.len() - 1];
        lengths.push(so_far + position(pair[0]).distance(position(pair[1])));
    }
    let total = lengths[lengths.len() - 1];
    let last = chain.len() - 1;
    if last == 0 {
        return vec![1.0];
    }
    if total <= f64::MIN_POSITIVE {
        return (0..=last).map(|index| index as f64 / last as f64).collect();
    }
    lengths.into_iter().map(|length| length / total).collect()
}
