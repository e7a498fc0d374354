//! Many clips at once: a folder of them, or a list. Every clip has results of its own, called after it.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};

use super::exit::{BAD_USAGE, Exit, INPUT_REFUSED, one_line, say};
use crate::formats::Format;

/// What stands for the name of a clip in the names of its results.
pub(super) const NAME: &str = "{name}";

/// Clips by the names that their results have.
pub(super) struct Clip {
    pub(super) name: String,
    pub(super) path: PathBuf,
}

/// The clips of a folder, by name, or of a list: a text with one path on each line, from the folder of the list.
pub(super) fn clips(place: &Path) -> Result<Vec<Clip>, Exit> {
    let shown = place.display();
    let failed = |error: std::io::Error| {
        let (what, hint) = match error.kind() {
            std::io::ErrorKind::NotFound => ("there is no such folder or list".to_owned(), "check the path"),
            std::io::ErrorKind::InvalidData => {
                ("this is not text".to_owned(), "send a folder, or a text with one path on each line")
            }
            _ => (format!("it cannot be read: {error}"), "check the permissions of the folder and of what is in it"),
        };
        Exit::new(INPUT_REFUSED, format!("batch {shown}: {what}"), hint)
    };
    let is_folder = place.is_dir();
    let mut paths = Vec::new();
    if is_folder {
        for entry in fs::read_dir(place).map_err(failed)? {
            let path = entry.map_err(failed)?.path();
            let is_hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
            if !is_hidden && path.is_file() {
                paths.push(path);
            }
        }
        paths.sort();
    } else {
        let folder = place.parent().unwrap_or(Path::new(""));
        let text = fs::read_to_string(place).map_err(failed)?;
        let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
        paths.extend(lines.map(|line| folder.join(line)));
    }
    let mut taken = BTreeSet::new();
    let mut clips = Vec::new();
    for path in paths {
        let file_name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        if is_folder && Format::from_file_name(&file_name).is_none() {
            say(format_args!("left out {}: the ending stands for no format", one_line(&path.display().to_string())));
            continue;
        }
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        // Two that differ in their ending or their folder only keep what tells them apart.
        let whole = path.strip_prefix(place).unwrap_or(&path).to_string_lossy().into_owned();
        let name =
            [stem, file_name, whole].into_iter().map(|name| clean(&name)).find(|name| taken.insert(name.clone()));
        let Some(name) = name else {
            let message = format!("batch {shown}: {} is named twice", path.display());
            return Err(Exit::new(BAD_USAGE, message, "name every clip once"));
        };
        clips.push(Clip { name, path });
    }
    if clips.is_empty() {
        return Err(Exit::new(INPUT_REFUSED, format!("batch {shown}: there are no clips in it"), ""));
    }
    Ok(clips)
}

/// A name that stays in its folder.
pub(super) fn clean(name: &str) -> String {
    let name: String = name
        .chars()
        .map(|letter| if matches!(letter, '/' | '\\') || letter.is_control() { '_' } else { letter })
        .collect();
    name.trim_start_matches('.').to_owned()
}

/// Refuses outputs that all clips would write to.
pub(super) fn check_names<'p>(outputs: impl IntoIterator<Item = &'p PathBuf>) -> Result<(), Exit> {
    let has_no_name = |path: &&PathBuf| path.file_name().is_none_or(|name| !name.to_string_lossy().contains(NAME));
    match outputs.into_iter().find(has_no_name) {
        None => Ok(()),
        Some(path) => {
            let message = format!("output {}: every clip of the batch would be written to it", path.display());
            let hint = format!("put {NAME} where the name of the clip belongs, as in out/{NAME}.glb");
            Err(Exit::new(BAD_USAGE, message, hint))
        }
    }
}

/// The place of the results of one clip.
pub(super) fn named(pattern: &Path, name: &str) -> PathBuf {
    let file_name = pattern.file_name().map(|file_name| file_name.to_string_lossy().replace(NAME, name));
    pattern.with_file_name(file_name.unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clips_of_a_folder_and_of_a_list_have_names_of_their_own() {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["walk.bvh", "run.glb", "walk.fbx", ".hidden.glb", "notes.txt"] {
            fs::write(folder.path().join(name), "").expect("a file");
        }
        let names = |place: &Path| {
            let clips = clips(place)?;
            Ok::<_, Exit>(clips.into_iter().map(|clip| clip.name).collect::<Vec<_>>())
        };
        assert_eq!(
            names(folder.path()).expect("clips"),
            ["run", "walk", "walk.fbx"],
            "in order, and what is no clip is left"
        );
        let list = folder.path().join("list.txt");
        fs::write(&list, "# two\nrun.glb\n\nother/run.glb\n").expect("a list");
        assert_eq!(names(&list).expect("clips"), ["run", "run.glb"], "as the list says");
        fs::write(&list, "#\n").expect("a list");
        assert_eq!(names(&list).expect_err("nothing").code, INPUT_REFUSED, "an empty list");
        assert_eq!(named(Path::new("out/{name}.glb"), "walk"), Path::new("out/walk.glb"), "called after the clip");
        assert_eq!(clean("../../etc"), "_.._etc", "and in its folder");
    }
}
