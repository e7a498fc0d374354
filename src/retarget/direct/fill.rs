//! Tracks out of tracks, block by block.

use glam::{DQuat, Quat, Vec3};

use super::{
    super::{
        lanes::{LANES, QuatLanes},
        vectors::Vectors,
    },
    Affine, Direct, Product,
    map::{BLOCK, RotationMap},
    wide,
};
use crate::model::{Canceled, Control, JointTracks, Track};

/// Blocks between two looks at whether the work is canceled.
const BLOCKS_PER_CHECK: usize = 64;

/// The tracks of one output.
pub(in super::super) struct Filled {
    pub(in super::super) tracks: JointTracks,
    /// Whether all values are finite.
    pub(in super::super) is_finite: bool,
}

impl Direct {
    /// Fills the tracks of one output from those of the source.
    ///
    /// # Errors
    /// When the work is canceled.
    pub(in super::super) fn fill(
        &self,
        source: &[JointTracks],
        frames: usize,
        control: &Control,
    ) -> Result<Filled, Canceled> {
        let (rotations, mut is_finite) = self.rotation.fill(source, frames, control)?;
        let mut tracks = JointTracks { rotation: Track::Sampled(rotations), ..JointTracks::default() };
        if let Some(affine) = &self.translation {
            let translations = affine.fill(source, frames);
            is_finite &= translations.iter().all(|value| value.is_finite());
            tracks.translation = Track::Sampled(translations);
        }
        Ok(Filled { tracks, is_finite })
    }
}

impl Product {
    fn fill(&self, source: &[JointTracks], frames: usize, control: &Control) -> Result<(Vec<Quat>, bool), Canceled> {
        let mut filling = Filling::new(frames);
        match self.factors.as_slice() {
            [] => {
                let value = self.first.normalize().as_quat();
                filling.values.resize(frames, if value.w < 0.0 { -value } else { value });
            }
            [(joint, after)] => {
                let map = RotationMap::new(self.first, *after);
                let vectors = Vectors::detected();
                let samples = samples(source, *joint);
                for blocks in samples.chunks(BLOCK * BLOCKS_PER_CHECK) {
                    control.check()?;
                    blocks.chunks(BLOCK).for_each(|block| filling.map(&map, vectors, block));
                }
            }
            [(joint, after), further @ ..] => {
                let first = (samples(source, *joint), *after);
                let further: Vec<(&[Quat], DQuat)> =
                    further.iter().map(|(joint, after)| (samples(source, *joint), *after)).collect();
                for begin in (0..frames).step_by(LANES) {
                    if begin % (BLOCK * BLOCKS_PER_CHECK) == 0 {
                        control.check()?;
                    }
                    filling.multiply(self.first, first, &further, begin..frames.min(begin + LANES));
                }
            }
        }
        Ok((filling.values, filling.is_finite))
    }
}

/// The samples of a joint that turns.
fn samples(source: &[JointTracks], joint: usize) -> &[Quat] {
    match &source[joint].rotation {
        Track::Sampled(values) => values,
        Track::Constant(_) | Track::Rest => &[],
    }
}

/// Rotations, as far as they are there.
struct Filling {
    values: Vec<Quat>,
    /// The last sample that was mapped, where there is one.
    last_sample: Option<Quat>,
    /// Whether the last one came out on the other hemisphere than the map gives.
    is_turned_over: bool,
    /// What the next one has to lie near.
    before: Quat,
    is_finite: bool,
}

impl Filling {
    fn new(frames: usize) -> Self {
        Self {
            values: Vec::with_capacity(frames),
            last_sample: None,
            is_turned_over: false,
            before: Quat::IDENTITY,
            is_finite: true,
        }
    }

    /// Maps samples. The map keeps lengths and distances, so where unit samples stay on one hemisphere, their images do.
    fn map(&mut self, map: &RotationMap, vectors: Vectors, samples: &[Quat]) {
        let last = match self.last_sample {
            Some(last) => last,
            None => {
                self.is_turned_over = map.apply(samples[0]).as_quat().w < 0.0;
                samples[0]
            }
        };
        self.last_sample = samples.last().copied();
        let way = if self.is_turned_over { map.negated() } else { *map };
        if wide::append(vectors, &way, last, samples, &mut self.values) {
            self.before = self.values[self.values.len() - 1];
            return;
        }
        for sample in samples {
            let wide = map.apply(*sample);
            let rotation = (wide / wide.length().max(f64::MIN_POSITIVE)).as_quat();
            self.is_turned_over = rotation.dot(self.before) < 0.0;
            let rotation = if self.is_turned_over { -rotation } else { rotation };
            self.is_finite &= rotation.is_finite();
            self.before = rotation;
            self.values.push(rotation);
        }
    }

    /// Multiplies the rotations of several joints, for at most [`LANES`] frames.
    fn multiply(
        &mut self,
        constant: DQuat,
        (first, after): (&[Quat], DQuat),
        further: &[(&[Quat], DQuat)],
        frames: std::ops::Range<usize>,
    ) {
        let (mut local, mut product, mut next) = (QuatLanes::IDENTITY, QuatLanes::IDENTITY, QuatLanes::IDENTITY);
        local.load(&first[frames.clone()]);
        next.set_product_of_constant(constant, &local);
        product.set_product_with_constant(&next, after);
        for (samples, after) in further {
            local.load(&samples[frames.clone()]);
            next.set_product(&product, &local);
            product.set_product_with_constant(&next, *after);
        }
        let mut block = [Quat::IDENTITY; LANES];
        let block = &mut block[..frames.len()];
        let is_near = product.refine_length();
        product.store(block, &mut self.before);
        self.is_finite &= is_near || block.iter().all(|rotation| rotation.is_finite());
        self.values.extend_from_slice(block);
    }
}

impl Affine {
    fn fill(&self, source: &[JointTracks], frames: usize) -> Vec<Vec3> {
        if let Some((joint, matrix)) = self.moving
            && let Track::Sampled(samples) = &source[joint].translation
        {
            return samples.iter().map(|sample| (matrix * sample.as_dvec3() + self.offset).as_vec3()).collect();
        }
        vec![self.offset.as_vec3(); frames]
    }
}
