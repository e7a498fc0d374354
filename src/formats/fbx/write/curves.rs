//! Tracks as the curves of a file: angles in the steadiest order, and the keys of every axis as they lie in the file.
//!
//! All nodes at once, on as many threads as there are: angles and compression are nearly all of what writing costs.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use rayon::prelude::*;

use crate::{
    formats::euler::{EulerOrder, EulerTrack, OrderChoice},
    model::{Canceled, Clip, Control, Track},
};

use super::{
    super::properties::SHAPE_WEIGHT,
    binary::{Array, Packer},
    figure::{Figure, LimbNode, USUAL_ORDER, degrees},
};

/// Below this many keys, other threads cost more than they give.
const PARALLEL_KEYS: usize = 4_096;

/// What has keys, as FBX calls it.
#[derive(Clone, Copy)]
pub(super) enum Channel {
    Translation,
    Rotation,
    Scaling,
    /// The weight of a blend shape.
    Weight,
}

impl Channel {
    pub(super) const fn node_name(self) -> &'static str {
        match self {
            Self::Translation => "T\0\u{1}AnimCurveNode",
            Self::Rotation => "R\0\u{1}AnimCurveNode",
            Self::Scaling => "S\0\u{1}AnimCurveNode",
            Self::Weight => "DeformPercent\0\u{1}AnimCurveNode",
        }
    }

    pub(super) const fn property(self) -> &'static str {
        match self {
            Self::Translation => "Lcl Translation",
            Self::Rotation => "Lcl Rotation",
            Self::Scaling => "Lcl Scaling",
            Self::Weight => SHAPE_WEIGHT,
        }
    }

    /// One curve each.
    pub(super) const fn axes(self) -> &'static [&'static str] {
        match self {
            Self::Translation | Self::Rotation | Self::Scaling => &["d|X", "d|Y", "d|Z"],
            Self::Weight => &["d|DeformPercent"],
        }
    }
}

/// The curves of what is moved of a node.
pub(super) struct NodeCurves {
    /// The order of its angles.
    pub(super) order: EulerOrder,
    pub(super) channels: Vec<Curves>,
}

/// The curves of one channel, one per axis.
pub(super) struct Curves {
    pub(super) channel: Channel,
    /// One per frame, or one that holds.
    pub(super) keys: usize,
    pub(super) axes: Vec<Curve>,
}

/// One axis.
pub(super) struct Curve {
    pub(super) first: f64,
    pub(super) values: Arc<Array>,
}

impl Curves {
    fn new<const N: usize>(channel: Channel, columns: &Columns<N>, packer: &mut Packer) -> Self {
        let axes = columns.first.iter().zip(&columns.values);
        let axes = axes.map(|(first, values)| Curve { first: *first, values: packer.singles(values) }).collect();
        Self { channel, keys: columns.values[0].len(), axes }
    }

    /// Of a blend shape, in percent; nothing where it rests.
    pub(super) fn of_weights(weights: &Track<f32>, packer: &mut Packer) -> Option<Self> {
        let weights = keys(weights)?;
        let mut columns = Columns::new(weights.len());
        weights.iter().for_each(|weight| columns.push([f64::from(*weight) * 100.0]));
        Some(Self::new(Channel::Weight, &columns, packer))
    }
}

/// The curves of all nodes for a clip. Without `steadiest`, their angles are in the order that the nodes have.
///
/// # Errors
/// When the work is canceled.
pub(super) fn of_nodes(
    figure: &Figure<'_>,
    clip: &Clip,
    steadiest: bool,
    control: &Control,
) -> Result<Vec<NodeCurves>, Canceled> {
    let curves = |packer: &mut Packer, node: &LimbNode| {
        control.check()?;
        Ok(of_node(node, clip, figure.centimeters, steadiest, packer))
    };
    if figure.nodes.len() * clip.frame_count() < PARALLEL_KEYS {
        let mut packer = Packer::default();
        return figure.nodes.iter().map(|node| curves(&mut packer, node)).collect();
    }
    figure.nodes.par_iter().map_init(Packer::default, curves).collect()
}

fn of_node(node: &LimbNode, clip: &Clip, centimeters: f64, steadiest: bool, packer: &mut Packer) -> NodeCurves {
    let tracks = &clip.joints()[node.joint];
    let mut found = NodeCurves { order: if steadiest { USUAL_ORDER } else { node.order }, channels: Vec::new() };
    if let Some(values) = keys(&tracks.translation) {
        let columns = Columns::of_vectors(values.iter().map(|value| value.as_dvec3() * centimeters));
        found.channels.push(Curves::new(Channel::Translation, &columns, packer));
    }
    if let Some(values) = keys(&tracks.rotation) {
        let (order, columns) = if steadiest && matches!(tracks.rotation, Track::Sampled(_)) {
            node.in_steadiest_order(values.iter().map(|rotation| rotation.as_dquat()))
        } else {
            (found.order, node.angles(found.order, values.iter().map(|rotation| rotation.as_dquat())))
        };
        found.order = order;
        found.channels.push(Curves::new(Channel::Rotation, &columns, packer));
    }
    if let Some(values) = keys(&tracks.scale) {
        let columns = Columns::of_vectors(values.iter().map(|value| value.as_dvec3()));
        found.channels.push(Curves::new(Channel::Scaling, &columns, packer));
    }
    found
}

impl LimbNode {
    /// What the node's own three angles have to give for a local rotation.
    fn after_pre_rotation(&self, rotation: DQuat) -> DQuat {
        (self.pre_rotation.inverse() * rotation).normalize()
    }

    /// The angles of local rotations in degrees.
    fn angles(&self, order: EulerOrder, rotations: impl ExactSizeIterator<Item = DQuat>) -> Columns<3> {
        let mut track = EulerTrack::new(order);
        let angles = rotations.map(|rotation| track.next(self.after_pre_rotation(rotation)));
        Columns::of_vectors(angles.map(|angles| degrees(order.by_axis(angles))))
    }

    /// The order whose angles are steadiest, and the angles of local rotations in it.
    fn in_steadiest_order(&self, rotations: impl ExactSizeIterator<Item = DQuat> + Clone) -> (EulerOrder, Columns<3>) {
        let mut choice = OrderChoice::new(USUAL_ORDER);
        let turned = || rotations.clone().map(|rotation| self.after_pre_rotation(rotation));
        let as_usual =
            Columns::of_vectors(turned().map(|rotation| degrees(USUAL_ORDER.by_axis(choice.look(rotation)))));
        if choice.is_in_doubt() {
            turned().for_each(|rotation| choice.try_all(rotation));
        }
        match choice.best() {
            USUAL_ORDER => (USUAL_ORDER, as_usual),
            order => (order, self.angles(order, rotations)),
        }
    }
}

/// Values by their axes, as a file has them, and the first ones as they are.
struct Columns<const N: usize> {
    first: [f64; N],
    values: [Vec<f32>; N],
}

impl<const N: usize> Columns<N> {
    fn new(keys: usize) -> Self {
        Self { first: [0.0; N], values: std::array::from_fn(|_| Vec::with_capacity(keys)) }
    }

    fn push(&mut self, values: [f64; N]) {
        if self.values[0].is_empty() {
            self.first = values;
        }
        self.values.iter_mut().zip(values).for_each(|(column, value)| column.push(value as f32));
    }
}

impl Columns<3> {
    fn of_vectors(vectors: impl ExactSizeIterator<Item = DVec3>) -> Self {
        let mut columns = Self::new(vectors.len());
        vectors.for_each(|vector| columns.push(vector.to_array()));
        columns
    }
}

/// The values of a channel that is animated: one per frame, or one that holds.
fn keys<T>(track: &Track<T>) -> Option<&[T]> {
    match track {
        Track::Rest => None,
        Track::Constant(value) => Some(std::slice::from_ref(value)),
        Track::Sampled(values) => Some(values),
    }
}
