//! Decompression of buffer views, for the few that hold bind matrices and animations.

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
    if view.mode != "ATTRIBUTES" {
        return Err(FormatError::unsupported(
            "bufferViews",
            place,
            format!("animation data compressed in mode '{}' cannot be read", view.mode),
            "export the animation in mode ATTRIBUTES, or without compression",
        ));
    }
    match view.stride {
        4 => decode_words::<1>(encoded, view, place),
        8 => decode_words::<2>(encoded, view, place),
        12 => decode_words::<3>(encoded, view, place),
        16 => decode_words::<4>(encoded, view, place),
        24 => decode_words::<6>(encoded, view, place),
        32 => decode_words::<8>(encoded, view, place),
        48 => decode_words::<12>(encoded, view, place),
        64 => decode_words::<16>(encoded, view, place),
        stride => Err(unsupported_filter(view, place, &format!("with a stride of {stride} bytes"))),
    }
}

fn decode_words<const N: usize>(encoded: &[u8], view: &CompressedView, place: &str) -> Result<Vec<u8>, FormatError>
where
    [u32; N]: Default + bytemuck::Pod,
{
    let mut elements: Vec<[u32; N]> = meshopt::decode_vertex_buffer(encoded, view.count).map_err(|_| {
        FormatError::malformed("bufferViews", place, "the compressed data is damaged and cannot be decoded")
    })?;
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
        Some(filter) => return Err(unsupported_filter(view, place, &format!("with the filter '{filter}'"))),
    }
    Ok(bytemuck::cast_slice(&elements).to_vec())
}

fn unsupported_filter(view: &CompressedView, place: &str, with: &str) -> FormatError {
    FormatError::unsupported(
        "bufferViews",
        place,
        format!("animation data compressed in mode '{}' {with} cannot be read", view.mode),
        "export the animation without compression",
    )
}
