//! What was worked out about a rig, so that nothing is worked out twice.

use std::{
    any::Any,
    sync::{Mutex, OnceLock, PoisonError},
};

use crate::model::ModelPose;

/// A question about a rig whose answer depends on nothing but the rig and the question.
pub(crate) trait Question: PartialEq + Send + 'static {
    /// What is answered.
    type Answer: Clone + Send + 'static;
}

/// The answers to the questions that were asked about one rig: how it stands, what its soles are, how thick it is. Whoever changes what a
/// rig is gives it a new memory.
#[derive(Debug, Default)]
pub(crate) struct RigMemory {
    /// How the rig rests that the answers are about.
    rest: OnceLock<ModelPose>,
    answers: Mutex<Vec<Box<dyn Any + Send>>>,
}

/// A question that was asked, and its answer.
struct Answered<Q: Question>(Q, Q::Answer);

impl RigMemory {
    /// How many answers are kept. A retarget asks about ten.
    const MAX_KEPT: usize = 64;

    /// Whether it is that of a rig which rests so. A rest pose may be changed by hand.
    pub(super) fn is_of(&self, rest: &ModelPose) -> bool {
        self.rest.get_or_init(|| rest.clone()) == rest
    }

    /// The answer that was given before, else the one that `answer` gives now.
    pub(super) fn recall<Q: Question>(&self, question: Q, answer: impl FnOnce(&Q) -> Q::Answer) -> Q::Answer {
        if let Some(known) = self.known(&question) {
            return known;
        }
        // Outside of the lock: it takes long, and may ask questions itself.
        let found = answer(&question);
        let mut kept = self.answers.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.len() < Self::MAX_KEPT {
            kept.push(Box::new(Answered(question, found.clone())));
        }
        found
    }

    fn known<Q: Question>(&self, question: &Q) -> Option<Q::Answer> {
        let kept = self.answers.lock().unwrap_or_else(PoisonError::into_inner);
        let mut alike = kept.iter().filter_map(|any| any.downcast_ref::<Answered<Q>>());
        alike.find(|answered| answered.0 == *question).map(|answered| answered.1.clone())
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;
    use crate::{
        model::Reporter,
        rig::{Rig, RigSpec},
        samples,
    };

    #[derive(PartialEq)]
    struct Double(u32);
    #[derive(PartialEq)]
    struct Half(u32);

    impl Question for Double {
        type Answer = u32;
    }

    impl Question for Half {
        type Answer = u32;
    }

    #[test]
    fn a_question_is_answered_once() {
        let (memory, count) = (RigMemory::default(), Cell::new(0));
        let double = |number: u32| {
            memory.recall(Double(number), |Double(number)| {
                count.set(count.get() + 1);
                // Asks another question about the same rig.
                memory.recall(Half(number * 4), |Half(number)| number / 2)
            })
        };
        assert_eq!([double(3), double(4), double(3), double(4)], [6, 8, 6, 8]);
        assert_eq!(count.get(), 2, "each once");
        assert_eq!(memory.recall(Half(3), |Half(number)| number / 2), 1, "another question with the same number");
    }

    #[test]
    fn it_is_bounded() {
        let memory = RigMemory::default();
        for number in 0..200 {
            assert_eq!(memory.recall(Double(number), |Double(number)| number * 2), number * 2);
        }
        assert_eq!(memory.answers.lock().expect("kept").len(), RigMemory::MAX_KEPT);
    }

    #[test]
    fn a_rest_pose_that_is_changed_by_hand_is_another_rig() {
        let scene = samples::mannequin_scene();
        let spec = RigSpec::default();
        let mut rig = Rig::new("target", &scene, None, &spec, &mut Reporter::new()).expect("a rig");
        assert_eq!(rig.recall(Double(1), |_| 2), 2);
        let own = rig.rest.clone();
        let mut moved = rig.rest_local.clone();
        moved.transforms_mut()[0].translation.y += 1.0;
        rig.rest = moved.to_model(rig.skeleton());
        assert_eq!(rig.recall(Double(1), |_| 3), 3, "not what is known of the other");
        rig.rest = own;
        assert_eq!(rig.recall(Double(1), |_| 4), 2, "which is still known");
    }
}
