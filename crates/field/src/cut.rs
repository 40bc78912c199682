//! Where a run of points along a space-filling curve is cut, so that the boxes around its parts are small.

use pulp::Arch;

use crate::surface::Aabb;

/// Points of the runs whose boxes are kept; cuts are found among these and then moved by single points.
const GRAIN: usize = 16;

/// Neither part of a cut has less than one in this many of the points.
const SHARE: usize = 16;

/// A box as −lo and hi, so that joining two is one maximum. Padded to eight numbers.
#[derive(Clone, Copy)]
struct Hull([f64; 8]);

impl Hull {
    const EMPTY: Hull = Hull([f64::NEG_INFINITY; 8]);

    #[inline(always)]
    fn of(p: &[f64; 3]) -> Hull {
        Hull([-p[0], -p[1], -p[2], 0.0, p[0], p[1], p[2], 0.0])
    }

    #[inline(always)]
    fn join(&self, b: &Hull) -> Hull {
        let mut r = *self;
        for k in 0..8 {
            r.0[k] = if b.0[k] > r.0[k] { b.0[k] } else { r.0[k] };
        }
        r
    }

    #[inline(always)]
    fn around(points: &[[f64; 3]]) -> Hull {
        points.iter().fold(Hull::EMPTY, |a, p| a.join(&Hull::of(p)))
    }

    /// Sum of the sides.
    #[inline(always)]
    fn size(&self) -> f64 {
        (self.0[0] + self.0[4]) + (self.0[1] + self.0[5]) + (self.0[2] + self.0[6])
    }

    #[inline(always)]
    fn aabb(&self) -> Aabb {
        let h = self.0;
        Aabb { lo: [-h[0], -h[1], -h[2]], hi: [h[4], h[5], h[6]] }
    }
}

/// A run of points and the box around it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    pub start: usize,
    pub end: usize,
    pub bounds: Aabb,
}

impl Part {
    pub(crate) fn len(&self) -> usize {
        self.end - self.start
    }
}

/// Points in order, with the boxes around short runs of them.
pub(crate) struct Curve<'a> {
    points: &'a [[f64; 3]],
    grains: Vec<Hull>,
}

impl<'a> Curve<'a> {
    pub(crate) fn new(points: &'a [[f64; 3]]) -> Self {
        let grains = Arch::new().dispatch(
            #[inline(always)]
            || points.chunks(GRAIN).map(Hull::around).collect(),
        );
        Self { points, grains }
    }

    #[inline(always)]
    fn hull(&self, start: usize, end: usize) -> Hull {
        let (first, last) = (start.div_ceil(GRAIN), end / GRAIN);
        if first >= last {
            return Hull::around(&self.points[start..end]);
        }
        let inner = self.grains[first..last].iter().fold(Hull::EMPTY, |a, b| a.join(b));
        let before = Hull::around(&self.points[start..first * GRAIN]);
        inner.join(&before).join(&Hull::around(&self.points[last * GRAIN..end]))
    }

    #[inline(always)]
    pub(crate) fn part(&self, start: usize, end: usize) -> Part {
        Part { start, end, bounds: self.hull(start, end).aabb() }
    }

    /// Cuts a run into up to `most` parts; those of no more than `leaf` points stay whole.
    pub(crate) fn parts(&self, start: usize, end: usize, most: usize, leaf: usize) -> Vec<Part> {
        Arch::new().dispatch(
            #[inline(always)]
            || self.cut(start, end, most, leaf),
        )
    }

    #[inline(always)]
    fn cut(&self, start: usize, end: usize, most: usize, leaf: usize) -> Vec<Part> {
        let mut cuts = vec![(start, end)];
        while cuts.len() < most {
            let mut longest = 0;
            for (i, c) in cuts.iter().enumerate() {
                if c.1 - c.0 > cuts[longest].1 - cuts[longest].0 {
                    longest = i;
                }
            }
            let (start, end) = cuts[longest];
            if end - start <= leaf.max(1) {
                break;
            }
            let middle = self.best_cut(start, end);
            cuts[longest].1 = middle;
            cuts.insert(longest + 1, (middle, end));
        }
        cuts.into_iter().map(|(start, end)| self.part(start, end)).collect()
    }

    /// The cut of a run that makes the two boxes smallest, each weighed by its points: a space-filling curve
    /// jumps, and it should be cut where it does. Both parts have a share of the points, so that the tree is not deep.
    #[inline(always)]
    fn best_cut(&self, start: usize, end: usize) -> usize {
        let n = end - start;
        let share = (n / SHARE).max(1);
        let (low, high) = (start + share, end - share);
        let (first, last) = (low.div_ceil(GRAIN), high / GRAIN);
        if first >= last {
            return self.refined(start, end, low, high);
        }
        // What lies behind each candidate k · GRAIN.
        let mut hull = self.hull(last * GRAIN, end);
        let mut after = vec![0.0; last - first + 1];
        for k in (first..=last).rev() {
            after[k - first] = hull.size() * (end - k * GRAIN) as f64;
            hull = hull.join(&self.grains[k - 1]);
        }
        let mut hull = self.hull(start, first * GRAIN);
        let mut best = (f64::INFINITY, (first + last) / 2);
        for k in first..=last {
            let cost = hull.size() * (k * GRAIN - start) as f64 + after[k - first];
            if cost < best.0 {
                best = (cost, k);
            }
            if k < last {
                hull = hull.join(&self.grains[k]);
            }
        }
        // Single points on both sides of the best.
        let at = best.1 * GRAIN;
        self.refined(start, end, low.max(at - GRAIN + 1), high.min(at + GRAIN - 1))
    }

    /// The best cut of a run from `low` to `high`.
    #[inline(always)]
    fn refined(&self, start: usize, end: usize, low: usize, high: usize) -> usize {
        let mut after = vec![0.0; high - low + 1];
        let mut hull = self.hull(high, end);
        for at in (low..=high).rev() {
            after[at - low] = hull.size() * (end - at) as f64;
            hull = hull.join(&Hull::of(&self.points[at - 1]));
        }
        let mut hull = self.hull(start, low);
        let mut best = (f64::INFINITY, low.midpoint(high));
        for at in low..=high {
            let cost = hull.size() * (at - start) as f64 + after[at - low];
            if cost < best.0 {
                best = (cost, at);
            }
            if at < high {
                hull = hull.join(&Hull::of(&self.points[at]));
            }
        }
        best.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points along a helix.
    fn helix(n: usize) -> Vec<[f64; 3]> {
        (0..n).map(|i| 0.01 * i as f64).map(|t| [t.cos(), t.sin(), 0.1 * t]).collect()
    }

    #[test]
    fn parts_follow_each_other_and_their_boxes_are_tight() {
        let points = helix(1003);
        let curve = Curve::new(&points);
        for (start, end, most, leaf) in
            [(0, 1003, 8, 100), (17, 990, 8, 1), (5, 7, 8, 1), (3, 40, 5, 4), (9, 10, 8, 64)]
        {
            let parts = curve.parts(start, end, most, leaf);
            assert!(parts.len() <= most && (parts.len() == most || parts.iter().all(|p| p.len() <= leaf)));
            assert_eq!((parts[0].start, parts[parts.len() - 1].end), (start, end));
            assert!(parts.windows(2).all(|w| w[0].end == w[1].start));
            for p in parts {
                assert_eq!(Some(p.bounds), Aabb::around(&points[p.start..p.end]));
            }
        }
    }

    #[test]
    fn a_jump_is_where_the_cut_is() {
        for at in [100, 333, 512, 900] {
            let mut points = helix(1000);
            points[at..].iter_mut().for_each(|p| p[0] += 50.0);
            let parts = Curve::new(&points).parts(0, 1000, 2, 1);
            assert_eq!((parts[0].end, parts[1].start), (at, at));
        }
    }

    #[test]
    fn points_at_one_place_or_nowhere_are_shared_out() {
        for p in [[1.0, 2.0, 3.0], [f64::NAN; 3], [f64::INFINITY, 0.0, 0.0]] {
            let points = vec![p; 1000];
            let parts = Curve::new(&points).parts(0, 1000, 2, 1);
            assert!(parts.iter().all(|p| p.len() >= 1000 / SHARE), "{parts:?}");
        }
    }
}
