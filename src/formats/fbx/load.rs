//! Bytes to the parser's own scene: the options that decide what the rest of this folder sees, the limits, and what the
//! parser's errors and warnings mean to us.

use std::borrow::Cow;

use ufbx::{ErrorType, ProgressResult, WarningType};

use crate::{
    formats::{Budget, ErrorKind, FormatError, Limit},
    model::{Canceled, Reporter},
};

/// How a binary file begins.
const BINARY_MAGIC: &[u8] = b"Kaydara FBX Binary";
/// One heap block for every so many bytes of file would be absurd; a file that asks for more is hostile.
const MAX_ALLOCATIONS: usize = 2_000_000;

/// Parses a file under the budget.
///
/// # Errors
/// When the bytes are no FBX, are damaged, hold nothing, or exceed the budget; or when the work is canceled.
pub(super) fn load(
    bytes: &[u8],
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<ufbx::SceneRoot, FormatError> {
    budget.check_canceled()?;
    let bytes = &*with_first_comment(bytes, budget)?;
    let control = budget.control();
    let progress = |_: &ufbx::Progress| match control.check() {
        Ok(()) => ProgressResult::Continue,
        Err(Canceled) => ProgressResult::Cancel,
    };
    // Half for what the parser keeps, half for what it throws away, so that both together respect the limit.
    let memory_limit = usize::try_from(budget.limits().decoded_bytes / 2).unwrap_or(usize::MAX).max(1);
    let allocator =
        || ufbx::AllocatorOpts { memory_limit, allocation_limit: MAX_ALLOCATIONS, ..ufbx::AllocatorOpts::default() };
    let options = |ignore_embedded: bool, ignore_geometry: bool| ufbx::LoadOpts {
        temp_allocator: allocator(),
        result_allocator: allocator(),
        // Other formats have readers of their own; the parser must not guess.
        file_format: ufbx::FileFormat::Fbx,
        ignore_geometry,
        ignore_embedded,
        skip_skin_vertices: true,
        skip_mesh_parts: true,
        node_depth_limit: u32::try_from(budget.limits().hierarchy_depth).unwrap_or(u32::MAX).max(1),
        progress_cb: ufbx::ProgressCb::Ref(&progress),
        target_axes: ufbx::CoordinateAxes::right_handed_y_up(),
        target_unit_meters: 1.0,
        // Of a left-handed file, the same scene: what is left stays left. Any axis would do, for geometry is mirrored with the joints.
        handedness_conversion_axis: ufbx::MirrorAxis::X,
        // The other ways of converting units leave a factor of 0.01 on the top nodes and centimeters below them.
        space_conversion: ufbx::SpaceConversion::ModifyGeometry,
        // A joint turns about its pivot, so that is where it has to be; the rest ends up in geometry, which we do not read.
        pivot_handling: ufbx::PivotHandling::AdjustToPivot,
        geometry_transform_handling: ufbx::GeometryTransformHandling::Preserve,
        // Resolved in `nodes` and `clips`: every other way inserts nodes that the file does not have.
        inherit_mode_handling: ufbx::InheritModeHandling::Preserve,
        ..ufbx::LoadOpts::default()
    };
    let mut loaded = ufbx::load_memory(bytes, options(false, false));
    if loaded.as_ref().is_err_and(is_about_memory) {
        loaded = ufbx::load_memory(bytes, options(true, false));
        if loaded.is_ok() {
            reporter.warn(
                "fbx_images_left_out",
                "Objects",
                "the file and the images in it are larger together than may be decoded; an FBX that is written of it only names them",
                "send the images beside the file, or ask the operator to raise the limit",
            );
        }
    }
    let file = match loaded {
        Ok(file) => file,
        Err(first) if is_about_the_whole_file(&first) => return Err(refusal(&first, budget)),
        Err(first) => {
            // Perhaps only its meshes are damaged, or too large; the skeleton and the clips are what we are here for.
            let file = ufbx::load_memory(bytes, options(true, true)).map_err(|error| refusal(&error, budget))?;
            reporter.warn(
                "skin_points_unreadable",
                "Objects",
                format!(
                    "the meshes cannot be decoded ({}); hands, feet and soles are judged without them",
                    first.description
                ),
                "export the file again if the feet or hands come out turned",
            );
            file
        }
    };
    budget.take(Limit::DecodedBytes, file.metadata.result_memory_used as u64, "file")?;
    report(&file, reporter);
    if file.nodes.len() <= 1 {
        return Err(empty(&file));
    }
    Ok(file)
}

/// The file, with an empty comment before a text that does not begin with one.
///
/// The parser takes the version from the first comment, wherever that stands, and so may change its mind after it has begun to read
/// by another version: ufbx 0.11 then ends the process.
fn with_first_comment<'a>(bytes: &'a [u8], budget: &mut Budget<'_>) -> Result<Cow<'a, [u8]>, FormatError> {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if bytes.starts_with(BINARY_MAGIC) || text.trim_ascii_start().starts_with(b";") {
        return Ok(Cow::Borrowed(bytes));
    }
    budget.take(Limit::DecodedBytes, text.len() as u64, "file")?;
    Ok(Cow::Owned([b";\n", text].concat()))
}

const fn is_about_memory(error: &ufbx::Error) -> bool {
    matches!(error.type_, ErrorType::MemoryLimit | ErrorType::AllocationLimit | ErrorType::OutOfMemory)
}

/// Whether reading without geometry cannot end otherwise.
fn is_about_the_whole_file(error: &ufbx::Error) -> bool {
    matches!(
        error.type_,
        ErrorType::Cancelled
            | ErrorType::NodeDepthLimit
            | ErrorType::UnrecognizedFileFormat
            | ErrorType::UnsupportedVersion
            | ErrorType::FeatureDisabled
            | ErrorType::EmptyFile
    )
}

/// What a parser error means to us. Only the fixed description is used: the parser's further details quote bytes of the
/// file, which need not be text.
fn refusal(error: &ufbx::Error, budget: &Budget<'_>) -> FormatError {
    let limits = budget.limits();
    let limit = |limit: Limit| ErrorKind::LimitExceeded {
        limit,
        most: limit.of(limits),
        actual: limit.of(limits).saturating_add(1),
    };
    let (kind, hint) = match error.type_ {
        _ if is_about_memory(error) => {
            (limit(Limit::DecodedBytes), "make the file smaller, or ask the operator to raise the limit")
        }
        ErrorType::NodeDepthLimit => {
            (limit(Limit::HierarchyDepth), "flatten the hierarchy, or ask the operator to raise the limit")
        }
        ErrorType::Cancelled => return Canceled.into(),
        // The parser gives bytes that are nothing like an FBX no kind of their own.
        _ if &*error.description == "Not an FBX file" => {
            (ErrorKind::UnsupportedFormat, "check that this is an FBX file")
        }
        ErrorType::UnrecognizedFileFormat => (ErrorKind::UnsupportedFormat, "check that this is an FBX file"),
        ErrorType::UnsupportedVersion | ErrorType::FeatureDisabled => {
            (ErrorKind::UnsupportedFeature, "export as FBX 2014 (7.4) or later, binary")
        }
        ErrorType::TruncatedFile | ErrorType::EmptyFile => {
            (ErrorKind::Malformed, "check that the upload or the export was complete")
        }
        _ => (ErrorKind::Malformed, "export the file again as FBX 2014 (7.4) or later, binary"),
    };
    FormatError {
        kind,
        phase: "container",
        place: String::new(),
        detail: format!("the FBX file cannot be read: {}", error.description),
        hint: hint.into(),
    }
}

fn empty(file: &ufbx::Scene) -> FormatError {
    if file.metadata.warnings.iter().any(|warning| matches!(warning.type_, WarningType::UnsupportedVersion)) {
        return FormatError::unsupported(
            "container",
            "header",
            format!("FBX version {} is not known, and nothing in the file could be read", file.metadata.version),
            "export as FBX 2014 (7.4) or later, binary",
        );
    }
    FormatError::malformed("nodes", "Objects", "the FBX file holds no model at all")
        .with_hint("check that the export included the skeleton and was complete")
}

/// Hands on the parser's warnings that touch what we read; those about meshes, textures and materials do not.
fn report(file: &ufbx::Scene, reporter: &mut Reporter) {
    for warning in &file.metadata.warnings {
        let element = file.elements.as_ref().get(warning.element_id as usize);
        let matters = match warning.type_ {
            WarningType::DuplicateConnection
            | WarningType::UnsupportedVersion
            | WarningType::DuplicateObjectId
            | WarningType::TruncatedArray => true,
            WarningType::BadUnicode => element
                .is_some_and(|element| matches!(element.type_, ufbx::ElementType::Node | ufbx::ElementType::AnimStack)),
            _ => false,
        };
        if matters {
            reporter.warn(
                "fbx_repaired",
                element.map_or_else(String::new, |element| element.name.to_string()),
                format!("{} ({} times); the file was read all the same", warning.description, warning.count),
                "export the file again if the result looks wrong",
            );
        }
    }
    if !file.constraints.is_empty() {
        reporter.warn(
            "constraints_ignored",
            "Objects",
            format!("{} constraints are not evaluated; only key frames move the joints", file.constraints.len()),
            "bake the animation before exporting",
        );
    }
}
