//! The document: header, settings, definitions, the nodes and how they hang together.

use glam::{DMat4, DVec3};

use crate::model::{Axes, SignedAxis};

use super::{
    animation::Animation,
    binary::{CREATION_TIME, FILE_ID, Property, Record, VERSION},
    figure::{Figure, LimbNode, USUAL_ORDER, degrees},
    mesh::Meshes,
    records::{connection, property},
};

const POSE_ID: i64 = 3;
const DOCUMENT_ID: i64 = 4;
const CREATOR: &str = concat!("retargetd ", env!("CARGO_PKG_VERSION"));
/// How a scale is handed on: as matrices do it, which is what most readers do whatever the file says.
const INHERIT_AS_MATRICES: i32 = 1;

impl Figure<'_> {
    fn model(&self, node: &LimbNode, meshes: &Meshes) -> Record {
        let joint = &self.skeleton.joints()[node.joint];
        let vector =
            |name, kind, flags, value: DVec3| property(name, kind, "", flags, value.to_array().map(Property::from));
        let kind = match node.is_limb {
            _ if meshes.is_node(node.joint) => "Mesh",
            true => "LimbNode",
            false => "Null",
        };
        let pre_rotation = degrees(USUAL_ORDER.by_axis(USUAL_ORDER.decompose(node.pre_rotation)));
        Record::new("Model")
            .with(node.id)
            .with(format!("{}\0\u{1}Model", self.name(node)))
            .with(kind)
            .field("Version", 232)
            .holding([Record::new("Properties70").holding([
                property("RotationActive", "bool", "", "", [1.into()]),
                property("RotationOrder", "enum", "", "", [node.rotation_order().into()]),
                property("InheritType", "enum", "", "", [INHERIT_AS_MATRICES.into()]),
                vector("PreRotation", "Vector3D", "", pre_rotation),
                vector("Lcl Translation", "Lcl Translation", "A", joint.rest.translation * self.centimeters),
                vector("Lcl Rotation", "Lcl Rotation", "A", DVec3::ZERO),
                vector("Lcl Scaling", "Lcl Scaling", "A", joint.rest.scale),
            ])])
            .field("Shading", Property::Whole(1))
            .field("Culling", "CullingOff")
    }

    fn attribute(&self, node: &LimbNode) -> Record {
        let name = format!("{}\0\u{1}NodeAttribute", self.name(node));
        let record = Record::new("NodeAttribute").with(node.attribute_id).with(name);
        if node.is_limb {
            record.with("LimbNode").field("TypeFlags", "Skeleton")
        } else {
            record.with("Null").field("TypeFlags", "Null")
        }
    }

    /// Where every node is at rest, for readers that do not take that from the nodes themselves.
    fn bind_pose(&self, meshes: &Meshes) -> Record {
        let mut model_from_joint: Vec<DMat4> = Vec::with_capacity(self.skeleton.len());
        for joint in self.skeleton.joints() {
            let rest = &joint.rest;
            let translation = rest.translation * self.centimeters;
            let local = DMat4::from_scale_rotation_translation(rest.scale, rest.rotation, translation);
            model_from_joint.push(joint.parent.map_or(local, |parent| model_from_joint[parent] * local));
        }
        // Where there are skins, what they bind is where they were made, and nothing is said of the rest.
        let matrix = |node: &LimbNode| match meshes.bind.is_empty() {
            true => Some(model_from_joint[node.joint]),
            false => meshes.bind.get(&node.joint).copied(),
        };
        let posed: Vec<(i64, DMat4)> = self.nodes.iter().filter_map(|node| Some((node.id, matrix(node)?))).collect();
        let poses = posed.iter().map(|(id, matrix)| {
            let matrix = matrix.to_cols_array().to_vec();
            Record::new("PoseNode").field("Node", *id).field("Matrix", Property::Numbers(matrix))
        });
        Record::new("Pose")
            .with(POSE_ID)
            .with("BindPose\0\u{1}Pose")
            .with("BindPose")
            .field("Type", "BindPose")
            .field("Version", 100)
            .field("NbPoseNodes", count(posed.len()))
            .holding(poses)
    }
}

/// All records of the file, in the order that readers expect.
pub(super) fn records(figure: &Figure<'_>, animation: Animation, meshes: Meshes, axes: Axes) -> Vec<Record> {
    let (settings, documents) = (settings(&animation, axes), documents(&animation));
    let definitions = definitions(figure, &animation, &meshes);
    let mut objects = Record::new("Objects");
    let mut connections = Record::new("Connections");
    for node in &figure.nodes {
        objects = objects.holding([figure.model(node, &meshes)]);
        connections = connections.holding([connection(node.id, node.parent_id)]);
        if !meshes.is_node(node.joint) {
            objects = objects.holding([figure.attribute(node)]);
            connections = connections.holding([connection(node.attribute_id, node.id)]);
        }
    }
    let bind_pose = figure.bind_pose(&meshes);
    let objects = objects.holding([bind_pose]).holding(meshes.objects).holding(meshes.materials.objects);
    let connections = connections.holding(meshes.connections).holding(meshes.materials.connections);
    vec![
        header(),
        Record::new("FileId").with(Property::Bytes(FILE_ID.to_vec())),
        Record::new("CreationTime").with(CREATION_TIME),
        Record::new("Creator").with(CREATOR),
        settings,
        documents,
        Record::new("References"),
        definitions,
        objects.holding(animation.objects),
        connections.holding(animation.connections),
    ]
}

fn header() -> Record {
    let stamp =
        ["Year", "Month", "Day", "Hour", "Minute", "Second", "Millisecond"].into_iter().zip([1970, 1, 1, 10, 0, 0, 0]);
    let stamp = stamp.fold(Record::new("CreationTimeStamp").field("Version", 1000), |record, (name, value)| {
        record.field(name, value)
    });
    Record::new("FBXHeaderExtension")
        .field("FBXHeaderVersion", 1003)
        .field("FBXVersion", VERSION as i32)
        .field("EncryptionType", 0)
        .holding([stamp])
        .field("Creator", CREATOR)
}

fn settings(animation: &Animation, axes: Axes) -> Record {
    let whole = |name, value: i32| property(name, "int", "Integer", "", [value.into()]);
    let number = |name, value: f64| property(name, "double", "Number", "", [value.into()]);
    let time = |name, ticks: i64| property(name, "KTime", "Time", "", [ticks.into()]);
    let (up, front) = (axes.up(), axes.front());
    // FBX names the axis that points at the viewer "front", which is where the figure looks, and the third one "coord".
    let side = SignedAxis::nearest(up.direction().cross(front.direction()));
    let (mode, custom) = time_mode(animation.frames_per_second);
    let mut rows = Vec::new();
    for (name, axis) in [("Up", up), ("Front", front), ("Coord", side)] {
        let [axis_name, sign_name] = match name {
            "Up" => ["UpAxis", "UpAxisSign"],
            "Front" => ["FrontAxis", "FrontAxisSign"],
            _ => ["CoordAxis", "CoordAxisSign"],
        };
        let (index, sign) = index_and_sign(axis);
        rows.extend([whole(axis_name, index), whole(sign_name, sign)]);
    }
    rows.extend([
        whole("OriginalUpAxis", -1),
        whole("OriginalUpAxisSign", 1),
        number("UnitScaleFactor", 1.0),
        number("OriginalUnitScaleFactor", 1.0),
        property("TimeMode", "enum", "", "", [mode.into()]),
        time("TimeSpanStart", animation.start_ticks),
        time("TimeSpanStop", animation.stop_ticks),
        number("CustomFrameRate", custom),
    ]);
    Record::new("GlobalSettings").field("Version", 1000).holding([Record::new("Properties70").holding(rows)])
}

fn index_and_sign(axis: SignedAxis) -> (i32, i32) {
    let direction = axis.direction().to_array();
    let index = direction.iter().position(|value| value.abs() > 0.5).unwrap_or(0);
    (index as i32, if direction[index] < 0.0 { -1 } else { 1 })
}

/// FBX's number for a frame rate, and the rate itself where it has none.
fn time_mode(frames_per_second: Option<f64>) -> (i32, f64) {
    const MODES: [(f64, i32); 8] =
        [(120.0, 1), (100.0, 2), (60.0, 3), (50.0, 4), (48.0, 5), (30.0, 6), (25.0, 10), (24.0, 11)];
    const CUSTOM: i32 = 14;
    let rate = frames_per_second.unwrap_or(30.0);
    let known = MODES.iter().find(|(known, _)| (known - rate).abs() < 1e-3);
    known.map_or((CUSTOM, rate), |(_, mode)| (*mode, -1.0))
}

fn documents(animation: &Animation) -> Record {
    let document = Record::new("Document").with(DOCUMENT_ID).with("Scene").with("Scene").holding([
        Record::new("Properties70").holding([
            property("SourceObject", "object", "", "", []),
            property("ActiveAnimStackName", "KString", "", "", [animation.name.as_str().into()]),
        ]),
        Record::new("RootNode").with(0_i64),
    ]);
    Record::new("Documents").field("Count", 1).holding([document])
}

fn definitions(figure: &Figure<'_>, animation: &Animation, meshes: &Meshes) -> Record {
    let nodes = count(figure.nodes.len());
    let kinds = [
        ("GlobalSettings", 1),
        ("NodeAttribute", nodes - count(meshes.nodes.len())),
        ("Geometry", meshes.geometries),
        ("Material", meshes.materials.materials),
        ("Texture", meshes.materials.textures),
        ("Video", meshes.materials.videos),
        ("Deformer", meshes.deformers),
        ("Model", nodes),
        ("Pose", 1),
        ("AnimationStack", animation.stacks),
        ("AnimationLayer", animation.stacks),
        ("AnimationCurveNode", animation.curve_nodes),
        ("AnimationCurve", animation.curves),
    ];
    let types = kinds
        .iter()
        .filter(|(_, count)| *count > 0)
        .map(|(kind, count)| Record::new("ObjectType").with(*kind).field("Count", *count));
    Record::new("Definitions")
        .field("Version", 100)
        .field("Count", kinds.iter().map(|(_, count)| count).sum::<i32>())
        .holding(types)
}

fn count(count: usize) -> i32 {
    i32::try_from(count).unwrap_or(i32::MAX)
}
