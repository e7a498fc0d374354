//! Decompression of buffer views: bind matrices, animations, vertices and the triangles between them.

use crate::formats::{Budget, FormatError, Limit, gltf::document::CompressedView};

/// Below this size a high ratio is no bomb but a constant track.
const RATIO_MATTERS_FROM_BYTES: u64 = 1 << 20;

/// Decodes a compressed view into `count · stride` bytes.
pub(super) fn decode(
    encoded: &[u8],
    view: &CompressedView,
    place: &str,
    budget: &mut Budget<'_>,
) -> Result<Vec<u8>, FormatError> {
    let decoded_bytes = (view.count as u64).saturating_mul(view.stride as u64);
    if decoded_bytes > RATIO_MATTERS_FROM_BYTES {
        let ratio = decoded_bytes / (encoded.len() as u64).max(1);
        budget.check(Limit::DecompressionRatio, ratio, place)?;
    }
    // Elements and their bytes are both there for a moment.
    budget.take_array(view.count as u64, (view.stride as u64).saturating_mul(2), place)?;
    match (view.mode.as_str(), view.stride) {
        ("TRIANGLES" | "INDICES", _) if view.filter.as_deref().is_some_and(|filter| filter != "NONE") => {
            Err(unsupported(view, place, "with a filter"))
        }
        // The decoder holds the caller to whole triangles.
        ("TRIANGLES", _) if !view.count.is_multiple_of(3) => Err(damaged(place)),
        ("TRIANGLES", 2) => indices(meshopt::decode_index_buffer::<u16>(encoded, view.count), place),
        ("TRIANGLES", 4) => indices(meshopt::decode_index_buffer::<u32>(encoded, view.count), place),
        ("INDICES", 2) => indices(meshopt::decode_index_sequence::<u16>(encoded, view.count), place),
        ("INDICES", 4) => indices(meshopt::decode_index_sequence::<u32>(encoded, view.count), place),
        ("ATTRIBUTES", 4) => decode_words::<1>(encoded, view, place),
        ("ATTRIBUTES", 8) => decode_words::<2>(encoded, view, place),
        ("ATTRIBUTES", 12) => decode_words::<3>(encoded, view, place),
        ("ATTRIBUTES", 16) => decode_words::<4>(encoded, view, place),
        ("ATTRIBUTES", 20) => decode_words::<5>(encoded, view, place),
        ("ATTRIBUTES", 24) => decode_words::<6>(encoded, view, place),
        ("ATTRIBUTES", 28) => decode_words::<7>(encoded, view, place),
        ("ATTRIBUTES", 32) => decode_words::<8>(encoded, view, place),
        ("ATTRIBUTES", 48) => decode_words::<12>(encoded, view, place),
        ("ATTRIBUTES", 64) => decode_words::<16>(encoded, view, place),
        (_, stride) => Err(unsupported(view, place, &format!("with a stride of {stride} bytes"))),
    }
}

fn indices<T: bytemuck::Pod>(decoded: Result<Vec<T>, meshopt::Error>, place: &str) -> Result<Vec<u8>, FormatError> {
    decoded.map(|indices| bytemuck::cast_slice(&indices).to_vec()).map_err(|_| damaged(place))
}

fn decode_words<const N: usize>(encoded: &[u8], view: &CompressedView, place: &str) -> Result<Vec<u8>, FormatError>
where
    [u32; N]: Default + bytemuck::Pod,
{
    let mut elements: Vec<[u32; N]> = meshopt::decode_vertex_buffer(encoded, view.count).map_err(|_| damaged(place))?;
    match view.filter.as_deref() {
        None | Some("NONE") => {}
        Some("QUATERNION") if view.stride == 8 => {
            meshopt::decode_filter_quat(bytemuck::cast_slice_mut::<_, [i16; 4]>(&mut elements));
        }
        Some("EXPONENTIAL") => meshopt::decode_filter_exp(&mut elements),
        Some("OCTAHEDRAL") if view.stride == 4 => {
            meshopt::decode_filter_oct(bytemuck::cast_slice_mut::<_, [i8; 4]>(&mut elements));
        }
        Some("OCTAHEDRAL") if view.stride == 8 => {
            meshopt::decode_filter_oct(bytemuck::cast_slice_mut::<_, [i16; 4]>(&mut elements));
        }
        Some(filter) => return Err(unsupported(view, place, &format!("with the filter '{filter}'"))),
    }
    Ok(bytemuck::cast_slice(&elements).to_vec())
}

fn damaged(place: &str) -> FormatError {
    FormatError::malformed("bufferViews", place, "the compressed data is damaged and cannot be decoded")
}

fn unsupported(view: &CompressedView, place: &str, with: &str) -> FormatError {
    FormatError::unsupported(
        "bufferViews",
        place,
        format!("data compressed in mode '{}' {with} cannot be read", view.mode),
        "export the file without compression",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{formats::Limits, model::Control};

    fn decoded(encoded: &[u8], mode: &str, stride: usize, count: usize) -> Result<Vec<u8>, FormatError> {
        let view = CompressedView {
            buffer: 0,
            offset: 0,
            length: encoded.len(),
            stride,
            count,
            mode: mode.to_owned(),
            filter: None,
        };
        decode(encoded, &view, "/bufferViews/0", &mut Budget::new(&Limits::default(), &Control::new()))
    }

    #[test]
    fn triangles_and_lists_of_indices_are_decoded() {
        let triangles: Vec<u32> = vec![0, 1, 2, 2, 1, 3, 3, 1, 4];
        let encoded = meshopt::encode_index_buffer(&triangles, 5).expect("encodes");
        let long = decoded(&encoded, "TRIANGLES", 4, 9).expect("triangles");
        // A triangle may begin at any of its corners.
        let turned = |corners: &[u32]| {
            let first = (0..3).min_by_key(|corner| corners[*corner]).unwrap_or(0);
            [0, 1, 2].map(|step| corners[(first + step) % 3])
        };
        let long: Vec<u32> = bytemuck::pod_collect_to_vec(&long);
        let short: Vec<u16> = bytemuck::pod_collect_to_vec(&decoded(&encoded, "TRIANGLES", 2, 9).expect("triangles"));
        for (at, expected) in triangles.chunks_exact(3).enumerate() {
            assert_eq!(turned(&long[3 * at..][..3]), turned(expected));
            assert_eq!(turned(&[0, 1, 2].map(|corner| u32::from(short[3 * at + corner]))), turned(expected));
        }
        let listed: Vec<u32> = vec![4, 0, 3, 3, 2];
        let encoded = meshopt::encode_index_sequence(&listed, 5).expect("encodes");
        let bytes = decoded(&encoded, "INDICES", 4, 5).expect("a list");
        assert_eq!(bytemuck::pod_collect_to_vec::<u8, u32>(&bytes), listed);
    }

    #[test]
    fn what_is_damaged_is_told() {
        let encoded = meshopt::encode_index_buffer(&[0, 1, 2], 3).expect("encodes");
        for (mode, count) in [("TRIANGLES", 4), ("TRIANGLES", 300), ("INDICES", 3)] {
            let error = decoded(&encoded, mode, 4, count).expect_err("not that");
            assert!(error.to_string().contains("damaged"), "{mode} {count}: {error}");
        }
        assert!(decoded(&encoded, "TRIANGLES", 8, 3).is_err(), "no index has eight bytes");
        assert!(decoded(&encoded, "POINTS", 4, 3).is_err(), "no such mode");
    }
}
