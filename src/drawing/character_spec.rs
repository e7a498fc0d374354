//! The joints of a drawing, in pixels.

use serde::{Deserialize, Serialize};

use super::{
    DrawingError,
    yaml::{self, NotUsed},
};

/// Joints of one drawing.
pub(super) const MAX_JOINTS: usize = 128;
/// Bytes of the name of a joint.
const MAX_NAME: usize = 200;
/// Pixels along one side of a drawing.
const MAX_SIDE: u32 = 16_384;

/// The size of a drawing and its joints.
#[derive(Clone, Debug, Deserialize)]
pub struct CharacterSpec {
    /// In pixels.
    pub height: u32,
    /// In pixels.
    pub width: u32,
    /// The joints.
    pub skeleton: Vec<JointSpec>,
    #[serde(flatten)]
    not_used: NotUsed,
}

/// A joint of a drawing.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct JointSpec {
    /// Its name.
    pub name: String,
    /// The joint that it hangs on; the root has none.
    pub parent: Option<String>,
    /// In pixels from the left and from the top.
    pub loc: [f64; 2],
}

impl CharacterSpec {
    /// Reads and checks the text of a character config.
    ///
    /// # Errors
    ///
    /// With the place of what is wrong.
    pub fn read(text: &str) -> Result<Self, DrawingError> {
        let spec: Self = yaml::parse(text)?;
        for (field, side) in [("height", spec.height), ("width", spec.width)] {
            if side == 0 || side > MAX_SIDE {
                let fix = format!("give the {field} of the texture, 1 to {MAX_SIDE}");
                return Err(DrawingError::new(field, format!("{side} pixels"), fix));
            }
        }
        let pixels = u64::from(spec.height) * u64::from(spec.width);
        if pixels > super::MAX_TEXTURE_PIXELS as u64 {
            let detail = format!("{} by {} pixels", spec.width, spec.height);
            let fix = format!("make the drawing smaller: {} pixels at most", super::MAX_TEXTURE_PIXELS);
            return Err(DrawingError::new("width, height", detail, fix));
        }
        if spec.skeleton.len() > MAX_JOINTS {
            let detail = format!("{} joints", spec.skeleton.len());
            return Err(DrawingError::new("skeleton", detail, format!("keep to {MAX_JOINTS}")));
        }
        for (index, joint) in spec.skeleton.iter().enumerate() {
            spec.check_joint(index, joint)?;
        }
        if !spec.skeleton.iter().any(|joint| joint.name == "root" && joint.parent.is_none()) {
            let fix = "name the joint without parent root";
            return Err(DrawingError::new("skeleton", "there is no joint root without parent", fix));
        }
        Ok(spec)
    }

    fn check_joint(&self, index: usize, joint: &JointSpec) -> Result<(), DrawingError> {
        let place = |field: &str| format!("skeleton[{index}].{field}");
        let [x, y] = joint.loc;
        if !(0.0..f64::from(self.width)).contains(&x) || !(0.0..f64::from(self.height)).contains(&y) {
            let detail = format!("{x}, {y} is outside the {} by {} pixels of the drawing", self.width, self.height);
            return Err(DrawingError::new(place("loc"), detail, "move the joint into the drawing"));
        }
        if joint.name.is_empty() || joint.name.len() > MAX_NAME {
            let detail = format!("a name of {} bytes", joint.name.len());
            return Err(DrawingError::new(place("name"), detail, format!("give a name of 1 to {MAX_NAME} bytes")));
        }
        if self.skeleton[..index].iter().any(|other| other.name == joint.name) {
            let detail = format!("two joints are named {:?}", joint.name);
            return Err(DrawingError::new(place("name"), detail, "rename one of them"));
        }
        let Some(parent) = &joint.parent else {
            if joint.name == "root" {
                return Ok(());
            }
            let detail = format!("the joint {:?} has no parent", joint.name);
            return Err(DrawingError::new(place("parent"), detail, "hang it on another joint"));
        };
        if !self.skeleton.iter().any(|other| other.name == *parent) {
            return Err(DrawingError::unknown_name(place("parent"), parent, &self.names()));
        }
        Ok(())
    }

    fn names(&self) -> Vec<String> {
        self.skeleton.iter().map(|joint| joint.name.clone()).collect()
    }

    /// The side of the square that the drawing is padded to, in pixels.
    #[must_use]
    pub fn padded_side(&self) -> u32 {
        self.width.max(self.height)
    }

    /// The fields that nothing reads.
    #[must_use]
    pub fn not_used(&self) -> Vec<String> {
        self.not_used.keys().cloned().collect()
    }
}
