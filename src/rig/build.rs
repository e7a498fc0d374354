//! Finding out about a rig: its rest pose, what its joints mean, how its space lies.

use crate::model::{Reporter, Scene};

use super::{
    alignment::{CanonicalPose, canonical_rest},
    error::{SpecError, SpecErrorKind},
    recognition::Recognizer,
    rest::{Rest, edit, find_rest, put_onto_floor, uploaded},
    rig::Rig,
    spec::{RestSpec, RigSpec},
};

impl<'a> Rig<'a> {
    /// Finds out about one rig.
    ///
    /// # Errors
    /// When the file has no joints, or the spec names joints, clips or roles that do not exist.
    pub fn new(
        name: &'static str,
        scene: &'a Scene,
        rest_scene: Option<&Scene>,
        spec: &RigSpec,
        reporter: &mut Reporter,
    ) -> Result<Self, SpecError> {
        Self::with_recognizer(name, scene, rest_scene, spec, Recognizer::default(), reporter)
    }

    /// The same, with what the user taught, and what was recognized before.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_recognizer(
        name: &'static str,
        scene: &'a Scene,
        rest_scene: Option<&Scene>,
        spec: &RigSpec,
        recognizer: Recognizer<'_>,
        reporter: &mut Reporter,
    ) -> Result<Self, SpecError> {
        let skeleton = &scene.skeleton;
        if skeleton.is_empty() {
            return Err(SpecError::new(
                SpecErrorKind::NoSkeleton,
                format!("the {name} file has no joints"),
                "send a file with a skeleton; 'retargetd inspect FILE' says what a file holds",
            ));
        }
        let Some(rest_scene) = rest_scene else {
            let rest = find_rest(name, scene, spec, recognizer, reporter)?;
            return Self::finished(name, scene, rest, spec, recognizer, reporter);
        };
        // What the rest file is compared with: the rig as it rests by itself.
        let plain = RigSpec { rest: RestSpec::default(), pose: Vec::new(), ..spec.clone() };
        let own = find_rest(name, scene, &plain, recognizer, &mut Reporter::new())?;
        let own = Self::finished(name, scene, own, &plain, recognizer, &mut Reporter::new())?;
        let (rest, fit) = uploaded(&own, rest_scene, spec, recognizer, reporter)?;
        let rig = Self::finished(name, scene, rest, spec, recognizer, reporter)?;
        Ok(Self { rest_fit: Some(fit), ..rig })
    }

    /// A rig that rests in a pose that was found already: solved, put onto the floor and edited where it is to be.
    fn finished(
        name: &'static str,
        scene: &'a Scene,
        rest: Rest,
        spec: &RigSpec,
        recognizer: Recognizer<'_>,
        reporter: &mut Reporter,
    ) -> Result<Self, SpecError> {
        let is_to_be_solved = rest.is_to_be_solved;
        let mut rig = Self::at_rest(name, scene, rest, spec, recognizer, reporter)?;
        if is_to_be_solved {
            let from_nothing = rig.recognition.body.is_none();
            let solved = canonical_rest(&rig, CanonicalPose::T, from_nothing).rest;
            rig.take_rest(solved.to_local(rig.skeleton()));
        }
        put_onto_floor(&mut rig);
        if let Some(edited) = edit(&rig, &spec.pose)? {
            rig.take_rest(edited);
            rig.rest_reason.push_str("; the config edits it");
        }
        Ok(rig)
    }
}
