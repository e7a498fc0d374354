//! What is measured, how much of it is told, and from which value on it is called bad.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How much is measured: a word, or the word together with thresholds of your own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected \"none\", \"summary\", \"full\" or {\"detail\": …, \"thresholds\": …}")]
pub enum ReportChoice {
    /// A word.
    Detail(ReportDetail),
    /// With thresholds.
    Spec(ReportSpec),
}

/// How much is measured, and from which value on it is called bad.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ReportSpec {
    /// How much is told.
    pub detail: ReportDetail,
    /// Thresholds of your own, by the metric's name, such as `{"foot_slide": {"warn_above": 1, "fail_above": 4}}`. Metrics that
    /// are not named keep theirs.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub thresholds: BTreeMap<MetricName, Threshold>,
}

/// From which value on a metric is called bad, in the metric's own unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Threshold {
    /// More than this is a warning; 0 or more.
    #[schemars(range(min = 0.0))]
    pub warn_above: f64,
    /// More than this is a failure; at least `warn_above`.
    #[schemars(range(min = 0.0))]
    pub fail_above: f64,
}

/// How much is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReportDetail {
    /// Timings, counts and warnings only.
    None,
    /// Every metric with its verdict, its worst frames and a coarse curve. Long clips are looked at in parts.
    #[default]
    Summary,
    /// The same from all frames, with one value per frame.
    Full,
}

impl Default for ReportChoice {
    fn default() -> Self {
        Self::Detail(ReportDetail::default())
    }
}

impl ReportChoice {
    /// How much is told.
    #[must_use]
    pub const fn detail(&self) -> ReportDetail {
        match self {
            Self::Detail(detail) => *detail,
            Self::Spec(spec) => spec.detail,
        }
    }

    /// The same thresholds with another detail.
    #[must_use]
    pub fn with_detail(self, detail: ReportDetail) -> Self {
        match self {
            Self::Detail(_) => Self::Detail(detail),
            Self::Spec(spec) => Self::Spec(ReportSpec { detail, ..spec }),
        }
    }

    /// From which value on a metric is called bad: what the user says, else what the metric has of its own.
    #[must_use]
    pub fn threshold(&self, metric: MetricName) -> Threshold {
        let own = match self {
            Self::Detail(_) => None,
            Self::Spec(spec) => spec.thresholds.get(&metric).copied(),
        };
        own.unwrap_or(metric.info().threshold)
    }
}

/// What is measured of a result. More is worse for all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MetricName {
    /// How far a foot travels over the floor while the source's foot stands, per contact, at 1 m leg length; 95th
    /// percentile over contacts.
    FootSlide,
    /// How deep the lowest point of a sole is below the floor, at 1 m leg length; 99th percentile over frames.
    FloorPenetration,
    /// How far a sole is off the floor while the source's foot stands, at 1 m leg length; 95th percentile over frames
    /// in contact.
    FloorFloat,
    /// 1 − F1 of the target's own foot contacts against the source's, frame by frame.
    ContactDisagreement,
    /// Angle between the directions of a source limb and a target limb; 95th percentile over frames, of the worst limb.
    LimbDirection,
    /// Difference of the turn about a limb's own axis since the rest pose, hands and feet included; 95th percentile
    /// over frames, of the worst limb.
    LimbTwist,
    /// Difference of the turn of pelvis, head, hands and feet since the rest pose; 95th percentile over frames
    /// and joints.
    EndOrientation,
    /// Mean jerk over mean speed, target over source: of hands and feet as seen from the start of their limbs, the head from the
    /// pelvis, and the pelvis in the world; 1 is as smooth as the source.
    JerkRatio,
    /// Knees and elbows that snap over or bend backwards where the source's do not.
    BendFlips,
    /// Local rotations that change by more than 20° from one frame to the next where the source's do not change half
    /// as much.
    RotationJumps,
    /// Neighboring keys of a rotation that lie on opposite hemispheres, so that players go the long way round.
    QuaternionContinuity,
    /// How far elbows, knees, wrists or the neck are bent beyond what a body can do; largest.
    JointLimits,
    /// Largest change of a driven bone's length against the target's rest, as a share of it.
    BoneLengthDrift,
    /// Distance between the paths of the pelvises when the source's is scaled to fit best, root mean square, in
    /// percent of the leg length.
    PelvisPath,
    /// Difference of the headings of the hips; 95th percentile over frames.
    Facing,
    /// How far the gap between hands, or of a hand to head or shoulder, differs from the source's while it is small
    /// there, in percent of the body's length; 95th percentile.
    HandGap,
    /// How far a limb's end is left from where inverse kinematics was to bring it, at 1 m leg length; largest.
    ReachResidual,
    /// The share of the body that is left at rest: limbs of the target that the source moves or does not have, and limbs that move on
    /// the source and drive nothing.
    UndrivenBody,
    /// How far one joint of spine, neck or head is bent beyond the sum of all bends of the source's; largest.
    SpineKink,
    /// Change of a knee's speed from one frame to the next beyond the source's within two frames; largest.
    KneePop,
    /// The same of elbows.
    ElbowPop,
    /// How far the pelvis moves to and fro over the floor beside the source's path when that is scaled to fit best, at 1 m leg length;
    /// 98th percentile over frames.
    PelvisSway,
    /// How far the lowest point of hips, waist and chest is off the floor while the source's is on it, beyond the source's, at 1 m leg length;
    /// 95th percentile over frames.
    TrunkFloat,
    /// How much deeper forearms and hands are in trunk and head than the source's, by capsules about the bones, at 1 m leg length; 98th
    /// percentile over frames, of the worst part.
    SelfPenetration,
    /// Angle between where the heads face; 95th percentile over frames.
    HeadFacing,
    /// Angle between where the chests face; 95th percentile over frames.
    ChestFacing,
    /// Angle between where a bone points in the rest pose and in the rest file that the pose was taken from; largest.
    RestResidual,
    /// How far a joint jumps where a clip that is played over and over begins again, beyond what the source's does, at 1 m leg length;
    /// largest.
    LoopSeam,
    /// How much deeper hands, arms, head, knees and trunk are in the floor than the source's, at 1 m leg length; 98th percentile over
    /// frames, of the worst part.
    BodyPenetration,
    /// How much farther a hand is off the floor than the source's that lies on it, at 1 m leg length; 95th percentile over those frames.
    HandFloat,
}

/// What is known of a metric before anything is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetricInfo {
    /// The metric.
    pub metric: MetricName,
    /// Its name on the wire.
    pub name: &'static str,
    /// Unit of its values.
    pub unit: &'static str,
    /// Where it is called bad. Those of feet, jerk and flips are the release thresholds of the field; the others are set where
    /// good results of real pairs end.
    pub threshold: Threshold,
    /// A value of any frame that is a warning even where the source has it too, because it is seen.
    pub absolute_warn_above: Option<f64>,
    /// Whether what the source itself has is forgiven.
    pub forgives_source: bool,
    /// How much it counts in the score.
    pub weight: f64,
    /// What it says, in one line.
    pub about: &'static str,
}

impl MetricName {
    /// All of them, in the order of a report.
    #[must_use]
    pub fn all() -> impl ExactSizeIterator<Item = Self> {
        METRICS.iter().map(|info| info.metric)
    }

    /// What is known of it.
    #[must_use]
    pub const fn info(self) -> &'static MetricInfo {
        &METRICS[self as usize]
    }

    /// Its name on the wire.
    #[must_use]
    pub const fn name(self) -> &'static str {
        self.info().name
    }
}

/// The one place of all thresholds.
const METRICS: [MetricInfo; 30] = [
    MetricInfo {
        metric: MetricName::FootSlide,
        name: "foot_slide",
        unit: "cm",
        threshold: Threshold { warn_above: 0.5, fail_above: 2.0 },
        absolute_warn_above: None,
        forgives_source: true,
        weight: 3.0,
        about: "how far a foot travels over the floor while the source's foot stands, per contact, at 1 m leg length: its longest way within a second, or from begin to end where that is more; 95th percentile over contacts",
    },
    MetricInfo {
        metric: MetricName::FloorPenetration,
        name: "floor_penetration",
        unit: "cm",
        threshold: Threshold { warn_above: 0.5, fail_above: 3.0 },
        absolute_warn_above: Some(2.0),
        forgives_source: true,
        weight: 2.0,
        about: "how deep the lowest vertex of a foot is below the floor (without a mesh: the lowest point of a sole), at 1 m leg length; 99th \
                percentile over frames; `absolute_value` is the deepest of any frame, and warns above 2 whatever the source has",
    },
    MetricInfo {
        metric: MetricName::FloorFloat,
        name: "floor_float",
        unit: "cm",
        threshold: Threshold { warn_above: 1.0, fail_above: 4.0 },
        absolute_warn_above: None,
        forgives_source: true,
        weight: 2.0,
        about: "how far the lowest vertex of a foot (without a mesh: a point of its sole) is off the floor while the source's foot stands, at 1 m leg length; 95th percentile over frames in contact",
    },
    MetricInfo {
        metric: MetricName::ContactDisagreement,
        name: "contact_disagreement",
        unit: "share",
        threshold: Threshold { warn_above: 0.1, fail_above: 0.4 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 1.0,
        about: "1 − F1 of the target's own foot contacts against the source's, frame by frame; what begins or ends within 0.05 s of the \
                source's, or a frame, agrees, and what is apart is a share of at least a second of contact",
    },
    MetricInfo {
        metric: MetricName::LimbDirection,
        name: "limb_direction",
        unit: "degrees",
        threshold: Threshold { warn_above: 8.0, fail_above: 20.0 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 2.0,
        about: "angle between the directions of a source limb and a target limb; 95th percentile over frames, of the worst limb",
    },
    MetricInfo {
        metric: MetricName::LimbTwist,
        name: "limb_twist",
        unit: "degrees",
        threshold: Threshold { warn_above: 12.0, fail_above: 30.0 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 1.0,
        about: "difference of the turn about a limb's own axis since the rest pose, hands and feet included; of a foot that stands with heel and ball no more than its tilt on the floor; 95th percentile over frames and limbs",
    },
    MetricInfo {
        metric: MetricName::EndOrientation,
        name: "end_orientation",
        unit: "degrees",
        threshold: Threshold { warn_above: 12.0, fail_above: 30.0 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 1.0,
        about: "difference of the turn of pelvis, head, hands and feet since the rest pose; of a foot that stands with heel and ball no more than its \
                tilt on the floor and the difference of headings; of one that would be more than 2 cm in the floor at 1 m leg length if it were turned as \
                the source's, what is beyond keeping it out; of one of which the source says nothing only its tilt while it stands; 95th percentile over \
                frames and joints",
    },
    MetricInfo {
        metric: MetricName::JerkRatio,
        name: "jerk_ratio",
        unit: "ratio",
        threshold: Threshold { warn_above: 1.15, fail_above: 1.5 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 2.0,
        about: "mean jerk over mean speed, target over source: of hands and feet as seen from the start of their limbs, the head \
                from the pelvis, and the pelvis in the world; 1 is as smooth as the source",
    },
    MetricInfo {
        metric: MetricName::BendFlips,
        name: "bend_flips",
        unit: "count",
        threshold: Threshold { warn_above: 0.0, fail_above: 2.0 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 3.0,
        about: "knees and elbows that snap over or bend backwards where the source's do not",
    },
    MetricInfo {
        metric: MetricName::RotationJumps,
        name: "rotation_jumps",
        unit: "count",
        threshold: Threshold { warn_above: 0.0, fail_above: 5.0 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 2.0,
        about: "local rotations that change by more than 20° from one frame to the next (of frames longer than 1/24 s by as much more) where \
                the source's do not change half as much; of a target with a skin, of joints that are driven or move the skin",
    },
    MetricInfo {
        metric: MetricName::QuaternionContinuity,
        name: "quaternion_continuity",
        unit: "count",
        threshold: Threshold { warn_above: 0.0, fail_above: 0.0 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 1.0,
        about: "neighboring keys of a rotation that lie on opposite hemispheres, so that players go the long way round",
    },
    MetricInfo {
        metric: MetricName::JointLimits,
        name: "joint_limits",
        unit: "degrees",
        threshold: Threshold { warn_above: 5.0, fail_above: 20.0 },
        absolute_warn_above: None,
        forgives_source: true,
        weight: 1.0,
        about: "how far elbows, knees, wrists or the neck are bent beyond what a body can do; largest",
    },
    MetricInfo {
        metric: MetricName::BoneLengthDrift,
        name: "bone_length_drift",
        unit: "share",
        threshold: Threshold { warn_above: 0.001, fail_above: 0.05 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 2.0,
        about: "largest change of a driven bone's length against the target's rest, as a share of it",
    },
    MetricInfo {
        metric: MetricName::PelvisPath,
        name: "pelvis_path",
        unit: "percent",
        threshold: Threshold { warn_above: 2.0, fail_above: 10.0 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 1.0,
        about: "distance between the paths of the pelvises when the source's is scaled to fit best, root mean square, in percent of the leg length",
    },
    MetricInfo {
        metric: MetricName::Facing,
        name: "facing",
        unit: "degrees",
        threshold: Threshold { warn_above: 5.0, fail_above: 20.0 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 1.0,
        about: "difference of the headings of the hips; 95th percentile over frames",
    },
    MetricInfo {
        metric: MetricName::HandGap,
        name: "hand_gap",
        unit: "percent",
        threshold: Threshold { warn_above: 3.0, fail_above: 8.0 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 1.0,
        about: "how far the gap between hands, or of a hand to head or shoulder, is from the source's while that is small and steady, in percent of the body's length; it may grow as the body does, or as what touches is thicker, or anything between; 95th percentile",
    },
    MetricInfo {
        metric: MetricName::ReachResidual,
        name: "reach_residual",
        unit: "cm",
        threshold: Threshold { warn_above: 0.5, fail_above: 3.0 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 2.0,
        about: "how far a limb's end is left from where inverse kinematics was to bring it, at 1 m leg length; largest",
    },
    MetricInfo {
        metric: MetricName::UndrivenBody,
        name: "undriven_body",
        unit: "share",
        threshold: Threshold { warn_above: 0.0, fail_above: 0.1 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 3.0,
        about: "share of the body that is left at rest: limbs of the target that the source moves or does not have, and limbs that move on the source and drive nothing",
    },
    MetricInfo {
        metric: MetricName::SpineKink,
        name: "spine_kink",
        unit: "degrees",
        threshold: Threshold { warn_above: 12.0, fail_above: 20.0 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 2.0,
        about: "how far one joint of spine, neck or head is bent beyond the sum of all bends of the source's; largest",
    },
    MetricInfo {
        metric: MetricName::KneePop,
        name: "knee_pop",
        unit: "degrees/frame²",
        threshold: Threshold { warn_above: 5.0, fail_above: 12.0 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 2.0,
        about: "change of a knee's speed from one frame to the next beyond the source's within two frames; largest. Frames shorter than \
                1/30 s are taken together, and those longer than 1/24 s count as if they were that long",
    },
    MetricInfo {
        metric: MetricName::ElbowPop,
        name: "elbow_pop",
        unit: "degrees/frame²",
        threshold: Threshold { warn_above: 8.0, fail_above: 20.0 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 1.0,
        about: "the same of elbows",
    },
    MetricInfo {
        metric: MetricName::PelvisSway,
        name: "pelvis_sway",
        unit: "cm",
        threshold: Threshold { warn_above: 3.0, fail_above: 8.0 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 1.0,
        about: "how far the pelvis moves to and fro over the floor beside the source's path when that is scaled to fit best, at 1 m leg length; 98th percentile over frames",
    },
    MetricInfo {
        metric: MetricName::TrunkFloat,
        name: "trunk_float",
        unit: "cm",
        threshold: Threshold { warn_above: 4.0, fail_above: 10.0 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 1.0,
        about: "how far the lowest point of hips, waist and chest is off the floor while the source's body sits or lies on it, above it or deeper in it than the source's, at 1 m leg length; 95th percentile over frames",
    },
    MetricInfo {
        metric: MetricName::SelfPenetration,
        name: "self_penetration",
        unit: "cm",
        threshold: Threshold { warn_above: 5.0, fail_above: 15.0 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 1.0,
        about: "how much deeper forearms and hands are in trunk, head and thighs than the source's, by capsules about the bones, as thick as the mesh, at 1 m leg length; 98th percentile over frames, of the worst part",
    },
    MetricInfo {
        metric: MetricName::HeadFacing,
        name: "head_facing",
        unit: "degrees",
        threshold: Threshold { warn_above: 10.0, fail_above: 30.0 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 1.0,
        about: "angle between where the heads face; 95th percentile over frames",
    },
    MetricInfo {
        metric: MetricName::ChestFacing,
        name: "chest_facing",
        unit: "degrees",
        threshold: Threshold { warn_above: 10.0, fail_above: 30.0 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 1.0,
        about: "angle between where the chests face; 95th percentile over frames",
    },
    MetricInfo {
        metric: MetricName::RestResidual,
        name: "rest_residual",
        unit: "degrees",
        threshold: Threshold { warn_above: 5.0, fail_above: 20.0 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 1.0,
        about: "angle between where a bone points in the rest pose and in the rest file that the pose was taken from; largest",
    },
    MetricInfo {
        metric: MetricName::LoopSeam,
        name: "loop_seam",
        unit: "cm",
        threshold: Threshold { warn_above: 1.0, fail_above: 4.0 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 1.0,
        about: "how far a joint jumps where a clip that is played over and over begins again, beyond what the source's does, at 1 m leg length; largest",
    },
    MetricInfo {
        metric: MetricName::BodyPenetration,
        name: "body_penetration",
        unit: "cm",
        threshold: Threshold { warn_above: 2.0, fail_above: 8.0 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 1.0,
        about: "how much deeper the lowest vertex of hands, arms, head, knees or trunk (without a mesh: their joints) is in the floor than the source's, at 1 m leg length; 98th percentile over frames, of the worst part",
    },
    MetricInfo {
        metric: MetricName::HandFloat,
        name: "hand_float",
        unit: "cm",
        threshold: Threshold { warn_above: 5.0, fail_above: 12.0 },
        absolute_warn_above: None,
        forgives_source: false,
        weight: 1.0,
        about: "how far the lowest vertex of a hand is off the floor while the source's lies on it, beyond the source's, at 1 m leg length; 95th percentile over those frames",
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_in_order_and_sane() {
        for (index, info) in METRICS.iter().enumerate() {
            assert_eq!(info.metric as usize, index, "{} is at its place", info.name);
            assert_eq!(serde_json::to_value(info.metric).expect("a word"), info.name, "one name everywhere");
            assert!(info.threshold.warn_above <= info.threshold.fail_above, "{}", info.name);
        }
    }

    #[test]
    fn own_thresholds_win_and_others_stay() {
        let text = r#"{"detail": "full", "thresholds": {"foot_slide": {"warn_above": 1, "fail_above": 4}}}"#;
        let choice: ReportChoice = serde_json::from_str(text).expect("a choice");
        assert_eq!(choice.detail(), ReportDetail::Full, "the word");
        assert_eq!(choice.threshold(MetricName::FootSlide), Threshold { warn_above: 1.0, fail_above: 4.0 }, "own");
        assert_eq!(choice.threshold(MetricName::JerkRatio), MetricName::JerkRatio.info().threshold, "the metric's");
    }
}
