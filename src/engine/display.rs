//! A file of any format as a plain GLB, for viewers that know nothing else.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DVec3, Mat4};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::{
    formats::{self, Limits},
    model::{
        Appearance, Axes, Carrier, Clip, Control, FourInfluences, Paint, Phase, Reporter, Scene, Skeleton, Surface,
    },
    picture::{capsules, plain_image},
    rig::{Rig, floors, standing_floor},
};

use super::{
    Failure, FailureCode, NamedBytes,
    drawn_bones::drawn_bones,
    files::load,
    preview::{chosen, rig_of},
};

/// Triangles of one figure.
const MAX_TRIANGLES: usize = 5_000_000;

/// What of a file is wanted for a viewer.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct DisplayOptions {
    /// The name of the clip; without one, the first that moves.
    pub clip: Option<String>,
    /// Whether surfaces are wanted beside the nodes.
    pub mesh: bool,
}

/// A file as a GLB in meters, +Y up and +Z front: decoded meshes, or where there are none capsules along the bones, plain materials,
/// textures of at most 1,024 pixels a side, and one clip. The first nodes are the file's in their order; `extras.joint` is how the API
/// calls each, and `extras.retargetd` of the scene has what a viewer wants to know.
///
/// # Errors
/// When the file cannot be read, is too large to be shown, or has no clip of that name.
pub fn display(
    file: NamedBytes<'_>,
    options: &DisplayOptions,
    limits: &Limits,
    control: &Control,
) -> Result<Vec<u8>, Failure> {
    let mut reporter = Reporter::new();
    let loaded = load(file, "source", limits, control, &mut reporter)?;
    let scene = &loaded.scene;
    let clip = chosen(scene, options.clip.as_deref())?;
    control.enter(Phase::Write, 1);
    let rig = rig_of(scene);
    let rig = rig.as_ref();
    let malformed = |error: crate::model::ClipError| Failure::new(FailureCode::AssetMalformed, error.to_string());
    let (skeleton, clip_of_nodes) = match &scene.stretched {
        Some(stretched) => {
            let clip =
                clip.map(|clip| stretched.clip_of_nodes(&scene.skeleton, clip)).transpose().map_err(malformed)?;
            (stretched.skeleton_of_nodes(&scene.skeleton), clip)
        }
        None => (scene.skeleton.clone(), clip.cloned()),
    };
    let unit = rig.map(|rig| rig.unit_meters).or(scene.unit_meters).filter(|unit| *unit > 0.0).unwrap_or(1.0);
    let axes = rig.map(|rig| rig.axes).or(scene.axes).unwrap_or(Axes::Y_UP_Z_FRONT);
    let appearance = if options.mesh {
        appearance(scene, rig, clip, &skeleton, (limits, control), &mut reporter)?
    } else {
        Appearance::default()
    };
    let extras = facts(scene, rig, clip, unit, (axes, appearance.triangle_count()));
    let nodes = Scene { skeleton, morphs: scene.morphs.clone(), ..Scene::default() };
    let space = (axes, unit);
    let written =
        formats::write_display(&nodes, clip_of_nodes.as_ref(), appearance, space, &extras, control, &mut reporter);
    written.map_err(Failure::from)
}

/// What can be seen: the file's own surfaces with images that viewers read, or a body of capsules.
fn appearance(
    scene: &Scene,
    rig: Option<&Rig<'_>>,
    clip: Option<&Clip>,
    skeleton: &Skeleton,
    (limits, control): (&Limits, &Control),
    reporter: &mut Reporter,
) -> Result<Appearance, Failure> {
    let is_animated = |morph: usize| clip.iter().flat_map(|clip| clip.morphs()).any(|track| track.morph == morph);
    let is_wanted = |morph: &usize| is_animated(*morph) || scene.morphs[*morph].rest != 0.0;
    let wanted: BTreeSet<usize> = (0..scene.morphs.len()).filter(is_wanted).collect();
    let mut found = formats::appearance(scene, &wanted, limits, control, reporter)?;
    if found.triangle_count() == 0 {
        let rest = skeleton.rest_pose().to_model(skeleton);
        let first = |role: &str| rig.and_then(|rig| rig.role(role).first().copied());
        let head = first("head").map(|head| (head, first("neck").or_else(|| first("pelvis"))));
        found = capsules(&rest, &drawn_bones(skeleton, rig), head);
    }
    let triangles = found.triangle_count();
    if triangles > MAX_TRIANGLES {
        let detail = format!("{triangles} triangles are more than the {MAX_TRIANGLES} that are shown");
        return Err(Failure::new(FailureCode::UnsupportedFeature, detail).with_hint("ask for it without its mesh"));
    }
    let used: BTreeSet<usize> = found.paints.iter().filter_map(|paint| paint.image).collect();
    for (index, image) in found.images.iter_mut().enumerate() {
        control.check()?;
        let bytes = std::mem::take(image);
        if used.contains(&index) {
            // One that cannot be decoded leaves its surfaces plain.
            *image = plain_image(bytes, used.len()).unwrap_or_default();
        }
    }
    unpaint_unwrapped(&mut found);
    found.surfaces = merged(found.surfaces);
    Ok(found)
}

/// Surfaces that do not say where on a texture they are have the color alone.
fn unpaint_unwrapped(found: &mut Appearance) {
    let mut plain_of: BTreeMap<usize, usize> = BTreeMap::new();
    for surface in found.surfaces.iter_mut().filter(|surface| surface.texture_coordinates.is_empty()) {
        let Some(paint) = surface.paint.filter(|paint| found.paints[*paint].image.is_some()) else { continue };
        surface.paint = Some(*plain_of.entry(paint).or_insert_with(|| {
            found.paints.push(Paint { image: None, ..found.paints[paint] });
            found.paints.len() - 1
        }));
    }
}

/// Surfaces that one joint carries each, and that are painted alike with nothing but a color, as one: a body of capsules is drawn at once.
fn merged(surfaces: Vec<Surface>) -> Vec<Surface> {
    let mut merged: BTreeMap<Option<usize>, Surface> = BTreeMap::new();
    let mut others = Vec::new();
    for surface in surfaces {
        let is_plain = surface.shapes.is_empty()
            && surface.texture_coordinates.is_empty()
            && surface.colors.is_empty()
            && surface.normals.len() == surface.positions.len();
        match surface.carrier {
            Carrier::Joint(joint) if is_plain => {
                let whole = merged.entry(surface.paint).or_insert_with(|| empty(surface.paint));
                append(whole, &surface, joint);
            }
            _ => others.push(surface),
        }
    }
    merged.into_values().chain(others).collect()
}

fn empty(paint: Option<usize>) -> Surface {
    Surface {
        positions: Vec::new(),
        normals: Vec::new(),
        texture_coordinates: Vec::new(),
        colors: Vec::new(),
        indices: Vec::new(),
        paint,
        carrier: Carrier::Skin { joints: Vec::new(), influences: vec![Vec::new()] },
        shapes: Vec::new(),
    }
}

/// Adds a surface that a joint carries, which is in the space of that joint as it is of a vertex that is bound by the identity.
fn append(whole: &mut Surface, surface: &Surface, joint: usize) {
    let Carrier::Skin { joints, influences } = &mut whole.carrier else { return };
    let place = joints.iter().position(|(known, _)| *known == joint).unwrap_or_else(|| {
        joints.push((joint, Mat4::IDENTITY));
        joints.len() - 1
    });
    let first = whole.positions.len() as u32;
    whole.positions.extend(&surface.positions);
    whole.normals.extend(&surface.normals);
    whole.indices.extend(surface.indices.iter().map(|index| first + index));
    let bound = FourInfluences { joints: [place as u16, 0, 0, 0], shares: [1.0, 0.0, 0.0, 0.0] };
    influences[0].extend(std::iter::repeat_n(bound, surface.positions.len()));
}

/// What a viewer wants to know beside what it sees.
fn facts(
    scene: &Scene,
    rig: Option<&Rig<'_>>,
    clip: Option<&Clip>,
    unit: f64,
    (axes, triangles): (Axes, usize),
) -> Value {
    let of_clip = |clip: &Clip| {
        json!({
            "name": clip.name(), "frames": clip.frame_count(), "seconds": clip.duration_seconds(),
            "fps": clip.uniform_fps(), "moves": clip.is_animated(),
        })
    };
    let clips: Vec<Value> = scene.clips.iter().map(of_clip).collect();
    let floor = rig.and_then(|rig| match clip {
        Some(clip) => floors(rig, clip).map(|(_, floor)| floor),
        None => standing_floor(rig),
    });
    let roles = rig.map(|rig| rig.roles.clone()).unwrap_or_default();
    // The front of the figure, in the space that is written.
    let front =
        rig.map_or(DVec3::Z, |rig| axes.canonical_from_this() * (rig.canonical_from_scene.inverse() * DVec3::Z));
    json!({
        "clips": clips,
        "clip": clip.map(Clip::name),
        "key_times_seconds": clip.map(Clip::times_seconds),
        "floor_meters": floor.map(|floor| floor * unit),
        "front": front.to_array().map(|part| (part * 1e6).round() / 1e6),
        "roles": roles,
        "triangles": triangles,
    })
}
