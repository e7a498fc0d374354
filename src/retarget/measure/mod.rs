//! What a retarget gave, measured against the source: metrics with thresholds, verdicts, worst places and curves.
//!
//! Measured from the clips alone, with forward kinematics of its own ([`motion`]): nothing is taken over from how the result was
//! made but which joints correspond and which rest poses look alike. Lengths of feet are told at 1 m leg length, so that figures of
//! dwarfs and giants compare. Each family of metrics is one file; their names, units and thresholds are one table,
//! [`MetricName`](super::spec::MetricName).
//!
//! Feet, knees, the spine and the pelvis are looked at in every frame, the rest of long clips in runs of neighboring frames, evenly spread, unless a
//! full report is asked for.

mod agreement;
mod bends;
mod body;
mod body_floor;
mod clearance;
mod collisions;
mod contacts;
mod coverage;
mod curves;
mod depths;
mod facing;
mod feet;
mod foot_points;
mod hands;
mod limbs;
mod loop_seam;
mod metric;
mod motion;
mod pops;
mod raised_ground;
mod rest;
mod running_floor;
mod sections;
mod skin;
mod slide;
mod smoothness;
mod spine;
mod standing;
mod statistics;
mod tracks;
mod travel;
mod trunk;
mod vertex_set;

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use self::{
    bends::Bends,
    body::Size,
    body_floor::BodyOnFloor,
    collisions::Collisions,
    coverage::undriven_body,
    curves::Keep,
    facing::Front,
    feet::FeetFindings,
    foot_points::Feet,
    hands::{Hands, hand_gap},
    limbs::{LimbSeries, Limbs, directions, percentile_finding},
    loop_seam::loop_seam,
    metric::{Finding, Reading, Series, judge, overall, rounded, score, verdict_reason},
    motion::{Both, Compared, Frames, Performer, Wanted, compare},
    pops::Pops,
    rest::rest_residual,
    smoothness::Smoothness,
    spine::Spine,
    tracks::{bone_length_drift, rotation_steps},
    travel::Travel,
    trunk::{Resting, Trunk},
};
use super::LimbReach;
use super::{
    cuts::Cuts,
    mapping::Mapping,
    spec::{MetricName, ReportChoice, ReportDetail},
};
use crate::{model::Clip, rig::Rig};

pub use curves::Curves;
pub use feet::ContactMeasure;
pub use limbs::LimbDirection;
pub use metric::{Metric, Verdict, Worst};

/// Frames of a long clip that a summary looks at beside feet and pelvis, and how many neighbors at a time.
const FRAMES_LOOKED_AT: usize = 400;
const NEIGHBORS: usize = 20;
const NO_GOALS: &str = "no inverse kinematics ran";
const NO_LIMBS: &str = "no limb was recognized on both sides";

/// What was measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Measures {
    /// The worst verdict of all metrics.
    pub verdict: Verdict,
    /// What the verdict is about, for people: the metric, its value, and the frame and joint where it is worst.
    #[serde(default)]
    pub verdict_reason: String,
    /// The share of the body that is driven, by weight of its limbs: what `undriven_body` leaves of 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coverage: Option<f64>,
    /// 0 is best; a metric that just fails adds its weight's share of 100.
    pub score: f64,
    /// Every metric by name.
    pub metrics: BTreeMap<MetricName, Metric>,
    /// What each foot does while the source's stands; of very many, those that slide most.
    pub contacts: Vec<ContactMeasure>,
    /// How many contacts are not listed.
    pub contacts_left_out: usize,
    /// Angle between the directions of source and target limbs, by role.
    pub limb_directions: BTreeMap<String, LimbDirection>,
    /// 95th percentile over all limbs and frames, degrees.
    pub limb_direction_p95_degrees: f64,
    /// Largest change of any bone's length against the target's rest, as a share of it.
    pub bone_length_drift: f64,
    /// Target pelvis height over source pelvis height.
    pub pelvis_scale: f64,
    /// Hip to ankle at rest, meters.
    pub leg_length_meters: SidePair,
    /// Where the figure walks on the spot, how fast the floor runs below it: the speed at which the target's feet do not slide. Meters a
    /// second in each file's own size; absent where the floor stands.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub floor_speed_meters_per_second: Option<SidePair>,
    /// How many frames were looked at; feet, pelvis and keys are looked at in every frame.
    pub frames_measured: usize,
    /// Values over time, by name: `limb_direction`, `sole_height`, `slide_speed`; of a full report also `limb_twist` and
    /// `end_orientation`.
    pub curves: BTreeMap<String, Curves>,
}

impl Measures {
    /// For people, where the figure walks on the spot: how fast to move it so that its feet do not slide.
    #[must_use]
    pub fn floor_speed(&self) -> Option<String> {
        let SidePair { source, target } = self.floor_speed_meters_per_second?;
        let source = source.map_or_else(String::new, |source| format!(" (source: {source:.2} m/s)"));
        Some(format!(
            "the figure walks on the spot; its feet slide least when it is moved at {:.2} m/s{source}",
            target?
        ))
    }
}

/// A length or a speed on both sides; absent where it is not known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SidePair {
    /// Of the source.
    pub source: Option<f64>,
    /// Of the target.
    pub target: Option<f64>,
}

/// How fast floors run, where they do, from velocities on the clock of the performance.
fn floor_speeds(velocities: &Both<DVec3>, tempo: f64) -> Option<SidePair> {
    let Both { source, target } = velocities.map(|velocity| Some(rounded(velocity.length() * tempo)));
    (velocities.source != DVec3::ZERO).then_some(SidePair { source, target })
}

/// Compares a result with the clip that it was made from; both have the same frames. `reaches` is what inverse kinematics says of
/// the goals that it set itself; nobody else knows them.
///
/// Never fails: what cannot be measured on these rigs is `not_applicable` and says why.
#[must_use]
pub fn measure(
    mapping: &Mapping,
    source: &Rig<'_>,
    target: &Rig<'_>,
    source_clip: &Clip,
    result: &Clip,
    choice: &ReportChoice,
    reaches: &[LimbReach],
) -> Measures {
    let count = source_clip.frame_count().min(result.frame_count());
    let is_full = choice.detail() == ReportDetail::Full;
    let rigs = Both { source, target };
    let sizes = rigs.map(|rig| Size::of(rig));
    let performers = Both {
        source: Performer { rig: source, rest: &mapping.source_rest, clip: source_clip },
        target: Performer { rig: target, rest: &mapping.target_rest, clip: result },
    };
    let cuts = Cuts::new(source.skeleton(), mapping).map_or_else(Vec::new, |cuts| cuts.find(source_clip));
    let spread = if is_full { Frames::all(count) } else { Frames::spread(count, FRAMES_LOOKED_AT, NEIGHBORS) };
    let every = OfEveryFrame::measure(&performers, sizes, Frames::all(count).cut_at(&cuts));
    let standing = (&every.flat, &every.resting);
    let spread = OfSpreadFrames::measure(&performers, &sizes, mapping, standing, spread.cut_at(&cuts));

    let looked_at = &spread.compared.frames.indices;
    let (continuity, jumps) = rotation_steps(mapping, (source.skeleton(), source_clip), (target, result), &cuts);
    let drift = bone_length_drift(mapping, target.skeleton(), result, looked_at);
    let value = |finding: &Finding| finding.as_ref().map_or(0.0, |reading| rounded(reading.value));
    let all_directions = percentile_finding(&spread.limbs.directions, looked_at, NO_LIMBS);
    let (limb_direction_p95_degrees, drift_value) = (value(&all_directions), value(&drift));
    let limb_directions = directions(&spread.limbs.directions, looked_at);
    let curves = curves(&every, &spread, is_full);
    let (contacts, contacts_left_out) = (every.contacts, every.contacts_left_out);
    let frames_measured = spread.compared.len();
    let body = BodyOnFloor::measure(&performers, &sizes, looked_at, every.has_raised_ground);
    let of_tracks = [
        (MetricName::RotationJumps, jumps),
        (MetricName::QuaternionContinuity, continuity),
        (MetricName::BoneLengthDrift, drift),
        (MetricName::ReachResidual, reach_residual(reaches, target, &sizes.target)),
        (MetricName::UndrivenBody, undriven_body(mapping, &performers)),
        (MetricName::RestResidual, rest_residual(&rigs)),
        (MetricName::LoopSeam, loop_seam(mapping, &performers, &sizes)),
        (MetricName::BodyPenetration, body.penetration),
        (MetricName::HandFloat, body.hand_float),
    ];
    let judged = |(name, finding): (MetricName, Finding)| {
        (name, judge(name, finding, choice, target.skeleton(), result.times_seconds()))
    };
    let metrics: BTreeMap<MetricName, Metric> =
        every.findings.into_iter().chain(spread.findings).chain(of_tracks).map(judged).collect();
    Measures {
        verdict: overall(&metrics),
        verdict_reason: verdict_reason(&metrics),
        coverage: metrics[&MetricName::UndrivenBody].value.map(|undriven| rounded(1.0 - undriven)),
        score: score(&metrics),
        metrics,
        contacts,
        contacts_left_out,
        limb_directions,
        limb_direction_p95_degrees,
        bone_length_drift: drift_value,
        pelvis_scale: mapping.global_scale,
        leg_length_meters: SidePair { source: sizes.source.leg, target: sizes.target.leg },
        floor_speed_meters_per_second: every.floor_speeds,
        frames_measured,
        curves,
    }
}

/// What is looked at in every frame.
struct OfEveryFrame {
    compared: Compared,
    findings: Vec<(MetricName, Finding)>,
    contacts: Vec<ContactMeasure>,
    contacts_left_out: usize,
    sole_heights: Vec<Series>,
    slide_speeds: Vec<Series>,
    flat: BTreeMap<String, Vec<bool>>,
    resting: Resting,
    has_raised_ground: bool,
    floor_speeds: Option<SidePair>,
}

impl OfEveryFrame {
    fn measure(performers: &Both<Performer<'_>>, sizes: Both<Size>, frames: Frames) -> Self {
        let rigs = performers.map(|performer| performer.rig);
        let mut wanted = Wanted::default();
        let feet = Feet::find(&rigs, sizes, &mut wanted);
        let travel = Travel::find(&rigs, &sizes, &mut wanted);
        let knees = Pops::knees(&rigs, &mut wanted);
        let spine = Spine::find(performers, &mut wanted);
        let trunk = Trunk::find(&rigs, &sizes, &mut wanted);
        let compared = compare(performers, &wanted, frames);
        let stood = feet.as_ref().map(|feet| feet.stand(&compared));
        let has_ground = stood.as_ref().is_some_and(|stood| stood.has_raised_ground);
        let resting = trunk.and_then(|trunk| trunk.resting(performers, &compared, has_ground)).unwrap_or_default();
        let feet = feet.as_ref().zip(stood);
        let feet =
            feet.map_or_else(FeetFindings::none, |(feet, stood)| feet.measure(performers, &compared, stood, &resting));
        let findings = vec![
            (MetricName::FootSlide, feet.slide),
            (MetricName::FloorPenetration, feet.penetration),
            (MetricName::FloorFloat, feet.float),
            (MetricName::ContactDisagreement, feet.disagreement),
            (MetricName::PelvisPath, travel.path(&compared, &resting)),
            (MetricName::Facing, travel.facing(&compared)),
            (MetricName::SpineKink, Spine::kink(spine.as_ref(), &compared)),
            (MetricName::KneePop, knees.measure(&compared)),
            (MetricName::PelvisSway, travel.sway(&compared, &resting)),
            (MetricName::TrunkFloat, resting.float(&compared)),
        ];
        Self {
            compared,
            findings,
            contacts: feet.contacts,
            contacts_left_out: feet.contacts_left_out,
            sole_heights: feet.heights,
            slide_speeds: feet.slide_speeds,
            flat: feet.flat,
            resting,
            has_raised_ground: has_ground,
            floor_speeds: floor_speeds(&feet.floors, performers.source.clip.tempo()),
        }
    }
}

/// What is looked at in runs of frames.
struct OfSpreadFrames {
    compared: Compared,
    findings: Vec<(MetricName, Finding)>,
    limbs: LimbSeries,
}

impl OfSpreadFrames {
    /// The frames of the clip in which feet of the source stand with all of their points, and those in which its trunk is on the floor.
    fn measure(
        performers: &Both<Performer<'_>>,
        sizes: &Both<Size>,
        mapping: &Mapping,
        standing: (&BTreeMap<String, Vec<bool>>, &Resting),
        frames: Frames,
    ) -> Self {
        let rigs = performers.map(|performer| performer.rig);
        let mut wanted = Wanted::default();
        let limbs = Limbs::find(&rigs, &sizes.target, mapping, &mut wanted);
        let bends = Bends::find(&rigs, &mut wanted);
        let smoothness = Smoothness::find(&rigs, sizes, &mut wanted);
        let hands = Hands::find(&rigs, sizes, &mut wanted);
        let elbows = Pops::elbows(&rigs, &mut wanted);
        let collisions = Collisions::find(&rigs, sizes.map(|size| size.leg), &mut wanted);
        let (head, chest) = (Front::head(&rigs, &mut wanted), Front::chest(&rigs, &mut wanted));
        let compared = compare(performers, &wanted, frames);

        let looked_at = &compared.frames.indices;
        let limbs = limbs.series(&compared, standing, (hands.as_ref(), collisions.as_ref()));
        let (flips, limits) = bends.measure(&compared);
        let worst_limb = Reading::of_worst_part(&limbs.directions, looked_at, 0.95).ok_or(NO_LIMBS);
        let findings = vec![
            (MetricName::LimbDirection, worst_limb),
            (MetricName::LimbTwist, percentile_finding(&limbs.twists, looked_at, NO_LIMBS)),
            (MetricName::EndOrientation, percentile_finding(&limbs.wholes, looked_at, NO_LIMBS)),
            (MetricName::JerkRatio, smoothness.jerk_ratio(&compared)),
            (MetricName::BendFlips, flips),
            (MetricName::JointLimits, limits),
            (MetricName::HandGap, hand_gap(hands.as_ref(), &compared)),
            (MetricName::ElbowPop, elbows.measure(&compared)),
            (MetricName::SelfPenetration, Collisions::measure(collisions.as_ref(), &compared)),
            (MetricName::HeadFacing, Front::measure(head.as_ref(), &compared)),
            (MetricName::ChestFacing, Front::measure(chest.as_ref(), &compared)),
        ];
        Self { compared, findings, limbs }
    }
}

fn curves(every: &OfEveryFrame, spread: &OfSpreadFrames, is_full: bool) -> BTreeMap<String, Curves> {
    let of_limbs = |series: &[Series]| Curves::new("degrees", series, &spread.compared, Keep::Largest, is_full);
    let mut curves = BTreeMap::from([
        ("limb_direction".to_owned(), of_limbs(&spread.limbs.directions)),
        ("sole_height".to_owned(), Curves::new("cm", &every.sole_heights, &every.compared, Keep::Smallest, is_full)),
        ("slide_speed".to_owned(), Curves::new("cm/s", &every.slide_speeds, &every.compared, Keep::Largest, is_full)),
    ]);
    if is_full {
        curves.insert("limb_twist".to_owned(), of_limbs(&spread.limbs.twists));
        curves.insert("end_orientation".to_owned(), of_limbs(&spread.limbs.wholes));
    }
    curves
}

fn reach_residual(reaches: &[LimbReach], target: &Rig<'_>, size: &Size) -> Finding {
    let mut reading = Reading::default();
    for LimbReach { limb, residual_max_meters, worst_frame, .. } in reaches {
        let end = limb.replace("_leg", "_foot").replace("_arm", "_hand");
        let Some(&joint) = target.role(&end).last() else { continue };
        let centimeters = residual_max_meters / size.leg.unwrap_or(1.0) * 100.0;
        reading.value = reading.value.max(centimeters);
        reading.parts.insert(limb.clone(), centimeters);
        reading.worst.push((*worst_frame, joint, limb.clone(), centimeters));
    }
    if reading.parts.is_empty() { Err(NO_GOALS) } else { Ok(reading) }
}
