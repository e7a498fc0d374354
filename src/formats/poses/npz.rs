//! The NumPy archive: a zip of arrays. Knows the names of the keys, not what they mean.

use std::io::{Cursor, Write};

use zip::{CompressionMethod, ZipArchive, ZipWriter, result::ZipError, write::SimpleFileOptions};

use crate::{
    formats::{
        Budget, FormatError,
        numpy::{self, npy},
        zipped::zip_error,
    },
    model::Control,
};

use super::{
    arrays::{Arrays, NAME_KEYS, NUMBER_KEYS, invalid},
    write::{Channel, Poses},
};

/// Of what is deflated, nearly all repeats from row to row; a higher level takes many times as long and gains a few percent.
const DEFLATE_LEVEL: i64 = 1;
/// Bytes that are handed to an archive at a time.
const BLOCK_BYTES: usize = 1 << 16;

/// Decodes the members that the layout knows, and only them.
pub(super) fn read(bytes: &[u8], budget: &mut Budget<'_>) -> Result<Arrays, FormatError> {
    let mut archive = numpy::Archive::open(bytes, budget)?;
    let mut arrays = Arrays::default();
    for (index, key) in archive.keys().to_vec().into_iter().enumerate() {
        if let Some(known) = NUMBER_KEYS.iter().find(|known| known.name == key) {
            arrays.numbers.insert(known.name, archive.numbers(index)?);
        } else if let Some(known) = NAME_KEYS.into_iter().find(|known| *known == key) {
            let (shape, names) = archive.strings(index)?;
            if shape.len() != 1 {
                return Err(invalid(key, format!("the shape is {shape:?}; one dimension is needed")));
            }
            arrays.names.insert(known, names);
        } else if key == "meta" {
            let (_, texts) = archive.strings(index)?;
            let [text] = texts.as_slice() else {
                return Err(invalid(key, format!("there are {} strings where one is needed", texts.len())));
            };
            arrays.meta =
                serde_json::from_str(text).map_err(|error| invalid(key, format!("no valid JSON: {error}")))?;
        } else {
            arrays.ignored.push(key);
        }
    }
    Ok(arrays)
}

/// Encodes as an archive that is the same for the same poses: fixed times, fixed order.
pub(super) fn write(poses: &Poses<'_>, control: &Control) -> Result<Vec<u8>, FormatError> {
    let (frames, joints) = (poses.times().len(), poses.joint_count());
    // Deflating is nearly all of what an archive costs, so the two channels are deflated at once.
    let deflated = |channel| {
        let mut archive = Archive::new();
        archive.add_channel(poses, channel, Packing::Deflated, control)?;
        archive.finish()
    };
    let (translations, scales) = rayon::join(|| deflated(Channel::Translation), || deflated(Channel::Scale));
    let (translations, scales) = (translations?, scales?);
    let mut archive = Archive::new();
    archive.add("joint_names", &npy::unicode_array(&poses.joint_names(), &[joints]), Packing::Deflated)?;
    let parents = array("<i4", &[joints], poses.parents().flat_map(i32::to_le_bytes));
    archive.add("parents", &parents, Packing::Deflated)?;
    for channel in Channel::ALL {
        let values = (0..joints).flat_map(|joint| poses.rest(channel, joint)).flat_map(f32::to_le_bytes);
        let member = array("<f4", &[joints, channel.width()], values);
        archive.add(&format!("rest_{}", channel.key()), &member, Packing::Deflated)?;
    }
    // In single precision, frames at the end of a long clip are no longer evenly apart, and what looks at a span of time finds a frame more
    // in it or less.
    let times = array("<f8", &[frames], poses.times().iter().flat_map(|time| time.to_le_bytes()));
    archive.add("times", &times, Packing::Deflated)?;
    archive.add_members_of(&translations, Channel::Translation.key())?;
    // The other two mostly repeat and all but vanish; rotations of captured motion hardly shrink. Stored, they also keep a
    // still clip's archive far from the ratio that readers, ours among them, take for an attack.
    archive.add_channel(poses, Channel::Rotation, Packing::Stored, control)?;
    archive.add_members_of(&scales, Channel::Scale.key())?;
    let (names, tracks) = poses.contacts();
    if !names.is_empty() {
        archive.add("contact_joints", &npy::unicode_array(&names, &[names.len()]), Packing::Deflated)?;
        let touches = (0..frames).flat_map(|frame| tracks.iter().map(move |track| u8::from(track[frame])));
        archive.add("contacts", &array("|b1", &[frames, names.len()], touches), Packing::Deflated)?;
    }
    let morphs = poses.morphs();
    if !morphs.is_empty() {
        let names: Vec<&str> = morphs.iter().map(|morph| morph.name).collect();
        archive.add("morph_names", &npy::unicode_array(&names, &[names.len()]), Packing::Deflated)?;
        let weights = (0..frames).flat_map(|frame| morphs.iter().map(move |morph| morph.weight(frame)));
        let member = array("<f4", &[frames, names.len()], weights.flat_map(f32::to_le_bytes));
        archive.add("morph_weights", &member, Packing::Deflated)?;
    }
    archive.add("meta", &npy::unicode_array(&[poses.meta()], &[]), Packing::Deflated)?;
    archive.finish()
}

fn array(description: &str, shape: &[usize], bytes: impl Iterator<Item = u8>) -> Vec<u8> {
    let mut member = Vec::new();
    npy::write_header(&mut member, description, shape);
    member.extend(bytes);
    member
}

#[derive(Clone, Copy)]
enum Packing {
    Stored,
    Deflated,
}

struct Archive {
    zip: ZipWriter<Cursor<Vec<u8>>>,
}

impl Archive {
    fn new() -> Self {
        Self { zip: ZipWriter::new(Cursor::new(Vec::new())) }
    }

    fn finish(self) -> Result<Vec<u8>, FormatError> {
        let bytes = self.zip.finish().map_err(|error| zip_error(&error, "archive"))?;
        Ok(bytes.into_inner())
    }

    fn add(&mut self, key: &str, member: &[u8], packing: Packing) -> Result<(), FormatError> {
        self.begin(key, member.len(), packing)?;
        self.append(key, member)
    }

    /// The values of a channel, block by block.
    fn add_channel(
        &mut self,
        poses: &Poses<'_>,
        channel: Channel,
        packing: Packing,
        control: &Control,
    ) -> Result<(), FormatError> {
        let (frames, joints, width) = (poses.times().len(), poses.joint_count(), channel.width());
        let row_bytes = joints * width * size_of::<f32>();
        let mut block = Vec::with_capacity(BLOCK_BYTES + row_bytes);
        npy::write_header(&mut block, "<f4", &[frames, joints, width]);
        self.begin(channel.key(), block.len() + frames * row_bytes, packing)?;
        for frame in 0..frames {
            control.check()?;
            for joint in 0..joints {
                poses.value(channel, joint, frame).for_each(|value| block.extend_from_slice(&value.to_le_bytes()));
            }
            if block.len() >= BLOCK_BYTES {
                self.append(channel.key(), &block)?;
                block.clear();
            }
        }
        self.append(channel.key(), &block)
    }

    /// Members of another archive, as they lie in it.
    fn add_members_of(&mut self, archive: &[u8], key: &str) -> Result<(), FormatError> {
        let mut members = ZipArchive::new(Cursor::new(archive)).map_err(|error| zip_error(&error, key))?;
        for index in 0..members.len() {
            let member = members.by_index_raw(index).map_err(|error| zip_error(&error, key))?;
            self.zip.raw_copy_file(member).map_err(|error| zip_error(&error, key))?;
        }
        Ok(())
    }

    fn begin(&mut self, key: &str, bytes: usize, packing: Packing) -> Result<(), FormatError> {
        let (method, level) = match packing {
            Packing::Stored => (CompressionMethod::Stored, None),
            Packing::Deflated => (CompressionMethod::Deflated, Some(DEFLATE_LEVEL)),
        };
        let options = SimpleFileOptions::default()
            .compression_method(method)
            .compression_level(level)
            .last_modified_time(zip::DateTime::default())
            .large_file(u32::try_from(bytes).is_err());
        self.zip.start_file(format!("{key}.npy"), options).map_err(|error| zip_error(&error, key))
    }

    fn append(&mut self, key: &str, bytes: &[u8]) -> Result<(), FormatError> {
        self.zip.write_all(bytes).map_err(|error| zip_error(&ZipError::Io(error), key))
    }
}
