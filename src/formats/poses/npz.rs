//! The NumPy archive: a zip of arrays. Knows the names of the keys, not what they mean.

use std::io::{Cursor, Write};

use zip::{CompressionMethod, ZipWriter, result::ZipError, write::SimpleFileOptions};

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
    let mut archive = Archive { zip: ZipWriter::new(Cursor::new(Vec::new())) };
    let (frames, joints) = (poses.times().len(), poses.joint_count());
    archive.add("joint_names", &npy::unicode_array(&poses.joint_names(), &[joints]), Packing::Deflated)?;
    let parents = array("<i4", &[joints], poses.parents().flat_map(i32::to_le_bytes));
    archive.add("parents", &parents, Packing::Deflated)?;
    for channel in Channel::ALL {
        let values = (0..joints).flat_map(|joint| poses.rest(channel, joint)).flat_map(f32::to_le_bytes);
        let member = array("<f4", &[joints, channel.width()], values);
        archive.add(&format!("rest_{}", channel.key()), &member, Packing::Deflated)?;
    }
    let times = array("<f4", &[frames], poses.times().iter().flat_map(|time| (*time as f32).to_le_bytes()));
    archive.add("times", &times, Packing::Deflated)?;
    for channel in Channel::ALL {
        let width = channel.width();
        let mut member = Vec::with_capacity(128 + frames * joints * width * size_of::<f32>());
        npy::write_header(&mut member, "<f4", &[frames, joints, width]);
        for frame in 0..frames {
            control.check()?;
            for joint in 0..joints {
                let values = poses.value(channel, joint, frame);
                member.extend(values.flat_map(f32::to_le_bytes));
            }
        }
        // The other two mostly repeat and all but vanish; rotations of captured motion hardly shrink. Stored, they also keep a
        // still clip's archive far from the ratio that readers, ours among them, take for an attack.
        let packing = if channel == Channel::Rotation { Packing::Stored } else { Packing::Deflated };
        archive.add(channel.key(), &member, packing)?;
    }
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
    let bytes = archive.zip.finish().map_err(|error| zip_error(&error, "archive"))?;
    Ok(bytes.into_inner())
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
    fn add(&mut self, key: &str, member: &[u8], packing: Packing) -> Result<(), FormatError> {
        let method = match packing {
            Packing::Stored => CompressionMethod::Stored,
            Packing::Deflated => CompressionMethod::Deflated,
        };
        let options = SimpleFileOptions::default()
            .compression_method(method)
            .last_modified_time(zip::DateTime::default())
            .large_file(u32::try_from(member.len()).is_err());
        self.zip.start_file(format!("{key}.npy"), options).map_err(|error| zip_error(&error, key))?;
        self.zip.write_all(member).map_err(|error| zip_error(&ZipError::Io(error), key))
    }
}
