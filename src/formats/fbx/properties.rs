//! Animated numbers beside the joints: custom properties of nodes, and the weights of blend shapes.

use std::collections::{BTreeMap, BTreeSet};

use ufbx::{ElementType, PropFlags, PropType};

use crate::{
    formats::{Budget, FormatError, Limit},
    model::{Morph, MorphPlace, MorphTrack, Track},
};

use super::nodes::Nodes;

/// What FBX calls the weight of a blend shape, in percent.
pub(super) const SHAPE_WEIGHT: &str = "DeformPercent";

/// Those of a file, over all of its stacks, and the shapes of its meshes: properties in the order of their nodes and then of their
/// names, then blend shapes.
#[derive(Debug, Default)]
pub(super) struct Properties {
    places: Vec<Place>,
    /// What users call them.
    names: Vec<String>,
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

    /// What the file calls it. Maya writes the name of one of the deformers before that of a shape.
    fn name<'f>(&'f self, file: &'f ufbx::Scene, deformers: &BTreeSet<&str>) -> &'f str {
        match self {
            Self::Node(_, name) => name,
            Self::Shape(_) => {
                let name: &str = &self.element(file).name;
                name.split_once('.').filter(|(prefix, _)| deformers.contains(prefix)).map_or(name, |(_, own)| own)
            }
        }
    }
}

impl Properties {
    /// Finds the custom numbers, switches and choices of joints that have keys in some stack, and the blend shapes that have, or that
    /// a mesh has.
    pub(super) fn find(file: &ufbx::Scene, nodes: &Nodes, budget: &mut Budget<'_>) -> Result<Self, FormatError> {
        let mut found: BTreeSet<Place> = BTreeSet::new();
        let meshes = (0..nodes.len()).filter_map(|joint| nodes.node(file, joint).mesh.as_ref());
        for channel in meshes.flat_map(|mesh| &mesh.blend_deformers).flat_map(|deformer| &deformer.channels) {
            budget.take_array(1, size_of::<Morph>() as u64, "blend shapes")?;
            found.insert(Place::Shape(channel.element.typed_id as usize));
        }
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
        let places: Vec<Place> = found.into_iter().collect();
        let deformers: BTreeSet<&str> = file.blend_deformers.iter().map(|deformer| &*deformer.element.name).collect();
        let mut of_the_name: BTreeMap<&str, usize> = BTreeMap::new();
        for place in &places {
            *of_the_name.entry(place.name(file, &deformers)).or_default() += 1;
        }
        // A name that several nodes have comes with its node's.
        let name = |place: &Place| {
            let name = place.name(file, &deformers);
            let is_node = matches!(place, Place::Node(..));
            if is_node && of_the_name[name] > 1 {
                format!("{}.{name}", &*place.element(file).name)
            } else {
                name.to_owned()
            }
        };
        let names: Vec<String> = places.iter().map(name).collect();
        budget.take(Limit::DecodedBytes, names.iter().map(|name| name.len() as u64).sum(), "animated properties")?;
        Ok(Self { places, names })
    }

    /// The index of the blend shape that a morph of the scene is; nothing where it is none.
    pub(super) fn shape(&self, morph: usize) -> Option<usize> {
        match self.places.get(morph)? {
            Place::Shape(index) => Some(*index),
            Place::Node(..) => None,
        }
    }

    /// As curves of the scene.
    pub(super) fn curves(&self, file: &ufbx::Scene) -> Vec<Morph> {
        let curve = |(place, name): (&Place, &String)| {
            let (property, unit) = place.property();
            let own = ufbx::find_prop(&place.element(file).props, property);
            let own = own.map_or(0.0, |property| property.value_vec4.x * unit);
            let kind = match place {
                Place::Node(..) => MorphPlace::Property,
                Place::Shape(_) => MorphPlace::Weight,
            };
            // Curves are single precision in every file.
            let rest = if own.is_finite() { own as f32 } else { 0.0 };
            Morph { name: name.clone(), rest, place: kind }
        };
        self.places.iter().zip(&self.names).map(curve).collect()
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
            let name = &self.names[morph];
            budget.take(Limit::Samples, times_seconds.len() as u64, name)?;
            budget.take_array(times_seconds.len() as u64, size_of::<f32>() as u64, name)?;
            let (element, (property, unit)) = (place.element(file), place.property());
            let value = |time: &f64| ufbx::evaluate_prop(&stack.anim, element, property, *time).value_vec4.x * unit;
            // Curves are single precision in every file.
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
