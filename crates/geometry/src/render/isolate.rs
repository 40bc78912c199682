//! The crossings of single rays, where a cell as a whole tells too little: at horizons, creases and thin sheets.

use isoswarm_field::{Aabb, CompiledPiece, Interval, Piece, Pieces};

use super::refine::Bracket;
use super::walk::{Span, Walk, rate};

/// Parts of rays are not cut below this, relative to t: two crossings nearer to each other may be missed.
const LEAST: f64 = 1e-8;

/// Most cuts of a ray in a cell.
const MOST: usize = 96;

/// A ray that is being cut: its open parts, the nearest last, each with F at its far end.
struct Track {
    ray: usize,
    open: Vec<(f64, f64, f64)>,
}

impl Walk<'_> {
    /// Cuts each span until it has no crossing, or one.
    pub(super) fn isolate(&mut self, piece: &Piece, ready: &CompiledPiece, spans: Vec<Span>) {
        let ends = self.values(ready, &spans.iter().map(|s| (s.ray, s.to)).collect::<Vec<_>>());
        let track = |(s, f): (&Span, f64)| Track { ray: s.ray, open: vec![(s.from, s.to, f)] };
        let mut tracks: Vec<Track> = spans.iter().zip(ends).map(track).collect();
        for round in 0..MOST {
            tracks.retain(|t| !t.open.is_empty() && self.is_open(t.ray));
            if tracks.is_empty() {
                return;
            }
            self.narrow(piece, ready, &mut tracks, round + 1 == MOST);
        }
    }

    /// Looks at the nearest open part of each track.
    fn narrow(&mut self, piece: &Piece, ready: &CompiledPiece, tracks: &mut [Track], last: bool) {
        let jumps = piece.jumps();
        let tops: Vec<(f64, f64, f64)> = tracks.iter().filter_map(|t| t.open.last().copied()).collect();
        let middles: Vec<(usize, f64)> =
            tracks.iter().zip(&tops).map(|(t, (a, b, _))| (t.ray, 0.5 * (a + b))).collect();
        let values = self.values(ready, &middles);
        let mut brackets = Vec::new();
        for first in (0..tracks.len()).step_by(Pieces::MOST) {
            let group = first..(first + Pieces::MOST).min(tracks.len());
            let boxes: Vec<Aabb> = group.clone().map(|k| self.around(tracks[k].ray, tops[k])).collect();
            let ranges = self.pieces.ranges(piece, &boxes, true);
            for (k, ranges) in group.zip(ranges) {
                let (t, (a, b, f)) = (&mut tracks[k], tops[k]);
                let (ray, inside) = (&self.bundle.rays[t.ray], self.states[t.ray].inside);
                t.open.pop();
                let slope = rate(&ray.direction.map(|d| Interval::new(d, d)), &ranges);
                // By the mean value theorem, F differs from the middle's by no more than slope · half length.
                let half = 0.5 * (b - a) * slope.magnitude();
                let apart = !ranges.value.has_zero() || (!jumps && values[k].abs() > half);
                let single = !jumps && !slope.has_zero();
                if apart {
                    continue;
                }
                let short = b - a <= LEAST * b.abs();
                if single || short || last {
                    if (f < 0.0) != inside {
                        brackets.push(Bracket::new(t.ray, a, b));
                        if last && !short {
                            t.open.clear();
                        }
                    }
                    continue;
                }
                let m = middles[k].1;
                t.open.push((m, b, f));
                t.open.push((a, m, values[k]));
            }
        }
        if !brackets.is_empty() {
            let mut refinery = std::mem::take(&mut self.refinery);
            refinery.ends(self.pieces, ready, self.bundle.rays, &mut brackets);
            self.refinery = refinery;
            self.settle(ready, brackets);
        }
    }

    fn values(&self, ready: &CompiledPiece, at: &[(usize, f64)]) -> Vec<f64> {
        let points: Vec<_> = at.iter().map(|&(i, t)| self.bundle.rays[i].at(t)).collect();
        let mut value = vec![0.0; points.len()];
        self.pieces.value(ready, &points, &mut value);
        value
    }

    /// The box around a part of a ray, with room for rounding.
    fn around(&self, ray: usize, (a, b, _): (f64, f64, f64)) -> Aabb {
        let ray = &self.bundle.rays[ray];
        let (p, q) = (ray.at(a), ray.at(b));
        let room = |k: usize| 4.0 * f64::EPSILON * (p[k].abs().max(q[k].abs()) + ray.origin[k].abs());
        Aabb::new([0, 1, 2].map(|k| p[k].min(q[k]) - room(k)), [0, 1, 2].map(|k| p[k].max(q[k]) + room(k)))
    }
}
