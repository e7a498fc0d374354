//! Which joints of a rig are the bones of VRM's humanoid, for files that know no other skeleton.

use crate::model::HumanoidBone;

use super::rig::Rig;

/// Bones on the middle: role, bones from the body outward, each of which hangs from the one before it, and the bones that the first
/// one may hang from, the nearest first.
const MIDDLE: [(&str, &[&str], &[&str]); 5] = [
    ("pelvis", &["hips"], &[]),
    ("spine", &["spine", "chest", "upperChest"], &["hips"]),
    ("neck", &["neck"], &["upperChest", "chest", "spine", "hips"]),
    ("head", &["head"], &["neck", "upperChest", "chest", "spine", "hips"]),
    ("jaw", &["jaw"], &["head"]),
];

/// Bones of one side, likewise, without their side; a parent in small letters is on the middle.
const SIDES: [(&str, &[&str], &[&str]); 13] = [
    ("thigh", &["UpperLeg"], &["hips"]),
    ("shin", &["LowerLeg"], &["UpperLeg"]),
    ("foot", &["Foot"], &["LowerLeg"]),
    ("toe", &["Toes"], &["Foot"]),
    ("clavicle", &["Shoulder"], &["upperChest", "chest", "spine", "hips"]),
    ("upper_arm", &["UpperArm"], &["Shoulder", "upperChest", "chest", "spine", "hips"]),
    ("forearm", &["LowerArm"], &["UpperArm"]),
    ("hand", &["Hand"], &["LowerArm"]),
    ("thumb", &["ThumbMetacarpal", "ThumbProximal", "ThumbDistal"], &["Hand"]),
    ("index", &["IndexProximal", "IndexIntermediate", "IndexDistal"], &["Hand"]),
    ("middle", &["MiddleProximal", "MiddleIntermediate", "MiddleDistal"], &["Hand"]),
    ("ring", &["RingProximal", "RingIntermediate", "RingDistal"], &["Hand"]),
    ("pinky", &["LittleProximal", "LittleIntermediate", "LittleDistal"], &["Hand"]),
];

/// The bones without which VRM's humanoid is none, without their side where there are two of them.
const REQUIRED: [&str; 9] = ["hips", "spine", "head", "UpperLeg", "LowerLeg", "Foot", "UpperArm", "LowerArm", "Hand"];

impl Rig<'_> {
    /// The humanoid's bones that this rig has, parents before children. Eyes are none of them: a VRM animation has a gaze instead.
    ///
    /// Names that the file itself gives its joints in a VRM humanoid map hold; the others follow from the roles.
    #[must_use]
    pub fn humanoid_bones(&self) -> Vec<HumanoidBone> {
        let mut bones: Vec<HumanoidBone> = Vec::new();
        for (role, names, above) in MIDDLE {
            self.add_bones(&mut bones, role, &owned(names, ""), &owned(above, ""));
        }
        for side in ["left", "right"] {
            for (part, names, above) in SIDES {
                self.add_bones(&mut bones, &format!("{side}_{part}"), &owned(names, side), &owned(above, side));
            }
        }
        bones
    }

    fn add_bones(&self, bones: &mut Vec<HumanoidBone>, role: &str, names: &[String], above: &[String]) {
        let joints = self.role(role);
        // A limb without the joint above it cannot hang anywhere.
        let mut parent = above.iter().find_map(|name| bones.iter().position(|bone| bone.name == *name));
        if parent.is_none() && !above.is_empty() {
            return;
        }
        for (name, joint) in self.named_bones(joints, names) {
            let turned_by = if names.len() == 1 { joints.last().copied().unwrap_or(joint) } else { joint };
            bones.push(HumanoidBone { name, parent, joint, turned_by });
            parent = Some(bones.len() - 1);
        }
    }

    /// Which of some bones the joints of a role are.
    fn named_bones(&self, joints: &[usize], names: &[String]) -> Vec<(String, usize)> {
        let declared: Vec<(String, usize)> = names
            .iter()
            .filter_map(|name| Some((name.clone(), self.declared_bone(name).filter(|joint| joints.contains(joint))?)))
            .collect();
        if !declared.is_empty() {
            return declared;
        }
        let place = |index: usize| match (joints.len(), index) {
            // Of a long spine, the ends and the middle.
            (count, 2) if count > 3 && names[0] == "spine" => count - 1,
            (count, 1) if count > 3 && names[0] == "spine" => count / 2,
            _ => index,
        };
        let joint = |index: usize| joints.get(place(index)).copied();
        names.iter().enumerate().map_while(|(index, name)| Some((name.clone(), joint(index)?))).collect()
    }

    /// The joint that the file's own humanoid map gives that name.
    fn declared_bone(&self, name: &str) -> Option<usize> {
        let scene = self.scene;
        let convention = scene.declared_convention.filter(|convention| convention.starts_with("vrm"))?;
        // VRM 0.x calls the joints of a thumb otherwise.
        let name = match convention {
            "vrm0" if name.ends_with("ThumbProximal") => name.replace("Proximal", "Intermediate"),
            "vrm0" if name.ends_with("ThumbMetacarpal") => name.replace("Metacarpal", "Proximal"),
            _ => name.to_owned(),
        };
        scene.declared_roles.iter().find(|(role, _)| *role == name).map(|(_, joint)| *joint)
    }
}

/// Names of the humanoid's required bones that are not among these.
#[must_use]
pub fn missing_bones(bones: &[HumanoidBone]) -> Vec<String> {
    let sides = |name: &'static str| if is_of_a_side(name) { vec!["left", "right"] } else { vec![""] };
    let required = REQUIRED.iter().flat_map(|name| sides(name).into_iter().map(move |side| format!("{side}{name}")));
    required.filter(|name| bones.iter().all(|bone| bone.name != *name)).collect()
}

fn is_of_a_side(name: &str) -> bool {
    name.starts_with(|letter: char| letter.is_ascii_uppercase())
}

fn owned(names: &[&str], side: &str) -> Vec<String> {
    names.iter().map(|name| if is_of_a_side(name) { format!("{side}{name}") } else { (*name).to_owned() }).collect()
}
