//! Where the body goes, and where it faces.

use glam::{DQuat, DVec3};

use super::{
    body::{Size, first_joint},
    limbs::percentile_finding,
    metric::{Finding, Reading, Series},
    motion::{Both, Compared, Wanted},
    trunk::Resting,
};
use crate::rig::{Rig, anatomy::rides};

/// Sway is faster than this.
const SWAY_SECONDS: f64 = 1.0;
const NO_PELVIS: &str = "no pelvis was recognized on both sides";
const NO_HIPS: &str = "no thighs were recognized on both sides";
const STANDS: &str = "the source's pelvis does not move";

/// What is looked at.
pub(super) struct Travel {
    pelvis: Option<Part>,
    hips: Option<Hips>,
    leg: Option<f64>,
}

#[derive(Clone, Copy)]
struct Part {
    joint: usize,
    slot: usize,
}

/// Both thighs, and the turn of what carries them.
#[derive(Clone, Copy)]
struct Hips {
    joint: usize,
    thighs: [usize; 2],
    carrier: Option<usize>,
}

/// What turns a thigh about the body: what it hangs from, or the pelvis where the file hangs it from the armature or the spine.
fn carrier_of(rig: &Rig<'_>, thigh: usize) -> Option<usize> {
    let ride = rides(rig).into_iter().find(|ride| ride.joint == thigh);
    ride.map(|ride| ride.on).or_else(|| rig.skeleton().parent(thigh))
}

impl Travel {
    pub(super) fn find(rigs: &Both<&Rig<'_>>, sizes: &Both<Size>, wanted: &mut Wanted) -> Self {
        let mut part = |role: &str| {
            let joint = first_joint(rigs, role)?;
            Some(Part { joint: joint.target, slot: wanted.joint(joint) })
        };
        let pelvis = part("pelvis");
        let thighs = part("left_thigh").zip(part("right_thigh"));
        let carrier = first_joint(rigs, "left_thigh").and_then(|thigh| {
            let source = carrier_of(rigs.source, thigh.source)?;
            Some(wanted.turn(Both { source, target: carrier_of(rigs.target, thigh.target)? }))
        });
        let hips = thighs.map(|(left, right)| Hips { joint: left.joint, thighs: [left.slot, right.slot], carrier });
        Self { pelvis, hips, leg: sizes.target.leg }
    }

    /// Where the target's pelvis is beside the source's path when that is scaled to fit best, level and upright ways apart; meters. Where a
    /// trunk is on the floor, how thick it is says how high the pelvis is, and not the path.
    fn beside(&self, compared: &Compared, resting: &Resting) -> Result<Vec<DVec3>, &'static str> {
        let pelvis = self.pelvis.ok_or(NO_PELVIS)?;
        let weight = |index: &usize| DVec3::new(1.0, if resting.is_near(*index) { 0.0 } else { 1.0 }, 1.0);
        let weights: Vec<DVec3> = compared.frames.indices.iter().map(weight).collect();
        let [source, target] = [false, true].map(|is_target| {
            let side = compared.side(is_target);
            let path: Vec<DVec3> = (0..compared.len()).map(|frame| side.position(frame, pelvis.slot)).collect();
            let weighed = path.iter().zip(&weights).map(|(position, weight)| *position * *weight);
            let middle = weighed.sum::<DVec3>() / weights.iter().sum::<DVec3>().max(DVec3::ONE);
            path.into_iter()
                .zip(&weights)
                .map(|(position, weight)| (position - middle) * *weight)
                .collect::<Vec<DVec3>>()
        });
        let fit = |axes: DVec3| {
            let (mut across, mut along) = (0.0, 0.0);
            for (source, target) in source.iter().zip(&target) {
                across += (*source * axes).dot(*target * axes);
                along += (*source * axes).length_squared();
            }
            if along > 0.0 { across / along } else { 0.0 }
        };
        let (level, upright) = (DVec3::new(1.0, 0.0, 1.0), DVec3::Y);
        let scale = level * fit(level) + upright * fit(upright);
        let moved = source.iter().map(|position| position.length_squared()).sum::<f64>();
        if moved <= 1e-12 * source.len() as f64 {
            return Err(STANDS);
        }
        Ok(source.iter().zip(&target).map(|(source, target)| *target - *source * scale).collect())
    }

    /// How far the target's pelvis is from the source's path when that is scaled to fit best.
    pub(super) fn path(&self, compared: &Compared, resting: &Resting) -> Finding {
        let (pelvis, leg) = (self.pelvis.ok_or(NO_PELVIS)?, self.leg.ok_or(NO_PELVIS)?);
        let off: Vec<f64> =
            self.beside(compared, resting)?.iter().map(|beside| beside.length() / leg * 100.0).collect();
        let mean_square = off.iter().map(|value| value * value).sum::<f64>() / off.len().max(1) as f64;
        let series = Series { part: "pelvis".to_owned(), joint: pelvis.joint, values: off };
        let reading = Reading::of_series(&[series], &compared.frames.indices, 1.0).ok_or(STANDS)?;
        Ok(Reading { value: mean_square.sqrt(), parts: std::collections::BTreeMap::new(), ..reading })
    }

    /// How far the pelvis moves to and fro beside that path: what is left of it over the floor without its mean over about a second.
    pub(super) fn sway(&self, compared: &Compared, resting: &Resting) -> Finding {
        let (pelvis, leg) = (self.pelvis.ok_or(NO_PELVIS)?, self.leg.ok_or(NO_PELVIS)?);
        let beside: Vec<DVec3> =
            self.beside(compared, resting)?.iter().map(|beside| *beside * DVec3::new(1.0, 0.0, 1.0)).collect();
        let mut sums = vec![DVec3::ZERO];
        beside.iter().for_each(|place| sums.push(sums[sums.len() - 1] + *place));
        let times = &compared.performed_seconds;
        let sway = |frame: usize| {
            let reach = (SWAY_SECONDS / 2.0).min(times[frame] - times[0]).min(times[times.len() - 1] - times[frame]);
            let first = times.partition_point(|time| *time < times[frame] - reach - 1e-9);
            let end = times.partition_point(|time| *time <= times[frame] + reach + 1e-9);
            let mean = (sums[end] - sums[first]) / (end - first).max(1) as f64;
            (beside[frame] - mean).length() / leg * 100.0
        };
        let values = (0..beside.len()).map(sway).collect();
        let series = Series { part: "pelvis".to_owned(), joint: pelvis.joint, values };
        Reading::of_series(&[series], &compared.frames.indices, 0.98).ok_or(STANDS)
    }

    /// The difference of where the hips face: the line from thigh to thigh, as what carries them turns it. Legs of figures in comics
    /// that slide to and fro below a body that does not turn do not count.
    pub(super) fn facing(&self, compared: &Compared) -> Finding {
        let hips = self.hips.ok_or(NO_HIPS)?;
        let headings = |is_target: bool| -> Vec<f64> {
            let side = compared.side(is_target);
            let turn = |frame: usize| hips.carrier.map_or(DQuat::IDENTITY, |carrier| side.turn(frame, carrier));
            let across = |frame: usize| side.position(frame, hips.thighs[0]) - side.position(frame, hips.thighs[1]);
            let usual: DVec3 = (0..compared.len()).map(|frame| turn(frame).conjugate() * across(frame)).sum();
            let heading = |frame: usize| {
                let across = if hips.carrier.is_some() { turn(frame) * usual } else { across(frame) };
                let is_level = across.x.hypot(across.z) > 0.2 * across.length();
                if is_level { across.z.atan2(across.x) } else { f64::NAN }
            };
            (0..compared.len()).map(heading).collect()
        };
        let off = |(source, target): (f64, f64)| {
            let turn = target - source;
            turn.sin().atan2(turn.cos()).abs().to_degrees()
        };
        let values = headings(false).into_iter().zip(headings(true)).map(off).collect();
        let series = Series { part: "pelvis".to_owned(), joint: hips.joint, values };
        percentile_finding(&[series], &compared.frames.indices, NO_HIPS)
    }
}
