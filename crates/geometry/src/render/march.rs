//! Rays through opaque functions: steps of |F| over a guessed slope, all rays at once, then brackets narrowed side by side.
//! Nothing is proved: what is thinner than a step may be missed.

use std::sync::atomic::{AtomicBool, Ordering};

use isoswarm_field::vector::norm;
use isoswarm_field::{Aabb, Field, Surface};

use super::{CastOptions, Hit, Ray, SIDE};
use crate::GeometryError;

/// Samples along a side of the box from which the slope is guessed.
const LATTICE: usize = 17;

/// The guess is the largest slope seen, times this.
const SAFETY: f64 = 1.5;

/// A step is at least the ray's length in the box over this, and at most that over `LONGEST`.
const SHORTEST: f64 = 384.0;
const LONGEST: f64 = 8.0;

/// Narrowings of a bracket: the step over 2^40 by bisection alone.
const NARROWINGS: usize = 40;

/// A guess of the largest |∇F| in a box.
pub(super) fn slope(field: &Field, bounds: &Aabb) -> Result<f64, GeometryError> {
    let at = |k: usize, a: usize| {
        let step = k / LATTICE.pow(a as u32) % LATTICE;
        bounds.lo[a] + (bounds.hi[a] - bounds.lo[a]) * step as f64 / (LATTICE - 1) as f64
    };
    let points: Vec<[f64; 3]> = (0..LATTICE.pow(3)).map(|k| [0, 1, 2].map(|a| at(k, a))).collect();
    let mut value = vec![0.0; points.len()];
    field.value(points.as_flattened(), &mut value)?;
    let mut largest = f64::MIN_POSITIVE;
    for k in 0..points.len() {
        for a in 0..3 {
            let next = k + LATTICE.pow(a as u32);
            let side = bounds.hi[a] - bounds.lo[a];
            if k / LATTICE.pow(a as u32) % LATTICE + 1 < LATTICE && side > 0.0 {
                let slope = (value[next] - value[k]).abs() * (LATTICE - 1) as f64 / side;
                largest = if slope.is_finite() { largest.max(slope) } else { largest };
            }
        }
    }
    Ok(SAFETY * largest)
}

/// A ray on its way.
struct Track {
    tile: usize,
    ray: usize,
    t: f64,
    value: f64,
    found: u16,
    /// Length of a unit of t, and the length of the whole ray in the box.
    unit: f64,
    length: f64,
}

/// A crossing between two values of t.
struct Bracket {
    tile: usize,
    ray: usize,
    a: (f64, f64),
    b: (f64, f64),
}

/// The crossings of each tile's rays.
pub(super) fn march(
    field: &Field,
    slope: f64,
    tiles: &[Vec<Ray>],
    options: &CastOptions,
    stop: &AtomicBool,
) -> Result<Vec<Vec<Hit>>, GeometryError> {
    let mut hits: Vec<Vec<Hit>> = tiles.iter().map(|_| Vec::new()).collect();
    let mut tracks = begin(field, tiles)?;
    for t in &mut tracks {
        let r = &tiles[t.tile][t.ray];
        if let Some(face) = r.face.filter(|&f| options.cuts(f, t.value < 0.0)) {
            hits[t.tile].push(Hit { ray: t.ray as u16, t: r.near, gradient: [0.0; 3], cut: Some(face) });
            t.found += 1;
        }
    }
    let mut brackets = Vec::new();
    loop {
        tracks.retain(|t| t.found < options.layers && t.t < tiles[t.tile][t.ray].far);
        if tracks.is_empty() {
            break;
        }
        if stop.load(Ordering::Relaxed) {
            return Err(GeometryError::Cancelled);
        }
        let step = |t: &Track| {
            let free = t.value.abs() / slope;
            let free = if free.is_finite() { free } else { 0.0 };
            (t.t + free.clamp(t.length / SHORTEST, t.length / LONGEST) / t.unit).min(tiles[t.tile][t.ray].far)
        };
        let next: Vec<f64> = tracks.iter().map(step).collect();
        let at = |(t, to): (&Track, &f64)| tiles[t.tile][t.ray].at(*to);
        let values = evaluate(field, tracks.iter().zip(&next).map(at).collect())?;
        for ((t, to), value) in tracks.iter_mut().zip(next).zip(values) {
            if (t.value < 0.0) != (value < 0.0) {
                brackets.push(Bracket { tile: t.tile, ray: t.ray, a: (t.t, t.value), b: (to, value) });
                t.found += 1;
            }
            (t.t, t.value) = (to, value);
        }
    }
    settle(field, tiles, brackets, &mut hits)?;
    for tile in &mut hits {
        tile.sort_by(|a, b| a.ray.cmp(&b.ray).then(a.t.total_cmp(&b.t)));
    }
    Ok(hits)
}

fn begin(field: &Field, tiles: &[Vec<Ray>]) -> Result<Vec<Track>, GeometryError> {
    let mut tracks = Vec::new();
    for (tile, rays) in tiles.iter().enumerate() {
        for (ray, r) in rays.iter().enumerate().take(SIDE * SIDE) {
            if r.near < r.far {
                let unit = norm(r.direction);
                let length = (r.far - r.near) * unit;
                tracks.push(Track { tile, ray, t: r.near, value: 0.0, found: 0, unit, length });
            }
        }
    }
    let values = evaluate(field, tracks.iter().map(|t| tiles[t.tile][t.ray].at(t.t)).collect())?;
    tracks.iter_mut().zip(values).for_each(|(t, v)| t.value = v);
    Ok(tracks)
}

fn evaluate(field: &Field, points: Vec<[f64; 3]>) -> Result<Vec<f64>, GeometryError> {
    let mut value = vec![0.0; points.len()];
    field.value(points.as_flattened(), &mut value)?;
    Ok(value)
}

/// Narrows all brackets by regula falsi and bisection in turn, and notes what they close in on.
fn settle(
    field: &Field,
    tiles: &[Vec<Ray>],
    mut brackets: Vec<Bracket>,
    hits: &mut [Vec<Hit>],
) -> Result<(), GeometryError> {
    for round in 0..NARROWINGS {
        let guess = |b: &Bracket| {
            let ((ta, fa), (tb, fb)) = (b.a, b.b);
            let t = ta - fa * (tb - ta) / (fb - fa);
            if round % 3 < 2 && ta < t && t < tb { t } else { 0.5 * (ta + tb) }
        };
        let middles: Vec<f64> = brackets.iter().map(guess).collect();
        let points = brackets.iter().zip(&middles).map(|(b, t)| tiles[b.tile][b.ray].at(*t)).collect();
        for ((b, t), f) in brackets.iter_mut().zip(middles).zip(evaluate(field, points)?) {
            if (f < 0.0) == (b.b.1 < 0.0) { b.b = (t, f) } else { b.a = (t, f) }
        }
        if brackets.iter().all(|b| b.b.0 - b.a.0 <= 1e-13 * b.b.0.abs()) {
            break;
        }
    }
    let points: Vec<[f64; 3]> = brackets.iter().map(|b| tiles[b.tile][b.ray].at(b.b.0)).collect();
    let (mut value, mut gradient) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    Surface::value_gradient(field, &points, &mut value, &mut gradient)?;
    for (b, gradient) in brackets.iter().zip(gradient) {
        if gradient.iter().all(|g| g.is_finite()) {
            hits[b.tile].push(Hit { ray: b.ray as u16, t: b.b.0, gradient, cut: None });
        }
    }
    Ok(())
}
