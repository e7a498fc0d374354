//! The take: stack, layer, curve nodes and curves, and how they hang together.

use glam::{DQuat, DVec3};

use crate::{
    formats::{
        FormatError,
        euler::{EulerOrder, EulerTrack, OrderChoice},
    },
    model::{Clip, Control, Track},
};

use super::{
    super::properties::SHAPE_WEIGHT,
    binary::{Property, Record},
    figure::{Figure, LimbNode, USUAL_ORDER, degrees},
    records::{connection, connection_to_property, property},
};

/// Ticks of FBX's clock; divisible by all frame rates in use.
const TICKS_PER_SECOND: f64 = 46_186_158_000.0;
const KEY_VERSION: i32 = 4008;
const LINEAR: i32 = 4;

/// Clips, as records: one stack each, of which the first is the active one.
pub(super) struct Animation {
    pub(super) name: String,
    pub(super) frames_per_second: Option<f64>,
    pub(super) start_ticks: i64,
    pub(super) stop_ticks: i64,
    pub(super) objects: Vec<Record>,
    pub(super) connections: Vec<Record>,
    /// How many objects there are of each kind, for the definitions.
    pub(super) curve_nodes: i32,
    pub(super) curves: i32,
    pub(super) stacks: i32,
}

/// What has keys, as FBX calls it.
#[derive(Clone, Copy)]
enum Channel {
    Translation,
    Rotation,
    Scaling,
    /// The weight of a blend shape.
    Weight,
}

impl Channel {
    const fn node_name(self) -> &'static str {
        match self {
            Self::Translation => "T\0\u{1}AnimCurveNode",
            Self::Rotation => "R\0\u{1}AnimCurveNode",
            Self::Scaling => "S\0\u{1}AnimCurveNode",
            Self::Weight => "DeformPercent\0\u{1}AnimCurveNode",
        }
    }

    const fn property(self) -> &'static str {
        match self {
            Self::Translation => "Lcl Translation",
            Self::Rotation => "Lcl Rotation",
            Self::Scaling => "Lcl Scaling",
            Self::Weight => SHAPE_WEIGHT,
        }
    }

    /// One curve each.
    const fn axes(self) -> &'static [&'static str] {
        match self {
            Self::Translation | Self::Rotation | Self::Scaling => &["d|X", "d|Y", "d|Z"],
            Self::Weight => &["d|DeformPercent"],
        }
    }
}

const FIRST_STACK_ID: i64 = 1;
const FIRST_LAYER_ID: i64 = 2;
/// Ids of the stacks after the first count from here, each followed by that of its layer.
const FURTHER_STACKS_ID: i64 = 16;
/// Ids of curves and curve nodes count from here; those of nodes are below.
const FIRST_CURVE_ID: i64 = 1 << 40;

impl Animation {
    /// What is animated for as long as this clip lasts, with no stack yet.
    pub(super) fn new(clip: &Clip) -> Self {
        let ticks = ticks(clip);
        Self {
            name: stack_name(clip).to_owned(),
            frames_per_second: clip.uniform_fps(),
            start_ticks: ticks[0],
            stop_ticks: ticks[ticks.len() - 1],
            objects: Vec::new(),
            connections: Vec::new(),
            curve_nodes: 0,
            curves: 0,
            stacks: 0,
        }
    }

    /// Adds a stack with the motion of the nodes, and of blend shapes: their weights, and the ids of what they are.
    pub(super) fn add_stack(
        &mut self,
        figure: &Figure<'_>,
        clip: &Clip,
        shapes: &[(&Track<f32>, i64)],
        control: &Control,
    ) -> Result<(), FormatError> {
        let times = ticks(clip);
        let (stack_id, layer_id) = match self.stacks {
            0 => (FIRST_STACK_ID, FIRST_LAYER_ID),
            index => (FURTHER_STACKS_ID + 2 * i64::from(index), FURTHER_STACKS_ID + 2 * i64::from(index) + 1),
        };
        self.stacks += 1;
        self.objects.extend([stack(stack_id, stack_name(clip), times[0], times[times.len() - 1]), layer(layer_id)]);
        self.connections.push(connection(layer_id, stack_id));
        for node in &figure.nodes {
            control.check()?;
            let tracks = &clip.joints()[node.joint];
            if let Some(values) = keys(&tracks.translation) {
                let values = values.iter().map(|value| value.as_dvec3() * figure.centimeters);
                self.add((layer_id, node.id), Channel::Translation, &times, columns(values));
            }
            if let Some(values) = keys(&tracks.rotation) {
                let mut track = EulerTrack::new(node.order);
                let angles = values.iter().map(|rotation| {
                    let angles = track.next(node.after_pre_rotation(rotation.as_dquat()));
                    degrees(node.order.by_axis(angles))
                });
                self.add((layer_id, node.id), Channel::Rotation, &times, columns(angles));
            }
            if let Some(values) = keys(&tracks.scale) {
                let values = values.iter().map(|value| value.as_dvec3());
                self.add((layer_id, node.id), Channel::Scaling, &times, columns(values));
            }
        }
        for (weights, shape) in shapes {
            control.check()?;
            if let Some(weights) = keys(weights) {
                let percent = weights.iter().map(|weight| f64::from(*weight) * 100.0);
                self.add((layer_id, *shape), Channel::Weight, &times, [percent.collect()]);
            }
        }
        Ok(())
    }

    /// Adds the curves of one channel of an object: a key per frame, or one for all frames.
    fn add<const N: usize>(
        &mut self,
        (layer, object): (i64, i64),
        channel: Channel,
        times: &[i64],
        columns: [Vec<f64>; N],
    ) {
        let node_id = self.next_id();
        self.curve_nodes += 1;
        let axes = || channel.axes().iter().zip(&columns);
        let defaults = Record::new("Properties70")
            .holding(axes().map(|(axis, values)| property(axis, "Number", "", "A", [values[0].into()])));
        self.objects.push(
            Record::new("AnimationCurveNode").with(node_id).with(channel.node_name()).with("").holding([defaults]),
        );
        self.connections.push(connection(node_id, layer));
        self.connections.push(connection_to_property(node_id, object, channel.property()));
        for (axis, values) in axes() {
            let curve_id = self.next_id();
            self.curves += 1;
            let values: Vec<f32> = values.iter().map(|value| *value as f32).collect();
            self.objects.push(curve(curve_id, &times[..values.len()], values));
            self.connections.push(connection_to_property(curve_id, node_id, axis));
        }
    }

    fn next_id(&self) -> i64 {
        FIRST_CURVE_ID + i64::from(self.curve_nodes) + i64::from(self.curves)
    }
}

/// Vectors by their axes.
fn columns(vectors: impl Iterator<Item = DVec3>) -> [Vec<f64>; 3] {
    let mut columns = [const { Vec::new() }; 3];
    for vector in vectors {
        columns.iter_mut().zip(vector.to_array()).for_each(|(column, value)| column.push(value));
    }
    columns
}

/// The values of a channel that is animated: one per frame, or one that holds.
fn keys<T>(track: &Track<T>) -> Option<&[T]> {
    match track {
        Track::Rest => None,
        Track::Constant(value) => Some(std::slice::from_ref(value)),
        Track::Sampled(values) => Some(values),
    }
}

impl LimbNode {
    /// What the node's own three angles have to give for a local rotation.
    fn after_pre_rotation(&self, rotation: DQuat) -> DQuat {
        (self.pre_rotation.inverse() * rotation).normalize()
    }

    /// The order whose angles are steadiest for a clip.
    pub(super) fn steadiest_order(&self, clip: &Clip) -> EulerOrder {
        let Track::Sampled(rotations) = &clip.joints()[self.joint].rotation else { return USUAL_ORDER };
        let mut choice = OrderChoice::new(USUAL_ORDER);
        let rotations = || rotations.iter().map(|rotation| self.after_pre_rotation(rotation.as_dquat()));
        rotations().for_each(|rotation| choice.look(rotation));
        if choice.is_in_doubt() {
            rotations().for_each(|rotation| choice.try_all(rotation));
        }
        choice.best()
    }
}

/// Key times on FBX's clock.
fn ticks(clip: &Clip) -> Vec<i64> {
    clip.times_seconds().iter().map(|time| (time * TICKS_PER_SECOND).round() as i64).collect()
}

fn stack_name(clip: &Clip) -> &str {
    if clip.name().is_empty() { "Take 001" } else { clip.name() }
}

fn stack(id: i64, name: &str, start: i64, stop: i64) -> Record {
    let time = |name, ticks: i64| property(name, "KTime", "Time", "", [ticks.into()]);
    Record::new("AnimationStack").with(id).with(format!("{name}\0\u{1}AnimStack")).with("").holding([Record::new(
        "Properties70",
    )
    .holding([
        time("LocalStart", start),
        time("LocalStop", stop),
        time("ReferenceStart", start),
        time("ReferenceStop", stop),
    ])])
}

/// Assimp leaves the whole animation out where this holds nothing.
fn layer(id: i64) -> Record {
    let weight = property("Weight", "Number", "", "A", [Property::from(100.0)]);
    Record::new("AnimationLayer")
        .with(id)
        .with("BaseLayer\0\u{1}AnimLayer")
        .with("")
        .holding([Record::new("Properties70").holding([weight])])
}

fn curve(id: i64, times: &[i64], values: Vec<f32>) -> Record {
    let keys = i32::try_from(times.len()).unwrap_or(i32::MAX);
    let default = f64::from(values[0]);
    Record::new("AnimationCurve")
        .with(id)
        .with("\0\u{1}AnimCurve")
        .with("")
        .field("Default", default)
        .field("KeyVer", KEY_VERSION)
        .field("KeyTime", Property::Longs(times.to_vec()))
        .field("KeyValueFloat", Property::Singles(values))
        .field("KeyAttrFlags", Property::Wholes(vec![LINEAR]))
        .field("KeyAttrDataFloat", Property::Singles(vec![0.0; 4]))
        .field("KeyAttrRefCount", Property::Wholes(vec![keys]))
}
