//! Animated custom properties of nodes: numbers beside the joints.

use std::collections::BTreeSet;

use ufbx::{ElementType, PropFlags, PropType};

use crate::{
    formats::{Budget, FormatError, Limit},
    model::{Morph, MorphPlace, MorphTrack, Track},
};

use super::nodes::Nodes;

/// Those of a file, over all of its stacks, in the order of their nodes and then of their names.
#[derive(Debug, Default)]
pub(super) struct Properties {
    /// Index of the node in the file, and the name there.
    places: Vec<(usize, String)>,
}

impl Properties {
    /// Finds the custom numbers, switches and choices of joints that have keys in some stack.
    pub(super) fn find(file: &ufbx::Scene, nodes: &Nodes, budget: &mut Budget<'_>) -> Result<Self, FormatError> {
        let mut found: BTreeSet<(usize, String)> = BTreeSet::new();
        for property in file.anim_stacks.iter().flat_map(|stack| &stack.layers).flat_map(|layer| &layer.anim_props) {
            let node = property.element.typed_id as usize;
            if is_custom_number(property)
                && file.nodes.as_ref().get(node).is_some_and(|node| nodes.joint(node).is_some())
            {
                budget.take_array(1, size_of::<Morph>() as u64, "custom properties")?;
                found.insert((node, property.prop_name.to_string()));
            }
        }
        Ok(Self { places: found.into_iter().collect() })
    }

    /// As curves of the scene. A name that several nodes have comes with its node's.
    pub(super) fn curves(&self, file: &ufbx::Scene) -> Vec<Morph> {
        let curve = |(node, name): &(usize, String)| {
            let is_repeated = self.places.iter().filter(|(_, other)| other == name).count() > 1;
            let node = &file.nodes[*node];
            let own = ufbx::find_prop(&node.element.props, name).map_or(0.0, |property| property.value_vec4.x);
            let name = if is_repeated { format!("{}.{name}", &*node.element.name) } else { name.clone() };
            #[expect(clippy::cast_possible_truncation, reason = "curves are single precision in every file")]
            let rest = if own.is_finite() { own as f32 } else { 0.0 };
            Morph { name, rest, place: MorphPlace::Property }
        };
        self.places.iter().map(curve).collect()
    }

    /// Their values at the times of a stack, of those that it animates.
    pub(super) fn tracks(
        &self,
        file: &ufbx::Scene,
        stack: &ufbx::AnimStack,
        times_seconds: &[f64],
        budget: &mut Budget<'_>,
    ) -> Result<Vec<MorphTrack>, FormatError> {
        let mut tracks = Vec::new();
        for (morph, (node, name)) in self.places.iter().enumerate() {
            let mut animated = stack.layers.iter().flat_map(|layer| &layer.anim_props);
            let is_this = |property: &ufbx::AnimProp| {
                // Keys are looked at last: there are many.
                property.element.typed_id as usize == *node
                    && *property.prop_name == **name
                    && is_custom_number(property)
            };
            if !animated.any(is_this) {
                continue;
            }
            budget.take(Limit::Samples, times_seconds.len() as u64, name)?;
            budget.take_array(times_seconds.len() as u64, size_of::<f32>() as u64, name)?;
            let element = &file.nodes[*node].element;
            #[expect(clippy::cast_possible_truncation, reason = "curves are single precision in every file")]
            let value = |time: &f64| ufbx::evaluate_prop(&stack.anim, element, name, *time).value_vec4.x as f32;
            let weights: Vec<f32> = times_seconds.iter().map(value).collect();
            if let Some(bad) = weights.iter().position(|weight| !weight.is_finite()) {
                let detail = format!("property '{name}' is not finite at {} s", times_seconds[bad]);
                return Err(FormatError::malformed("animation", stack.element.name.to_string(), detail));
            }
            tracks.push(MorphTrack { morph, weights: Track::Sampled(weights).compacted() });
        }
        Ok(tracks)
    }
}

fn is_custom_number(property: &ufbx::AnimProp) -> bool {
    matches!(property.element.type_, ElementType::Node)
        && property.anim_value.curves[0].as_ref().is_some_and(|curve| {
            // Exporters write keys of switches that nobody ever turns.
            curve.keyframes.as_ref().windows(2).any(|pair| pair[0].value != pair[1].value)
        })
        && ufbx::find_prop(&property.element.props, &property.prop_name).is_some_and(|own| {
            own.flags.has_any(PropFlags::USER_DEFINED)
                && matches!(own.type_, PropType::Boolean | PropType::Integer | PropType::Number)
        })
}
