//! The take: stack, layer, curve nodes and curves, and how they hang together.

use std::sync::Arc;

use crate::{
    formats::FormatError,
    model::{Clip, Control, Track},
};

use super::{
    binary::{Array, Packer, Property, Record},
    curves::{Curve, Curves, NodeCurves},
    figure::Figure,
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
        curves: Vec<NodeCurves>,
        shapes: &[(&Track<f32>, i64)],
        control: &Control,
    ) -> Result<(), FormatError> {
        let ticks = ticks(clip);
        let (stack_id, layer_id) = match self.stacks {
            0 => (FIRST_STACK_ID, FIRST_LAYER_ID),
            index => (FURTHER_STACKS_ID + 2 * i64::from(index), FURTHER_STACKS_ID + 2 * i64::from(index) + 1),
        };
        self.stacks += 1;
        self.objects.extend([stack(stack_id, stack_name(clip), ticks[0], ticks[ticks.len() - 1]), layer(layer_id)]);
        self.connections.push(connection(layer_id, stack_id));
        let mut packer = Packer::default();
        let times = KeyTimes::new(&ticks, &mut packer);
        for (node, curves) in figure.nodes.iter().zip(curves) {
            control.check()?;
            curves.channels.into_iter().for_each(|curves| self.add((layer_id, node.id), &times, curves));
        }
        for (weights, shape) in shapes {
            control.check()?;
            if let Some(curves) = Curves::of_weights(weights, &mut packer) {
                self.add((layer_id, *shape), &times, curves);
            }
        }
        Ok(())
    }

    /// Adds the curves of one channel of an object: a key per frame, or one for all frames.
    fn add(&mut self, (layer, object): (i64, i64), times: &KeyTimes, curves: Curves) {
        let Curves { channel, keys, axes } = curves;
        let node_id = self.next_id();
        self.curve_nodes += 1;
        let axes = || channel.axes().iter().zip(&axes);
        let defaults = Record::new("Properties70")
            .holding(axes().map(|(axis, curve)| property(axis, "Number", "", "A", [curve.first.into()])));
        self.objects.push(
            Record::new("AnimationCurveNode").with(node_id).with(channel.node_name()).with("").holding([defaults]),
        );
        self.connections.push(connection(node_id, layer));
        self.connections.push(connection_to_property(node_id, object, channel.property()));
        for (axis, axis_curve) in axes() {
            let curve_id = self.next_id();
            self.curves += 1;
            self.objects.push(curve(curve_id, times, keys, axis_curve));
            self.connections.push(connection_to_property(curve_id, node_id, axis));
        }
    }

    fn next_id(&self) -> i64 {
        FIRST_CURVE_ID + i64::from(self.curve_nodes) + i64::from(self.curves)
    }
}

/// Key times as they lie in the file, of all curves of a clip.
struct KeyTimes {
    of_all: Arc<Array>,
    of_first: Arc<Array>,
    /// What linear keys have to say of their tangents.
    no_data: Arc<Array>,
}

impl KeyTimes {
    fn new(ticks: &[i64], packer: &mut Packer) -> Self {
        Self { of_all: packer.longs(ticks), of_first: packer.longs(&ticks[..1]), no_data: packer.singles(&[0.0; 4]) }
    }

    /// Of as many keys: one, or one per frame.
    fn of(&self, keys: usize) -> Arc<Array> {
        Arc::clone(if keys == 1 { &self.of_first } else { &self.of_all })
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

fn curve(id: i64, times: &KeyTimes, keys: usize, curve: &Curve) -> Record {
    Record::new("AnimationCurve")
        .with(id)
        .with("\0\u{1}AnimCurve")
        .with("")
        .field("Default", f64::from(curve.first as f32))
        .field("KeyVer", KEY_VERSION)
        .field("KeyTime", times.of(keys))
        .field("KeyValueFloat", Arc::clone(&curve.values))
        .field("KeyAttrFlags", Property::Wholes(vec![LINEAR]))
        .field("KeyAttrDataFloat", Arc::clone(&times.no_data))
        .field("KeyAttrRefCount", Property::Wholes(vec![i32::try_from(keys).unwrap_or(i32::MAX)]))
}
