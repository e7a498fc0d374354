//! Feet on the floor: slide, penetration, float, and whether contacts are where the source has them.
//!
//! Where a rig has a mesh, every vertex of its feet is looked at ([`FootSkin`]). Without one, a foot is points of a sole: where the
//! floor is under ankle, ball and toe tip at rest, fixed to those joints. Rigs without a mesh that do not stand at rest are looked at by
//! the joints themselves, each over the height at which it stands.
//!
//! When the source's feet stand is found from its joints, with or without a mesh.

use std::collections::BTreeMap;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{
    agreement::disagreement,
    body::Size,
    contacts::{HEIGHT_ON, Standing, intervals},
    depths::{own_depths, standing_of},
    foot_points::{Feet, FootPoint, Traced},
    metric::{Finding, Reading, Series, rounded},
    motion::{Both, Compared, Performer},
    raised_ground::find_grounds,
    running_floor::under_standing_feet,
    skin::{FootSkin, Half, PartTrack, WantedPart},
    slide::travel,
    standing::Stood,
    statistics::{mean, percentile},
    trunk::Resting,
};
use crate::rig::floors;

/// Contacts that are told of; of more, those that slide most.
pub(super) const MAX_CONTACTS: usize = 200;
const CENTIMETERS: f64 = 100.0;

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
    /// How far the target's foot travels over the floor in it, centimeters at 1 m leg length.
    pub slide_cm: f64,
    /// How far the source's does.
    pub source_slide_cm: f64,
    /// Mean height of the target's sole over the floor in it, centimeters at 1 m leg length; negative is below.
    pub height_cm: f64,
}

/// What the mesh of one side says.
pub(super) struct Skinned {
    /// One per point; toe tips have none, as their vertices are the ball's.
    tracks: Vec<PartTrack>,
    /// Height of the floor, meters.
    floor: f64,
}

/// Everything about feet.
pub(super) struct FeetFindings {
    pub(super) slide: Finding,
    pub(super) penetration: Finding,
    pub(super) float: Finding,
    pub(super) disagreement: Finding,
    pub(super) contacts: Vec<ContactMeasure>,
    pub(super) contacts_left_out: usize,
    /// Height of every foot's lowest point over the floor, centimeters at 1 m leg length.
    pub(super) heights: Vec<Series>,
    /// How fast a foot slides while the source's stands, centimeters per second at 1 m leg length.
    pub(super) slide_speeds: Vec<Series>,
    /// In which frames the source's foot stands with all of its points, by foot.
    pub(super) flat: BTreeMap<String, Vec<bool>>,
    /// How fast the floor runs below both figures, meters a second; zero where it stands.
    pub(super) floors: Both<DVec3>,
}

const NO_LEGS: &str = "no legs were recognized on both sides";
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
            flat: BTreeMap::new(),
            floors: Both::default(),
        }
    }
}

impl Feet {
    /// Skins the feet of one side in every frame; nothing where it has no mesh. How a part moves matters while the source's stands still.
    fn skin(
        &self,
        performer: &Performer<'_>,
        is_target: bool,
        frames: &[usize],
        standing: &[Both<Standing>],
    ) -> Option<Skinned> {
        let pick = |both: &Both<usize>| if is_target { both.target } else { both.source };
        let bearing = self.points.iter().filter(|point| point.bears);
        let wanted: Vec<WantedPart> = bearing
            .map(|point| {
                let of_foot = self.points.iter().filter(|other| other.part == point.part && other.bears);
                let joints: Vec<usize> = of_foot.map(|other| pick(&other.joints)).collect();
                let half =
                    |joints: &[usize]| Half { is_front: point.name == "ball", ankle: joints[0], ball: joints[1] };
                WantedPart { half: (joints.len() > 1).then(|| half(&joints)), joints }
            })
            .collect();
        let leg = if is_target { self.legs.target } else { self.legs.source };
        let of_bearing = self.points.iter().zip(standing).filter(|(point, _)| point.bears);
        let moves: Vec<Vec<bool>> = of_bearing.map(|(_, standing)| standing.source.still_steps()).collect();
        let moves: Vec<&[bool]> = moves.iter().map(Vec::as_slice).collect();
        let mut tracks = FootSkin::find(*performer, wanted, leg)?.follow(frames, &moves).into_iter();
        let of_point = |point: &FootPoint| if point.bears { tracks.next() } else { None };
        let tracks = self.points.iter().map(of_point).map(Option::unwrap_or_default).collect();
        // A rig that rests elsewhere than on the floor of its file, in the air or with its pelvis at the origin, is put onto the source's.
        let (_, in_clip) = floors(performer.rig, performer.clip)?;
        Some(Skinned { tracks, floor: in_clip * performer.rig.unit_meters })
    }

    pub(super) fn measure(
        &self,
        performers: &Both<Performer<'_>>,
        compared: &Compared,
        stood: Stood,
        resting: &Resting,
    ) -> FeetFindings {
        let frames = &compared.frames.indices;
        let Stood { positions, standing, floors, has_raised_ground } = stood;
        let skins = Both {
            source: self.skin(&performers.source, false, frames, &standing),
            target: self.skin(&performers.target, true, frames, &standing),
        };
        let traced = positions.into_iter().zip(standing).enumerate();
        let mut traced: Vec<Traced<'_>> = traced
            .map(|(index, (positions, standing))| self.trace(index, positions, standing, &skins, compared))
            .collect();
        if has_raised_ground {
            find_grounds(&mut traced, &self.legs, &compared.performed_seconds);
        }
        let floors = under_standing_feet(&traced, &floors);
        traced.iter_mut().for_each(|traced| traced.floors = floors);
        let bearing: Vec<&Traced<'_>> = traced.iter().filter(|traced| traced.point.bears).collect();
        let (mut contacts, slide_speeds) = self.contacts(&bearing, compared);
        let slide = slide_finding(&contacts, &bearing);
        let contacts_left_out = contacts.len().saturating_sub(MAX_CONTACTS);
        if contacts_left_out > 0 {
            contacts.sort_by(|first, second| second.slide_cm.total_cmp(&first.slide_cm));
            contacts.truncate(MAX_CONTACTS);
        }
        contacts.sort_by_key(|contact| (contact.first_frame, contact.part.clone(), contact.point.clone()));
        let heights = self.lowest(&traced, true);
        FeetFindings {
            slide,
            penetration: self.penetration(&traced, &heights, &skins, compared),
            float: self.float(&bearing, compared),
            disagreement: disagreement(&bearing, frames, resting).ok_or(NO_CONTACT),
            contacts,
            contacts_left_out,
            heights,
            slide_speeds,
            flat: flat(&bearing),
            floors,
        }
    }

    fn trace<'a>(
        &'a self,
        index: usize,
        positions: Both<Vec<DVec3>>,
        standing: Both<Standing>,
        skins: &'a Both<Option<Skinned>>,
        compared: &'a Compared,
    ) -> Traced<'a> {
        let level = |skin: &Option<Skinned>, size: &Size, standing: &Standing| {
            skin.as_ref().map_or(size.floor.unwrap_or(standing.level), |skin| skin.floor)
        };
        let levels = Both {
            source: level(&skins.source, &self.sizes.source, &standing.source),
            target: level(&skins.target, &self.sizes.target, &standing.target),
        };
        let track = |skin: &'a Option<Skinned>| skin.as_ref().map(|skin| &skin.tracks[index]);
        let skin = Both { source: track(&skins.source), target: track(&skins.target) };
        Traced {
            index,
            point: &self.points[index],
            positions,
            standing,
            levels,
            skin,
            ground: None,
            floors: Both::default(),
            size: self.legs.source / self.legs.target,
            compared,
        }
    }

    fn contacts(&self, bearing: &[&Traced<'_>], compared: &Compared) -> (Vec<ContactMeasure>, Vec<Series>) {
        let mut contacts = Vec::new();
        let mut speeds = Vec::new();
        for traced in bearing {
            let still = traced.standing.source.still_steps();
            let mut speed = vec![f64::NAN; compared.len()];
            for (first, last) in intervals(&traced.standing.source.stands) {
                let frames = || (first..last).filter(|frame| still[*frame]);
                if frames().next().is_none() {
                    continue;
                }
                let slide = |is_target: bool, leg: f64| {
                    let step = |frame: usize| (compared.performed_seconds[frame + 1], traced.step(is_target, frame));
                    travel(&frames().map(step).collect::<Vec<_>>()) / leg * CENTIMETERS
                };
                let (slide, source_slide) = (slide(true, self.legs.target), slide(false, self.legs.source));
                for frame in frames() {
                    let seconds = compared.times_seconds[frame + 1] - compared.times_seconds[frame];
                    speed[frame] =
                        traced.step(true, frame).length() / self.legs.target * CENTIMETERS / seconds.max(1e-9);
                }
                let heights: Vec<f64> = (first..=last).map(|frame| traced.height(true, frame)).collect();
                let height = mean(&heights);
                contacts.push(ContactMeasure {
                    part: traced.point.part.clone(),
                    point: traced.point.name.to_owned(),
                    first_frame: compared.frames.indices[first],
                    last_frame: compared.frames.indices[last],
                    start_seconds: rounded(compared.times_seconds[first]),
                    end_seconds: rounded(compared.times_seconds[last]),
                    slide_cm: rounded(slide),
                    source_slide_cm: rounded(source_slide),
                    height_cm: rounded(height / self.legs.target * CENTIMETERS),
                });
            }
            let part = format!("{} {}", traced.point.part, traced.point.name);
            speeds.push(Series { part, joint: traced.point.joint, values: speed });
        }
        (contacts, speeds)
    }

    /// The lowest point of every foot over the floor, in centimeters at 1 m leg length.
    fn lowest<'t>(&self, traced: impl IntoIterator<Item = &'t Traced<'t>>, is_target: bool) -> Vec<Series> {
        let leg = if is_target { self.legs.target } else { self.legs.source };
        let mut feet: Vec<Series> = Vec::new();
        for traced in traced {
            let heights =
                (0..traced.positions.target.len()).map(|frame| traced.height(is_target, frame) / leg * CENTIMETERS);
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

    fn penetration(
        &self,
        traced: &[Traced<'_>],
        heights: &[Series],
        skins: &Both<Option<Skinned>>,
        compared: &Compared,
    ) -> Finding {
        let depths = |series: &Series| Series {
            values: series.values.iter().map(|height| (-height).max(0.0)).collect(),
            ..series.clone()
        };
        let own: Vec<Series> = heights.iter().map(depths).collect();
        // Points that are fixed below the joints of a foot go through the floor when the foot rolls, where a shoe bends. That says
        // nothing of how deep the source is, so it excuses no mesh.
        let of_source = if skins.target.is_some() && skins.source.is_none() {
            self.joint_heights(traced, compared)
        } else {
            self.lowest(traced, false).into_iter().map(|series| series.values).collect()
        };
        let mut source = own_depths(&of_source, &standing_of(traced));
        let reading = Reading::of_series(&own, &compared.frames.indices, 0.99).ok_or(NO_LEGS)?;
        let deepest = own.iter().flat_map(|series| &series.values).copied().fold(0.0, f64::max);
        Ok(Reading { absolute_value: Some(deepest), ..reading.with_source(percentile(&mut source, 0.99)) })
    }

    /// How far the source's ankles and balls are above the heights at which they stand at rest, in centimeters at 1 m leg length: the
    /// lower of the two per foot.
    fn joint_heights(&self, traced: &[Traced<'_>], compared: &Compared) -> Vec<Vec<f64>> {
        let mut feet: Vec<(&str, Vec<f64>)> = Vec::new();
        for traced in traced.iter().filter(|traced| traced.point.bears) {
            let at_rest = self.ankles[traced.index].source.zip(self.sizes.source.floor);
            let over = |frame: usize| match at_rest {
                Some((height, floor)) => compared.source.position(frame, traced.point.joint_slot).y - floor - height,
                None => traced.height(false, frame),
            };
            let heights = (0..compared.len()).map(|frame| over(frame) / self.legs.source * CENTIMETERS);
            match feet.iter_mut().find(|(part, _)| *part == traced.point.part) {
                Some((_, lowest)) => lowest.iter_mut().zip(heights).for_each(|(low, height)| *low = low.min(height)),
                None => feet.push((&traced.point.part, heights.collect())),
            }
        }
        feet.into_iter().map(|(_, heights)| heights).collect()
    }

    /// While the source's foot stands: the lowest of the mesh of the whole foot, else each point of the sole.
    fn float(&self, bearing: &[&Traced<'_>], compared: &Compared) -> Finding {
        let is_skinned = bearing.iter().any(|traced| traced.skin.target.is_some());
        let off: Vec<(Vec<f64>, Vec<f64>)> = if is_skinned {
            self.feet_off(bearing, compared)
        } else {
            bearing.iter().map(|traced| self.points_off(traced, compared)).collect()
        };
        let series = |(traced, (own, _)): (&&Traced<'_>, &(Vec<f64>, Vec<f64>))| Series {
            part: format!("{} {}", traced.point.part, traced.point.name),
            joint: traced.point.joint,
            values: own.clone(),
        };
        let own: Vec<Series> = bearing.iter().zip(&off).map(series).collect();
        let mut source: Vec<f64> =
            off.into_iter().flat_map(|(_, source)| source).filter(|value| value.is_finite()).collect();
        let reading = Reading::of_series(&own, &compared.frames.indices, 0.95).ok_or(NO_CONTACT)?;
        Ok(reading.with_source(percentile(&mut source, 0.95)))
    }

    /// The height of a point of the sole while it stands on the source, of the target and of the source.
    fn points_off(&self, traced: &Traced<'_>, compared: &Compared) -> (Vec<f64>, Vec<f64>) {
        let off = |is_target: bool, leg: f64| {
            let height = |frame: usize| match traced.standing.source.is_still[frame] {
                true => (traced.height(is_target, frame) / leg * CENTIMETERS).max(0.0),
                false => f64::NAN,
            };
            (0..compared.len()).map(height).collect()
        };
        (off(true, self.legs.target), off(false, self.legs.source))
    }

    /// The height of the lowest vertex of the foot while a point of it stands on the source. A point that is as slow and as high as it
    /// often is, such as a raised heel, does not say that the foot is on the floor: the source's foot must be as low as its feet
    /// usually are.
    fn feet_off(&self, bearing: &[&Traced<'_>], compared: &Compared) -> Vec<(Vec<f64>, Vec<f64>)> {
        let of_source = self.lowest(bearing.iter().copied(), false);
        let of_target = self.lowest(bearing.iter().copied(), true);
        let floor = usual_low(&of_source.iter().map(|foot| foot.values.clone()).collect::<Vec<_>>());
        let foot = |feet: &[Series], part: &str| feet.iter().position(|foot| foot.part == part).unwrap_or(0);
        let off = |traced: &&Traced<'_>| {
            let index = foot(&of_source, &traced.point.part);
            let (source, target) = (&of_source[index].values, &of_target[index].values);
            let stands = |frame: &usize| {
                traced.standing.source.is_still[*frame] && source[*frame] - floor <= HEIGHT_ON * CENTIMETERS
            };
            let heights = |values: &[f64], floor: f64| {
                let height = |frame: usize| if stands(&frame) { (values[frame] - floor).max(0.0) } else { f64::NAN };
                (0..compared.len()).map(height).collect::<Vec<f64>>()
            };
            (heights(target, 0.0), heights(source, floor))
        };
        bearing.iter().map(off).collect()
    }
}

/// How low the lower foot usually is, of the heights of each foot: where the source stands, however far that is from its floor.
fn usual_low(feet: &[Vec<f64>]) -> f64 {
    let frames = feet.iter().map(Vec::len).min().unwrap_or(0);
    let mut lows: Vec<f64> =
        (0..frames).map(|frame| feet.iter().map(|foot| foot[frame]).fold(f64::INFINITY, f64::min)).collect();
    percentile(&mut lows, 0.05)
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

/// In which frames all points of a foot of the source stand.
fn flat(bearing: &[&Traced<'_>]) -> BTreeMap<String, Vec<bool>> {
    let mut feet: BTreeMap<String, Vec<bool>> = BTreeMap::new();
    for traced in bearing {
        let stands = &traced.standing.source.stands;
        let flat = feet.entry(traced.point.part.clone()).or_insert_with(|| stands.clone());
        flat.iter_mut().zip(stands).for_each(|(flat, stands)| *flat &= stands);
    }
    feet
}
