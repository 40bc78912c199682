//! Points on creases, evenly by arc length or by another measure.

use super::network::Line;
use super::trace::Knot;
use crate::vector::{V3, add, along, distance, scale};

/// Length of the arc between two knots: that of the circle with the same chord and the same turn of the tangent.
pub(super) fn arc(a: &Knot, b: &Knot) -> f64 {
    let turn = angle(a.t, b.t);
    let chord = distance(a.p, b.p);
    // (θ/2) / sin(θ/2)
    let half = 0.5 * turn;
    if half < 1e-4 {
        chord * (1.0 + half * half / 6.0)
    } else {
        chord * half / isoswarm_field::math::sin(half)
    }
}

/// The angle between unit vectors.
fn angle(a: V3, b: V3) -> f64 {
    2.0 * isoswarm_field::math::asin((0.5 * distance(a, b)).min(1.0))
}

impl Line {
    /// Pairs of knots that follow each other.
    fn segments(&self) -> impl Iterator<Item = (&Knot, &Knot)> {
        let n = self.knots.len();
        let count = if self.ends.is_none() { n } else { n.saturating_sub(1) };
        (0..count).map(move |k| (&self.knots[k], &self.knots[(k + 1) % n]))
    }

    /// Arc length.
    pub(super) fn length(&self) -> f64 {
        self.segments().map(|(a, b)| arc(a, b)).sum()
    }

    /// By how much the tangent turns from end to end, or the normal of a side if that turns more (radians).
    pub(super) fn turn(&self) -> f64 {
        let sum = |of: &dyn Fn(&Knot) -> V3| self.segments().map(|(a, b)| angle(of(a), of(b))).sum::<f64>();
        sum(&|k| k.t).max(sum(&|k| k.sides[0].normal)).max(sum(&|k| k.sides[1].normal))
    }

    /// Arc lengths between knots.
    pub(super) fn lengths(&self) -> Vec<f64> {
        self.segments().map(|(a, b)| arc(a, b)).collect()
    }

    /// Between knots: how much they and the normals of the sides turn (radians).
    pub(super) fn turns(&self) -> Vec<f64> {
        let side = |a: &Knot, b: &Knot, k: usize| angle(a.sides[k].normal, b.sides[k].normal);
        self.segments().map(|(a, b)| angle(a.t, b.t).max(side(a, b, 0)).max(side(a, b, 1))).collect()
    }

    /// The knots, and places beside each that far into both sides.
    pub(super) fn places(&self, off: f64) -> Vec<V3> {
        let around = |k: &Knot| [k.p, along(k.p, off, k.sides[0].way), along(k.p, off, k.sides[1].way)];
        self.knots.iter().flat_map(around).collect()
    }

    /// Guesses of the points at `count` parts of equal measure, given between knots, with tangents: the first knot is the first of them,
    /// and the end comes last unless the line is closed.
    pub(super) fn parts(&self, count: usize, measure: &[f64]) -> Vec<(V3, V3)> {
        let total: f64 = measure.iter().sum();
        let mut out = vec![(self.knots[0].p, self.knots[0].t)];
        let (mut done, mut next) = (0.0, 1);
        for ((a, b), &size) in self.segments().zip(measure) {
            while next < count && total * next as f64 / count as f64 <= done + size {
                let part = (total * next as f64 / count as f64 - done) / size;
                out.push(between(a, b, part.clamp(0.0, 1.0), arc(a, b)));
                next += 1;
            }
            done += size;
        }
        if self.ends.is_some()
            && let Some(last) = self.knots.last()
        {
            out.push((last.p, last.t));
        }
        out
    }
}

/// A point and the tangent on Hermite's cubic from `a` to `b`, whose speed is about `length`.
fn between(a: &Knot, b: &Knot, s: f64, length: f64) -> (V3, V3) {
    let (s2, s3) = (s * s, s * s * s);
    let mix = |w: [f64; 4]| {
        let ends = add(scale(a.p, w[0]), scale(b.p, w[1]));
        add(ends, add(scale(a.t, w[2] * length), scale(b.t, w[3] * length)))
    };
    let p = mix([2.0 * s3 - 3.0 * s2 + 1.0, 3.0 * s2 - 2.0 * s3, s3 - 2.0 * s2 + s, s3 - s2]);
    let t = mix([6.0 * s2 - 6.0 * s, 6.0 * s - 6.0 * s2, 3.0 * s2 - 4.0 * s + 1.0, 3.0 * s2 - 2.0 * s]);
    (p, crate::vector::unit(t))
}
