//! Feet on the floor: slide, penetration, float, and whether contacts are where the source has them.
//!
//! A foot is looked at by points of its sole: where the floor is under ankle, ball and toe tip at rest, fixed to those joints. So a
//! foot that rolls has its lowest point below the floor when a shoe would. Rigs that do not stand at rest are looked at by the
//! joints themselves, each over the height at which it stands.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{
    body::Size,
    contacts::{Standing, find_standing, intervals},
    metric::{Finding, Reading, Series, rounded},
    motion::{Anchor, Both, Compared, Wanted},
    statistics::percentile,
};
use crate::rig::{Rig, Role};

/// A sole further below its joint than this share of the leg is none: the rest pose stands on something else. Cartoon figures have
/// ankles at a third of their legs.
const MOST_SOLE: f64 = 0.5;
/// Contacts that are told of; of more, those that slide most.
const MOST_CONTACTS: usize = 200;
const CENTIMETRES: f64 = 100.0;

/// One contact of the source, and what the target does in it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ContactMeasure {
    /// The foot.
    pub part: String,
    /// `heel`, `ball` or `paw`.
    pub point: String,
    /// First frame.
    pub first_frame: usize,
    /// Last frame.
    pub last_frame: usize,
    /// Time of the first.
    pub start_seconds: f64,
    /// Time of the last.
    pub end_seconds: f64,
    /// How far the target's foot travels over the floor in it, centimetres at 1 m leg length.
    pub slide_cm: f64,
    /// How far the source's does.
    pub source_slide_cm: f64,
    /// Mean height of the target's sole over the floor in it, centimetres at 1 m leg length; negative is below.
    pub height_cm: f64,
}

/// What is looked at.
pub(super) struct Feet {
    points: Vec<FootPoint>,
    sizes: Both<Size>,
    legs: Both<f64>,
}

struct FootPoint {
    part: String,
    name: &'static str,
    joint: usize,
    slot: usize,
    /// Whether it is one that stands; a toe tip only goes through the floor.
    bears: bool,
}

/// Everything about feet.
pub(super) struct FeetFindings {
    pub(super) slide: Finding,
    pub(super) penetration: Finding,
    pub(super) float: Finding,
    pub(super) disagreement: Finding,
    pub(super) contacts: Vec<ContactMeasure>,
    pub(super) contacts_left_out: usize,
    /// Height of every foot's lowest point over the floor, centimetres at 1 m leg length.
    pub(super) heights: Vec<Series>,
    /// How fast a foot slides while the source's stands, centimetres per second at 1 m leg length.
    pub(super) slide_speeds: Vec<Series>,
}

const NO_LEGS: &str = "no legs were recognised on both sides";
const NO_CONTACT: &str = "no foot of the source stands in this clip";

impl FeetFindings {
    pub(super) fn none() -> Self {
        Self {
            slide: Err(NO_LEGS),
            penetration: Err(NO_LEGS),
            float: Err(NO_LEGS),
            disagreement: Err(NO_LEGS),
            contacts: Vec::new(),
            contacts_left_out: 0,
            heights: Vec::new(),
            slide_speeds: Vec::new(),
        }
    }
}

/// One point on both sides, over the clip.
struct Traced<'a> {
    point: &'a FootPoint,
    positions: Both<Vec<DVec3>>,
    standing: Both<Standing>,
    /// Height of the floor under it: where the rig stands at rest, else where it stands in the clip.
    levels: Both<f64>,
}

impl Feet {
    pub(super) fn find(rigs: &Both<&Rig<'_>>, sizes: Both<Size>, wanted: &mut Wanted) -> Option<Self> {
        let legs = Both { source: sizes.source.leg?, target: sizes.target.leg? };
        let mut points = Vec::new();
        for side in ["left", "right"] {
            let foot = format!("{side}_foot");
            let toe = format!("{side}_toe");
            let ends = [(foot.as_str(), "heel"), (toe.as_str(), "ball")];
            for (role, name) in ends {
                let joints = rigs.map(|rig| rig.role(role).first().copied());
                let (Some(source), Some(target)) = (joints.source, joints.target) else { continue };
                let both = Both { source, target };
                points.push(FootPoint::new(&foot, name, rigs, both, &sizes, wanted));
                if name == "ball" {
                    let tips = Both { source: tip(rigs.source, source), target: tip(rigs.target, target) };
                    points.push(FootPoint::new(&foot, "tip", rigs, tips, &sizes, wanted));
                }
            }
            let is_leg = |role: &&String| {
                role.starts_with(side) && role.parse::<Role>().is_ok_and(|role| role.part.is_whole_leg())
            };
            for leg in rigs.target.roles.keys().filter(is_leg) {
                let joints = rigs.map(|rig| rig.role(leg).last().copied());
                if let (Some(source), Some(target)) = (joints.source, joints.target) {
                    points.push(FootPoint::new(leg, "paw", rigs, Both { source, target }, &sizes, wanted));
                }
            }
        }
        (!points.is_empty()).then_some(Self { points, sizes, legs })
    }

    pub(super) fn measure(&self, compared: &Compared) -> FeetFindings {
        let traced: Vec<Traced<'_>> = self.points.iter().map(|point| self.trace(point, compared)).collect();
        let bearing: Vec<&Traced<'_>> = traced.iter().filter(|traced| traced.point.bears).collect();
        let (mut contacts, slide_speeds) = self.contacts(&bearing, compared);
        let slide = slide_finding(&contacts, &bearing);
        let contacts_left_out = contacts.len().saturating_sub(MOST_CONTACTS);
        if contacts_left_out > 0 {
            contacts.sort_by(|first, second| second.slide_cm.total_cmp(&first.slide_cm));
            contacts.truncate(MOST_CONTACTS);
        }
        contacts.sort_by_key(|contact| (contact.first_frame, contact.part.clone(), contact.point.clone()));
        let heights = self.lowest(&traced, true);
        FeetFindings {
            slide,
            penetration: self.penetration(&traced, &heights, compared),
            float: self.float(&bearing, compared),
            disagreement: disagreement(&bearing),
            contacts,
            contacts_left_out,
            heights,
            slide_speeds,
        }
    }

    fn trace<'a>(&self, point: &'a FootPoint, compared: &Compared) -> Traced<'a> {
        let positions = Both { source: &compared.source, target: &compared.target };
        let positions = positions
            .map(|motion| (0..compared.len()).map(|frame| motion.position(frame, point.slot)).collect::<Vec<DVec3>>());
        let stand = |positions: &[DVec3], leg: f64, floor: Option<f64>| {
            if point.bears || floor.is_none() {
                find_standing(positions, &compared.times_seconds, leg)
            } else {
                Standing { level: 0.0, stands: Vec::new(), is_still: Vec::new() }
            }
        };
        let standing = Both {
            source: stand(&positions.source, self.legs.source, self.sizes.source.floor),
            target: stand(&positions.target, self.legs.target, self.sizes.target.floor),
        };
        let levels = Both {
            source: self.sizes.source.floor.unwrap_or(standing.source.level),
            target: self.sizes.target.floor.unwrap_or(standing.target.level),
        };
        Traced { point, positions, standing, levels }
    }

    fn contacts(&self, bearing: &[&Traced<'_>], compared: &Compared) -> (Vec<ContactMeasure>, Vec<Series>) {
        let mut contacts = Vec::new();
        let mut speeds = Vec::new();
        for traced in bearing {
            let still = &traced.standing.source.is_still;
            let step = |positions: &[DVec3], frame: usize, leg: f64| {
                let way = positions[frame + 1] - positions[frame];
                way.x.hypot(way.z) / leg * CENTIMETRES
            };
            let mut speed = vec![f64::NAN; compared.len()];
            for (first, last) in intervals(&traced.standing.source.stands) {
                let (mut slide, mut source_slide, mut steps) = (0.0, 0.0, 0_usize);
                for frame in (first..last).filter(|frame| still[*frame] && still[frame + 1]) {
                    let own = step(&traced.positions.target, frame, self.legs.target);
                    slide += own;
                    source_slide += step(&traced.positions.source, frame, self.legs.source);
                    steps += 1;
                    let seconds = compared.times_seconds[frame + 1] - compared.times_seconds[frame];
                    speed[frame] = own / seconds.max(1e-9);
                }
                if steps == 0 {
                    continue;
                }
                let heights = &traced.positions.target[first..=last];
                let height = heights.iter().map(|position| position.y).sum::<f64>() / heights.len() as f64;
                contacts.push(ContactMeasure {
                    part: traced.point.part.clone(),
                    point: traced.point.name.to_owned(),
                    first_frame: compared.frames.indices[first],
                    last_frame: compared.frames.indices[last],
                    start_seconds: rounded(compared.times_seconds[first]),
                    end_seconds: rounded(compared.times_seconds[last]),
                    slide_cm: rounded(slide),
                    source_slide_cm: rounded(source_slide),
                    height_cm: rounded((height - traced.levels.target) / self.legs.target * CENTIMETRES),
                });
            }
            let part = format!("{} {}", traced.point.part, traced.point.name);
            speeds.push(Series { part, joint: traced.point.joint, values: speed });
        }
        (contacts, speeds)
    }

    /// The lowest point of every foot over the floor, in centimetres at 1 m leg length.
    fn lowest(&self, traced: &[Traced<'_>], is_target: bool) -> Vec<Series> {
        let leg = if is_target { self.legs.target } else { self.legs.source };
        let mut feet: Vec<Series> = Vec::new();
        for traced in traced {
            let (positions, level) = if is_target {
                (&traced.positions.target, traced.levels.target)
            } else {
                (&traced.positions.source, traced.levels.source)
            };
            let heights = positions.iter().map(|position| (position.y - level) / leg * CENTIMETRES);
            match feet.iter_mut().find(|foot| foot.part == traced.point.part) {
                Some(foot) => {
                    foot.values.iter_mut().zip(heights).for_each(|(lowest, height)| *lowest = lowest.min(height));
                }
                None => feet.push(Series {
                    part: traced.point.part.clone(),
                    joint: traced.point.joint,
                    values: heights.collect(),
                }),
            }
        }
        feet
    }

    fn penetration(&self, traced: &[Traced<'_>], heights: &[Series], compared: &Compared) -> Finding {
        let depths = |series: &Series| Series {
            values: series.values.iter().map(|height| (-height).max(0.0)).collect(),
            ..series.clone()
        };
        let own: Vec<Series> = heights.iter().map(depths).collect();
        let mut source: Vec<f64> =
            self.lowest(traced, false).iter().map(depths).flat_map(|series| series.values).collect();
        let reading = Reading::of_series(&own, &compared.frames.indices, 0.99).ok_or(NO_LEGS)?;
        Ok(reading.with_source(percentile(&mut source, 0.99)))
    }

    fn float(&self, bearing: &[&Traced<'_>], compared: &Compared) -> Finding {
        let off = |traced: &Traced<'_>, positions: &[DVec3], level: f64, leg: f64| -> Vec<f64> {
            let frames = positions.iter().zip(&traced.standing.source.is_still);
            frames
                .map(
                    |(position, still)| {
                        if *still { ((position.y - level) / leg * CENTIMETRES).max(0.0) } else { f64::NAN }
                    },
                )
                .collect()
        };
        let own: Vec<Series> = bearing
            .iter()
            .map(|traced| Series {
                part: format!("{} {}", traced.point.part, traced.point.name),
                joint: traced.point.joint,
                values: off(traced, &traced.positions.target, traced.levels.target, self.legs.target),
            })
            .collect();
        let sources = bearing
            .iter()
            .flat_map(|traced| off(traced, &traced.positions.source, traced.levels.source, self.legs.source));
        let mut source: Vec<f64> = sources.filter(|value| value.is_finite()).collect();
        let reading = Reading::of_series(&own, &compared.frames.indices, 0.95).ok_or(NO_CONTACT)?;
        Ok(reading.with_source(percentile(&mut source, 0.95)))
    }
}

impl FootPoint {
    fn new(
        part: &str,
        name: &'static str,
        rigs: &Both<&Rig<'_>>,
        joints: Both<usize>,
        sizes: &Both<Size>,
        wanted: &mut Wanted,
    ) -> Self {
        let anchor = Both {
            source: sole(rigs.source, joints.source, &sizes.source),
            target: sole(rigs.target, joints.target, &sizes.target),
        };
        Self { part: part.to_owned(), name, joint: joints.target, slot: wanted.point(anchor), bears: name != "tip" }
    }
}

/// The floor under a joint at rest, fixed to the joint; the joint itself where the rig does not stand at rest.
fn sole(rig: &Rig<'_>, joint: usize, size: &Size) -> Anchor {
    let rest = rig.rest.transforms()[joint];
    let (Some(floor), Some(leg)) = (size.floor, size.leg) else { return Anchor::at(joint) };
    let drop = rig.rest_height(joint) - floor / rig.unit_metres;
    if drop.abs() * rig.unit_metres > MOST_SOLE * leg {
        return Anchor::at(joint);
    }
    let below = rest.rotation.conjugate() * (rig.up() * -drop);
    let scale = DVec3::select(rest.scale.cmpeq(DVec3::ZERO), DVec3::ONE, rest.scale);
    Anchor { joint, offset: below / scale }
}

/// The end of the longest straight run of first children below a toe.
fn tip(rig: &Rig<'_>, toe: usize) -> usize {
    let joints = rig.skeleton().joints();
    let mut current = toe;
    for (index, joint) in joints.iter().enumerate().skip(toe + 1) {
        if joint.parent == Some(current) {
            current = index;
        }
    }
    current
}

fn slide_finding(contacts: &[ContactMeasure], bearing: &[&Traced<'_>]) -> Finding {
    if contacts.is_empty() {
        return Err(NO_CONTACT);
    }
    let mut reading = Reading::default();
    let slides = |part: &str, pick: fn(&ContactMeasure) -> f64| {
        let contacts = contacts.iter().filter(|contact| part.is_empty() || contact.part == part);
        contacts.map(pick).collect::<Vec<f64>>()
    };
    reading.value = percentile(&mut slides("", |contact| contact.slide_cm), 0.95);
    reading.source_value = Some(percentile(&mut slides("", |contact| contact.source_slide_cm), 0.95));
    for contact in contacts {
        if !reading.parts.contains_key(&contact.part) {
            let mut own = slides(&contact.part, |contact| contact.slide_cm);
            reading.parts.insert(contact.part.clone(), percentile(&mut own, 0.95));
        }
        let joint =
            bearing.iter().find(|traced| traced.point.part == contact.part && traced.point.name == contact.point);
        if let Some(traced) = joint {
            let part = format!("{} {}", contact.part, contact.point);
            reading.worst.push((contact.first_frame, traced.point.joint, part, contact.slide_cm));
        }
    }
    Ok(reading)
}

/// 1 − F1 of frames in contact.
fn disagreement(bearing: &[&Traced<'_>]) -> Finding {
    let mut reading = Reading::default();
    let (mut all_both, mut all_either) = (0_usize, 0_usize);
    for traced in bearing {
        let (source, target) = (&traced.standing.source.stands, &traced.standing.target.stands);
        let count = |stands: &[bool]| stands.iter().filter(|stands| **stands).count();
        let both = source.iter().zip(target).filter(|(source, target)| **source && **target).count();
        let sum = count(source) + count(target);
        all_both += both;
        all_either += sum;
        if sum > 0 {
            let part = format!("{} {}", traced.point.part, traced.point.name);
            reading.parts.insert(part, 1.0 - 2.0 * both as f64 / sum as f64);
        }
    }
    if all_either == 0 {
        return Err(NO_CONTACT);
    }
    reading.value = 1.0 - 2.0 * all_both as f64 / all_either as f64;
    Ok(reading)
}
