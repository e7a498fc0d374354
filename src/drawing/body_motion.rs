//! The places of a body's joints seen from the body: upright, facing +X, with the root at the origin.

use std::ops::Range;

use glam::{DMat3, DVec3};

use super::{DrawingError, MotionFile, MotionSpec, UpAxis};

/// The motion of a body.
#[derive(Clone, Debug)]
pub struct BodyMotion {
    /// The names of the joints.
    pub joint_names: Vec<String>,
    /// Seconds between frames.
    pub frame_time: f64,
    /// The root at each frame in the world: Y up, the body faces +X at the first frame, its ground joint is at height 0 there.
    pub roots: Vec<DVec3>,
    /// Where the body faces at each frame in that world.
    pub forwards: Vec<DVec3>,
    /// For each frame and joint the place relative to the root, turned about +Y until the body faces +X.
    pub places: Vec<DVec3>,
}

impl BodyMotion {
    /// The motion of a file as its config asks for it.
    ///
    /// # Errors
    ///
    /// Where the config names what the file does not have.
    pub fn new(file: &MotionFile, spec: &MotionSpec) -> Result<Self, DrawingError> {
        let range = spec.frames(file.frames)?;
        let find = |place: String, name: &str| {
            let index = file.joint_names.iter().position(|joint| joint == name);
            index.ok_or_else(|| DrawingError::unknown_name(place, name, &file.joint_names))
        };
        let ground = find("groundplane_joint".to_owned(), &spec.groundplane_joint)?;
        let mut pairs = Vec::new();
        for (index, (from, to)) in spec.forward_perp_joint_vectors.iter().enumerate() {
            let place = |side: usize| format!("forward_perp_joint_vectors[{index}][{side}]");
            pairs.push((find(place(0), from)?, find(place(1), to)?));
        }
        let upright = match spec.up {
            UpAxis::Y => DMat3::IDENTITY,
            UpAxis::Z => {
                let quarter = -std::f64::consts::FRAC_PI_2;
                DMat3::from_rotation_y(quarter) * DMat3::from_rotation_x(quarter)
            }
        };
        let frame_time = spec.frame_time.unwrap_or(file.frame_time);
        let body = Body { joint_names: file.joint_names.clone(), frame_time, ground, pairs };
        body.seen(range, (upright, spec.scale), |frame| file.places(frame))
    }

    /// The motion of a body whose joints are there at each frame, in a world with +Y up; the first is its root. `pairs` are indices of
    /// joints of its left side and of its right side.
    ///
    /// # Errors
    ///
    /// Where there is no frame, or where the pairs point straight up at some.
    pub fn of_places(
        joint_names: Vec<String>,
        frame_time: f64,
        pairs: Vec<(usize, usize)>,
        places: &[Vec<DVec3>],
    ) -> Result<Self, DrawingError> {
        if places.is_empty() {
            return Err(DrawingError::new("motion", "there are no frames", "give a clip that moves"));
        }
        let body = Body { joint_names, frame_time, ground: 0, pairs };
        body.seen(0..places.len(), (DMat3::IDENTITY, 1.0), |frame| places[frame].clone())
    }

    /// How many frames there are.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.roots.len()
    }

    /// How many joints there are.
    #[must_use]
    pub fn joints(&self) -> usize {
        self.joint_names.len()
    }

    /// The place of a joint at a frame.
    #[must_use]
    pub fn place(&self, frame: usize, joint: usize) -> DVec3 {
        self.places[frame * self.joints() + joint]
    }

    /// The place of a joint at a frame in the world of [`Self::roots`].
    #[must_use]
    pub fn world_place(&self, frame: usize, joint: usize) -> DVec3 {
        self.roots[frame] + facing_x(self.forwards[frame]).transpose() * self.place(frame, joint)
    }

    /// The first joint of a name.
    #[must_use]
    pub fn joint(&self, name: &str) -> Option<usize> {
        self.joint_names.iter().position(|joint| joint == name)
    }
}

/// What is known of a body before it is seen: the joints that its ground and its sides are taken from.
struct Body {
    joint_names: Vec<String>,
    frame_time: f64,
    ground: usize,
    pairs: Vec<(usize, usize)>,
}

impl Body {
    /// The frames of a range, which are turned upright and scaled.
    fn seen(
        self,
        range: Range<usize>,
        (upright, scale): (DMat3, f64),
        places_at: impl Fn(usize) -> Vec<DVec3>,
    ) -> Result<BodyMotion, DrawingError> {
        let Self { joint_names, frame_time, ground, pairs } = self;
        let start = places_at(range.start);
        let first: Vec<DVec3> = start.iter().map(|&place| upright * place).collect();
        let basis = facing_x(forward(&first, &pairs)?) * upright * scale;
        let mut motion = BodyMotion {
            frame_time,
            roots: Vec::with_capacity(range.len()),
            forwards: Vec::with_capacity(range.len()),
            places: Vec::with_capacity(range.len() * joint_names.len()),
            joint_names,
        };
        let origin = basis * start[0];
        let floor = basis * start[ground];
        let shift = DVec3::new(-origin.x, -floor.y, -origin.z);
        for frame in range {
            let places: Vec<DVec3> = places_at(frame).into_iter().map(|place| basis * place + shift).collect();
            let forward = forward(&places, &pairs)?;
            let turn = facing_x(forward);
            motion.roots.push(places[0]);
            motion.forwards.push(forward);
            motion.places.extend(places.iter().map(|&place| turn * (place - places[0])));
        }
        Ok(motion)
    }
}

/// Where a body faces: at right angles to the mean of the pairs' directions, level.
fn forward(places: &[DVec3], pairs: &[(usize, usize)]) -> Result<DVec3, DrawingError> {
    let across: DVec3 = pairs.iter().map(|&(from, to)| (places[to] - places[from]).normalize_or_zero()).sum();
    DVec3::Y.cross(across).try_normalize().ok_or_else(|| {
        let fix = "name pairs that go from the left side of the body to its right side";
        DrawingError::new("forward_perp_joint_vectors", "the pairs point straight up or cancel out", fix)
    })
}

/// The turn about +Y that takes a level direction to +X.
fn facing_x(forward: DVec3) -> DMat3 {
    DMat3::from_rotation_y(forward.z.atan2(forward.x))
}
