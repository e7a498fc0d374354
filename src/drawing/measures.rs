//! How good a moving drawing is, by what is seen of it.

use glam::DVec2;
use rayon::prelude::*;
use serde::Serialize;

use super::{Performance, PlanarRig, Puppet, PuppetWorkspace, Skin, contacts::runs, untangle::doubled_area};

/// Frames whose meshes are looked at.
const MAX_FRAMES: usize = 150;

/// A value with what is good enough.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Measured {
    /// The value.
    pub value: f64,
    /// Up to here it passes.
    pub pass_up_to: f64,
    /// Beyond this it fails.
    pub fail_above: f64,
}

/// What is measured of a moving drawing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DrawingMeasures {
    /// Largest angle between a driven bone and the angle that it is to have, degrees.
    pub angle_error_degrees: Measured,
    /// Largest turn of a driven bone from one frame to the next, degrees a second.
    pub fastest_turn_degrees_per_second: Measured,
    /// Triangles that are turned over, of all, on average: percent. Absent where there is no mask.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub turned_over_percent: Option<Measured>,
    /// The same in the worst frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub turned_over_percent_most: Option<f64>,
    /// Changes of the order of drawing, a second and group, of the group that changes most.
    pub order_changes_per_second: Measured,
    /// How far standing feet slip: percent of the drawing's height a second. Absent where no foot stands.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slip_percent_per_second: Option<Measured>,
    /// How much the area of all that is one bone's alone changes against rest, on average: percent. Absent where there is no mask.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area_change_percent: Option<Measured>,
    /// How far the vertices of a model on bones (`.glb`) are from those of the picture, on average: percent of the drawing's width. Absent where
    /// the picture is deformed as the original does it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model_error_percent: Option<Measured>,
    /// Largest change of a bone's length against rest, where bones are not foreshortened: percent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_change_percent: Option<Measured>,
}

impl DrawingMeasures {
    /// All values that have a bound, by their names.
    #[must_use]
    pub fn bounded(&self) -> Vec<(&'static str, Measured)> {
        let all: [(&'static str, Option<Measured>); 8] = [
            ("angle_error_degrees", Some(self.angle_error_degrees)),
            ("fastest_turn_degrees_per_second", Some(self.fastest_turn_degrees_per_second)),
            ("turned_over_percent", self.turned_over_percent),
            ("order_changes_per_second", Some(self.order_changes_per_second)),
            ("slip_percent_per_second", self.slip_percent_per_second),
            ("area_change_percent", self.area_change_percent),
            ("model_error_percent", self.model_error_percent),
            ("length_change_percent", self.length_change_percent),
        ];
        all.into_iter().filter_map(|(name, measured)| Some((name, measured?))).collect()
    }
}

/// Measures what a drawing does; of its mesh only where it has one.
#[must_use]
pub fn measure(
    puppet: Option<&Puppet>,
    rig: &PlanarRig,
    performance: &Performance,
    foreshortened: bool,
) -> DrawingMeasures {
    let bounded = |value: f64, pass_up_to: f64, fail_above: f64| Measured { value, pass_up_to, fail_above };
    let mesh = puppet.map(|puppet| MeshMeasures::of(puppet, performance));
    let model = mesh.and_then(|mesh| mesh.model_error_percent);
    let slip = slip(rig, performance).map(|slip| bounded(slip, 1.0, 5.0));
    DrawingMeasures {
        angle_error_degrees: bounded(angle_error(rig, performance), 0.01, 1.0),
        fastest_turn_degrees_per_second: bounded(fastest_turn(performance), 901.0, 2000.0),
        turned_over_percent: mesh.map(|mesh| bounded(mesh.turned_over_percent, 0.05, 0.5)),
        turned_over_percent_most: mesh.map(|mesh| mesh.turned_over_percent_most),
        order_changes_per_second: bounded(order_changes(performance), 2.0, 4.0),
        slip_percent_per_second: slip,
        area_change_percent: mesh.map(|mesh| bounded(mesh.area_change_percent, 2.0, 10.0)),
        model_error_percent: model.map(|error| bounded(error, 1.0, 4.0)),
        length_change_percent: (!foreshortened).then(|| bounded(length_change(rig, performance), 3.0, 10.0)),
    }
}

fn joints_of(performance: &Performance, frame: usize) -> &[DVec2] {
    let count = performance.joints.len() / performance.frames;
    &performance.joints[frame * count..][..count]
}

fn apart_degrees(one: f64, other: f64) -> f64 {
    ((one - other + 180.0).rem_euclid(360.0) - 180.0).abs()
}

fn angle_error(rig: &PlanarRig, performance: &Performance) -> f64 {
    let driven: Vec<usize> = performance.driven.iter().filter_map(|name| rig.joint(name)).collect();
    let mut most: f64 = 0.0;
    for frame in 0..performance.frames {
        let joints = joints_of(performance, frame);
        for (place, &joint) in driven.iter().enumerate() {
            let Some(parent) = rig.parents[joint] else { continue };
            let mut way = joints[joint] - joints[parent];
            if way.length() < 1e-6 {
                continue;
            }
            if performance.is_mirrored[frame] {
                way.x = -way.x;
            }
            let wanted = performance.orientations_degrees[frame * driven.len() + place];
            most = most.max(apart_degrees(way.y.atan2(way.x).to_degrees() - 90.0, wanted));
        }
    }
    most
}

fn fastest_turn(performance: &Performance) -> f64 {
    let bones = performance.driven.len();
    let angles = &performance.orientations_degrees;
    let turn = |at: usize| apart_degrees(angles[at + bones], angles[at]);
    let most = (0..angles.len().saturating_sub(bones)).map(turn).fold(0.0, f64::max);
    most / performance.frame_time
}

fn order_changes(performance: &Performance) -> f64 {
    let groups = performance.order.len() / performance.frames;
    let place = |frame: usize, group: usize| {
        performance.order[frame * groups..][..groups].iter().position(|other| *other == group)
    };
    let changes =
        |group: usize| (1..performance.frames).filter(|&frame| place(frame, group) != place(frame - 1, group)).count();
    let most = (0..groups).map(changes).max().unwrap_or(0);
    // A short clip may change once or twice.
    most as f64 / (performance.frames as f64 * performance.frame_time).max(1.0)
}

/// Percent of the height at rest that feet slip in a second of standing.
fn slip(rig: &PlanarRig, performance: &Performance) -> Option<f64> {
    let heights = rig.rest.iter().map(|place| place.y);
    let height = heights.clone().fold(f64::MIN, f64::max) - heights.fold(f64::MAX, f64::min);
    let (mut way, mut seconds) = (0.0, 0.0);
    for (joint, stands) in &performance.contacts {
        for run in runs(stands) {
            for frame in run.start + 1..run.end {
                way += (joints_of(performance, frame)[*joint].x - joints_of(performance, frame - 1)[*joint].x).abs();
                seconds += performance.frame_time;
            }
        }
    }
    (seconds > 0.0).then(|| 100.0 * way / height.max(1e-9) / seconds)
}

fn length_change(rig: &PlanarRig, performance: &Performance) -> f64 {
    let mut most: f64 = 0.0;
    for frame in 0..performance.frames {
        let joints = joints_of(performance, frame);
        for (joint, parent) in rig.parents.iter().enumerate() {
            let Some(parent) = *parent else { continue };
            let rest = rig.rest[joint].distance(rig.rest[parent]);
            if rest > 1e-6 {
                most = most.max(100.0 * (joints[joint].distance(joints[parent]) / rest - 1.0).abs());
            }
        }
    }
    most
}

/// What is measured of the meshes of some frames.
#[derive(Clone, Copy)]
struct MeshMeasures {
    turned_over_percent: f64,
    turned_over_percent_most: f64,
    /// By how much the area of the firm triangles changes on average.
    area_change_percent: f64,
    /// Percent of the width at rest that a model's vertices are away from those of the picture, on average.
    model_error_percent: Option<f64>,
}

impl MeshMeasures {
    fn of(puppet: &Puppet, performance: &Performance) -> Self {
        let (rest, triangles) = puppet.rest();
        let areas: Vec<f64> = triangles.iter().map(|triangle| doubled_area(rest, triangle)).collect();
        let skin = puppet.skin();
        let is_firm = |triangle: &[usize; 3]| {
            skin.as_ref().is_none_or(|skin| triangle.iter().all(|&vertex| skin.is_firm(vertex)))
        };
        let firm: Vec<bool> = triangles.iter().map(is_firm).collect();
        let whole: f64 = areas.iter().zip(&firm).filter(|(_, firm)| **firm).map(|(area, _)| area.abs()).sum();
        let looked_at: Vec<usize> =
            (0..performance.frames).step_by(performance.frames.div_ceil(MAX_FRAMES).max(1)).collect();
        let look = |workspace: &mut PuppetWorkspace, &frame: &usize| {
            let side = if performance.is_mirrored[frame] { -1.0 } else { 1.0 };
            let deformed = puppet.deformed(performance, frame, workspace);
            let (mut turned_over, mut now) = (0.0, 0.0);
            for ((triangle, area), firm) in triangles.iter().zip(&areas).zip(&firm) {
                let after = doubled_area(deformed, triangle) * side;
                if after * area <= 0.0 {
                    turned_over += 1.0;
                }
                if *firm {
                    now += after.abs();
                }
            }
            let error = skin.as_ref().map_or(0.0, |skin| model_error(skin, performance, frame, deformed));
            [100.0 * turned_over / triangles.len() as f64, 100.0 * (now / whole.max(1e-12) - 1.0).abs(), error]
        };
        let seen: Vec<[f64; 3]> = looked_at.par_iter().map_init(|| puppet.workspace(), look).collect();
        let mean = |value: usize| seen.iter().map(|seen| seen[value]).sum::<f64>() / seen.len() as f64;
        let across = rest.iter().map(|place| place.x);
        let width = across.clone().fold(f64::MIN, f64::max) - across.fold(f64::MAX, f64::min);
        Self {
            turned_over_percent: mean(0),
            turned_over_percent_most: seen.iter().map(|seen| seen[0]).fold(0.0, f64::max),
            area_change_percent: mean(1),
            model_error_percent: skin.is_some().then(|| 100.0 * mean(2) / width.max(1e-9)),
        }
    }
}

/// How far a model's vertices are away from those of the picture at a frame, on average.
fn model_error(skin: &Skin<'_>, performance: &Performance, frame: usize, deformed: &[DVec2]) -> f64 {
    let (mut joints, root) = performance.joints_about_root(frame);
    let side = DVec2::new(if performance.is_mirrored[frame] { -1.0 } else { 1.0 }, 1.0);
    joints.iter_mut().for_each(|joint| *joint *= side);
    let placed = skin.placed(&joints);
    let off = |(model, picture): (&DVec2, &DVec2)| (*model * side + root).distance(*picture);
    placed.iter().zip(deformed).map(off).sum::<f64>() / placed.len() as f64
}
