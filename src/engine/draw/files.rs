//! The files of a drawing in an archive, found by the names that configs call them by.

use crate::{
    engine::{AnnotationView, Failure, FailureCode, NamedBytes, annotate_drawing},
    formats::{Limits, is_picture, unpack_files},
    model::Control,
};

/// Endings of files that configs name.
const ENDINGS: [&str; 7] = ["yaml", "yml", "png", "jpg", "jpeg", "webp", "bvh"];
/// The file by which the folder of a drawing is known.
pub(super) const CHARACTER: &str = "char_cfg.yaml";

/// The files of a drawing, or of what goes beside it.
#[derive(Clone, Debug, Default)]
pub struct DrawingFiles {
    files: Vec<(String, Vec<u8>)>,
    annotation: Option<AnnotationView>,
}

impl DrawingFiles {
    /// The files of a drawing: those of an archive, or of a picture alone, which is annotated.
    ///
    /// # Errors
    /// As [`Self::unpack`], and when there is no figure in the picture.
    pub fn read(file: NamedBytes<'_>, limits: &Limits, control: &Control) -> Result<Self, Failure> {
        if !is_picture(file.bytes) {
            return Self::unpack(file.bytes, limits, control);
        }
        check_size(file.bytes)?;
        let drawing = annotate_drawing(file, None, None, None, control)?;
        let files = drawing.files()?.into_iter().map(|(name, bytes)| (name.to_owned(), bytes)).collect();
        Ok(Self { files, annotation: Some(drawing.view()) })
    }

    /// What was found in the picture, where the drawing is one alone.
    #[must_use]
    pub const fn annotation(&self) -> Option<&AnnotationView> {
        self.annotation.as_ref()
    }

    /// Unpacks an archive.
    ///
    /// # Errors
    /// When it is broken, or larger than the limits allow.
    pub fn unpack(bytes: &[u8], limits: &Limits, control: &Control) -> Result<Self, Failure> {
        Ok(Self { files: unpack_files(bytes, &ENDINGS, limits, control)?, annotation: None })
    }

    /// The file of a name. A path need not begin where the archive does: the file whose path ends as the name does, for as many folders as
    /// can be, is meant.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<&[u8]> {
        let wanted = parts(name);
        let shared = |path: &str| {
            let own = parts(path);
            wanted.iter().rev().zip(own.iter().rev()).take_while(|(one, other)| one == other).count()
        };
        let best = self.files.iter().map(|(path, bytes)| (shared(path), bytes)).max_by_key(|(shared, _)| *shared);
        best.filter(|(shared, _)| *shared > 0).map(|(_, bytes)| &**bytes)
    }

    /// The file of exactly that name, wherever it is, with its path.
    pub(super) fn named(&self, name: &str) -> Option<(&str, &[u8])> {
        let found = self.files.iter().find(|(path, _)| path.rsplit('/').next() == Some(name));
        found.map(|(path, bytes)| (&**path, &**bytes))
    }

    /// The picture that is called the background.
    pub(super) fn background(&self) -> Option<(&str, &[u8])> {
        let found = self
            .files
            .iter()
            .find(|(path, _)| path.rsplit('/').next().is_some_and(|name| name.starts_with("background.")));
        found.map(|(path, bytes)| (&**path, &**bytes))
    }

    /// The folder of the one drawing in it; empty where that is at the top. Of several, the one that is nearest to the top.
    ///
    /// # Errors
    /// When there is none, or there are several side by side.
    pub fn folder(&self) -> Result<String, Failure> {
        let is_character = |path: &&String| path.rsplit('/').next() == Some(CHARACTER);
        let mut folders: Vec<String> = self
            .files
            .iter()
            .map(|(path, _)| path)
            .filter(is_character)
            .map(|path| path[..path.len() - CHARACTER.len()].to_owned())
            .collect();
        folders.sort_by_key(|folder| folder.matches('/').count());
        match &folders[..] {
            [] => {
                Err(self.missing(CHARACTER).with_hint("pack char_cfg.yaml, texture.png and mask.png into one archive"))
            }
            [first, second, ..] if first.matches('/').count() == second.matches('/').count() => {
                let detail =
                    format!("there are {} drawings in the archive: {}", folders.len(), folders[..2].join(", "));
                Err(Failure::new(FailureCode::AssetMalformed, detail).in_part("target").with_hint("send one at a time"))
            }
            [first, ..] => Ok(first.trim_end_matches('/').to_owned()),
        }
    }

    /// What is said where a file is not there.
    #[must_use]
    pub fn missing(&self, name: &str) -> Failure {
        let has: Vec<&str> = self.files.iter().map(|(path, _)| &**path).take(12).collect();
        let has = if has.is_empty() {
            "it has no file that could be meant".to_owned()
        } else {
            format!("it has {}", has.join(", "))
        };
        let detail = format!("the archive has no file {name}");
        Failure::new(FailureCode::UnknownName, detail).in_part("target").with_hint(has)
    }
}

/// Refuses a PNG with more pixels than are worth looking for a figure in; its other readers hold it row by row.
fn check_size(bytes: &[u8]) -> Result<(), Failure> {
    const MOST: u64 = 1 << 25;
    let side = |at: usize| bytes.get(at..at + 4)?.try_into().ok().map(u32::from_be_bytes).map(u64::from);
    let is_png = bytes.starts_with(b"\x89PNG");
    let Some((width, height)) = side(16).zip(side(20)).filter(|_| is_png) else { return Ok(()) };
    if width * height <= MOST {
        return Ok(());
    }
    let detail = format!("a picture of {width} by {height} pixels is larger than the {MOST} pixels that are read");
    Err(Failure::new(FailureCode::AssetLimitExceeded, detail).in_part("target").with_hint("make it smaller"))
}

fn parts(path: &str) -> Vec<&str> {
    path.split(['/', '\\']).filter(|part| !matches!(*part, "" | ".")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_found_by_the_longest_end_of_their_path() {
        let file = |path: &str| (path.to_owned(), path.as_bytes().to_vec());
        let of = |files| DrawingFiles { files, annotation: None };
        let files = of(vec![file("a/char1/char_cfg.yaml"), file("a/char2/char_cfg.yaml"), file("dab.yaml")]);
        let found = |name: &str| files.find(name).map(|bytes| String::from_utf8_lossy(bytes).into_owned());
        assert_eq!(found("examples/characters/char2/char_cfg.yaml").as_deref(), Some("a/char2/char_cfg.yaml"));
        assert_eq!(found("examples/config/motion/dab.yaml").as_deref(), Some("dab.yaml"));
        assert_eq!(found("wave.yaml"), None);
        assert!(files.folder().is_err(), "two drawings");
        assert_eq!(of(vec![file("x/char_cfg.yaml")]).folder().ok().as_deref(), Some("x"));
    }
}
