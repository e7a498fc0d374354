//! Images of 16 by 16 pixels.

use base64::{Engine as _, prelude::BASE64_STANDARD};
use retargetd::{
    engine::{Limits, NamedBytes, PreviewOptions, View, preview},
    model::Control,
};

use super::Seed;

const JPEG: &str = "/9j/4AAQSkZJRgABAQAAAQABAAD/2wBDABsSFBcUERsXFhceHBsgKEIrKCUlKFE6PTBCYFVlZF9VXVtqeJmBanGQc1tdhbWGkJ6jq62rZ4C8ybqmx5moq6T/2wBDARweHigjKE4rK06k\
    bl1upKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKT/wAARCAAQABADASIAAhEBAxEB/8QAHwAAAQUBAQEBAQEAAAAAAAAAAAECAwQFBgcICQoL\
    /8QAtRAAAgEDAwIEAwUFBAQAAAF9AQIDAAQRBRIhMUEGE1FhByJxFDKBkaEII0KxwRVS0fAkM2JyggkKFhcYGRolJicoKSo0NTY3ODk6Q0RFRkdISUpTVFVWV1hZWmNkZWZnaGlqc3R1\
    dnd4eXqDhIWGh4iJipKTlJWWl5iZmqKjpKWmp6ipqrKztLW2t7i5usLDxMXGx8jJytLT1NXW19jZ2uHi4+Tl5ufo6erx8vP09fb3+Pn6/8QAHwEAAwEBAQEBAQEBAQAAAAAAAAECAwQF\
    BgcICQoL/8QAtREAAgECBAQDBAcFBAQAAQJ3AAECAxEEBSExBhJBUQdhcRMiMoEIFEKRobHBCSMzUvAVYnLRChYkNOEl8RcYGRomJygpKjU2Nzg5OkNERUZHSElKU1RVVldYWVpjZGVm\
    Z2hpanN0dXZ3eHl6goOEhYaHiImKkpOUlZaXmJmaoqOkpaanqKmqsrO0tba3uLm6wsPExcbHyMnK0tPU1dbX2Nna4uPk5ebn6Onq8vP09fb3+Pn6/9oADAMBAAIRAxEAPwDMitvarcVt\
    7VbitvarkVt7U51gwuIP/9k=";
const PROGRESSIVE_JPEG: &str = "/9j/4AAQSkZJRgABAQAAAQABAAD/2wBDACgcHiMeGSgjISMtKygwPGRBPDc3PHtYXUlkkYCZlo+AjIqgtObDoKrarYqMyP/L2u71////m8H////6/+b9//j/2wBDASstLTw1PHZBQXb4\
    pYyl+Pj4+Pj4+Pj4+Pj4+Pj4+Pj4+Pj4+Pj4+Pj4+Pj4+Pj4+Pj4+Pj4+Pj4+Pj4+Pj4+Pj/wgARCAAQABADASIAAhEBAxEB/8QAFAABAAAAAAAAAAAAAAAAAAAAA//EABQBAQAAAAAA\
    AAAAAAAAAAAAAAD/2gAMAwEAAhADEAAAAQREP//EABUQAQEAAAAAAAAAAAAAAAAAAAAR/9oACAEBAAEFAoiI/8QAFREBAQAAAAAAAAAAAAAAAAAAAgD/2gAIAQMBAT8BCv/EABYRAAMA\
    AAAAAAAAAAAAAAAAAAABAv/aAAgBAgEBPwF0f//EABQQAQAAAAAAAAAAAAAAAAAAACD/2gAIAQEABj8CH//EABUQAQEAAAAAAAAAAAAAAAAAAAAB/9oACAEBAAE/IYxjH//aAAwDAQAC\
    AAMAAAAQy//EABQRAQAAAAAAAAAAAAAAAAAAAAD/2gAIAQMBAT8QP//EABQRAQAAAAAAAAAAAAAAAAAAAAD/2gAIAQIBAT8QH//EABUQAQEAAAAAAAAAAAAAAAAAAABh/9oACAEBAAE/\
    EJJJJP/Z";
const WEBP: &str =
    "UklGRkIAAABXRUJQVlA4IDYAAADQAQCdASoQABAABABoJbACdH8AGBRReAD+8X5sn6Vnb0fRGVc+/JehV6wEJvP6Y/L9u1VtAAA=";
const LOSSLESS_WEBP: &str = "UklGRi4AAABXRUJQVlA4TCIAAAAvD8ADALkyRPQ/dhHR/wCRtk0l3L/hwdOBGMCYAKoO1H8A";

/// One of each kind that is read.
///
/// # Panics
/// When the sample cannot be drawn.
pub(super) fn all() -> Vec<Seed> {
    let texts =
        [("jpeg", JPEG), ("progressive_jpeg", PROGRESSIVE_JPEG), ("webp", WEBP), ("lossless_webp", LOSSLESS_WEBP)];
    let decoded = |text: &str| BASE64_STANDARD.decode(text).expect("text that was made from an image");
    let drawn = ["png", "apng"].map(|ending| {
        let view = View { size: [16, 16], ..View::default() };
        let options = PreviewOptions { view, ending: ending.to_owned(), clip: None };
        let clip = super::clip();
        let picture =
            preview(NamedBytes { name: "clip.glb", bytes: &clip }, &options, &Limits::default(), &Control::new());
        (ending.to_owned(), picture.expect("the sample can be drawn").bytes)
    });
    texts.map(|(name, text)| (name.to_owned(), decoded(text))).into_iter().chain(drawn).collect()
}
