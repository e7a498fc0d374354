//! Numbers beside the joints: glTF has no channels for custom properties, so ours lie in the extras of an animation, under `curves`.
//!
//! Extras are anybody's. What does not look as our writer leaves it is somebody else's, and not read.

use std::{collections::BTreeMap, rc::Rc};

use serde_json::Value;

use super::curve::{Curve, Interpolation};
use crate::{
    formats::{Budget, FormatError},
    model::{Morph, MorphPlace},
};

/// Those of a file, over all of its animations.
#[derive(Debug, Default)]
pub(super) struct Properties {
    /// In the order in which they are met.
    pub(super) all: Vec<Morph>,
    /// Animation by animation, those that it has, each with its index among the morphs of the file.
    pub(super) of_animations: Vec<Vec<(usize, Curve<f32>)>>,
}

/// Reads them from the document; `first` is how many morphs come before them.
pub(super) fn read(document: &Value, first: usize, budget: &mut Budget<'_>) -> Result<Properties, FormatError> {
    let mut properties = Properties::default();
    let mut indices: BTreeMap<&str, usize> = BTreeMap::new();
    for animation in document["animations"].as_array().map_or(&[][..], Vec::as_slice) {
        budget.check_canceled()?;
        let curves = &animation["extras"]["curves"];
        let mut own = Vec::new();
        if let (Some(times), Some(values)) = (key_times(&curves["times_seconds"]), curves["values"].as_object()) {
            for (name, values) in values {
                let Some(values) = numbers(values).filter(|values| values.len() == times.len()) else { continue };
                budget.take_array(values.len() as u64, size_of::<f32>() as u64, name)?;
                let index = *indices.entry(name).or_insert_with(|| {
                    properties.all.push(Morph { name: name.clone(), rest: 0.0, place: MorphPlace::Property });
                    properties.all.len() - 1
                });
                own.push((
                    first + index,
                    Curve { times: Rc::clone(&times), values, interpolation: Interpolation::Linear },
                ));
            }
        }
        properties.of_animations.push(own);
    }
    Ok(properties)
}

/// Times that rise; nothing where they do not, or where there is none.
fn key_times(times: &Value) -> Option<Rc<Vec<f32>>> {
    numbers(times).filter(|times| !times.is_empty() && times.windows(2).all(|pair| pair[0] < pair[1])).map(Rc::new)
}

/// Finite numbers, where all elements are some.
fn numbers(values: &Value) -> Option<Vec<f32>> {
    // Curves are single precision in every file.
    let number = |value: &Value| value.as_f64().map(|value| value as f32).filter(|value| value.is_finite());
    values.as_array()?.iter().map(number).collect()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::{formats::Limits, model::Control};

    fn found(animations: &Value) -> Properties {
        let (limits, control) = (Limits::default(), Control::new());
        read(&json!({ "animations": animations }), 3, &mut Budget::new(&limits, &control)).expect("within limits")
    }

    #[test]
    fn curves_are_found_by_name_over_all_animations() {
        let curves =
            |values: Value| json!({ "extras": { "curves": { "times_seconds": [0.0, 0.5], "values": values } } });
        let properties =
            found(&json!([curves(json!({ "lock": [0, 1] })), {}, curves(json!({ "a": [2, 3], "lock": [1, 1] }))]));
        let names: Vec<&str> = properties.all.iter().map(|morph| morph.name.as_str()).collect();
        assert_eq!(names, ["lock", "a"], "each once");
        let indices: Vec<Vec<usize>> =
            properties.of_animations.iter().map(|own| own.iter().map(|(index, _)| *index).collect()).collect();
        assert_eq!(indices, [vec![3], vec![], vec![4, 3]], "behind the morphs of meshes");
        assert_eq!(properties.of_animations[0][0].1.values, [0.0, 1.0], "as they are");
    }

    #[test]
    fn extras_of_others_are_not_read() {
        for curves in [
            json!("text"),
            json!({ "times_seconds": [0.0, 0.0], "values": { "a": [1, 2] } }),
            json!({ "times_seconds": [], "values": { "a": [] } }),
            json!({ "times_seconds": [0.0, 1e300], "values": { "a": [1, 2] } }),
            json!({ "times_seconds": [0.0, 1.0], "values": { "a": [1], "b": [1, "2"], "c": 3 } }),
        ] {
            let properties = found(&json!([{ "extras": { "curves": curves } }]));
            assert!(properties.all.is_empty(), "{:?}", properties.all);
        }
    }
}
