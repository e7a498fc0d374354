//! What the sizes of two figures say about the pelvis.

use glam::DVec3;

use crate::model::Reporter;

use crate::{
    retarget::{
        mapping::CrotchRule,
        ops::{PelvisOp, PelvisScale, PelvisScaleRule},
    },
    rig::rig::Rig,
};

/// ikrigretarget's guard: a source height below this counts as one.
pub(in crate::retarget) const MIN_HEIGHT: f64 = 1e-4;
/// A crotch is at least this share of the pelvis' height above the floor.
const MIN_CROTCH: f64 = 0.1;

/// What scale rules compare.
pub(in crate::retarget) struct Sizes<'a> {
    pub(in crate::retarget) source: &'a Rig<'a>,
    pub(in crate::retarget) target: &'a Rig<'a>,
    /// Below the source's and the target's rest pose.
    pub(in crate::retarget) floors: [f64; 2],
    /// Target units per source unit.
    pub(in crate::retarget) unit: f64,
}

impl Sizes<'_> {
    /// Factors along left, up and front.
    pub(in crate::retarget) fn scale(&self, scale: PelvisScale, height: f64, reporter: &mut Reporter) -> DVec3 {
        let rule = match scale {
            PelvisScale::Value(value) => return DVec3::splat(value),
            PelvisScale::Rule(rule) => rule,
        };
        let legs = |reporter: &mut Reporter| {
            let ratio = leg_length(self.source)
                .zip(leg_length(self.target))
                .map(|(source, target)| target / (source * self.unit));
            if ratio.is_none() {
                reporter.warn(
                    "legs_not_found",
                    "ops",
                    "the pelvis is to be scaled by the legs, but not both rigs have any; the height of the pelvis is taken",
                    "name thighs, shins and feet in source.roles and target.roles",
                );
            }
            ratio.unwrap_or(height)
        };
        match rule {
            PelvisScaleRule::None => DVec3::ONE,
            PelvisScaleRule::Height => DVec3::splat(height),
            PelvisScaleRule::Legs => DVec3::splat(legs(reporter)),
            PelvisScaleRule::Stature => {
                let (source, target) = (stature(self.source, self.floors[0]), stature(self.target, self.floors[1]));
                DVec3::splat(if source > MIN_HEIGHT { target / (source * self.unit) } else { height })
            }
            PelvisScaleRule::Limbs => {
                let legs = legs(reporter);
                DVec3::new(legs, height, legs)
            }
        }
    }

    /// What the crotch's height does, for figures whose pelvis is at these heights at rest; `source_floor` is that of the clip in plan
    /// units, `scale` what the pelvis scale makes of heights.
    pub(in crate::retarget) fn crotch(
        &self,
        op: &PelvisOp,
        heights: [f64; 2],
        source_floor: f64,
        scale: f64,
        up: DVec3,
    ) -> CrotchRule {
        let below = |given: Option<f64>, side: &Rig<'_>, height: f64| {
            given.map_or_else(|| crotch_below(side, height), |meters| meters / side.unit_meters)
        };
        let [source_height, target_height] = heights;
        let source_below = below(op.source_crotch, self.source, source_height) * self.unit;
        let target_below = below(op.target_crotch, self.target, target_height);
        let source_height = source_height * self.unit;
        let source_crotch = (source_height - source_below).max(MIN_CROTCH * source_height).max(f64::MIN_POSITIVE);
        let target_crotch = (target_height - target_below).max(MIN_CROTCH * target_height);
        CrotchRule {
            up,
            source_floor,
            source_below,
            target_below,
            ratio: target_crotch / source_crotch,
            scale,
            weight: op.floor_constraint,
            faded_at: (op.floor_falloff > 0.0).then_some(op.floor_falloff * source_crotch),
        }
    }
}

/// How far a crotch is below the pelvis joint, in the scene's unit: it lies half as far below the hips as those are apart.
fn crotch_below(side: &Rig<'_>, height: f64) -> f64 {
    let place = |role: &str| side.role(role).first().map(|&joint| side.rest.transforms()[joint].translation);
    let (Some(pelvis), Some(left), Some(right)) = (place("pelvis"), place("left_thigh"), place("right_thigh")) else {
        return 0.1 * height;
    };
    let hips = (left + right).dot(side.up()) / 2.0;
    pelvis.dot(side.up()) - (hips - left.distance(right) / 2.0)
}

/// Mean length of the legs from hip to ankle, in the scene's unit.
fn leg_length(side: &Rig<'_>) -> Option<f64> {
    let place = |role: String| Some(side.rest.transforms()[*side.role(&role).first()?].translation);
    let leg = |name: &str| {
        let [hip, knee, ankle] = ["thigh", "shin", "foot"].map(|part| place(format!("{name}_{part}")));
        Some(hip?.distance(knee?) + knee?.distance(ankle?))
    };
    let legs: Vec<f64> = ["left", "right"].into_iter().filter_map(leg).filter(|length| *length > 0.0).collect();
    (!legs.is_empty()).then(|| legs.iter().sum::<f64>() / legs.len() as f64)
}

/// Height of the highest joint of a body above a floor, in the scene's unit.
fn stature(side: &Rig<'_>, floor: f64) -> f64 {
    let joints = side.role("pelvis").first().into_iter().flat_map(|&pelvis| {
        (pelvis..side.skeleton().len()).filter(move |&joint| side.skeleton().is_ancestor_or_self(pelvis, joint))
    });
    joints.map(|joint| side.rest_height(joint)).fold(floor, f64::max) - floor
}
