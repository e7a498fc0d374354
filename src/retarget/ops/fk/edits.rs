//! What `fk` does beyond following rotations: shapes of chains, poles of limbs, and fading.

use super::{
    poles::{Pole, PoleStep},
    shapes::{ChainShape, ShapeStep},
};
use crate::retarget::mapping::LimbPair;
use crate::retarget::{
    mapping::Mapping,
    ops::edit::Edit,
    stages::posed::{Step, builder::StepBuilder, figure::Figure},
};
use crate::{
    retarget::{
        mapping::ChainPair,
        ops::FkOp,
        spec::{RotationMode, TranslationMode},
    },
    rig::auto_map::LIMBS,
};

/// The edits that an op needs behind the plan. `chains` are the op's own.
pub(in crate::retarget) fn resolve(op: &FkOp, chains: &[ChainPair], limbs: &[LimbPair]) -> Vec<ChainEdit> {
    let mut edits = Vec::new();
    let mut is_done = vec![false; chains.len()];
    for index in 0..chains.len() {
        let chain = &chains[index];
        let drive = chain.drive;
        if is_done[index] || !(drive.rotation.is_shape() || drive.translation.is_shape()) {
            continue;
        }
        // The parts of a limb are chains of one joint each; together they have a shape.
        let limb = LIMBS.iter().find(|(_, roles)| roles.contains(&chain.name.as_str())).map_or(&[][..], |limb| limb.1);
        let mut parts: Vec<usize> = limb
            .iter()
            .filter_map(|role| chains.iter().position(|other| other.name == *role && other.drive == drive))
            .collect();
        if parts.is_empty() {
            parts.push(index);
        }
        let mut shape = ChainShape {
            source: Vec::new(),
            target: Vec::new(),
            ends: parts.last().and_then(|&last| chains[last].chord).map(|chord| (chord.source_end, chord.target_end)),
            rotation: if drive.rotation.is_shape() { drive.rotation } else { RotationMode::None },
            translation: if drive.translation.is_shape() { drive.translation } else { TranslationMode::None },
            rotation_alpha: drive.rotation_alpha,
            translation_alpha: drive.translation_alpha,
        };
        for &part in &parts {
            is_done[part] = true;
            shape.source.extend(&chains[part].source[chains[part].spacing.lead()..]);
            shape.target.extend(&chains[part].target);
        }
        edits.push(ChainEdit::Shape(Box::new(shape)));
    }
    if op.align_pole > 0.0 || op.pole_offset != 0.0 {
        let is_driven = |joint: usize| chains.iter().any(|chain| chain.target.contains(&joint));
        let poles = (0..limbs.len())
            .filter(|&limb| is_driven(limbs[limb].target.start) && is_driven(limbs[limb].target.middle));
        edits.extend(poles.map(|limb| {
            ChainEdit::Pole(Pole {
                limb,
                align: op.align_pole,
                offset: op.pole_offset.to_radians(),
                keeps_offset: op.keep_pole_offset,
            })
        }));
    }
    edits
}

/// What is done with a chain or a limb.
#[derive(Clone, Debug)]
pub(in crate::retarget) enum ChainEdit {
    /// A chain takes the shape, the local rotations or the lengths of the source's.
    Shape(Box<ChainShape>),
    /// A limb's bend is turned to where the source's points.
    Pole(Pole),
}

/// The same in slots.
#[derive(Clone, Debug)]
pub(in crate::retarget) enum ChainStep {
    Shape(Box<ShapeStep>),
    Pole(PoleStep),
}

impl Step for ChainStep {
    fn apply(&self, figure: &mut Figure<'_>) {
        match self {
            Self::Shape(step) => step.apply(figure),
            Self::Pole(step) => step.apply(figure),
        }
    }
}

impl Edit for ChainEdit {
    type Step = ChainStep;

    fn joints(&self, mapping: &Mapping) -> Vec<usize> {
        match self {
            Self::Shape(shape) => shape.target.clone(),
            Self::Pole(pole) => mapping.limbs.get(pole.limb).into_iter().flat_map(|limb| limb.turned(false)).collect(),
        }
    }

    fn step(&self, builder: &mut StepBuilder<'_>) -> ChainStep {
        match self {
            Self::Shape(shape) => ChainStep::Shape(Box::new(shape.step(builder))),
            Self::Pole(pole) => ChainStep::Pole(pole.step(builder)),
        }
    }
}
