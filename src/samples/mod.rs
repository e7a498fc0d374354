//! The clip and the character that the demo and the tests use, made by code.
//!
//! A walk on a skeleton named and oriented as Mixamo does it, and a skinned mannequin with the names and bone axes of
//! Unreal 5, of another size, other proportions and another rest pose: the everyday job of the service, with nothing to
//! download and nobody's rights involved. Knows no rig convention as data; the names are plain text here.

mod capsules;
mod document;
mod drawing;
mod figure;
mod gait;
mod mannequin;
mod walker;

pub use drawing::drawing;
pub use gait::{WALK_FPS, WALK_SECONDS, WALK_SPEED};

use crate::model::{Clip, Scene};

/// A sample as a file.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// The name of the file.
    pub name: &'static str,
    /// What is in it, in half a sentence.
    pub about: &'static str,
    pub(crate) make: fn() -> Vec<u8>,
}

impl Sample {
    /// All of them.
    pub const ALL: [Self; 3] = [
        Self { name: "walk.glb", about: "a walk on a skeleton with Mixamo's joint names, T pose", make: walk_clip },
        Self { name: "mannequin.glb", about: "a skinned mannequin with Unreal 5 joint names, A pose", make: mannequin },
        Self {
            name: "drawing.zip",
            about: "a drawn child with the joints of Animated Drawings, to move with 'retargetd draw'",
            make: drawing,
        },
    ];

    /// Its bytes; always the same.
    #[must_use]
    pub fn bytes(&self) -> Vec<u8> {
        (self.make)()
    }
}

/// A man of 1.80 m who walks 4.8 m forward in four seconds, as the scene that [`walk_clip`] encodes: 65 joints with
/// Mixamo's names, T pose, +Y along the bones, one clip of 121 frames at 30 per second. A planted foot does not slide.
#[must_use]
pub fn walk_scene() -> Scene {
    let skeleton = walker::figure().skeleton();
    let clip: Clip = gait::walk(&walker::figure());
    Scene {
        skeleton,
        clips: vec![clip],
        axes: Some(crate::model::Axes::Y_UP_Z_FRONT),
        unit_meters: Some(1.0),
        ..Scene::default()
    }
}

/// The walk as a GLB without a mesh.
#[must_use]
pub fn walk_clip() -> Vec<u8> {
    let figure = walker::figure();
    let clip = gait::walk(&figure);
    document::Document::new(&figure).with_skin("Walker").with_clip(&clip).into_glb()
}

/// The skeleton of [`mannequin`] as a scene: 1.65 m tall, Unreal 5 names, A pose with the arms 45° down.
#[must_use]
pub fn mannequin_scene() -> Scene {
    Scene {
        skeleton: mannequin::figure().skeleton(),
        axes: Some(crate::model::Axes::Y_UP_Z_FRONT),
        unit_meters: Some(1.0),
        ..Scene::default()
    }
}

/// The mannequin as a GLB: capsules bound to its joints, one material, no animation.
#[must_use]
pub fn mannequin() -> Vec<u8> {
    let figure = mannequin::figure();
    let mesh = capsules::mesh(&figure, &mannequin::shapes());
    document::Document::new(&figure).with_skin("Mannequin").with_mesh("Mannequin", &mesh).into_glb()
}

#[cfg(test)]
mod tests;
