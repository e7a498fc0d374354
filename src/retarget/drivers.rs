//! What drives each target joint, in words of joints: the same decisions as those that a plan is compiled from.

use super::{
    mapping::{ChainPair, Mapping},
    ops::Carry,
};
use crate::model::Skeleton;

use super::{
    Plan,
    places::{Place, places},
};

/// What drives a target joint.
#[derive(Clone, Debug, PartialEq)]
pub enum JointDriver {
    /// Nothing: it keeps its rest transform under its parent.
    Nothing,
    /// The pelvis op: rotation and position of a source joint.
    Pelvis {
        /// The source joint.
        source: usize,
    },
    /// A chain: one source joint, or two and how much each counts; the weights add up to 1.
    Chain {
        /// Index into [`Mapping::chains`].
        chain: usize,
        /// Source joints and weights.
        sources: Vec<(usize, f64)>,
    },
    /// The twist of a limb, of which it takes a share. Where a chain drives it too, it adds to that.
    Twist {
        /// The target joint that the twist is seen between, beside the carrier or the end: the limb's segment.
        segment: usize,
        /// How much of the twist; −1 to 1.
        share: f64,
        /// The chain that turns it besides, where there is one: index into [`Mapping::chains`].
        chain: Option<usize>,
        /// Source joints and weights of that chain.
        sources: Vec<(usize, f64)>,
    },
    /// A clavicle that lifts with its arm.
    Shoulder {
        /// The target's upper arm.
        upper_arm: usize,
    },
    /// A chain that has nothing for this joint, so that it keeps its rest transform: a surplus joint, or rotation mode `none`.
    Surplus {
        /// Index into [`Mapping::chains`].
        chain: usize,
    },
}

/// One driver per target joint. The skeletons are those of the mapping.
#[must_use]
pub fn joint_drivers(source: &Skeleton, target: &Skeleton, mapping: &Mapping) -> Vec<JointDriver> {
    // A twist or a shoulder that nothing is there to be measured against is left out of the plan.
    let planned: Vec<usize> = Plan::new(source, target, mapping).outputs.iter().map(|output| output.joint).collect();
    let mut drivers = vec![JointDriver::Nothing; target.len()];
    for (index, chain) in mapping.chains.iter().enumerate() {
        // Chain places are shares of a chain's length, so it does not matter in which space and unit they are measured.
        let places = places(chain, mapping.source_rest.transforms(), mapping.target_rest.transforms());
        for (&joint, place) in chain.target.iter().zip(places) {
            drivers[joint] = match place {
                None => JointDriver::Surplus { chain: index },
                Some(place) => JointDriver::Chain { chain: index, sources: sources(chain, place) },
            };
        }
        if chain.drive.carry == Carry::Model {
            add_further(chain, mapping, &mut drivers);
        }
    }
    for shoulder in mapping.shoulders.iter().filter(|shoulder| planned.contains(&shoulder.joint)) {
        drivers[shoulder.joint] = JointDriver::Shoulder { upper_arm: shoulder.upper_arm };
    }
    for twist in mapping.twists.iter().filter(|twist| planned.contains(&twist.joint)) {
        let (chain, sources) = match std::mem::replace(&mut drivers[twist.joint], JointDriver::Nothing) {
            JointDriver::Chain { chain, sources } => (Some(chain), sources),
            JointDriver::Surplus { chain } => (Some(chain), Vec::new()),
            _ => (None, Vec::new()),
        };
        drivers[twist.joint] = JointDriver::Twist { segment: twist.segment, share: twist.share, chain, sources };
    }
    if let Some(pelvis) = &mapping.pelvis {
        drivers[pelvis.target] = JointDriver::Pelvis { source: pelvis.source };
    }
    drivers
}

/// The source joints of the further chains of which a chain follows the mean.
fn add_further(chain: &ChainPair, mapping: &Mapping, drivers: &mut [JointDriver]) {
    let further = chain.further();
    for strand in &further {
        let places = places(strand, mapping.source_rest.transforms(), mapping.target_rest.transforms());
        for (&joint, place) in chain.target.iter().zip(places) {
            if let (JointDriver::Chain { sources: all, .. }, Some(place)) = (&mut drivers[joint], place) {
                all.extend(sources(strand, place));
            }
        }
    }
    for &joint in &chain.target {
        if let JointDriver::Chain { sources, .. } = &mut drivers[joint] {
            sources.iter_mut().for_each(|(_, weight)| *weight /= further.len() as f64 + 1.0);
        }
    }
}

fn sources(chain: &ChainPair, place: Place) -> Vec<(usize, f64)> {
    match place {
        Place::At(position) => vec![(chain.source[position], 1.0)],
        Place::Between(position, fraction) => {
            vec![(chain.source[position], 1.0 - fraction), (chain.source[position + 1], fraction)]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        model::{Control, Reporter},
        retarget::{
            resolve::resolve,
            spec::{RetargetSpec, parse_spec},
        },
        rig::Rig,
        samples,
    };

    fn drivers(config: &str) -> (Vec<JointDriver>, usize) {
        let (walk, mannequin) = (samples::walk_scene(), samples::mannequin_scene());
        let spec: RetargetSpec = parse_spec(config.as_bytes()).expect("a spec");
        let mut reporter = Reporter::new();
        let source = Rig::new("source", &walk, None, &spec.source, &mut reporter).expect("a rig");
        let target = Rig::new("target", &mannequin, None, &spec.target, &mut reporter).expect("a rig");
        let mapping = resolve(&spec, &source, &target, &walk.clips[0], &mut reporter).expect("resolves").mapping;
        let plan = Plan::new(source.skeleton(), target.skeleton(), &mapping);
        let clip = crate::retarget::run(&plan, &walk.clips[0], &Control::new()).expect("runs");
        let animated = clip.joints().iter().filter(|tracks| tracks.rotation.is_animated()).count();
        (joint_drivers(source.skeleton(), target.skeleton(), &mapping), animated)
    }

    #[test]
    fn exactly_the_driven_joints_get_tracks() {
        for config in ["{}", r#"{"ops": [{"op": "fk", "mask": ["left_arm"]}]}"#, r#"{"ops": [{"op": "pelvis"}]}"#] {
            let (drivers, animated) = drivers(config);
            let is_driven =
                |driver: &&JointDriver| !matches!(driver, JointDriver::Nothing | JointDriver::Surplus { .. });
            assert_eq!(drivers.iter().filter(is_driven).count(), animated, "{config}");
            for driver in &drivers {
                let JointDriver::Chain { sources, .. } = driver else { continue };
                let sum: f64 = sources.iter().map(|(_, weight)| weight).sum();
                assert!((sum - 1.0).abs() < 1e-12, "{config}: weights add up: {driver:?}");
            }
        }
    }
}
