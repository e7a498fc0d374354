//! What drawn characters look like: moving pictures, and single frames.

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
        Ok(Self { scenery, puppets, background })
    }

    /// Frames a second, and how many there are, where so many are shown at most.
    fn pace(&self, most_fps: f64) -> (f64, usize) {
        let performances = || self.scenery.characters.iter().map(|character| &character.performance);
        let seconds = performances().next().map_or(1.0 / 30.0, |performance| performance.frame_time);
        let longest = performances().map(|performance| performance.frames).max().unwrap_or(1);
        let fps = (1.0 / seconds).min(most_fps);
        (fps, ((longest as f64 * seconds * fps).round() as usize).max(1))
    }

    /// Memory for [`Self::at`].
    fn workspaces(&self) -> Vec<PuppetWorkspace> {
        self.puppets.iter().map(Puppet::workspace).collect()
    }

    /// The picture of a moment.
    fn at(&self, seconds: f64, workspaces: &mut [PuppetWorkspace]) -> Picture {
        let mut picture = self.background.clone();
        for ((puppet, character), workspace) in self.puppets.iter().zip(&self.scenery.characters).zip(workspaces) {
            let frame = (seconds / character.performance.frame_time).round() as usize;
            puppet.draw(&character.performance, frame, workspace, &mut picture);
            if self.scenery.shows_bodies {
                // Bodies begin anew where drawings hold still.
                let frame = frame % character.motion.frames();
                let shift = character.performance.seen_shift(frame).extend(0.0);
                let places: Vec<glam::DVec3> = (0..character.motion.joints())
                    .map(|joint| character.motion.world_place(frame, joint) + shift)
                    .collect();
                puppet.draw_body(&places, character.body_scale, &mut picture);
            }
        }
        picture
    }

    /// The moving picture.
    pub(super) fn film(&self, format: PictureFormat, control: &Control) -> Result<Vec<u8>, Failure> {
        let (fps, count) = self.pace(if format == PictureFormat::Gif { MAX_FPS_OF_GIF } else { MAX_FPS });
        let is_transparent = self.background.pixels.iter().any(|pixel| pixel[3] < 255);
        let size = [self.background.width, self.background.height];
        let alone = |index: usize| self.at(index as f64 / fps, &mut self.workspaces());
        let mut reel = Reel::new(format, size, fps, count, is_transparent, alone).map_err(broken)?;
        let shoot = |workspaces: &mut Vec<PuppetWorkspace>, index: usize| self.at(index as f64 / fps, workspaces);
        let pixels = self.background.pixels.len();
        in_order(
            (count, pixels),
            control,
            || self.workspaces(),
            shoot,
            |pictures| reel.add(&pictures).map_err(broken),
        )?;
        reel.finish().map_err(broken)
    }

    /// Every frame as a PNG, in one archive.
    pub(super) fn stills(&self, control: &Control) -> Result<Vec<u8>, Failure> {
        let (fps, count) = self.pace(MAX_FPS);
        let mut files: Vec<Vec<u8>> = Vec::with_capacity(count);
        let make =
            |workspaces: &mut Vec<PuppetWorkspace>, index: usize| self.at(index as f64 / fps, workspaces).to_png();
        in_order(
            (count, self.background.pixels.len()),
            control,
            || self.workspaces(),
            make,
            |stills| {
                for still in stills {
                    files.push(still.map_err(broken)?);
                }
                Ok(())
            },
        )?;
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
