//! What a stack gives beside the clip.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::Serialize;

use crate::model::Clip;

use super::{
    temporal::runs,
    work::{LimitedJoint, Work},
};

/// The retargeted clip, and what was found on the way.
#[derive(Clone, Debug)]
pub struct StackResult {
    /// One entry per target joint.
    pub clip: Clip,
    /// When points of the source touch.
    pub contacts: Vec<ContactTrack>,
    /// How limbs reached their goals.
    pub reaches: Vec<LimbReach>,
    /// What `limits` ops took back, in their order; joints that they left alone are not among them.
    pub limited: Vec<LimitedJoint>,
}

/// When one point of the source touches.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ContactTrack {
    /// The point, such as `left_toe`.
    pub point: String,
    /// Contacts as `[from, to]` in seconds: the times of their first and last frame. Fits `contacts.set` of a spec.
    pub seconds: Vec<[f64; 2]>,
    /// One value per frame.
    #[serde(skip)]
    pub touches: Vec<bool>,
}

/// How one limb reached its goals.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LimbReach {
    /// The limb.
    pub limb: String,
    /// Largest distance left between goal and end, meters of the target.
    pub residual_max_meters: f64,
    /// Mean of it.
    pub residual_mean_meters: f64,
    /// Frames with more than a millimeter left.
    pub frames_out_of_reach: usize,
    /// The frame with the largest.
    pub worst_frame: usize,
}

impl LimbReach {
    /// Of two sections of a clip, the other of which begins so late; how many frames each has.
    #[must_use]
    pub fn with_section(self, other: &Self, first_frame: usize, [frames, others]: [usize; 2]) -> Self {
        let (own_share, other_share) = (frames as f64, others as f64);
        let sum = self.residual_mean_meters * own_share + other.residual_mean_meters * other_share;
        let is_worse = other.residual_max_meters > self.residual_max_meters;
        Self {
            residual_max_meters: self.residual_max_meters.max(other.residual_max_meters),
            residual_mean_meters: sum / (own_share + other_share).max(1.0),
            frames_out_of_reach: self.frames_out_of_reach + other.frames_out_of_reach,
            worst_frame: if is_worse { first_frame + other.worst_frame } else { self.worst_frame },
            limb: self.limb,
        }
    }
}

/// More than this counts as out of reach.
const OUT_OF_REACH_METERS: f64 = 1e-3;

/// The times of the first and the last frame of contacts.
pub(in crate::retarget) fn seconds_of(touches: &[bool], times: &[f64]) -> Vec<[f64; 2]> {
    runs(touches).into_iter().map(|(first, last)| [times[first], times[last]]).collect()
}

/// `limbs` are the names of the mapping's limbs.
pub(in crate::retarget) fn tell(
    work: &Work<'_>,
    limbs: &[&str],
    meters_per_unit: f64,
) -> (Vec<ContactTrack>, Vec<LimbReach>) {
    let own = work.clock.own();
    let times = &work.times[own.clone()];
    let mut contacts = BTreeMap::new();
    for point in &work.contacts.points {
        let touches = point.touches[own.clone()].to_vec();
        let seconds = seconds_of(&touches, times);
        contacts.insert(point.name, ContactTrack { point: point.name.to_owned(), seconds, touches });
    }
    let reach = |(index, limb): (usize, &&str)| {
        let residuals: Vec<f64> = work
            .residuals
            .iter()
            .skip(index)
            .step_by(limbs.len())
            .skip(own.start)
            .take(own.len())
            .map(|residual| f64::from(*residual) * meters_per_unit)
            .collect();
        if residuals.iter().any(|residual| residual.is_nan()) {
            return None;
        }
        let worst = residuals.iter().enumerate().max_by(|first, second| first.1.total_cmp(second.1))?;
        Some(LimbReach {
            limb: (*limb).to_owned(),
            residual_max_meters: *worst.1,
            residual_mean_meters: residuals.iter().sum::<f64>() / residuals.len() as f64,
            frames_out_of_reach: residuals.iter().filter(|residual| **residual > OUT_OF_REACH_METERS).count(),
            worst_frame: worst.0,
        })
    };
    (contacts.into_values().collect(), limbs.par_iter().enumerate().filter_map(reach).collect())
}
