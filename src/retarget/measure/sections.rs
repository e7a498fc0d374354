//! Measures of a long clip that is measured section by section.

use std::collections::BTreeMap;

use super::{
    ContactMeasure, LimbDirection, Measures, Metric,
    feet::MAX_CONTACTS,
    metric::{MAX_WORST, overall, rounded, verdict_reason},
};

impl Measures {
    /// The same of a section that begins so late in the clip.
    #[must_use]
    pub fn shifted(mut self, frames: usize, seconds: f64) -> Self {
        for worst in self.metrics.values_mut().flat_map(|metric| &mut metric.worst) {
            worst.frame += frames;
            worst.time_seconds += seconds;
        }
        for contact in &mut self.contacts {
            contact.first_frame += frames;
            contact.last_frame += frames;
            contact.start_seconds += seconds;
            contact.end_seconds += seconds;
        }
        self.limb_directions.values_mut().for_each(|limb| limb.worst_frame += frames);
        self
    }

    /// Of two sections of a clip: what is worse of each metric, and with it the verdict. The score and the means are those of all frames.
    /// Values over time are left out.
    #[must_use]
    pub fn with_section(self, other: Self) -> Self {
        let (frames, of_other) = (self.frames_measured as f64, other.frames_measured as f64);
        let mean = |own: f64, others: f64| rounded((own * frames + others * of_other) / (frames + of_other).max(1.0));
        let mut metrics = self.metrics;
        for (name, metric) in other.metrics {
            let worse = match metrics.remove(&name) {
                Some(own) => worse(own, metric),
                None => metric,
            };
            metrics.insert(name, worse);
        }
        let mut limb_directions = self.limb_directions;
        for (limb, direction) in other.limb_directions {
            let joined = match limb_directions.remove(&limb) {
                Some(own) => LimbDirection {
                    mean_degrees: mean(own.mean_degrees, direction.mean_degrees),
                    p95_degrees: own.p95_degrees.max(direction.p95_degrees),
                    max_degrees: own.max_degrees.max(direction.max_degrees),
                    worst_frame: if direction.max_degrees > own.max_degrees { direction } else { own }.worst_frame,
                },
                None => direction,
            };
            limb_directions.insert(limb, joined);
        }
        let (contacts, left_out) = sliding_most(self.contacts.into_iter().chain(other.contacts).collect());
        Self {
            verdict: overall(&metrics),
            verdict_reason: verdict_reason(&metrics),
            coverage: self.coverage.zip(other.coverage).map(|(own, others)| own.min(others)),
            score: mean(self.score, other.score),
            metrics,
            contacts,
            contacts_left_out: self.contacts_left_out + other.contacts_left_out + left_out,
            limb_directions,
            limb_direction_p95_degrees: self.limb_direction_p95_degrees.max(other.limb_direction_p95_degrees),
            bone_length_drift: self.bone_length_drift.max(other.bone_length_drift),
            floor_speed_meters_per_second: self.floor_speed_meters_per_second.or(other.floor_speed_meters_per_second),
            frames_measured: self.frames_measured + other.frames_measured,
            curves: BTreeMap::new(),
            ..self
        }
    }
}

/// The worse of two, with the parts and the places of both.
fn worse(own: Metric, other: Metric) -> Metric {
    let rank = |metric: &Metric| (metric.verdict, metric.value.unwrap_or(f64::NEG_INFINITY));
    let (mut worse, better) = if rank(&own) < rank(&other) { (other, own) } else { (own, other) };
    for (part, value) in better.parts {
        let known = worse.parts.entry(part).or_insert(value);
        *known = known.max(value);
    }
    worse.worst.extend(better.worst);
    worse.worst.sort_by(|first, second| second.value.total_cmp(&first.value).then(first.frame.cmp(&second.frame)));
    worse.worst.truncate(MAX_WORST);
    worse.absolute_value = [worse.absolute_value, better.absolute_value].into_iter().flatten().reduce(f64::max);
    worse
}

/// Those that slide most of very many, in the order of the clip, and how many are left out.
fn sliding_most(mut contacts: Vec<ContactMeasure>) -> (Vec<ContactMeasure>, usize) {
    let left_out = contacts.len().saturating_sub(MAX_CONTACTS);
    if left_out > 0 {
        contacts.sort_by(|first, second| second.slide_cm.total_cmp(&first.slide_cm));
        contacts.truncate(MAX_CONTACTS);
        contacts.sort_by_key(|contact| contact.first_frame);
    }
    (contacts, left_out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::retarget::{MetricName, Verdict, Worst};

    fn measures(verdict: Verdict, value: f64, frame: usize, frames: usize) -> Measures {
        let worst = Worst { frame, joint: "foot".into(), part: "left_leg".into(), value, ..Worst::default() };
        let parts = BTreeMap::from([("left_leg".to_owned(), value)]);
        let metric =
            Metric { verdict, value: Some(value), fail_above: 2.0, parts, worst: vec![worst], ..Metric::default() };
        Measures {
            verdict,
            score: value,
            metrics: BTreeMap::from([(MetricName::FootSlide, metric)]),
            frames_measured: frames,
            ..Measures::default()
        }
    }

    #[test]
    fn a_clip_is_as_bad_as_its_worst_section() {
        let good = measures(Verdict::Pass, 0.5, 7, 300);
        let bad = measures(Verdict::Fail, 3.0, 7, 100).shifted(1000, 10.0);
        for joined in [good.clone().with_section(bad.clone()), bad.with_section(good)] {
            assert_eq!(joined.verdict, Verdict::Fail);
            let metric = &joined.metrics[&MetricName::FootSlide];
            let places: Vec<usize> = metric.worst.iter().map(|worst| worst.frame).collect();
            assert_eq!(places, [1007, 7], "the worst place first, by frames of the clip");
            assert!((metric.worst[0].time_seconds - 10.0).abs() < 1e-9);
            assert!((metric.parts["left_leg"] - 3.0).abs() < 1e-9);
            assert!((joined.score - 1.125).abs() < 1e-9, "the mean of all frames");
            assert_eq!(joined.frames_measured, 400);
            assert!(joined.verdict_reason.contains("frame 1007"), "{}", joined.verdict_reason);
        }
    }
}
