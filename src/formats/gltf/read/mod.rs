//! A file to a [`Scene`].

mod accessor;
mod animation;
mod appearance;
mod contacts;
mod curve;
mod extensions;
mod humanoid;
mod look_at;
mod meshopt;
mod morph_meshes;
mod morphs;
mod nodes;
mod paints;
mod points;
mod properties;
mod skins;

use super::{container, document::Document, json};
use crate::{
    formats::{Budget, Format, FormatError, straighten},
    model::{Axes, Joint, Payload, Reporter, Scene, Skeleton},
};
use accessor::Accessors;

pub(in crate::formats) use appearance::appearance;
pub(in crate::formats) use morph_meshes::morph_meshes;

/// Decodes any of the glTF formats. The bytes, not `format`, decide between GLB and JSON, and humanoid maps are found in
/// files of any name.
///
/// # Errors
/// When the container, the JSON or anything about nodes, skins and animations is broken, lies in another file, needs an
/// extension that we do not have, or exceeds the budget; or when the work is canceled. What is wrong with meshes,
/// materials and images alone is no error.
pub(in crate::formats) fn read(
    bytes: &[u8],
    format: Format,
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<Scene, FormatError> {
    let parts = container::split(bytes, reporter)?;
    let json = json::parse(parts.json, budget)?;
    let document = Document::new(json, &parts, budget, reporter)?;
    let root = document.root();
    extensions::check_required(&root, reporter)?;

    let mut graph = nodes::read(&root, budget, reporter)?;
    let mut accessors = Accessors::new(&document);
    let mut skins = skins::read(&mut accessors, &graph, budget, reporter)?;
    let skin_vertices = points::read(&mut accessors, &graph, &mut skins, budget, reporter)?;
    let humanoid = humanoid::read(&root, &graph, reporter)?;
    let is_vrm = matches!(format, Format::Vrm | Format::Vrma);
    if is_vrm && humanoid.is_none() {
        let detail = "the file is named as VRM, but holds no humanoid map; its roles will have to be found";
        reporter.warn("humanoid_missing", "/extensions", detail, "");
    }
    let mut morphs = morphs::read(&document.json, &graph, budget)?;
    let properties = properties::read(&document.json, morphs.all.len(), budget)?;
    let clips = animation::read(&mut accessors, &graph, &morphs, properties.of_animations, budget, reporter)?;
    morphs.all.extend(properties.all);

    let (declared_convention, declared_roles) =
        humanoid.map_or((None, Vec::new()), |map| (Some(map.convention), map.roles));
    let (is_shown, graph_size) = (std::mem::take(&mut graph.is_shown), graph.joints.len());
    let skeleton = mark_joints(graph, skins.skins.iter().flat_map(|skin| &skin.joints), &declared_roles)?;
    let clips = contacts::with_contacts(clips, &document.json, &skeleton, budget)?;
    let scene = Scene {
        hidden_joints: hidden_joints(&skeleton, &is_shown, reporter),
        skeleton,
        clips,
        skins: skins.skins,
        bind_pose: skins.bind_pose,
        skin_points: skin_vertices.points(graph_size),
        skin_vertices: skin_vertices.into(),
        morphs: morphs.all,
        declared_roles,
        declared_convention,
        axes: Some(Axes::Y_UP_Z_FRONT),
        unit_meters: Some(1.0),
        look_at: morphs.look_at,
        gaze_joint: morphs.gaze_joint,
        stretched: None,
        payload: Payload::new(document),
    };
    straighten(scene, budget, reporter)
}

/// Nodes that viewers do not show, where there are joints both among them and among the others.
fn hidden_joints(skeleton: &Skeleton, is_shown: &[bool], reporter: &mut Reporter) -> Vec<usize> {
    let (shown, hidden): (Vec<usize>, Vec<usize>) = (0..skeleton.len()).partition(|joint| is_shown[*joint]);
    let joints = |all: &[usize]| all.iter().filter(|joint| skeleton.joints()[**joint].is_joint).count();
    let Some(first) = hidden.iter().find(|joint| skeleton.joints()[**joint].is_joint) else { return Vec::new() };
    let of_shown = joints(&shown);
    reporter.warn(
        "joints_outside_scene",
        format!("/nodes/{}", skeleton.joints()[*first].node),
        format!(
            "{} joints are in no scene or in another one than viewers show, and {of_shown} in that one; {}",
            joints(&hidden),
            if of_shown > 0 { "a body among the latter is preferred" } else { "they were read all the same" }
        ),
        "set the document's default scene to the one with the character, or export one character per file",
    );
    if of_shown > 0 { hidden } else { Vec::new() }
}

fn mark_joints<'a>(
    graph: nodes::Graph,
    skinned: impl Iterator<Item = &'a usize>,
    roles: &'a [(String, usize)],
) -> Result<Skeleton, FormatError> {
    let mut joints: Vec<Joint> = graph.joints;
    for joint in skinned.chain(roles.iter().map(|(_, joint)| joint)) {
        joints[*joint].is_joint = true;
    }
    Skeleton::new(joints).map_err(|error| FormatError::malformed("nodes", "/nodes", error.to_string()))
}
