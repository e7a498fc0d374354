//! Where the picture is seen from, so that the whole figure is in it.

use glam::{Mat3, Mat4, Vec2, Vec3};

use super::view::CameraKind;

/// Half the angle of view along the shorter side.
const HALF_ANGLE_DEGREES: f32 = 14.0;
/// The share of the picture that the figure may fill.
const FILLED: f32 = 0.86;

/// A camera that sees in perspective.
#[derive(Clone, Copy, Debug)]
pub(super) struct Camera {
    pub(super) eye: Vec3,
    /// Columns: right, up, and back toward the viewer.
    axes: Mat3,
    /// Pixels per unit at distance 1.
    scale: f32,
    middle: Vec2,
    /// What is nearer is not seen.
    pub(super) near: f32,
}

/// Where a picture was seen from, in the space and the units of the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// Where the camera is.
    pub eye: Vec3,
    /// Unit vectors: what is to the right on the picture, what is up, and what is toward the viewer.
    pub axes: [Vec3; 3],
    /// The angle of view from the lower edge of the picture to the upper one.
    pub vertical_degrees: f32,
}

/// From which side a camera looks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Direction {
    /// From ahead of the figure toward its left.
    pub(super) azimuth_degrees: f32,
    /// Above the horizon.
    pub(super) elevation_degrees: f32,
}

impl Direction {
    /// `progress` is 0 at the first frame and 1 at the last.
    pub(super) fn of(kind: CameraKind, turn_degrees: f64, progress: f64) -> Self {
        let (azimuth, elevation, turn) = match kind {
            CameraKind::Front => (0.0, 6.0, turn_degrees),
            CameraKind::ThreeQuarter => (35.0, 12.0, turn_degrees),
            CameraKind::Side => (90.0, 6.0, turn_degrees),
            CameraKind::Back => (180.0, 6.0, turn_degrees),
            CameraKind::Top => (0.0, 89.0, turn_degrees),
            CameraKind::Orbit => (35.0, 12.0, if turn_degrees == 0.0 { 360.0 } else { turn_degrees }),
        };
        Self { azimuth_degrees: azimuth + (turn * progress) as f32, elevation_degrees: elevation }
    }

    fn axes(self) -> Mat3 {
        let (sin, cos) = self.azimuth_degrees.to_radians().sin_cos();
        let (rise, flat) = self.elevation_degrees.to_radians().sin_cos();
        let back = Vec3::new(sin * flat, rise, cos * flat);
        let right = Vec3::new(cos, 0.0, -sin);
        Mat3::from_cols(right, back.cross(right), back)
    }
}

impl Camera {
    /// The nearest camera in a direction that sees all points, in a picture of that many pixels.
    pub(super) fn fitting(direction: Direction, points: &[Vec3], [width, height]: [usize; 2]) -> Self {
        let axes = direction.axes();
        let tangent = HALF_ANGLE_DEGREES.to_radians().tan();
        let (width, height) = (width as f32, height as f32);
        let scale = 0.5 * width.min(height) / tangent;
        let seen: Vec<Vec3> = points.iter().map(|point| axes.transpose() * *point).collect();
        let low = seen.iter().copied().reduce(Vec3::min).unwrap_or(Vec3::NEG_ONE);
        let high = seen.iter().copied().reduce(Vec3::max).unwrap_or(Vec3::ONE);
        let size = (high - low).max_element().max(1e-6);
        let room = Vec2::new(width, height) * (0.5 * FILLED / scale);
        // As far away as each point asks for; the middle follows from that distance, and the distance from the middle.
        let mut center = (low + high) * 0.5;
        let mut distance = 0.0_f32;
        for _ in 0..4 {
            let needed = |point: &Vec3| {
                let off = ((*point - center).truncate()).abs() / room;
                off.max_element() + (point.z - center.z)
            };
            distance = seen.iter().map(needed).fold(0.1 * size, f32::max);
            let on_picture =
                |point: &Vec3| (*point - center).truncate() / (distance - (point.z - center.z)).max(1e-6 * size);
            let low = seen.iter().map(on_picture).reduce(Vec2::min).unwrap_or_default();
            let high = seen.iter().map(on_picture).reduce(Vec2::max).unwrap_or_default();
            center += ((low + high) * (0.5 * distance)).extend(0.0);
        }
        let eye = axes * (center + Vec3::Z * distance);
        Self { eye, axes, scale, middle: Vec2::new(width, height) * 0.5, near: 0.02 * distance }
    }

    /// The camera for a world that is so many times as large.
    pub(super) fn scaled(self, factor: f32) -> Self {
        Self { eye: self.eye * factor, near: self.near * factor, ..self }
    }

    /// The camera moved by some way.
    pub(super) fn moved(self, by: Vec3) -> Self {
        Self { eye: self.eye + by, ..self }
    }

    /// Where it is in the space of a file.
    pub(super) fn sight(&self, picture_from_file: &Mat4) -> Sight {
        let file_from_picture = picture_from_file.inverse();
        let axis = |axis: Vec3| file_from_picture.transform_vector3(axis).normalize_or_zero();
        Sight {
            eye: file_from_picture.transform_point3(self.eye),
            axes: [self.axes.x_axis, self.axes.y_axis, self.axes.z_axis].map(axis),
            vertical_degrees: 2.0 * (self.middle.y / self.scale).atan().to_degrees(),
        }
    }

    /// The same camera for a picture that is larger by a whole number.
    pub(super) fn enlarged(self, factor: f32) -> Self {
        Self { scale: self.scale * factor, middle: self.middle * factor, ..self }
    }

    /// In pixels, Y down, and the distance from the plane of the eye.
    pub(super) fn project(&self, place: Vec3) -> Vec3 {
        let seen = self.axes.transpose() * (place - self.eye);
        self.on_picture(Vec3::new(seen.x, seen.y, -seen.z))
    }

    /// In the axes of the camera: right, up, away.
    pub(super) fn see(&self, place: Vec3) -> Vec3 {
        let seen = self.axes.transpose() * (place - self.eye);
        Vec3::new(seen.x, seen.y, -seen.z)
    }

    /// What is seen at a place in the axes of the camera, in pixels, with its distance.
    pub(super) fn on_picture(&self, seen: Vec3) -> Vec3 {
        let factor = self.scale / seen.z;
        Vec3::new(self.middle.x + seen.x * factor, self.middle.y - seen.y * factor, seen.z)
    }

    /// The direction in which a pixel looks; its part away from the eye is 1.
    pub(super) fn ray(&self, x: f32, y: f32) -> Vec3 {
        self.axes * Vec3::new((x - self.middle.x) / self.scale, (self.middle.y - y) / self.scale, -1.0)
    }

    /// Toward the viewer.
    pub(super) fn back(&self) -> Vec3 {
        self.axes.z_axis
    }

    pub(super) fn right(&self) -> Vec3 {
        self.axes.x_axis
    }

    /// The angle that a pixel is wide.
    pub(super) fn pixel(&self) -> f32 {
        1.0 / self.scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_is_in_the_picture_and_one_is_near_its_edge() {
        let points: Vec<Vec3> = (0..8)
            .map(|corner| Vec3::new((corner & 1) as f32, 1.8 * ((corner >> 1) & 1) as f32, 3.0 * (corner >> 2) as f32))
            .collect();
        for kind in [CameraKind::Front, CameraKind::ThreeQuarter, CameraKind::Side, CameraKind::Back, CameraKind::Top] {
            for size in [[512, 512], [640, 200], [100, 900]] {
                let camera = Camera::fitting(Direction::of(kind, 0.0, 0.0), &points, size);
                let shown: Vec<Vec3> = points.iter().map(|point| camera.project(*point)).collect();
                let share = |at: &Vec3| {
                    let from_middle = Vec2::new(at.x / size[0] as f32 - 0.5, at.y / size[1] as f32 - 0.5) * 2.0;
                    from_middle.abs().max_element()
                };
                let farthest = shown.iter().map(share).fold(0.0, f32::max);
                assert!((0.8..0.9).contains(&farthest), "{kind:?} {size:?}: {farthest}");
                assert!(shown.iter().all(|at| at.z > camera.near), "{kind:?}: all points are ahead");
            }
        }
    }

    #[test]
    fn a_ray_leads_back_to_what_is_seen_there() {
        let direction = Direction { azimuth_degrees: 35.0, elevation_degrees: 12.0 };
        let camera = Camera::fitting(direction, &[Vec3::ZERO, Vec3::ONE], [300, 200]);
        let place = Vec3::new(0.3, 0.7, 0.2);
        let at = camera.project(place);
        let found = camera.eye + camera.ray(at.x, at.y) * at.z;
        assert!(found.distance(place) < 1e-4, "{found}");
    }
}
