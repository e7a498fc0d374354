//! How a rest file was put onto a rig, as the rig keeps it.

/// What told how joints are turned about their bones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OrientationFrom {
    /// The axes of the joints, which are the same in both files.
    Axes,
    /// A pose that both files hold.
    CommonPose,
    /// Nothing: bones turn the shortest way, and as elbows and knees bend.
    Directions,
}

impl OrientationFrom {
    /// The name on the wire.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Axes => "axes",
            Self::CommonPose => "common_pose",
            Self::Directions => "directions",
        }
    }
}

/// How a rest file was put onto a rig.
#[derive(Clone, Debug, PartialEq)]
pub struct RestFit {
    /// Joints of the rig that were matched by their name.
    pub by_name: usize,
    /// Joints that were matched by their role.
    pub by_role: usize,
    /// Joints that were matched by how they hang together.
    pub by_structure: usize,
    /// Joints of the rig with a role that the rest file lacks; they ride their parents.
    pub missing: Vec<usize>,
    /// Joints of the rest file that the rig lacks.
    pub surplus: usize,
    /// How far the rest file was turned into the rig's space, in degrees.
    pub turned_degrees: f64,
    /// The rig's bone lengths over those of the rest file, the unit of the file included.
    pub scale: f64,
    /// Whether both have the same proportions.
    pub is_one_build: bool,
    /// What told how joints are turned about their bones.
    pub orientation_from: OrientationFrom,
    /// By joint of the rig, the angle between where its bones point in the solved pose and in the rest file, in degrees; the
    /// largest of its bones.
    pub residuals: Vec<(usize, f64)>,
}

impl RestFit {
    /// The largest residual, in degrees, and its joint.
    #[must_use]
    pub fn worst(&self) -> Option<(usize, f64)> {
        self.residuals.iter().copied().max_by(|one, other| one.1.total_cmp(&other.1))
    }

    /// How joints were matched and orientations found, as a clause for people.
    pub(super) fn in_words(&self) -> String {
        let ways = [(self.by_name, "name"), (self.by_role, "role"), (self.by_structure, "structure")];
        let matched: Vec<String> =
            ways.iter().filter(|(count, _)| *count > 0).map(|(count, way)| format!("{count} by {way}")).collect();
        let orientation = match self.orientation_from {
            OrientationFrom::Axes => "orientations are those of its joints",
            OrientationFrom::CommonPose => "orientations come from a pose that both files hold",
            OrientationFrom::Directions => "orientations follow from directions",
        };
        format!("joints were matched {}; {orientation}", matched.join(", "))
    }
}
