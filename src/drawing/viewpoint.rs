//! From where drawings are seen: a camera in perspective.

use glam::{DVec2, DVec3};

use super::{ViewSection, scene_spec::FIELD_OF_VIEW_DEGREES};

/// What is nearer is not seen.
const NEAR: f64 = 0.1;

/// A camera and the size of its picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Viewpoint {
    place: DVec3,
    right: DVec3,
    up: DVec3,
    back: DVec3,
    size: DVec2,
    /// Pixels at a distance of 1.
    scale: f64,
}

impl Viewpoint {
    pub(super) fn new(view: &ViewSection) -> Self {
        let back = DVec3::from_array(view.camera_fwd).try_normalize().unwrap_or(DVec3::Z);
        let hint = if back.cross(DVec3::Y).length() < 1e-6 { DVec3::Z } else { DVec3::Y };
        let right = hint.cross(back).normalize();
        let size = DVec2::new(view.window_dimensions[0] as f64, view.window_dimensions[1] as f64);
        let scale = size.y / 2.0 / (FIELD_OF_VIEW_DEGREES / 2.0).to_radians().tan();
        Self { place: DVec3::from_array(view.camera_pos), right, up: back.cross(right), back, size, scale }
    }

    /// Where a place is on the picture, in pixels from the left and from the top; nowhere behind the camera.
    pub(super) fn seen(&self, place: DVec3) -> Option<DVec2> {
        let away = place - self.place;
        let distance = -away.dot(self.back);
        (distance > NEAR).then(|| {
            let on = DVec2::new(away.dot(self.right), -away.dot(self.up)) * (self.scale / distance);
            on + self.size / 2.0
        })
    }

    /// Pixels of a length of 1 on the plane at `z`, seen from straight ahead.
    pub(super) fn scale_at(&self, z: f64) -> f64 {
        let distance = (self.place - DVec3::new(0.0, self.place.y, z)).dot(self.back).abs();
        self.scale / distance.max(NEAR)
    }

    /// The place at the height of 0 that is seen at a place of the picture; nothing where that shows the sky.
    pub(super) fn on_floor(&self, at: DVec2) -> Option<DVec3> {
        let away = at - self.size / 2.0;
        let ray = self.right * (away.x / self.scale) - self.up * (away.y / self.scale) - self.back;
        let distance = -self.place.y / ray.y;
        (distance.is_finite() && distance > NEAR).then(|| self.place + ray * distance)
    }
}
