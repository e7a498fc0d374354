//! Assets that every caller has, so that a first job needs no upload: they have ids that never change.

use crate::store::AssetId;

/// A file that every caller has.
#[derive(Clone, Copy, Debug)]
pub struct BuiltInAsset {
    /// The end of its id: `ast_00…01` for 1.
    pub number: u8,
    /// The name of the file.
    pub file_name: &'static str,
    /// Makes its bytes; always the same.
    pub bytes: fn() -> Vec<u8>,
}

impl BuiltInAsset {
    /// The text of the id that names it. Ids that are made begin with the time, and never with so many zeros.
    pub(super) fn id(&self) -> String {
        format!("{}{:026}", AssetId::PREFIX, self.number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_of_the_usual_form() {
        let asset = BuiltInAsset { number: 12, file_name: "walk.glb", bytes: Vec::new };
        let id = AssetId::parse("ast_00000000000000000000000012").expect("an id");
        assert!(asset.id() == id.as_str() && asset.id() != AssetId::new().as_str());
    }
}
