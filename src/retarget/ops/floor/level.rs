//! The level of the floor under each contact.
//!
//! Captures are off by the thickness of a shoe, floors are not level, and what is known of the source's soles may be guessed. So what
//! the source's sole is above its floor while it stands counts as standing, contact by contact, as long as that is a few
//! centimeters; what is more is a step.

use super::{CARRIES_METERS, Clearance, FloorFoot, FloorStage};
use crate::retarget::{
    stages::contact_points::{ContactPoints, Part},
    stages::{
        temporal::{median, runs, smoothed},
        work::Work,
    },
};

/// The largest level, for a leg of 1 m.
const MAX_METERS: f64 = 0.04;
/// Feet that touch in less than one of so many frames in which one is low touch too seldom to say when they stand.
const SELDOM: usize = 4;
/// One of so many frames in which nothing touches is lower than the floor.
const LOW_SHARE: usize = 4;
/// Standard deviation of the smoothing from one contact to the next.
const SMOOTHING_SECONDS: f64 = 0.1;

impl FloorStage {
    /// The largest level that is taken off, in units of the source.
    pub(in crate::retarget) fn most_level(&self) -> f64 {
        if self.op.adaptive { MAX_METERS * self.source_leg } else { 0.0 }
    }

    /// The contacts, where they say when feet stand. Of feet that are low far more often than they touch, as in walks on the spot in
    /// which a toe rests for a moment, they do not.
    pub(in crate::retarget) fn standing<'w>(
        &self,
        rows: &[Clearance],
        work: &'w Work<'_>,
    ) -> Option<&'w ContactPoints> {
        let contacts = Some(&work.contacts).filter(|contacts| contacts.is_anything_touching())?;
        let most = self.lowest_level(rows) + CARRIES_METERS * self.source_leg;
        let (mut low, mut touching) = (0_usize, 0_usize);
        for (frame, row) in rows.chunks_exact(self.feet.len().max(1)).enumerate() {
            low += usize::from(row.iter().any(|foot| foot.source < most));
            touching += usize::from(self.feet.iter().any(|foot| contacts.touches(foot.limb, frame)));
        }
        (touching * SELDOM >= low).then_some(contacts)
    }

    /// The level under every foot, frame by frame, in units of the source.
    pub(in crate::retarget) fn levels(
        &self,
        rows: &[Clearance],
        standing: Option<&ContactPoints>,
        work: &Work<'_>,
    ) -> Vec<Vec<f64>> {
        let known = |(index, foot): (usize, &FloorFoot)| match standing {
            Some(_) => self.known(index, foot, rows, work),
            None => Vec::new(),
        };
        let of_feet: Vec<Vec<Known>> = self.feet.iter().enumerate().map(known).collect();
        let mut levels: Vec<f64> = of_feet.iter().flatten().map(|known| known.level).collect();
        let all = median(&mut levels);
        let all = all.unwrap_or_else(|| self.lowest_level(rows));
        of_feet.iter().map(|known| over_time(known, all, work.times)).collect()
    }

    /// The level in a clip in which nothing touches: a low height of the lower foot.
    fn lowest_level(&self, rows: &[Clearance]) -> f64 {
        let lower = |row: &[Clearance]| row.iter().map(|foot| foot.source).fold(f64::INFINITY, f64::min);
        let mut heights: Vec<f64> = rows.chunks_exact(self.feet.len().max(1)).map(lower).collect();
        heights.sort_by(f64::total_cmp);
        let most = self.most_level();
        heights.get(heights.len() / LOW_SHARE).map_or(0.0, |height| height.clamp(-most, most))
    }

    fn known(&self, index: usize, foot: &FloorFoot, rows: &[Clearance], work: &Work<'_>) -> Vec<Known> {
        let (width, most) = (self.feet.len(), self.most_level());
        let touches: Vec<bool> = (0..work.frame_count()).map(|frame| work.contacts.touches(foot.limb, frame)).collect();
        // Room for the frames of a contact, so that a long clip allocates no more than a short one.
        let mut clearances = Vec::with_capacity(work.frame_count());
        let level = |(first, last): (usize, usize)| {
            let clearance = |frame: usize| rows[frame * width + index].source;
            clearances.clear();
            clearances.extend((first..=last).filter(|frame| is_flat(foot.limb, *frame, work)).map(clearance));
            if clearances.is_empty() {
                clearances.extend((first..=last).map(clearance));
            }
            Known { first, last, level: median(&mut clearances).unwrap_or(0.0).clamp(-most, most) }
        };
        runs(&touches).into_iter().map(level).collect()
    }
}

/// The level of one contact.
struct Known {
    first: usize,
    last: usize,
    level: f64,
}

/// Whether a foot of the source stands on heel and ball.
pub(in crate::retarget) fn is_flat(limb: usize, frame: usize, work: &Work<'_>) -> bool {
    let touches = |part: Part| work.contacts.find(limb, part).map(|point| point.touches[frame]);
    touches(Part::End) == Some(true) && touches(Part::Ball) != Some(false)
}

/// Straight from one contact to the next, then smooth.
fn over_time(known: &[Known], otherwise: f64, times: &[f64]) -> Vec<f64> {
    let (Some(first), Some(last)) = (known.first(), known.last()) else { return vec![otherwise; times.len()] };
    let mut next = 0;
    let at = |frame: usize| {
        while next < known.len() && known[next].last < frame {
            next += 1;
        }
        let after = known.get(next).unwrap_or(last);
        let before = next.checked_sub(1).map_or(first, |before| &known[before]);
        let span = times[after.first] - times[before.last];
        let share = if span > 0.0 { ((times[frame] - times[before.last]) / span).clamp(0.0, 1.0) } else { 1.0 };
        before.level + (after.level - before.level) * share
    };
    let levels: Vec<f64> = (0..times.len()).map(at).collect();
    smoothed(&levels, times, SMOOTHING_SECONDS)
}
