//! What drawn characters look like: moving pictures, and single frames.

use std::sync::{Mutex, PoisonError};

use crate::{
    drawing::{Puppet, PuppetWorkspace},
    engine::{Failure, FailureCode},
    formats::pack_files,
    model::Control,
    picture::{Picture, PictureError, PictureFormat, Reel, read_picture},
};

use super::{
    DrawRequest, FileReader,
    background::background,
    in_order,
    stage::{DrawnCharacter, Scenery, refused},
};

/// A GIF shows at most so many pictures a second.
const MAX_FPS_OF_GIF: f64 = 50.0;
const MAX_FPS: f64 = 1000.0;

/// A scene that is ready to be seen.
pub(super) struct Shown<'a> {
    scenery: &'a Scenery,
    pub(super) puppets: Vec<Puppet>,
    background: Picture,
    /// What pictures are drawn with: there are as many as are drawn at the same time.
    easels: Mutex<Vec<Easel>>,
}

/// A picture that is drawn on again and again, and what that takes.
struct Easel {
    workspaces: Vec<PuppetWorkspace>,
    picture: Picture,
    /// The area of it that is not the background.
    drawn: [usize; 4],
}

impl<'a> Shown<'a> {
    /// Reads the pictures of a scene, and puts its characters together.
    pub(super) fn new(
        scenery: &'a Scenery,
        request: &DrawRequest<'_>,
        read: &mut FileReader<'_>,
    ) -> Result<Self, Failure> {
        let frames = scenery.characters.iter().map(|character| character.performance.frames).max().unwrap_or(0);
        let most = crate::drawing::MAX_VIDEO_FRAMES;
        if frames > most {
            let detail = format!("the motion has {frames} frames; the limit 'video_frames' is {most}");
            return Err(Failure::new(FailureCode::AssetLimitExceeded, detail).with_hint("take a part of it"));
        }
        let puppets = scenery
            .characters
            .iter()
            .map(|character| puppet(character, scenery, false, read))
            .collect::<Result<Vec<_>, _>>()?;
        let background = background(scenery, request.background, read)?;
        Ok(Self { scenery, puppets, background, easels: Mutex::new(Vec::new()) })
    }

    /// Frames a second, and how many there are, where so many are shown at most.
    fn pace(&self, most_fps: f64) -> (f64, usize) {
        let performances = || self.scenery.characters.iter().map(|character| &character.performance);
        let seconds = performances().next().map_or(1.0 / 30.0, |performance| performance.frame_time);
        let longest = performances().map(|performance| performance.frames).max().unwrap_or(1);
        let fps = (1.0 / seconds).min(most_fps);
        (fps, ((longest as f64 * seconds * fps).round() as usize).max(1))
    }

    /// Draws the picture of a moment, and says which area of it is not the background.
    fn draw(&self, seconds: f64, easel: &mut Easel) -> [usize; 4] {
        let Easel { workspaces, picture, drawn } = easel;
        let [left, top, right, bottom] = *drawn;
        for row in top..bottom {
            let pixels = row * picture.width + left..row * picture.width + right;
            picture.pixels[pixels.clone()].copy_from_slice(&self.background.pixels[pixels]);
        }
        *drawn = [picture.width, picture.height, 0, 0];
        for ((puppet, character), workspace) in self.puppets.iter().zip(&self.scenery.characters).zip(workspaces) {
            let frame = (seconds / character.performance.frame_time).round() as usize;
            let [left, top, right, bottom] = puppet.draw(&character.performance, frame, workspace, picture);
            *drawn = [drawn[0].min(left), drawn[1].min(top), drawn[2].max(right), drawn[3].max(bottom)];
            if self.scenery.shows_bodies {
                // Bodies begin anew where drawings hold still.
                let frame = frame % character.motion.frames();
                let shift = character.performance.seen_shift(frame).extend(0.0);
                let places: Vec<glam::DVec3> = (0..character.motion.joints())
                    .map(|joint| character.motion.world_place(frame, joint) + shift)
                    .collect();
                puppet.draw_body(&places, character.body_scale, picture);
                *drawn = [0, 0, picture.width, picture.height];
            }
        }
        *drawn
    }

    /// Does something with the picture of a moment and the area of it that is not the background.
    fn at<T>(&self, seconds: f64, work: impl FnOnce(&Picture, [usize; 4]) -> T) -> T {
        let free = self.easels.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut easel = free.unwrap_or_else(|| Easel {
            workspaces: self.puppets.iter().map(Puppet::workspace).collect(),
            picture: self.background.clone(),
            drawn: [0; 4],
        });
        let area = self.draw(seconds, &mut easel);
        let made = work(&easel.picture, area);
        self.easels.lock().unwrap_or_else(PoisonError::into_inner).push(easel);
        made
    }

    /// The moving picture.
    pub(super) fn film(&self, format: PictureFormat, control: &Control) -> Result<Vec<u8>, Failure> {
        let (fps, count) = self.pace(if format == PictureFormat::Gif { MAX_FPS_OF_GIF } else { MAX_FPS });
        let alone = |index: usize| self.at(index as f64 / fps, |picture, _| picture.clone());
        let (mut reel, shutter) = Reel::new(format, &self.background, fps, count, alone).map_err(broken)?;
        let shoot = |index: usize| self.at(index as f64 / fps, |picture, area| shutter.shot(picture, area));
        in_order((count, self.background.pixels.len()), control, shoot, |shots| reel.add(shots).map_err(broken))?;
        reel.finish().map_err(broken)
    }

    /// Every frame as a PNG, in one archive.
    pub(super) fn stills(&self, control: &Control) -> Result<Vec<u8>, Failure> {
        let (fps, count) = self.pace(MAX_FPS);
        let mut files: Vec<Vec<u8>> = Vec::with_capacity(count);
        let make = |index: usize| self.at(index as f64 / fps, |picture, _| picture.to_png());
        in_order((count, self.background.pixels.len()), control, make, |stills| {
            for still in stills {
                files.push(still.map_err(broken)?);
            }
            Ok(())
        })?;
        let names: Vec<String> = (0..count).map(|index| format!("frame_{index:05}.png")).collect();
        let members = names.iter().map(String::as_str).zip(files.iter().map(Vec::as_slice));
        Ok(pack_files(members)?)
    }
}

/// Puts a character together; with `keep_texture` for a model and not for a picture.
pub(super) fn puppet(
    character: &DrawnCharacter,
    scenery: &Scenery,
    keep_texture: bool,
    read: &mut FileReader<'_>,
) -> Result<Puppet, Failure> {
    let [texture, mask] = &character.pictures;
    let pictures = [picture(&read(texture)?, texture)?, picture(&read(mask)?, mask)?];
    let mut look = scenery.look.clone();
    look.keep_texture = keep_texture;
    Puppet::new(&character.spec, &character.rig, &character.retarget, &scenery.view, &look, pictures).map_err(|error| {
        let file = if error.place == "mask" { mask } else { texture };
        refused(error, file)
    })
}

fn picture(bytes: &[u8], file: &str) -> Result<Picture, Failure> {
    read_picture(bytes).map_err(|error| {
        let failure = Failure::new(FailureCode::AssetMalformed, format!("{file}: {error}"));
        Failure { place: file.to_owned(), ..failure.with_hint("save it again as PNG") }
    })
}

fn broken(error: PictureError) -> Failure {
    Failure::new(FailureCode::UnsupportedFeature, error.to_string())
}
