//! FBX, binary and text, through the `ufbx` parser.
//!
//! What comes out is +Y up, +Z front and meters, whatever the header says; a header that is wrong about the size is
//! believed here and judged by those who know what the joints mean. Pivots, pre- and post-rotations and rotation orders
//! are resolved into plain translation, rotation and scale; scale inheritance becomes the component-wise composition of
//! [`Transform`](crate::model::Transform) without any helper node. Of geometry only the vertices of skinned meshes are looked
//! at, though all of it is kept to be written back, and a file whose meshes cannot be decoded is read without them. Knows no rig convention, though a HumanIK characterization is handed on as it stands.

mod clips;
mod geometry;
mod keys;
mod load;
mod meshes;
mod nodes;
mod points;
mod properties;
mod skins;
mod write;

pub(super) use meshes::meshes;
pub(super) use write::write;

use crate::{
    formats::{Budget, FormatError, Limits, straighten, straighten_clips},
    model::{Axes, Clip, Control, Payload, Reporter, Scene, Skeleton, joints_stretched_in},
};

/// Decodes an FBX file.
///
/// # Errors
/// When the bytes are no FBX, break its rules, animate a node with numbers that are not finite, or exceed the budget; or
/// when the work is canceled.
pub(super) fn read(bytes: &[u8], budget: &mut Budget<'_>, reporter: &mut Reporter) -> Result<Scene, FormatError> {
    let file = load::load(bytes, budget, reporter)?;
    let nodes = nodes::Nodes::collect(&file, budget, reporter)?;
    let limits = *budget.limits();
    let skeleton = Skeleton::new(nodes.joints(&file))
        .map_err(|error| FormatError::malformed("nodes", "Objects", error.to_string()))?;
    let is_sheared = nodes::is_sheared(&file, &nodes, &skeleton);
    let properties = properties::Properties::find(&file, &nodes, budget)?;
    let (clips, origins) = clips::read_all(&file, &nodes, &properties, budget, reporter)?;
    let declared_roles = skins::declared_roles(&file, &nodes);
    let skin_vertices = points::skin_vertices(&file, &nodes, budget)?;
    let scene = Scene {
        morphs: properties.curves(&file),
        clips,
        hidden_joints: Vec::new(),
        skins: skins::skins(&file, &nodes),
        skin_points: skin_vertices.points(nodes.len()),
        skin_vertices: skin_vertices.into(),
        bind_pose: skins::bind_pose(&file, &nodes, &skeleton, reporter),
        declared_convention: (!declared_roles.is_empty()).then_some("humanik"),
        declared_roles,
        axes: Some(Axes::Y_UP_Z_FRONT),
        unit_meters: Some(1.0),
        look_at: None,
        gaze_joint: None,
        stretched: None,
        payload: Payload::default(),
        skeleton,
    };
    if !is_sheared {
        // Where a scale is not inherited, no matrices are multiplied either.
        let multiplies = !file.nodes.iter().any(|node| nodes::ignores_parent_scale(node));
        let scene = Scene { payload: Payload::new(FbxDocument { file, nodes, properties, origins, limits }), ..scene };
        return if multiplies { straighten_clips(scene, budget, reporter) } else { Ok(scene) };
    }
    // The joints are no longer those that the meshes are bound to, so they cannot be written back.
    let scene = straighten(scene, budget, reporter)?;
    nodes::report_shear(&file, &nodes, &scene.skeleton, reporter);
    Ok(scene)
}

/// What a scene keeps of its file, to write its meshes back.
struct FbxDocument {
    file: ufbx::SceneRoot,
    nodes: nodes::Nodes,
    properties: properties::Properties,
    /// One per clip.
    origins: Vec<clips::Origin>,
    /// What the file was read under.
    limits: Limits,
}

/// What the curves of a clip say at rising times on the clip's clock; nothing where no more is known than the clip says.
///
/// # Errors
/// When a curve gives a number that is not finite, a limit is exceeded, or the work is canceled.
pub(super) fn evaluated(
    scene: &Scene,
    clip: usize,
    times_seconds: &[f64],
    control: &Control,
) -> Result<Option<Clip>, FormatError> {
    let Some(document) = scene.payload.get::<FbxDocument>() else { return Ok(None) };
    let Some(origin) = document.origins.get(clip) else { return Ok(None) };
    let mut budget = Budget::new(&document.limits, control);
    let FbxDocument { file, nodes, properties, .. } = document;
    let found = clips::evaluated(file, nodes, properties, (clip, *origin), times_seconds, &mut budget)?;
    // Joints below a stretch were moved to where viewers show them when the clip was read; the curves know nothing of that.
    Ok(found.filter(|found| joints_stretched_in(&scene.skeleton, found) == 0))
}

/// Whether a scene came from a file of this format.
pub(super) fn has_document(scene: &Scene) -> bool {
    scene.payload.get::<FbxDocument>().is_some()
}

/// Whether a file that is written of a target holds the weights of one of its morphs: where that is a blend shape of an FBX.
pub(super) fn holds_morph(target: &Scene, morph: usize) -> bool {
    target.payload.get::<FbxDocument>().is_some_and(|document| document.properties.shape(morph).is_some())
}
