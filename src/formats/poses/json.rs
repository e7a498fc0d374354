//! The JSON codec: the same keys, nested arrays. Decodes straight into flat arrays, without a tree in between.

use std::{cell::RefCell, fmt};

use serde::{
    Deserialize, Deserializer, Serialize, Serializer,
    de::{self, DeserializeSeed, IgnoredAny, MapAccess, SeqAccess, Visitor},
    ser::{Error as _, SerializeMap, SerializeSeq},
};

use crate::{
    formats::{Budget, FormatError, Limit},
    model::Control,
};

use super::{
    arrays::{Arrays, Meta, NAME_KEYS, NUMBER_KEYS, NumberArray, NumberKey, Values, invalid},
    write::{Channel, Poses},
};

/// How many values are decoded between two looks at the budget.
const VALUES_PER_CHECK: u64 = 4096;

/// Decodes the members that the layout knows.
pub(super) fn read(bytes: &[u8], budget: &mut Budget<'_>) -> Result<Arrays, FormatError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let progress = RefCell::new(Progress { budget, place: String::new(), failure: None });
    let mut deserializer = serde_json::Deserializer::from_slice(bytes);
    let result = DocumentSeed { progress: &progress }
        .deserialize(&mut deserializer)
        .and_then(|arrays| deserializer.end().map(|()| arrays));
    result.map_err(|error| {
        let progress = progress.into_inner();
        progress.failure.unwrap_or_else(|| FormatError::malformed("json", progress.place, error.to_string()))
    })
}

/// Encodes; floats are written with the fewest digits that read back as the same value.
pub(super) fn write(poses: &Poses<'_>, control: &Control) -> Result<Vec<u8>, FormatError> {
    let mut output = Vec::new();
    let written = serde_json::to_writer(&mut output, &Document { poses, control });
    control.check()?;
    written.map_err(|error| FormatError::malformed("json", "", format!("the poses cannot be written: {error}")))?;
    Ok(output)
}

/// Where the decoder is, and why it stopped where serde's own error cannot say it.
struct Progress<'a, 'limits> {
    budget: &'a mut Budget<'limits>,
    place: String,
    failure: Option<FormatError>,
}

impl Progress<'_, '_> {
    /// Keeps the real error aside, since serde's can only carry text.
    fn fail<E: de::Error>(&mut self, failure: FormatError) -> E {
        let error = E::custom(&failure);
        self.failure = Some(failure);
        error
    }
}

struct DocumentSeed<'a, 'budget, 'limits> {
    progress: &'a RefCell<Progress<'budget, 'limits>>,
}

impl<'de> DeserializeSeed<'de> for DocumentSeed<'_, '_, '_> {
    type Value = Arrays;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Arrays, D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for DocumentSeed<'_, '_, '_> {
    type Value = Arrays;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an object of pose arrays")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Arrays, A::Error> {
        let mut arrays = Arrays::default();
        while let Some(key) = map.next_key::<String>()? {
            self.progress.borrow_mut().place.clone_from(&key);
            let mut twice = false;
            if let Some(known) = NUMBER_KEYS.iter().find(|known| known.name == key) {
                let array = map.next_value_seed(NumbersSeed { key: *known, progress: self.progress })?;
                twice = arrays.numbers.insert(known.name, array).is_some();
            } else if let Some(known) = NAME_KEYS.into_iter().find(|known| *known == key) {
                let names = map.next_value_seed(NamesSeed { key: known, progress: self.progress })?;
                twice = arrays.names.insert(known, names).is_some();
            } else if key == "meta" {
                arrays.meta = map.next_value::<MetaValue>()?.0;
            } else {
                map.next_value::<IgnoredAny>()?;
                let mut progress = self.progress.borrow_mut();
                if let Err(failure) = progress.budget.take(Limit::DecodedBytes, key.len() as u64 + 24, &key) {
                    return Err(progress.fail(failure));
                }
                arrays.ignored.push(key.clone());
            }
            if twice {
                return Err(self.progress.borrow_mut().fail(invalid(key, "the key is there twice")));
            }
            self.progress.borrow_mut().place.clear();
        }
        Ok(arrays)
    }
}

/// `meta` is a JSON string as in the archive; an object in its place is taken as well.
struct MetaValue(Meta);

impl<'de> Deserialize<'de> for MetaValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct MetaVisitor;

        impl<'de> Visitor<'de> for MetaVisitor {
            type Value = Meta;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("a string that holds a JSON object")
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<Meta, E> {
                serde_json::from_str(text).map_err(|error| E::custom(format!("'meta' is not valid JSON: {error}")))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Meta, A::Error> {
                Meta::deserialize(de::value::MapAccessDeserializer::new(map))
            }
        }

        deserializer.deserialize_any(MetaVisitor).map(Self)
    }
}

struct NamesSeed<'a, 'budget, 'limits> {
    key: &'static str,
    progress: &'a RefCell<Progress<'budget, 'limits>>,
}

impl<'de> DeserializeSeed<'de> for NamesSeed<'_, '_, '_> {
    type Value = Vec<String>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Vec<String>, D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for NamesSeed<'_, '_, '_> {
    type Value = Vec<String>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a list of strings")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Vec<String>, A::Error> {
        let mut names = Vec::new();
        while let Some(name) = seq.next_element::<String>()? {
            let mut progress = self.progress.borrow_mut();
            let bytes = (size_of::<String>() + name.len()) as u64;
            if let Err(failure) = progress.budget.take(Limit::DecodedBytes, bytes, self.key) {
                return Err(progress.fail(failure));
            }
            names.push(name);
        }
        Ok(names)
    }
}

/// Whether something is so, in a word or as 1 or 0.
#[derive(Deserialize)]
#[serde(untagged, expecting = "expected true, false or a number")]
enum Truth {
    Word(bool),
    Number(f32),
}

/// Decodes the nested lists of one key into one flat array.
struct NumbersSeed<'a, 'budget, 'limits> {
    key: NumberKey,
    progress: &'a RefCell<Progress<'budget, 'limits>>,
}

impl<'de> DeserializeSeed<'de> for NumbersSeed<'_, '_, '_> {
    type Value = NumberArray;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<NumberArray, D::Error> {
        let values = if self.key.single { Values::Single(Vec::new()) } else { Values::Double(Vec::new()) };
        let mut array = Nested {
            key: self.key,
            shape: vec![None; self.key.rank],
            values,
            unchecked: 0,
            indices: vec![0; self.key.rank],
            progress: self.progress,
        };
        let result = LevelSeed { array: &mut array, level: 0 }.deserialize(deserializer);
        let complete = result.and_then(|()| array.check_budget());
        if complete.is_err() {
            let indices: Vec<String> = array.indices.iter().map(usize::to_string).collect();
            self.progress.borrow_mut().place = format!("{}[{}]", self.key.name, indices.join(", "));
        }
        complete?;
        let shape = array.shape.iter().map(|length| length.unwrap_or(0)).collect();
        Ok(NumberArray { shape, values: array.values })
    }
}

/// The array as far as it has been decoded.
struct Nested<'a, 'budget, 'limits> {
    key: NumberKey,
    /// The length of every dimension, once its first list has ended.
    shape: Vec<Option<usize>>,
    values: Values,
    /// Values since the last look at the budget.
    unchecked: u64,
    indices: Vec<usize>,
    progress: &'a RefCell<Progress<'budget, 'limits>>,
}

impl Nested<'_, '_, '_> {
    fn check_budget<E: de::Error>(&mut self) -> Result<(), E> {
        let size = if self.key.single { size_of::<f32>() } else { size_of::<f64>() };
        let mut progress = self.progress.borrow_mut();
        let canceled = progress.budget.check_canceled().map_err(FormatError::from);
        let paid = canceled.and_then(|()| progress.budget.take_array(self.unchecked, size as u64, self.key.name));
        self.unchecked = 0;
        paid.map_err(|failure| progress.fail(failure))
    }

    /// All lists of one dimension must be of one length.
    fn end_list<E: de::Error>(&mut self, level: usize, length: usize) -> Result<(), E> {
        match self.shape[level] {
            Some(expected) if expected != length => {
                let outer: Vec<String> = self.indices[..level].iter().map(usize::to_string).collect();
                let place = format!("{}[{}]", self.key.name, outer.join(", "));
                let detail = format!("the list has {length} entries where the ones before it have {expected}");
                Err(self.progress.borrow_mut().fail(invalid(place, detail)))
            }
            _ => {
                self.shape[level] = Some(length);
                Ok(())
            }
        }
    }
}

/// One dimension; the recursion is as deep as the key has dimensions, whatever the file holds.
struct LevelSeed<'a, 'progress, 'budget, 'limits> {
    array: &'a mut Nested<'progress, 'budget, 'limits>,
    level: usize,
}

impl<'de> DeserializeSeed<'de> for LevelSeed<'_, '_, '_, '_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        if self.level < self.array.key.rank {
            return deserializer.deserialize_seq(self);
        }
        match &mut self.array.values {
            Values::Single(values) if self.array.key.truth => {
                values.push(match Truth::deserialize(deserializer)? {
                    Truth::Number(number) => number,
                    Truth::Word(truth) => f32::from(u8::from(truth)),
                });
            }
            Values::Single(values) => values.push(f32::deserialize(deserializer)?),
            Values::Double(values) => values.push(f64::deserialize(deserializer)?),
        }
        self.array.unchecked += 1;
        if self.array.unchecked == VALUES_PER_CHECK { self.array.check_budget() } else { Ok(()) }
    }
}

impl<'de> Visitor<'de> for LevelSeed<'_, '_, '_, '_> {
    type Value = ();

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "a list ('{}' has {} dimensions)", self.array.key.name, self.array.key.rank)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<(), A::Error> {
        let mut length = 0;
        self.array.indices[self.level] = 0;
        while seq.next_element_seed(LevelSeed { array: &mut *self.array, level: self.level + 1 })?.is_some() {
            length += 1;
            self.array.indices[self.level] = length;
        }
        self.array.end_list(self.level, length)
    }
}

struct Document<'a> {
    poses: &'a Poses<'a>,
    control: &'a Control,
}

impl Serialize for Document<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let poses = self.poses;
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("joint_names", &poses.joint_names())?;
        map.serialize_entry("parents", &Sequence(|| poses.parents()))?;
        for channel in Channel::ALL {
            let rows = || (0..poses.joint_count()).map(|joint| Sequence(move || poses.rest(channel, joint)));
            map.serialize_entry(&format!("rest_{}", channel.key()), &Sequence(rows))?;
        }
        map.serialize_entry("times", &Sequence(|| poses.times().iter().map(|time| *time as f32)))?;
        for channel in Channel::ALL {
            map.serialize_entry(channel.key(), &Frames { document: self, channel })?;
        }
        let (names, tracks) = poses.contacts();
        if !names.is_empty() {
            map.serialize_entry("contact_joints", &names)?;
            let frames = || {
                (0..poses.times().len()).map(|frame| {
                    Sequence({
                        let tracks = &tracks;
                        move || tracks.iter().map(move |track| track[frame])
                    })
                })
            };
            map.serialize_entry("contacts", &Sequence(frames))?;
        }
        let morphs = poses.morphs();
        if !morphs.is_empty() {
            map.serialize_entry("morph_names", &Sequence(|| morphs.iter().map(|morph| morph.name)))?;
            let frames = || {
                (0..poses.times().len()).map(|frame| {
                    Sequence({
                        let morphs = &morphs;
                        move || morphs.iter().map(move |morph| morph.weight(frame))
                    })
                })
            };
            map.serialize_entry("morph_weights", &Sequence(frames))?;
        }
        map.serialize_entry("meta", &poses.meta())?;
        map.end()
    }
}

struct Frames<'a> {
    document: &'a Document<'a>,
    channel: Channel,
}

impl Serialize for Frames<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Document { poses, control } = *self.document;
        let channel = self.channel;
        let mut frames = serializer.serialize_seq(Some(poses.times().len()))?;
        for frame in 0..poses.times().len() {
            control.check().map_err(S::Error::custom)?;
            let joints =
                || (0..poses.joint_count()).map(move |joint| Sequence(move || poses.value(channel, joint, frame)));
            frames.serialize_element(&Sequence(joints))?;
        }
        frames.end()
    }
}

/// A list made while it is written.
struct Sequence<F>(F);

impl<F, I> Serialize for Sequence<F>
where
    F: Fn() -> I,
    I: Iterator,
    I::Item: Serialize,
{
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0())
    }
}
