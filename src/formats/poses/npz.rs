//! The NumPy archive: a zip of arrays. Knows the names of the keys, not what they mean.

use std::io::{Cursor, Read, Write};

use zip::{CompressionMethod, ZipArchive, ZipWriter, result::ZipError, write::SimpleFileOptions};

use crate::{
    formats::{Budget, ErrorKind, FormatError, Limit},
    model::Control,
};

use super::{
    arrays::{Arrays, NUMBER_KEYS, invalid},
    npy,
    write::{Channel, Poses},
};

/// An archive of the layout has some twenty members; the directory of one with more is not even built.
const MOST_MEMBERS: usize = 1024;
/// Arrays that repeat one value compress beyond any ratio; below this size that does no harm.
const RATIO_FREE_BYTES: u64 = 8 << 20;
const CHUNK_BYTES: usize = 1 << 20;

/// Decodes the members that the layout knows, and only them. No member is ever written anywhere.
pub(super) fn read(bytes: &[u8], budget: &mut Budget<'_>) -> Result<Arrays, FormatError> {
    // The zip reader allocates for every entry of its directory, so they are counted before it starts.
    let entries = bytes.windows(4).filter(|window| *window == b"PK\x01\x02").take(MOST_MEMBERS + 1).count();
    if entries > MOST_MEMBERS {
        return Err(invalid("archive", format!("the archive has more than {MOST_MEMBERS} members")));
    }
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|error| zip_error(&error, "archive"))?;
    let names: Vec<String> = archive.file_names_raw().map(|name| String::from_utf8_lossy(name).into_owned()).collect();
    let keys: Vec<&str> = names.iter().map(|name| name.strip_suffix(".npy").unwrap_or(name)).collect();
    refuse_other_layouts(&keys)?;

    let mut member = Members { archive: &mut archive, archive_bytes: bytes.len() as u64, decoded_bytes: 0, budget };
    let mut arrays = Arrays::default();
    for (index, key) in keys.iter().enumerate() {
        if let Some(known) = NUMBER_KEYS.iter().find(|known| known.name == *key) {
            let (header, data) = member.read(index, key)?;
            let array = npy::numbers(&header, &data, key)?;
            arrays.numbers.insert(known.name, array);
        } else if *key == "joint_names" {
            let (header, data) = member.read(index, key)?;
            if header.shape.len() != 1 {
                return Err(invalid(*key, format!("the shape is {:?}; one dimension is needed", header.shape)));
            }
            arrays.joint_names = Some(npy::strings(&header, &data, key)?);
        } else if *key == "meta" {
            let (header, data) = member.read(index, key)?;
            let texts = npy::strings(&header, &data, key)?;
            let [text] = texts.as_slice() else {
                return Err(invalid(*key, format!("there are {} strings where one is needed", texts.len())));
            };
            arrays.meta =
                serde_json::from_str(text).map_err(|error| invalid(*key, format!("no valid JSON: {error}")))?;
        } else {
            arrays.ignored.push((*key).to_owned());
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
    archive.add("meta", &npy::unicode_array(&[poses.meta()], &[]), Packing::Deflated)?;
    let bytes = archive.zip.finish().map_err(|error| zip_error(&error, "archive"))?;
    Ok(bytes.into_inner())
}

/// Reads members of one archive under its budget.
struct Members<'archive, 'bytes, 'budget, 'limits> {
    archive: &'archive mut ZipArchive<Cursor<&'bytes [u8]>>,
    archive_bytes: u64,
    decoded_bytes: u64,
    budget: &'budget mut Budget<'limits>,
}

impl Members<'_, '_, '_, '_> {
    /// The header of a member and exactly as many bytes as it declares, all paid for before they are read.
    fn read(&mut self, index: usize, key: &str) -> Result<(npy::Header, Vec<u8>), FormatError> {
        let mut member = self.archive.by_index(index).map_err(|error| zip_error(&error, key))?;
        let zip_bytes = member.size();
        let header = npy::read_header(&mut member, key)?;
        let too_large = || invalid(key, format!("the shape {:?} is larger than any memory", header.shape));
        let data_bytes = header.data_bytes().ok_or_else(too_large)?;
        let decoded_bytes = header.decoded_bytes().ok_or_else(too_large)?;

        self.budget.take(Limit::DecodedBytes, data_bytes as u64, key)?;
        self.budget.take(Limit::DecodedBytes, decoded_bytes as u64, key)?;
        self.decoded_bytes += data_bytes as u64;
        if self.decoded_bytes > RATIO_FREE_BYTES {
            self.budget.check(Limit::DecompressionRatio, self.decoded_bytes / self.archive_bytes.max(1), key)?;
        }
        if zip_bytes != header.header_bytes + data_bytes as u64 {
            return Err(invalid(
                key,
                format!(
                    "the shape {:?} asks for {data_bytes} bytes, but the member holds {zip_bytes} with its header",
                    header.shape
                ),
            ));
        }

        let mut data = vec![0; data_bytes];
        for chunk in data.chunks_mut(CHUNK_BYTES) {
            self.budget.check_canceled()?;
            member.read_exact(chunk).map_err(|error| invalid(key, format!("the array cannot be unpacked: {error}")))?;
        }
        // The checksum is compared when the end is reached, so the end must be asked for.
        match member.read(&mut [0]) {
            Ok(0) => Ok((header, data)),
            Ok(_) => Err(invalid(key, "there are bytes after the end of the array")),
            Err(error) => Err(invalid(key, format!("the array cannot be unpacked: {error}"))),
        }
    }
}

/// Archives of body models follow other layouts; saying so is better than a list of missing keys.
fn refuse_other_layouts(keys: &[&str]) -> Result<(), FormatError> {
    let body_model = keys.iter().find(|key| matches!(**key, "poses" | "smpl_poses" | "root_orient"));
    match body_model {
        Some(key) if !keys.contains(&"joint_names") => Err(FormatError::unsupported(
            "arrays",
            *key,
            "this is an archive of body model parameters (AMASS or SMPL), which holds no skeleton; it is not read yet",
            "convert it to BVH, FBX or glTF, or to pose arrays with joint_names, parents and rest_translations",
        )),
        _ => Ok(()),
    }
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

fn zip_error(error: &ZipError, place: &str) -> FormatError {
    let kind = match error {
        ZipError::UnsupportedArchive(_) | ZipError::CompressionMethodNotSupported(_) | ZipError::InvalidPassword => {
            ErrorKind::UnsupportedFeature
        }
        _ => ErrorKind::Malformed,
    };
    FormatError {
        kind,
        phase: "container",
        place: place.to_owned(),
        detail: format!("the archive cannot be unpacked: {error}"),
        hint: "save it again with numpy.savez or numpy.savez_compressed".into(),
    }
}
