//! Results as pictures: what was made, beside what it was made from, with what the report found drawn into it.

use crate::{
    formats::Limits,
    model::{Clip, Control, Reporter, Scene},
    picture::{Cast, Grade, Marks, PictureFormat, Ring, Strip, Touch, View, render},
    retarget::{ContactMeasure, Measures, Metric, MetricName, Verdict},
    rig::Rig,
};

use super::{
    Failure, FailureCode,
    output_request::OutputRequest,
    preview::{failed, rig_of},
    shown::Shown,
};

/// What a picture of a result may show beside the result itself.
#[derive(Clone, Copy)]
pub(super) struct Sights<'a> {
    /// What it was made from.
    pub(super) source: Option<(&'a Rig<'a>, &'a Clip)>,
    /// What was measured.
    pub(super) measures: Option<&'a Measures>,
    pub(super) limits: &'a Limits,
}

/// Draws a result as an output asks for.
pub(super) fn picture(
    wanted: &OutputRequest,
    target: &Rig<'_>,
    result: &Clip,
    sights: &Sights<'_>,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Vec<u8>, Failure> {
    let view = checked_view(wanted)?;
    let format = picture_format(wanted, &view)?;
    let means = (sights.limits, control);
    let shown = Shown::new("result", target.scene, Some(target), Some(result), means, reporter)?;
    let source = sights
        .source
        .filter(|_| wanted.shows_source())
        .map(|(rig, clip)| Shown::new("source", rig.scene, Some(rig), Some(clip), means, reporter))
        .transpose()?;
    let source = source.as_ref().map(Shown::subject);
    let marks = sights.measures.map(|measures| marks(measures, target));
    let cast = Cast { main: &shown.subject(), companion: source.as_ref(), marks: marks.as_ref() };
    Ok(render(&cast, &view, format, control).map_err(failed)?.bytes)
}

/// Draws a character in a pose, which its scene has at rest.
pub(super) fn posed(
    wanted: &OutputRequest,
    scene: &Scene,
    limits: &Limits,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Vec<u8>, Failure> {
    let view = checked_view(wanted)?;
    let format = picture_format(wanted, &view)?;
    let rig = rig_of(scene);
    let shown = Shown::new("pose", scene, rig.as_ref(), None, (limits, control), reporter)?;
    Ok(render(&Cast::alone(&shown.subject()), &view, format, control).map_err(failed)?.bytes)
}

fn checked_view(wanted: &OutputRequest) -> Result<View, Failure> {
    let view = wanted.options.view.clone().unwrap_or_default();
    match view.problem() {
        Some((field, problem)) => {
            Err(Failure::new(FailureCode::InvalidValue, format!("/output/view/{field}: {problem}")))
        }
        None => Ok(view),
    }
}

fn picture_format(wanted: &OutputRequest, view: &View) -> Result<PictureFormat, Failure> {
    PictureFormat::of_ending(wanted.format.info().endings[0], !view.is_still())
        .ok_or_else(|| Failure::new(FailureCode::Internal, "a format that is a picture and cannot be drawn"))
}

/// What measures say, as it is drawn: the places where those that do not pass are worst, the worst verdict first.
fn marks(measures: &Measures, target: &Rig<'_>) -> Marks {
    let skeleton = target.skeleton();
    let joint_of = |name: &str| (0..skeleton.len()).find(|joint| skeleton.joints()[*joint].name == name);
    let mut found: Vec<(MetricName, &Metric)> = measures
        .metrics
        .iter()
        .filter(|(_, metric)| grade(metric.verdict) > Grade::Good)
        .map(|(name, metric)| (*name, metric))
        .collect();
    found.sort_by(|(_, one), (_, other)| other.verdict.cmp(&one.verdict).then(excess(other).total_cmp(&excess(one))));
    let mut rings = Vec::new();
    for (name, metric) in &found {
        let is_too_much = |value: f64| value > metric.warn_above;
        for worst in metric.worst.iter().enumerate().filter(|(place, worst)| *place == 0 || is_too_much(worst.value)) {
            let worst = worst.1;
            rings.extend(joint_of(&worst.joint).map(|joint| Ring {
                joint,
                seconds: worst.time_seconds,
                grade: grade(metric.verdict),
                text: said(*name, metric, worst.value, &worst.part),
            }));
        }
    }
    let touches = measures.contacts.iter().filter_map(|contact| touch(contact, measures, target)).collect();
    Marks { rings, touches, strip: strip(measures, found.first().map(|(name, _)| *name)) }
}

fn grade(verdict: Verdict) -> Grade {
    match verdict {
        Verdict::NotApplicable | Verdict::Pass => Grade::Good,
        Verdict::Warn => Grade::Doubtful,
        Verdict::Fail => Grade::Bad,
    }
}

/// By how much a metric is beyond its threshold.
fn excess(metric: &Metric) -> f64 {
    metric.value.unwrap_or(0.0) / metric.warn_above.max(1e-9)
}

fn said(name: MetricName, metric: &Metric, value: f64, part: &str) -> String {
    let unit = metric.unit.split(' ').next().filter(|unit| *unit != "ratio").unwrap_or_default();
    format!("{} {value:.1} {unit}, {part}", name.name()).replace('_', " ").replace(" ,", ",")
}

/// A foot that stands, graded as the thresholds of sliding say.
fn touch(contact: &ContactMeasure, measures: &Measures, target: &Rig<'_>) -> Option<Touch> {
    let slide = measures.metrics.get(&MetricName::FootSlide)?;
    let more = contact.slide_cm - contact.source_slide_cm;
    let grade = match () {
        () if more > slide.fail_above => Grade::Bad,
        () if more > slide.warn_above => Grade::Doubtful,
        () => Grade::Good,
    };
    Some(Touch {
        joint: *target.role(&contact.part).first()?,
        seconds: [contact.start_seconds, contact.end_seconds],
        grade,
    })
}

/// The curve that belongs to a metric; that of the limbs where it has none of its own.
fn strip(measures: &Measures, worst: Option<MetricName>) -> Option<Strip> {
    let name = match worst {
        Some(MetricName::FloorPenetration) => "sole_height",
        Some(MetricName::FootSlide) => "slide_speed",
        _ => "limb_direction",
    };
    let curves = measures.curves.get(name)?;
    let sign = if name == "sole_height" { -1.0 } else { 1.0 };
    let worst_at = |index: usize| {
        let values = curves.parts.values().filter_map(|values| values.get(index).copied().flatten());
        values.map(|value| sign * value).fold(0.0, f64::max)
    };
    Some(Strip {
        text: name.replace('_', " "),
        times_seconds: curves.times_seconds.clone(),
        values: (0..curves.times_seconds.len()).map(worst_at).collect(),
    })
}
