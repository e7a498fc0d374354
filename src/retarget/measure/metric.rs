//! What a metric says: its value, its verdict, and where it is worst.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::statistics::percentile;
use crate::{
    model::Skeleton,
    retarget::spec::{MetricInfo, MetricName, ReportChoice, Threshold},
};

/// Places that are told of each metric.
pub(super) const MAX_WORST: usize = 5;
/// A value of zero where none is allowed counts as this in the score's divisor.
const MIN_FAILURE: f64 = 1.0;

/// How good a value is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// It cannot be measured here; the reason is given.
    #[default]
    NotApplicable,
    /// As good as one could wish.
    Pass,
    /// Worth a look.
    Warn,
    /// Visibly wrong.
    Fail,
}

impl Verdict {
    /// The word on the wire.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::NotApplicable => "not_applicable",
            Self::Pass => "pass",
            Self::Warn => "warn",
            Self::Fail => "fail",
        }
    }
}

/// One metric of a result.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Metric {
    /// Unit of all values.
    pub unit: String,
    /// What it says.
    pub about: String,
    /// How good it is.
    pub verdict: Verdict,
    /// The value that is judged; more is worse.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// The same of the source itself, where what it has is forgiven.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source_value: Option<f64>,
    /// The largest value of any frame with nothing forgiven; a viewer sees it, whatever the source has. Where it is too much, the
    /// verdict is a warning at least.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub absolute_value: Option<f64>,
    /// More than this is a warning.
    pub warn_above: f64,
    /// More than this is a failure.
    pub fail_above: f64,
    /// The value of each limb or joint.
    #[serde(skip_serializing_if = "BTreeMap::is_empty", default)]
    pub parts: BTreeMap<String, f64>,
    /// Where it is worst, at most one place per limb.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub worst: Vec<Worst>,
    /// Why it is not applicable.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

/// A place where a metric is worst.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Worst {
    /// Frame of the result, from 0.
    pub frame: usize,
    /// Its key time.
    pub time_seconds: f64,
    /// Joint of the target.
    pub joint: String,
    /// The limb or role.
    pub part: String,
    /// The value there.
    pub value: f64,
}

/// Values of one limb at frames; NaN where there is nothing to say.
#[derive(Clone, Debug)]
pub(super) struct Series {
    pub(super) part: String,
    /// Joint of the target that is blamed.
    pub(super) joint: usize,
    pub(super) values: Vec<f64>,
}

/// What a family of metrics found out about one of them.
#[derive(Clone, Debug, Default)]
pub(super) struct Reading {
    pub(super) value: f64,
    pub(super) source_value: Option<f64>,
    pub(super) absolute_value: Option<f64>,
    pub(super) parts: BTreeMap<String, f64>,
    /// Frame, joint, part, value.
    pub(super) worst: Vec<(usize, usize, String, f64)>,
}

/// A reading, or why there is none.
pub(super) type Finding = Result<Reading, &'static str>;

impl Reading {
    /// A percentile over all values, with the same per part and the largest of each part as its worst place. `frames` are the
    /// clip's frames that the values are of.
    pub(super) fn of_series(series: &[Series], frames: &[usize], share: f64) -> Option<Self> {
        let finite = |series: &Series| series.values.iter().copied().filter(|value| value.is_finite()).collect();
        let mut all: Vec<f64> = Vec::new();
        let mut reading = Self::default();
        for series in series {
            let mut values: Vec<f64> = finite(series);
            if values.is_empty() {
                continue;
            }
            all.extend(&values);
            reading.parts.insert(series.part.clone(), percentile(&mut values, share));
            let finite = series.values.iter().enumerate().filter(|(_, value)| value.is_finite());
            if let Some((index, value)) = finite.max_by(|first, second| first.1.total_cmp(second.1)) {
                reading.worst.push((frames[index], series.joint, series.part.clone(), *value));
            }
        }
        if all.is_empty() {
            return None;
        }
        reading.value = percentile(&mut all, share);
        Some(reading)
    }

    /// The same with the value of the part that is worst.
    pub(super) fn of_worst_part(series: &[Series], frames: &[usize], share: f64) -> Option<Self> {
        let reading = Self::of_series(series, frames, share)?;
        let value = reading.parts.values().copied().fold(0.0, f64::max);
        Some(Self { value, ..reading })
    }

    pub(super) fn with_source(self, source_value: f64) -> Self {
        Self { source_value: Some(source_value), ..self }
    }
}

/// Judges a finding.
pub(super) fn judge(
    name: MetricName,
    finding: Finding,
    choice: &ReportChoice,
    skeleton: &Skeleton,
    times_seconds: &[f64],
) -> Metric {
    let MetricInfo { unit, about, absolute_warn_above, .. } = name.info();
    let Threshold { warn_above, fail_above } = choice.threshold(name);
    let metric = Metric { unit: (*unit).into(), about: (*about).into(), warn_above, fail_above, ..Metric::default() };
    match finding {
        Err(reason) => Metric { reason: Some(reason.into()), ..metric },
        Ok(reading) => {
            let mut worst = reading.worst;
            worst.retain(|place| place.3 > 0.0);
            worst.sort_by(|first, second| second.3.total_cmp(&first.3).then(first.0.cmp(&second.0)));
            worst.truncate(MAX_WORST);
            let worst = worst.into_iter().map(|(frame, joint, part, value)| Worst {
                frame,
                time_seconds: times_seconds.get(frame).copied().unwrap_or_default(),
                joint: skeleton.label(joint),
                part,
                value: rounded(value),
            });
            let beyond_source = verdict(reading.value, reading.source_value, choice.threshold(name));
            let seen = absolute_warn_above.zip(reading.absolute_value);
            let is_seen = seen.is_some_and(|(most, value)| value > most.max(warn_above));
            Metric {
                verdict: if is_seen { beyond_source.max(Verdict::Warn) } else { beyond_source },
                value: Some(rounded(reading.value)),
                source_value: reading.source_value.map(rounded),
                absolute_value: reading.absolute_value.map(rounded),
                parts: reading.parts.into_iter().map(|(part, value)| (part, rounded(value))).collect(),
                worst: worst.collect(),
                ..metric
            }
        }
    }
}

/// A result may have so much more than the source, in shares of where it warns: nobody sees the difference.
const UNSEEN_SHARE: f64 = 0.5;

/// What the source has itself is forgiven: the thresholds begin there, where it is above them.
fn verdict(value: f64, source_value: Option<f64>, threshold: Threshold) -> Verdict {
    let Threshold { warn_above, fail_above } = threshold;
    let source = source_value.unwrap_or(0.0);
    let unseen = if source > 0.0 { source + UNSEEN_SHARE * warn_above } else { 0.0 };
    if value <= warn_above.max(unseen) {
        Verdict::Pass
    } else if value <= fail_above.max(source + fail_above - warn_above) {
        Verdict::Warn
    } else {
        Verdict::Fail
    }
}

/// The worst verdict of all.
pub(super) fn overall(metrics: &BTreeMap<MetricName, Metric>) -> Verdict {
    metrics.values().map(|metric| metric.verdict).max().unwrap_or_default()
}

/// The metric that the verdict is about: of the worst verdict, the one that is beyond its threshold by the largest share. Nothing where
/// nothing is measured.
pub(super) fn decisive(metrics: &BTreeMap<MetricName, Metric>) -> Option<MetricName> {
    let verdict = overall(metrics);
    let excess = |metric: &Metric| {
        let forgiven = metric.source_value.unwrap_or(0.0);
        let beyond = (metric.value.unwrap_or(0.0) - forgiven).max(metric.absolute_value.unwrap_or(0.0) - forgiven);
        beyond / metric.fail_above.max(f64::MIN_POSITIVE)
    };
    let worst = metrics.iter().filter(|(_, metric)| metric.verdict == verdict && metric.value.is_some());
    worst
        .max_by(|first, second| excess(first.1).total_cmp(&excess(second.1)).then(second.0.cmp(first.0)))
        .map(|(name, _)| *name)
}

/// One line for people: what the verdict is about, and where.
pub(super) fn verdict_reason(metrics: &BTreeMap<MetricName, Metric>) -> String {
    let Some(name) = decisive(metrics) else { return "nothing could be measured".to_owned() };
    let metric = &metrics[&name];
    let unit = if ["count", "share", "ratio"].contains(&metric.unit.as_str()) { "" } else { &metric.unit };
    let with_unit = |value: f64| format!("{} {unit}", (value * 100.0).round() / 100.0).trim_end().to_owned();
    let value = metric.value.unwrap_or(0.0);
    let mut text = format!("{} is {}", name.name(), with_unit(value));
    if let Some(source) = metric.source_value.filter(|source| *source > metric.warn_above) {
        text.push_str(&format!(" where the source has {}", with_unit(source)));
    }
    if let Some(absolute) = metric.absolute_value.filter(|absolute| *absolute > value) {
        text.push_str(&format!(", at most {}", with_unit(absolute)));
    }
    let limit = match metric.verdict {
        Verdict::Fail => format!(" (fails above {})", with_unit(metric.fail_above)),
        Verdict::Warn => format!(" (warns above {})", with_unit(metric.warn_above)),
        Verdict::Pass | Verdict::NotApplicable => return format!("nothing is above its threshold; {text}"),
    };
    text.push_str(&limit);
    if let Some(worst) = metric.worst.first() {
        text.push_str(&format!("; worst at frame {} ({:.2} s), '{}'", worst.frame, worst.time_seconds, worst.joint));
        if !worst.part.is_empty() {
            text.push_str(&format!(", {}", worst.part.replace('_', " ")));
        }
    }
    text
}

/// 0 is best: the mean over the metrics that apply, by weight, of the value above what is forgiven as a share of where it fails,
/// times 100. Beyond its failure a metric counts by the logarithm, so that one alone does not hide all others.
///
/// Values below their threshold count too, so that the better of two good results has the lower score.
pub(super) fn score(metrics: &BTreeMap<MetricName, Metric>) -> f64 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for (name, metric) in metrics {
        let Some(value) = metric.value else { continue };
        let best = if *name == MetricName::JerkRatio { 1.0 } else { 0.0 };
        let forgiven = metric.source_value.unwrap_or(0.0).max(best);
        let whole = (metric.fail_above - best).max(if metric.fail_above > 0.0 { 1e-9 } else { MIN_FAILURE });
        let weight = name.info().weight;
        let failures = (value - forgiven).max(0.0) / whole;
        sum += weight * if failures > 1.0 { 1.0 + failures.ln() } else { failures };
        weights += weight;
    }
    if weights > 0.0 { rounded(sum / weights * 100.0) } else { 0.0 }
}

/// Six significant digits are more than any of these values has.
pub(super) fn rounded(value: f64) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return 0.0;
    }
    #[expect(clippy::cast_possible_truncation, reason = "an exponent of a finite number")]
    let digits = 5 - value.abs().log10().floor() as i32;
    if digits > 12 {
        return 0.0;
    }
    let factor = 10.0_f64.powi(digits);
    (value * factor).round() / factor
}

#[cfg(test)]
mod tests {
    use super::*;

    const THRESHOLD: Threshold = Threshold { warn_above: 1.0, fail_above: 3.0 };

    #[test]
    fn what_the_source_has_is_forgiven() {
        assert_eq!(verdict(1.0, None, THRESHOLD), Verdict::Pass, "at the threshold");
        assert_eq!(verdict(1.1, None, THRESHOLD), Verdict::Warn, "above it");
        assert_eq!(verdict(3.1, None, THRESHOLD), Verdict::Fail, "far above it");
        assert_eq!(verdict(5.0, Some(5.0), THRESHOLD), Verdict::Pass, "the source's own");
        assert_eq!(verdict(5.5, Some(5.0), THRESHOLD), Verdict::Pass, "no more than nobody sees");
        assert_eq!(verdict(1.0, Some(0.1), THRESHOLD), Verdict::Pass, "the threshold itself is no lower");
        assert_eq!(verdict(6.9, Some(5.0), THRESHOLD), Verdict::Warn, "a little more than the source");
        assert_eq!(verdict(7.1, Some(5.0), THRESHOLD), Verdict::Fail, "much more than the source");
    }

    #[test]
    fn the_score_counts_what_is_above_the_source() {
        let metric =
            |value, source_value| Metric { value: Some(value), source_value, fail_above: 2.0, ..Metric::default() };
        let score_of = |value, source| score(&BTreeMap::from([(MetricName::FootSlide, metric(value, source))]));
        assert!((score_of(1.0, None) - 50.0).abs() < 1e-9, "half of a failure");
        assert!(score_of(1.0, Some(1.5)).abs() < 1e-9, "better than the source");
        assert!((score_of(2.0, None) - 100.0).abs() < 1e-9, "a failure");
        assert!(score_of(200.0, None) > score_of(100.0, None), "worse is always more");
        assert!(score_of(200.0, None) < 600.0, "but by the logarithm");
        assert!(score(&BTreeMap::new()).abs() < 1e-9, "nothing to measure");
    }

    #[test]
    fn numbers_keep_six_digits() {
        assert!((rounded(123_456.789) - 123_457.0).abs() < 1e-9, "large");
        assert!((rounded(0.001_234_567_8) - 0.001_234_57).abs() < 1e-12, "small");
        assert!(rounded(1e-30).abs() < f64::MIN_POSITIVE, "nothing");
    }
}
