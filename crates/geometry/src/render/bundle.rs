//! A square of rays, and the boxes around what parts of it sweep.

use isoswarm_field::Aabb;

/// Rays along the side of a tile.
pub const SIDE: usize = 64;

/// Sizes of squares, from the tile to a single ray.
pub(super) const LEVELS: usize = SIDE.ilog2() as usize + 1;

/// The points origin + t · direction for t from `near` to `far`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// The point t = 0.
    pub origin: [f64; 3],
    /// Any length but zero.
    pub direction: [f64; 3],
    /// Least t.
    pub near: f64,
    /// Largest t.
    pub far: f64,
    /// Whether the ray begins on a face of a clip region, and on which.
    pub face: Option<u16>,
}

impl Ray {
    /// The point at t.
    #[inline(always)]
    pub fn at(&self, t: f64) -> [f64; 3] {
        [0, 1, 2].map(|a| self.origin[a] + t * self.direction[a])
    }

    fn is_open(&self) -> bool {
        self.near < self.far
    }

    /// The box around its points for t from `from` to `to`, with a little room for rounding.
    pub(super) fn swept(&self, from: f64, to: f64) -> Aabb {
        Common::of(self).swept(from, to)
    }
}

/// A square of rays: its level and its place among those of its level.
#[derive(Clone, Copy, Debug)]
pub(super) struct Square {
    pub level: usize,
    pub x: usize,
    pub y: usize,
}

impl Square {
    pub(super) const WHOLE: Square = Square { level: 0, x: 0, y: 0 };

    pub(super) fn side(self) -> usize {
        SIDE >> self.level
    }

    /// The four quarters.
    pub(super) fn quarters(self) -> [Square; 4] {
        let (level, x, y) = (self.level + 1, 2 * self.x, 2 * self.y);
        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| Square { level, x: x + i, y: y + j })
    }

    /// Numbers of its rays.
    pub(super) fn rays(self) -> impl Iterator<Item = usize> {
        let side = self.side();
        let (x, y) = (self.x * side, self.y * side);
        (y..y + side).flat_map(move |row| row * SIDE + x..row * SIDE + x + side)
    }

    fn number(self) -> usize {
        (self.y << self.level) + self.x
    }
}

/// What the open rays of a square have in common.
#[derive(Clone, Copy, Debug)]
pub(super) struct Common {
    origin: Aabb,
    pub direction: Aabb,
    /// Least and largest t of any.
    pub near: f64,
    pub far: f64,
    /// Largest `near`: from here on all have begun.
    pub begun: f64,
    /// Rays that have not found all they look for.
    pub open: u32,
}

impl Common {
    fn of(r: &Ray) -> Self {
        Self {
            origin: Aabb::new(r.origin, r.origin),
            direction: Aabb::new(r.direction, r.direction),
            near: r.near,
            far: r.far,
            begun: r.near,
            open: 1,
        }
    }

    fn join(a: Option<Self>, b: Option<Self>) -> Option<Self> {
        let (Some(a), Some(b)) = (a, b) else { return a.or(b) };
        let hull = |p: Aabb, q: Aabb| {
            Aabb::new([0, 1, 2].map(|k| p.lo[k].min(q.lo[k])), [0, 1, 2].map(|k| p.hi[k].max(q.hi[k])))
        };
        Some(Self {
            origin: hull(a.origin, b.origin),
            direction: hull(a.direction, b.direction),
            near: a.near.min(b.near),
            far: a.far.max(b.far),
            begun: a.begun.max(b.begun),
            open: a.open + b.open,
        })
    }

    /// The box around all rays' points for t from `from` to `to`, with a little room for rounding.
    pub(super) fn swept(&self, from: f64, to: f64) -> Aabb {
        let mut b = self.origin;
        for a in 0..3 {
            let (lo, hi) = (self.direction.lo[a], self.direction.hi[a]);
            let low = (from * lo).min(to * lo);
            let high = (from * hi).max(to * hi);
            let size = b.lo[a].abs().max(b.hi[a].abs()) + low.abs().max(high.abs());
            b.lo[a] += low - ROUNDING * size;
            b.hi[a] += high + ROUNDING * size;
        }
        b
    }

    /// Longest side across at t, and length of a unit of t.
    pub(super) fn extent(&self, t: f64) -> (f64, f64) {
        let (mut across, mut along) = (0.0, 0.0);
        for a in 0..3 {
            let d = self.direction.hi[a] - self.direction.lo[a];
            across = f64::max(across, self.origin.hi[a] - self.origin.lo[a] + t.abs() * d);
            along = f64::max(along, self.direction.hi[a].abs().max(self.direction.lo[a].abs()));
        }
        (across, along)
    }
}

/// Room for rounding in a point of a ray, relative.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// A tile of rays with what each square of them has in common.
pub(super) struct Bundle<'a> {
    pub rays: &'a [Ray],
    levels: Vec<Vec<Option<Common>>>,
}

impl<'a> Bundle<'a> {
    pub(super) fn new(rays: &'a [Ray]) -> Self {
        let last = LEVELS - 1;
        let count = 1 << last;
        let smallest = |k: usize| {
            let square = Square { level: last, x: k % count, y: k / count };
            square
                .rays()
                .filter(|&i| rays[i].is_open())
                .map(|i| Common::of(&rays[i]))
                .fold(None, |a, b| Common::join(a, Some(b)))
        };
        let mut levels = vec![(0..count * count).map(smallest).collect::<Vec<_>>()];
        for level in (0..last).rev() {
            let finer = &levels[0];
            let count = 1 << level;
            let joined = |k: usize| {
                let square = Square { level, x: k % count, y: k / count };
                square.quarters().iter().map(|q| finer[q.number()]).fold(None, Common::join)
            };
            let coarser = (0..count * count).map(joined).collect();
            levels.insert(0, coarser);
        }
        Self { rays, levels }
    }

    /// What the rays of a square have in common, if any is still open.
    pub(super) fn common(&self, s: Square) -> Option<&Common> {
        self.levels[s.level][s.number()].as_ref().filter(|c| c.open > 0)
    }

    /// Ray `i` has found all it looks for.
    pub(super) fn close(&mut self, i: usize) {
        let (x, y) = (i % SIDE, i / SIDE);
        for (level, squares) in self.levels.iter_mut().enumerate() {
            let side = SIDE >> level;
            let s = Square { level, x: x / side, y: y / side };
            if let Some(c) = &mut squares[s.number()] {
                c.open -= 1;
            }
        }
    }
}
