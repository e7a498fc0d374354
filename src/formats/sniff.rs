//! Which format some bytes are of. The bytes decide; a name only tells apart what the bytes cannot.

use super::{ErrorKind, Format, FormatError, body_model};

/// The end of an archive that is searched for names; a directory of arrays is far smaller.
const MAX_DIRECTORY_BYTES: usize = 64 << 10;

/// Files that a drawing consists of: its joints, its texture and its mask.
pub const DRAWING_FILES: [&str; 3] = ["char_cfg.yaml", "texture.png", "mask.png"];

/// Keys of pose arrays that no glTF document has.
const POSE_KEYS: [&[u8]; 3] = [b"\"joint_names\"", b"\"rest_translations\"", b"\"rest_rotations\""];

/// Finds the format of a file from its first bytes; `file_name` only separates formats that share them (`.vrm` from
/// `.glb`).
///
/// # Errors
/// When the bytes are of no format that can be read.
pub fn sniff(bytes: &[u8], file_name: &str) -> Result<Format, FormatError> {
    let named = Format::from_file_name(file_name);
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    if bytes.starts_with(b"glTF") {
        return Ok(match named {
            Some(Format::Vrm) => Format::Vrm,
            Some(Format::Vrma) => Format::Vrma,
            _ => Format::Glb,
        });
    }
    if bytes.starts_with(b"Kaydara FBX Binary") {
        return Ok(Format::Fbx);
    }
    if bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(b"PK\x05\x06") {
        // The directory at the archive's end names its members in clear.
        let directory = &bytes[bytes.len().saturating_sub(MAX_DIRECTORY_BYTES)..];
        if !first_member(bytes).is_some_and(|name| name.ends_with(b".npy")) {
            let is_drawing = DRAWING_FILES.into_iter().all(|name| find(directory, name.as_bytes()).is_some());
            return Ok(if is_drawing { Format::Drawing } else { Format::Zip });
        }
        let has = |key: &str| find(directory, format!("{key}.npy").as_bytes()).is_some();
        return Ok(if body_model::is_parameter_archive(has) { Format::BodyModel } else { Format::PosesNpz });
    }
    if is_picture(bytes) {
        // A drawing that is annotated when it is used.
        return Ok(Format::Drawing);
    }
    if bytes.starts_with(b"\x93NUMPY") {
        return Ok(Format::JointPositions);
    }
    if text.starts_with(b"{") {
        // glTF and pose arrays are both JSON objects; a glTF document must have a member `asset`, pose arrays have keys of their own.
        let has = |key: &[u8]| find(text, key).is_some();
        let is_poses = !has(b"\"asset\"") && POSE_KEYS.into_iter().any(has);
        return Ok(if is_poses { Format::PosesJson } else { Format::Gltf });
    }
    if text.len() >= 9 && text[..9].eq_ignore_ascii_case(b"HIERARCHY") {
        return Ok(Format::Bvh);
    }
    let looks_like_text_fbx =
        text.starts_with(b"; FBX") || find(&text[..text.len().min(4096)], b"FBXHeaderExtension").is_some();
    if looks_like_text_fbx {
        return Ok(Format::Fbx);
    }
    Err(unknown(bytes, file_name))
}

/// Whether a file is a picture alone: PNG, JPEG or WebP.
#[must_use]
pub fn is_picture(bytes: &[u8]) -> bool {
    let is_webp = bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP");
    bytes.starts_with(b"\x89PNG\r\n\x1a\n") || bytes.starts_with(b"\xff\xd8\xff") || is_webp
}

/// The name of an archive's first member, from the header before it.
fn first_member(bytes: &[u8]) -> Option<&[u8]> {
    const NAME: usize = 30;
    let length = usize::from(u16::from_le_bytes(bytes.get(26..28)?.try_into().ok()?));
    bytes.get(NAME..NAME + length)
}

fn find(haystack: &[u8], needle: &[u8]) -> Option<usize> {
    haystack.windows(needle.len()).position(|window| window == needle)
}

fn unknown(bytes: &[u8], file_name: &str) -> FormatError {
    let (detail, hint) = if bytes.is_empty() {
        ("the file is empty", "check that the upload or the export was complete")
    } else if bytes.starts_with(b"version https://git-lfs.github.com/spec/") {
        ("this is a Git LFS pointer, not the file itself", "run 'git lfs pull' and send the file that it fetches")
    } else if bytes.starts_with(b"\x1f\x8b") {
        ("this is compressed with gzip", "unpack it with 'gunzip' and send what comes out")
    } else if bytes.starts_with(b"\x80") && file_name.to_ascii_lowercase().ends_with(".pkl") {
        (
            "this is a Python pickle, which is never decoded because it can run code",
            "save its arrays with numpy.savez: poses, trans, mocap_framerate",
        )
    } else {
        (
            "the first bytes are of no format that can be read",
            "send .glb, .gltf, .vrm, .vrma, .fbx, .bvh, .npz, .npy, poses .json, a .zip of one model, or a picture of a figure",
        )
    };
    FormatError {
        kind: ErrorKind::UnsupportedFormat,
        phase: "sniff",
        // Whoever sent it knows which file it is, and says so.
        place: String::new(),
        detail: detail.into(),
        hint: hint.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_decide_and_names_only_refine() {
        assert_eq!(sniff(b"glTF\x02\0\0\0", "a.fbx"), Ok(Format::Glb), "bytes over name");
        assert_eq!(sniff(b"glTF\x02\0\0\0", "a.VRM"), Ok(Format::Vrm), "name refines");
        assert_eq!(sniff(b"\xef\xbb\xbfHIERARCHY\n", ""), Ok(Format::Bvh), "byte order mark");
        assert_eq!(sniff(b"{\"joint_names\": []}", ""), Ok(Format::PosesJson), "pose arrays");
        assert_eq!(sniff(b"{\"asset\": {}}", ""), Ok(Format::Gltf), "glTF");
        for picture in [&b"\x89PNG\r\n\x1a\n...."[..], b"\xff\xd8\xff\xe0", b"RIFF\0\0\0\0WEBPVP8 "] {
            assert_eq!(sniff(picture, "hero.bvh"), Ok(Format::Drawing), "a picture is a drawing");
        }
        assert!(sniff(b"RIFF\0\0\0\0WAVEfmt ", "hero.webp").is_err(), "a sound is none");
    }

    #[test]
    fn what_is_nothing_says_what_it_is() {
        let error = sniff(b"version https://git-lfs.github.com/spec/v1\n", "a.fbx").expect_err("a pointer");
        assert!(error.detail.contains("Git LFS"), "names the problem: {error}");
        assert!(sniff(b"", "a.glb").expect_err("empty").detail.contains("empty"), "names the problem");
    }
}
