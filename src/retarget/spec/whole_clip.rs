//! What of a spec can be done only where the whole clip is at hand.

use super::{KeysSpec, OutputChoice, OutputSpec, RetargetSpec, TuneChoice};
use crate::rig::ALL_CHARACTERS;

impl RetargetSpec {
    /// The JSON pointer of the first thing that it asks for and that is about the whole clip, so that a long one cannot be worked through
    /// section by section.
    #[must_use]
    pub fn about_whole_clip(&self) -> Option<String> {
        let is_all = |character: &Option<String>| character.as_deref() == Some(ALL_CHARACTERS);
        let fields = [
            ("/clip", self.clip.is_some()),
            ("/edit", self.edit != Default::default()),
            ("/layer", self.layer.is_some()),
            ("/morphs", self.morphs != Default::default()),
            ("/source/character", is_all(&self.source.character)),
            ("/target/character", is_all(&self.target.character)),
            ("/tune", !matches!(self.tune, None | Some(TuneChoice::Switch(false)))),
        ];
        if let Some((pointer, _)) = fields.iter().find(|(_, is_asked)| *is_asked) {
            return Some((*pointer).to_owned());
        }
        let ops = self.ops.iter().flatten();
        if let Some(index) = ops.clone().position(super::Op::looks_at_whole_clip) {
            return Some(format!("/ops/{index}"));
        }
        let are_reduced = |output: &OutputSpec| !KeysSpec::is_all(&output.keys);
        let outputs = match &self.output {
            None => &[][..],
            Some(OutputChoice::One(output)) => std::slice::from_ref(output),
            Some(OutputChoice::Many(outputs)) => outputs.as_slice(),
        };
        outputs.iter().any(are_reduced).then(|| "/output/keys".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use crate::retarget::parse_spec;

    #[test]
    fn what_is_about_the_whole_clip_is_named() {
        for (spec, pointer) in [
            ("{}", None),
            (r#"{"ops": [{"op": "pelvis"}, {"op": "fk"}, {"op": "contacts"}, {"op": "plant"}]}"#, None),
            (r#"{"tune": false, "report": {"detail": "none"}}"#, None),
            (r#"{"edit": {"speed": 2}}"#, Some("/edit")),
            (r#"{"ops": [{"op": "pelvis"}, {"op": "fk", "frames": [3, 5]}]}"#, Some("/ops/1")),
            (r#"{"ops": [{"op": "contacts", "set": {"left_foot": [[0, 1]]}}]}"#, Some("/ops/0")),
            (r#"{"ops": [{"op": "floor", "alpha": [[0, 0], [1, 1]]}]}"#, Some("/ops/0")),
            (r#"{"ops": [{"op": "stride"}]}"#, Some("/ops/0")),
            (r#"{"output": {"keys": "needed"}}"#, Some("/output/keys")),
            (r#"{"target": {"character": "all"}}"#, Some("/target/character")),
            (r#"{"tune": true}"#, Some("/tune")),
            (r#"{"morphs": {"by_name": false}}"#, Some("/morphs")),
        ] {
            let found =
                parse_spec(spec.as_bytes()).unwrap_or_else(|error| panic!("{spec}: {error}")).about_whole_clip();
            assert_eq!(found.as_deref(), pointer, "{spec}");
        }
    }
}
