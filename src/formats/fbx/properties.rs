//! Animated numbers beside the joints: custom properties of nodes, and the weights of blend shapes.

use std::collections::BTreeSet;

use ufbx::{ElementType, PropFlags, PropType};

use crate::{
    formats::{Budget, FormatError, Limit},
    model::{Morph, MorphPlace, MorphTrack, Track},
};

use super::nodes::Nodes;

/// What FBX calls the weight of a blend shape, in percent.
const SHAPE_WEIGHT: &str = "DeformPercent";

/// Those of a file, over all of its stacks: properties in the order of their nodes and then of their names, then blend shapes.
#[derive(Debug, Default)]
pub(super) struct Properties {
    places: Vec<Place>,
}

/// What has keys.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Place {
    /// The index of a node in the file, and the name of its property.
    Node(usize, String),
    /// The index of a blend shape in the file.
    Shape(usize),
}

impl Place {
    /// What an animated property is of; nothing where it is none of ours.
    fn of(property: &ufbx::AnimProp) -> Option<Self> {
        let index = property.element.typed_id as usize;
        match property.element.type_ {
            ElementType::Node if is_custom_number(property) => Some(Self::Node(index, property.prop_name.to_string())),
            ElementType::BlendChannel if *property.prop_name == *SHAPE_WEIGHT && changes(property) => {
                Some(Self::Shape(index))
            }
            _ => None,
        }
    }

    fn element<'f>(&self, file: &'f ufbx::Scene) -> &'f ufbx::Element {
        match self {
            Self::Node(index, _) => &file.nodes[*index].element,
            Self::Shape(index) => &file.blend_channels[*index].element,
        }
    }

    /// The name of the property in the file, and how much of a value there is one here.
    fn property(&self) -> (&str, f64) {
        match self {
            Self::Node(_, name) => (name, 1.0),
            Self::Shape(_) => (SHAPE_WEIGHT, 0.01),
        }
    }

    /// What users call it. Maya writes the name of the deformer before that of a shape.
    fn name<'f>(&'f self, file: &'f ufbx::Scene) -> &'f str {
        match self {
            Self::Node(_, name) => name,
            Self::Shape(_) => {
                let name: &str = &self.element(file).name;
                let is_deformer =
                    |prefix: &str| file.blend_deformers.iter().any(|other| *other.element.name == *prefix);
                name.split_once('.').filter(|(prefix, _)| is_deformer(prefix)).map_or(name, |(_, own)| own)
            }
        }
    }
}

impl Properties {
    /// Finds the custom numbers, switches and choices of joints, and the blend shapes, that have keys in some stack.
    pub(super) fn find(file: &ufbx::Scene, nodes: &Nodes, budget: &mut Budget<'_>) -> Result<Self, FormatError> {
        let mut found: BTreeSet<Place> = BTreeSet::new();
        for property in file.anim_stacks.iter().flat_map(|stack| &stack.layers).flat_map(|layer| &layer.anim_props) {
            let is_there = |place: &Place| match place {
                Place::Node(index, _) => {
                    file.nodes.as_ref().get(*index).is_some_and(|node| nodes.joint(node).is_some())
                }
                Place::Shape(index) => file.blend_channels.as_ref().get(*index).is_some(),
            };
            if let Some(place) = Place::of(property).filter(is_there) {
                budget.take_array(1, size_of::<Morph>() as u64, "animated properties")?;
                found.insert(place);
            }
        }
        Ok(Self { places: found.into_iter().collect() })
    }

    /// As curves of the scene. A name that several nodes have comes with its node's.
    pub(super) fn curves(&self, file: &ufbx::Scene) -> Vec<Morph> {
        let curve = |place: &Place| {
            let name = place.name(file);
            let element = place.element(file);
            let (property, unit) = place.property();
            let own = ufbx::find_prop(&element.props, property).map_or(0.0, |property| property.value_vec4.x * unit);
            let is_repeated = self.places.iter().filter(|other| other.name(file) == name).count() > 1;
            let (name, place) = match place {
                Place::Node(..) if is_repeated => (format!("{}.{name}", &*element.name), MorphPlace::Property),
                Place::Node(..) => (name.to_owned(), MorphPlace::Property),
                Place::Shape(_) => (name.to_owned(), MorphPlace::Weight),
            };
            #[expect(clippy::cast_possible_truncation, reason = "curves are single precision in every file")]
            let rest = Some(own as f32).filter(|rest| rest.is_finite()).unwrap_or(0.0);
            Morph { name, rest, place }
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
        let animated: BTreeSet<Place> =
            stack.layers.iter().flat_map(|layer| &layer.anim_props).filter_map(Place::of).collect();
        let mut tracks = Vec::new();
        for (morph, place) in self.places.iter().enumerate().filter(|(_, place)| animated.contains(place)) {
            let name = place.name(file);
            budget.take(Limit::Samples, times_seconds.len() as u64, name)?;
            budget.take_array(times_seconds.len() as u64, size_of::<f32>() as u64, name)?;
            let (element, (property, unit)) = (place.element(file), place.property());
            let value = |time: &f64| ufbx::evaluate_prop(&stack.anim, element, property, *time).value_vec4.x * unit;
            #[expect(clippy::cast_possible_truncation, reason = "curves are single precision in every file")]
            let weights: Vec<f32> = times_seconds.iter().map(|time| value(time) as f32).collect();
            if let Some(bad) = weights.iter().position(|weight| !weight.is_finite()) {
                let detail = format!("'{name}' is not finite at {} s", times_seconds[bad]);
                return Err(FormatError::malformed("animation", stack.element.name.to_string(), detail));
            }
            tracks.push(MorphTrack { morph, weights: Track::Sampled(weights).compacted() });
        }
        Ok(tracks)
    }
}

/// Whether it is the weight of a blend shape that changes.
pub(super) fn is_shape_weight(property: &ufbx::AnimProp) -> bool {
    matches!(Place::of(property), Some(Place::Shape(_)))
}

fn is_custom_number(property: &ufbx::AnimProp) -> bool {
    ufbx::find_prop(&property.element.props, &property.prop_name).is_some_and(|own| {
        own.flags.has_any(PropFlags::USER_DEFINED)
            && matches!(own.type_, PropType::Boolean | PropType::Integer | PropType::Number)
    }) && changes(property)
}

/// Whether its keys differ: exporters write keys of switches that nobody ever turns. Asked last, for there are many.
fn changes(property: &ufbx::AnimProp) -> bool {
    property.anim_value.curves[0]
        .as_ref()
        .is_some_and(|curve| curve.keyframes.as_ref().windows(2).any(|pair| pair[0].value != pair[1].value))
}
