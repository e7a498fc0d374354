//! The shape of a figure: its middle, the tips that stand out of it, and the ways from them to the middle.

use glam::DVec2;

use super::{bits::Bits, distance::distances, ways::Ways};
use crate::model::{Canceled, Control};

/// Pixels of the longer side that shapes are looked at with; tips and joints are found to less than a hundredth of the figure.
const SIDE: usize = 320;
/// Tips that are looked for.
const MAX_TIPS: usize = 14;
/// How far a tip stands out at least, as a share of the longer side.
const STANDS_OUT: f64 = 0.055;

/// The shape of a figure. Places are pixels of it, `factor` pixels of the mask to each side.
#[derive(Clone, Debug)]
pub(super) struct Shape {
    pub(super) bits: Bits,
    /// Pixels of the mask on the side of one of its own.
    pub(super) factor: usize,
    /// The distance of each pixel from the edge.
    pub(super) depth: Vec<f64>,
    /// Left, top, right, bottom.
    pub(super) bounds: [f64; 4],
    /// A pixel in the middle of the figure.
    pub(super) center: usize,
    pub(super) tips: Vec<Tip>,
}

/// A place that stands out.
#[derive(Clone, Debug)]
pub(super) struct Tip {
    /// From it to the center of the figure, in the middle of what lies between.
    pub(super) way: Vec<usize>,
    /// How far it is from the ways of the tips before it and from all that is as near to them as the edge is.
    pub(super) stands_out: f64,
}

impl Shape {
    /// The shape of a mask.
    pub(super) fn new(mask: &Bits, control: &Control) -> Result<Self, Canceled> {
        let factor = mask.width.max(mask.height).div_ceil(SIDE).max(1);
        let bits = mask.reduced(factor);
        let depth = distances(&bits);
        let bounds = bits.bounds().unwrap_or([0, 0, 1, 1]).map(|side| side as f64);
        let mut shape = Self { bits, factor, depth, bounds, center: 0, tips: Vec::new() };
        shape.center = shape.middle(control)?;
        shape.tips = shape.find_tips(control)?;
        Ok(shape)
    }

    pub(super) fn width(&self) -> f64 {
        self.bounds[2] - self.bounds[0]
    }

    pub(super) fn height(&self) -> f64 {
        self.bounds[3] - self.bounds[1]
    }

    /// The middle of a pixel.
    pub(super) fn place(&self, pixel: usize) -> DVec2 {
        DVec2::new((pixel % self.bits.width) as f64 + 0.5, (pixel / self.bits.width) as f64 + 0.5)
    }

    /// The pixel of the figure that is nearest to a place.
    pub(super) fn nearest(&self, place: DVec2) -> usize {
        let column = (place.x.max(0.0) as usize).min(self.bits.width - 1);
        let row = (place.y.max(0.0) as usize).min(self.bits.height - 1);
        if self.bits.cells[row * self.bits.width + column] {
            return row * self.bits.width + column;
        }
        let figure = (0..self.bits.cells.len()).filter(|&pixel| self.bits.cells[pixel]);
        let far = |pixel: &usize| self.place(*pixel).distance_squared(place);
        figure.min_by(|one, other| far(one).total_cmp(&far(other))).unwrap_or(self.center)
    }

    /// The deepest pixel in the middle third of the longest way within the figure, which leads through the trunk of whatever has limbs.
    fn middle(&self, control: &Control) -> Result<usize, Canceled> {
        let deepest = (0..self.depth.len())
            .max_by(|&one, &other| self.depth[one].total_cmp(&self.depth[other]).then(other.cmp(&one)));
        let mut end = deepest.unwrap_or(0);
        let mut longest = Vec::new();
        for _ in 0..2 {
            control.check()?;
            let mut ways = Ways::new(self.depth.len());
            ways.begin(&self.bits, &[end], &|_| 1.0);
            end = ways.farthest().map_or(end, |(pixel, _)| pixel);
            longest = ways.back(end);
        }
        let third = longest.len() / 3;
        let middle = &longest[third..(longest.len() - third).max(third + 1).min(longest.len())];
        let on_way = middle
            .iter()
            .copied()
            .max_by(|&one, &other| self.depth[one].total_cmp(&self.depth[other]).then(other.cmp(&one)));
        Ok(on_way.map_or(end, |pixel| self.climb(pixel)))
    }

    /// From a pixel to a neighbor that is deeper, as long as there is one.
    fn climb(&self, mut pixel: usize) -> usize {
        loop {
            let (row, column) = ((pixel / self.bits.width) as i64, (pixel % self.bits.width) as i64);
            let around = (-1..=1).flat_map(|down| (-1..=1).map(move |right| (row + down, column + right)));
            let around = around.filter(|&(row, column)| self.bits.has(column, row));
            let deepest = around
                .map(|(row, column)| row as usize * self.bits.width + column as usize)
                .max_by(|&one, &other| self.depth[one].total_cmp(&self.depth[other]).then(other.cmp(&one)));
            match deepest {
                Some(deeper) if self.depth[deeper] > self.depth[pixel] => pixel = deeper,
                _ => return pixel,
            }
        }
    }

    /// What is farthest from everything that has been found, again and again (after Plagemann et al., 2010).
    fn find_tips(&self, control: &Control) -> Result<Vec<Tip>, Canceled> {
        let deepest = self.depth.iter().copied().fold(1.0, f64::max);
        // Steps near the edge are dear, so that ways keep to the middle.
        let cost = |pixel: usize| {
            let depth = self.depth[pixel].max(0.5);
            1.0 + 4.0 * (1.0 - depth / deepest).powi(3) + (0.15 * deepest / depth).powi(2).min(20.0)
        };
        let mut to_center = Ways::new(self.depth.len());
        to_center.begin(&self.bits, &[self.center], &cost);
        let mut beyond = Ways::new(self.depth.len());
        self.begin_around(&mut beyond, &[self.center]);
        let least = STANDS_OUT * self.width().max(self.height());
        let mut tips = Vec::new();
        while tips.len() < MAX_TIPS {
            control.check()?;
            let Some((tip, stands_out)) = beyond.farthest().filter(|(_, far)| *far >= least) else { break };
            let way = to_center.back(tip);
            self.begin_around(&mut beyond, &way);
            tips.push(Tip { way, stands_out });
        }
        Ok(tips)
    }

    /// Begins ways at all that is as near to some pixels as the edge is.
    fn begin_around(&self, ways: &mut Ways, pixels: &[usize]) {
        let mut around = Bits::filled(self.bits.width, self.bits.height, false);
        for &pixel in pixels {
            around.draw_disc(self.place(pixel).to_array(), self.depth[pixel]);
        }
        let starts: Vec<usize> = (0..around.cells.len()).filter(|&pixel| around.cells[pixel]).collect();
        ways.begin(&self.bits, &starts, &|_| 1.0);
    }

    /// How many pixels of a way come before it meets one of others.
    pub(super) fn own(&self, way: &[usize], others: &[&[usize]]) -> usize {
        let mut taken = vec![false; self.depth.len()];
        others.iter().flat_map(|other| other.iter()).for_each(|&pixel| taken[pixel] = true);
        way.iter().position(|&pixel| taken[pixel]).unwrap_or(way.len())
    }

    /// The length of a part of a way.
    pub(super) fn length(&self, way: &[usize]) -> f64 {
        way.windows(2).map(|pair| self.place(pair[0]).distance(self.place(pair[1]))).sum()
    }

    /// Where along a part of a way half of its length, or another share of it, is behind.
    pub(super) fn along(&self, way: &[usize], share: f64) -> DVec2 {
        let whole = self.length(way);
        let mut behind = 0.0;
        for pair in way.windows(2) {
            if behind >= share * whole {
                return self.place(pair[0]);
            }
            behind += self.place(pair[0]).distance(self.place(pair[1]));
        }
        way.last().map_or(DVec2::ZERO, |&last| self.place(last))
    }

    /// The median depth along a part of a way.
    pub(super) fn median_depth(&self, way: &[usize]) -> f64 {
        let mut depths: Vec<f64> = way.iter().map(|&pixel| self.depth[pixel]).collect();
        depths.sort_by(f64::total_cmp);
        depths.get(depths.len() / 2).copied().unwrap_or(0.0)
    }
}
