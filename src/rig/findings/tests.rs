//! Every finding on a rig that was made ill for it, and none on one that is well.

use std::collections::BTreeSet;

use glam::{DQuat, DVec3, Quat, Vec3};

use super::{FileFacts, Finding, FindingCode, Severity, examine};
use crate::{
    formats::{self, Format, Limits},
    model::{Clip, Control, Joint, JointTracks, Reporter, Scene, Skeleton, SkinPoint, SkinPoints, Track},
    rig::{Rig, RigSpec},
    samples,
};

fn findings(scene: &Scene) -> Vec<Finding> {
    let rig = Rig::new("source", scene, None, &RigSpec::default(), &mut Reporter::new()).expect("a rig");
    examine(&rig, FileFacts { can_have_skins: true, warnings: &[] })
}

fn codes(scene: &Scene) -> BTreeSet<FindingCode> {
    findings(scene).into_iter().map(|finding| finding.code).collect()
}

/// The mannequin with its mesh: skinned, no clip.
fn mannequin() -> Scene {
    let bytes = samples::mannequin();
    formats::read(&bytes, Format::Glb, &Limits::default(), &Control::new(), &mut Reporter::new()).expect("readable")
}

/// The same scene with other joints; parents stay before children.
fn with_joints(scene: &mut Scene, change: impl FnOnce(&mut Vec<Joint>)) {
    let mut joints = scene.skeleton.joints().to_vec();
    change(&mut joints);
    scene.skeleton = Skeleton::new(joints).expect("still a skeleton");
    for clip in &mut scene.clips {
        let (name, times, mut tracks) = clip.clone().into_parts();
        tracks.resize(scene.skeleton.len(), JointTracks::default());
        *clip = Clip::new(name, times, tracks).expect("still a clip");
    }
}

fn index(joints: &[Joint], name: &str) -> usize {
    joints.iter().position(|joint| joint.name.ends_with(name)).unwrap_or_else(|| panic!("there is a joint {name}"))
}

/// Takes a joint out; what hangs from it hangs from the joint above, where it was.
fn without(scene: &mut Scene, name: &str) {
    let model = scene.skeleton.rest_pose().to_model(&scene.skeleton);
    scene.clips.clear();
    with_joints(scene, |joints| {
        let gone = index(joints, name);
        let above = joints[gone].parent.expect("it has a parent");
        for (place, joint) in joints.iter_mut().enumerate().filter(|(_, joint)| joint.parent == Some(gone)) {
            joint.parent = Some(above);
            joint.rest = model.transforms()[above].relative(&model.transforms()[place]);
        }
        joints.remove(gone);
        for joint in joints.iter_mut() {
            joint.parent = joint.parent.map(|parent| if parent > gone { parent - 1 } else { parent });
        }
    });
}

/// Turns a joint about an axis of the model.
fn turn(joints: &mut [Joint], name: &str, turn: DQuat) {
    let joint = index(joints, name);
    let mut above = DQuat::IDENTITY;
    let mut current = joints[joint].parent;
    while let Some(parent) = current {
        above = joints[parent].rest.rotation * above;
        current = joints[parent].parent;
    }
    joints[joint].rest.rotation = above.conjugate() * turn * above * joints[joint].rest.rotation;
}

fn scale(scene: &mut Scene, name: &str, scale: DVec3) {
    with_joints(scene, |joints| {
        let joint = index(joints, name);
        joints[joint].rest.scale = scale;
    });
}

fn with_clip(scene: &mut Scene, times: Vec<f64>, change: impl Fn(usize, &mut JointTracks)) {
    let frames = times.len();
    let mut tracks = vec![JointTracks::default(); scene.skeleton.len()];
    for (joint, tracks) in tracks.iter_mut().enumerate() {
        tracks.rotation = Track::Constant(Quat::IDENTITY);
        change(joint, tracks);
    }
    scene.clips = vec![Clip::new(format!("{frames} frames"), times, tracks).expect("a clip")];
}

fn sampled(frames: usize) -> Track<Quat> {
    Track::Sampled((0..frames).map(|frame| Quat::from_rotation_x(frame as f32 * 0.1)).collect())
}

type Illness = (FindingCode, fn() -> Scene, fn(&mut Scene));

/// Which rig is made ill, and how.
const ILLNESSES: &[Illness] = &[
    (FindingCode::ScaleAboveSkeleton, samples::walk_scene, |scene| {
        with_joints(scene, |joints| {
            joints[0].is_joint = false;
            joints[0].name = "Armature".to_owned();
            joints[0].rest.scale = DVec3::splat(0.01);
        });
    }),
    (FindingCode::NonUniformScale, samples::walk_scene, |scene| scale(scene, "Spine1", DVec3::new(1.0, 1.35, 1.0))),
    (FindingCode::ScaledJoint, samples::walk_scene, |scene| scale(scene, "Head", DVec3::splat(1.5))),
    (FindingCode::NegativeScale, samples::walk_scene, |scene| scale(scene, "LeftHand", DVec3::new(-1.0, 1.0, 1.0))),
    (FindingCode::ZeroScale, samples::walk_scene, |scene| scale(scene, "RightHand", DVec3::ZERO)),
    (FindingCode::Shear, samples::walk_scene, |scene| {
        scale(scene, "LeftArm", DVec3::new(1.0, 2.0, 1.0));
        with_joints(scene, |joints| turn(joints, "LeftForeArm", DQuat::from_rotation_y(-0.5)));
    }),
    (FindingCode::JointNamesMissing, samples::walk_scene, |scene| {
        with_joints(scene, |joints| joints.iter_mut().for_each(|joint| joint.name.clear()));
    }),
    (FindingCode::JointNamesRepeated, samples::walk_scene, |scene| {
        with_joints(scene, |joints| {
            let name = joints[index(joints, "LeftHandIndex2")].name.clone();
            let joint = index(joints, "LeftHandIndex1");
            joints[joint].name = name;
        });
    }),
    (FindingCode::SidesSwapped, samples::walk_scene, |scene| {
        with_joints(scene, |joints| {
            for joint in joints {
                let name = joint.name.replace("Left", "?").replace("Right", "Left");
                joint.name = name.replace('?', "Right");
            }
        });
    }),
    (FindingCode::NoSkin, samples::walk_scene, |_| {}),
    (FindingCode::SeveralSkins, mannequin, |scene| scene.skins.push(scene.skins[0].clone())),
    (FindingCode::RoleUnskinned, mannequin, |scene| {
        let joints = scene.skeleton.joints().to_vec();
        scene.skins[0].joints.retain(|joint| !joints[*joint].name.contains("lowerarm"));
    }),
    (FindingCode::MeshOffJoints, mannequin, |scene| {
        let points = (0..scene.skeleton.len() as u32).flat_map(|joint| {
            let away = |point: &SkinPoint| SkinPoint { position: point.position + Vec3::splat(60.0), ..*point };
            scene.skin_points.of(joint as usize).iter().map(move |point| (joint, away(point)))
        });
        scene.skin_points = SkinPoints::new(scene.skeleton.len(), &points.collect::<Vec<_>>());
    }),
    (FindingCode::JointsUnskinned, mannequin, |scene| {
        with_joints(scene, |joints| {
            let parent = joints[1].parent;
            for (name, parent) in [("ik_foot_root", parent), ("ik_foot_l", Some(joints.len()))] {
                let joint = joints[1].clone();
                joints.push(Joint { name: name.to_owned(), is_joint: true, parent, ..joint });
            }
        });
    }),
    (FindingCode::InverseBindsMissing, mannequin, |scene| scene.skins[0].has_no_inverse_binds = true),
    (FindingCode::InverseBindsIdentity, mannequin, |scene| scene.skins[0].has_identity_binds = true),
    (FindingCode::BindPoseDiffers, mannequin, |scene| {
        with_joints(scene, |joints| turn(joints, "upperarm_l", DQuat::from_rotation_z(0.7)));
    }),
    (FindingCode::BindPoseIgnored, mannequin, |scene| {
        with_joints(scene, |joints| {
            joints.iter_mut().step_by(2).for_each(|joint| joint.rest.translation *= 3.0);
            turn(joints, "upperarm_l", DQuat::from_rotation_z(0.7));
        });
    }),
    (FindingCode::TooManyInfluences, mannequin, |scene| scene.skins[0].most_influences = 8),
    (FindingCode::NoBody, samples::walk_scene, |scene| {
        with_joints(scene, |joints| {
            joints.truncate(5);
            joints.iter_mut().enumerate().for_each(|(index, joint)| joint.name = format!("crane_{index}"));
        });
        scene.clips.clear();
    }),
    (FindingCode::SeveralBodies, samples::walk_scene, |scene| {
        with_joints(scene, |joints| {
            let (count, mut twin) = (joints.len(), joints.clone());
            for joint in &mut twin {
                if joint.parent.is_none() {
                    joint.rest.translation.x += 3.0;
                }
                joint.parent = joint.parent.map(|parent| parent + count);
                joint.node += count;
            }
            joints.append(&mut twin);
        });
    }),
    (FindingCode::SizeImplausible, samples::walk_scene, |scene| {
        with_joints(scene, |joints| joints.iter_mut().for_each(|joint| joint.rest.translation *= 100.0));
    }),
    (FindingCode::UnitUnknown, samples::walk_scene, |scene| scene.unit_meters = None),
    (FindingCode::FeetOffFloor, samples::walk_scene, |scene| {
        with_joints(scene, |joints| joints[0].rest.translation.y += 0.9);
    }),
    (FindingCode::RestPoseUnclear, samples::walk_scene, |scene| {
        with_joints(scene, |joints| {
            turn(joints, "LeftArm", DQuat::from_rotation_z(1.2));
            turn(joints, "RightArm", DQuat::from_rotation_z(-1.2));
        });
    }),
    (FindingCode::LimbDisconnected, samples::walk_scene, |scene| {
        let model = scene.skeleton.rest_pose().to_model(&scene.skeleton);
        with_joints(scene, |joints| {
            let (foot, root) = (index(joints, "LeftFoot"), 0);
            joints[foot].parent = Some(root);
            joints[foot].rest = model.transforms()[root].relative(&model.transforms()[foot]);
        });
    }),
    (FindingCode::LimbIncomplete, samples::walk_scene, |scene| without(scene, "LeftUpLeg")),
    (FindingCode::LimbCutOff, samples::walk_scene, |scene| {
        with_joints(scene, |joints| {
            for joint in joints
                .iter_mut()
                .filter(|joint| ["LeftLeg", "LeftFoot", "LeftToeBase"].iter().any(|name| joint.name.ends_with(name)))
            {
                joint.name = "stump".to_owned();
                joint.rest.translation *= 0.01;
            }
        });
    }),
    (FindingCode::LimbOnLimb, samples::walk_scene, |scene| {
        let model = scene.skeleton.rest_pose().to_model(&scene.skeleton);
        // Parents come before children: an arm of the other chain is hung from the leg.
        with_joints(scene, |joints| {
            let (arm, leg) = (index(joints, "LeftArm"), index(joints, "LeftUpLeg"));
            let (child, parent) = if arm > leg { (arm, leg) } else { (leg, arm) };
            joints[child].parent = Some(parent);
            joints[child].rest = model.transforms()[parent].relative(&model.transforms()[child]);
        });
    }),
    (FindingCode::BoneWithoutLength, samples::walk_scene, |scene| {
        with_joints(scene, |joints| {
            for name in ["LeftForeArm", "RightForeArm"] {
                let joint = index(joints, name);
                joints[joint].rest.translation = DVec3::ZERO;
            }
        });
    }),
    (FindingCode::BoneImplausible, samples::walk_scene, |scene| {
        with_joints(scene, |joints| {
            let joint = index(joints, "LeftHand");
            joints[joint].rest.translation *= 6.0;
        });
    }),
    (FindingCode::NameMisleads, samples::walk_scene, |scene| {
        with_joints(scene, |joints| {
            for side in ["Left", "Right"] {
                let chain = ["UpLeg", "Leg", "Foot", "ToeBase"].map(|part| index(joints, &format!("{side}{part}")));
                for place in 0..3 {
                    joints[chain[place]].name = joints[chain[place + 1]].name.clone();
                }
                joints[chain[3]].name = format!("{side}Extra");
            }
        });
    }),
    (FindingCode::KneeBackwards, samples::walk_scene, |scene| {
        with_joints(scene, |joints| turn(joints, "LeftLeg", DQuat::from_rotation_x(-0.5)));
    }),
    (FindingCode::ElbowBackwards, samples::walk_scene, |scene| {
        with_joints(scene, |joints| turn(joints, "LeftForeArm", DQuat::from_rotation_y(0.5)));
    }),
    (FindingCode::LimbsUneven, samples::walk_scene, |scene| {
        with_joints(scene, |joints| {
            let foot = index(joints, "LeftFoot");
            joints[foot].rest.translation *= 1.2;
        });
    }),
    (FindingCode::NoAnimation, samples::walk_scene, |scene| scene.clips.clear()),
    (FindingCode::ClipStill, samples::walk_scene, |scene| with_clip(scene, vec![0.0, 1.0], |_, _| {})),
    (FindingCode::ClipOneFrame, samples::walk_scene, |scene| with_clip(scene, vec![0.0], |_, _| {})),
    (FindingCode::ClipStartsLate, samples::walk_scene, |scene| {
        with_clip(scene, vec![2.0, 3.0], |_, tracks| tracks.rotation = sampled(2));
    }),
    (FindingCode::TracksConstant, samples::walk_scene, |scene| {
        with_clip(scene, vec![0.0, 1.0], |joint, tracks| {
            if joint < 5 {
                tracks.rotation = sampled(2);
            }
        });
    }),
    (FindingCode::ScaleAnimated, samples::walk_scene, |scene| {
        with_clip(scene, vec![0.0, 1.0], |_, tracks| {
            tracks.scale = Track::Sampled(vec![Vec3::ONE, Vec3::splat(1.2)]);
        });
    }),
    (FindingCode::BonesStretch, samples::walk_scene, |scene| {
        with_clip(scene, vec![0.0, 1.0], |_, tracks| {
            tracks.translation = Track::Sampled(vec![Vec3::Y, Vec3::Y * 1.1]);
        });
    }),
];

#[test]
fn every_illness_is_found_and_only_there() {
    let covered: BTreeSet<FindingCode> = ILLNESSES.iter().map(|(code, _, _)| *code).collect();
    assert_eq!(covered.len(), FindingCode::ALL.len(), "every finding has its illness");
    for (code, make, make_ill) in ILLNESSES {
        let mut scene = make();
        let before = codes(&scene);
        make_ill(&mut scene);
        let after = codes(&scene);
        let is_always_there = matches!(code, FindingCode::NoSkin);
        assert!(after.contains(code), "{}: not found among {after:?}", code.name());
        assert!(is_always_there || !before.contains(code), "{}: found on a rig that is well", code.name());
        if code.severity() == Severity::Error {
            let first = findings(&scene).remove(0);
            assert_eq!(first.code.severity(), Severity::Error, "the worst first");
        }
    }
}

#[test]
fn a_layer_of_controls_is_no_second_body() {
    let mut scene = samples::walk_scene();
    with_joints(&mut scene, |joints| {
        let (count, mut controls) = (joints.len(), joints.clone());
        for joint in &mut controls {
            joint.parent = joint.parent.map(|parent| parent + count);
            joint.node += count;
        }
        joints.append(&mut controls);
    });
    assert!(!codes(&scene).contains(&FindingCode::SeveralBodies), "both are in one place");
}

#[test]
fn what_is_well_gets_notes_only() {
    for scene in [samples::walk_scene(), samples::mannequin_scene(), mannequin()] {
        for finding in findings(&scene) {
            assert_eq!(finding.code.severity(), Severity::Note, "{finding:?}");
        }
    }
}

#[test]
fn findings_name_a_few_joints_and_count_the_rest() {
    let mut scene = samples::walk_scene();
    with_joints(&mut scene, |joints| joints.iter_mut().for_each(|joint| joint.name.clear()));
    let finding = findings(&scene).into_iter().find(|finding| finding.code == FindingCode::JointNamesMissing);
    let Finding { place, detail, .. } = finding.expect("found");
    assert!(place.starts_with('#') && detail.starts_with("65 joints") && detail.contains("and 60 more"), "{detail}");
}

#[test]
fn the_catalogue_is_complete_sentences() {
    let mut names: Vec<&str> = FindingCode::ALL.iter().map(|code| code.name()).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), FindingCode::ALL.len(), "codes are unique");
    for code in FindingCode::ALL {
        assert!(code.about().ends_with('.') && code.fix().ends_with('.'), "{}", code.name());
    }
}
