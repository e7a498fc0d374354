//! Support points of a foot, laid out for finding where they are at one frame after the other.
//!
//! A point moves with ankle, toes and shin by shares. Its offsets are multiplied by those once; then its height is a sum of products,
//! and those of neighbors are found side by side.

use glam::DVec3;

use crate::rig::{FootShape, SupportPoint};

/// Points that are looked at side by side.
const LANES: usize = 4;

type Lane = [f64; LANES];

/// The support points of a foot.
#[derive(Clone, Debug, Default)]
pub(in crate::retarget) struct Sole {
    /// Those that bending the toes does not lift.
    firm: Vec<Points>,
    /// The others.
    yielding: Vec<Points>,
}

/// A few support points. Those that there are not are copies of one that there is.
#[derive(Clone, Copy, Debug, Default)]
struct Points {
    /// Offsets in the axes of ankle, joint of the ball and shin, each times the share by which the point moves with it.
    from_end: [Lane; 3],
    from_ball: [Lane; 3],
    from_shin: [Lane; 3],
    /// By which shares the points move with toes and shin, 0 to 1.
    toes: Lane,
    shin: Lane,
    radius: Lane,
}

/// A direction in the axes of ankle, joint of the ball and shin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Along {
    pub(super) of_end: DVec3,
    /// How far the joint of the ball is along it from the ankle, and the direction there.
    pub(super) of_ball: (f64, DVec3),
}

/// How far a few points are from the ankle, without what of them moves with the shin, along two directions; and how far they should be
/// along the first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turned {
    pub(super) above: Lane,
    pub(super) before: Lane,
    pub(super) wanted: Lane,
}

impl Sole {
    /// Of a foot that has a joint of the ball, or none.
    pub(in crate::retarget) fn new(shape: &FootShape, has_ball: bool) -> Self {
        let of = |gives_way: bool| -> Vec<SupportPoint> {
            shape.points.iter().filter(|point| point.gives_way == gives_way).copied().collect()
        };
        let lanes = |points: Vec<SupportPoint>| points.chunks(LANES).map(|some| Points::new(some, has_ball)).collect();
        Self { firm: lanes(of(false)), yielding: lanes(of(true)) }
    }

    /// How far the lowest points are above the ankle: of those that toes do not lift, and of all. Infinite where there are none.
    #[inline(always)]
    pub(super) fn lowest(&self, up: &Along, up_of_shin: DVec3) -> [f64; 2] {
        let lowest = |points: &[Points]| {
            let mut lowest = [f64::INFINITY; LANES];
            for points in points {
                let (foot, shin) = (points.along(up), dot(&points.from_shin, up_of_shin));
                for lane in 0..LANES {
                    lowest[lane] = lowest[lane].min(foot[lane] + shin[lane] - points.radius[lane]);
                }
            }
            lowest.into_iter().fold(f64::INFINITY, f64::min)
        };
        let firm = lowest(&self.firm);
        [firm, firm.min(lowest(&self.yielding))]
    }

    /// How far the farthest point is along a direction, as far as it moves with the foot; at least 0.
    pub(super) fn farthest(&self, direction: &Along) -> f64 {
        let mut farthest = 0.0;
        for points in self.firm.iter().chain(&self.yielding) {
            let along = points.along(direction);
            for (along, shin) in along.into_iter().zip(points.shin) {
                farthest = f64::max(farthest, if shin < 1.0 { along / (1.0 - shin) } else { 0.0 });
            }
        }
        farthest
    }

    /// Points along two directions, those that toes lift or the others. `wanted` is how far all of a point should be along the first.
    #[inline(always)]
    pub(super) fn turned(
        &self,
        of_yielding: bool,
        [above, before]: [Along; 2],
        up_of_shin: DVec3,
        wanted: f64,
    ) -> impl Iterator<Item = Turned> {
        let points = if of_yielding { &self.yielding } else { &self.firm };
        points.iter().map(move |points| {
            let shin = dot(&points.from_shin, up_of_shin);
            let wanted = std::array::from_fn(|lane| wanted + points.radius[lane] - shin[lane]);
            Turned { above: points.along(&above), before: points.along(&before), wanted }
        })
    }
}

impl Points {
    fn new(points: &[SupportPoint], has_ball: bool) -> Self {
        let mut made = Self::default();
        for lane in 0..LANES {
            let point = &points[lane.min(points.len() - 1)];
            let toes = if has_ball { point.toes } else { 0.0 };
            let parts = [
                (&mut made.from_end, point.from_end * (1.0 - point.shin - toes)),
                (&mut made.from_ball, point.from_ball * toes),
                (&mut made.from_shin, point.from_shin * point.shin),
            ];
            for (lanes, offset) in parts {
                lanes.iter_mut().zip(offset.to_array()).for_each(|(lanes, value)| lanes[lane] = value);
            }
            (made.toes[lane], made.shin[lane], made.radius[lane]) = (toes, point.shin, point.radius);
        }
        made
    }

    /// How far the points are along a direction from the ankle, but for what moves with the shin.
    #[inline(always)]
    fn along(&self, direction: &Along) -> Lane {
        let (end, (ball, of_ball)) = (dot(&self.from_end, direction.of_end), direction.of_ball);
        let toes = dot(&self.from_ball, of_ball);
        std::array::from_fn(|lane| end[lane] + (toes[lane] + ball * self.toes[lane]))
    }
}

#[inline(always)]
fn dot([x, y, z]: &[Lane; 3], direction: DVec3) -> Lane {
    std::array::from_fn(|lane| x[lane] * direction.x + y[lane] * direction.y + z[lane] * direction.z)
}
