//! How evenly points lie, as the literature measures it.

use isoswarm_field::Aabb;
use isoswarm_field::arrange::Arrange;

use crate::constraint::Walls;
use crate::population::{Census, census, linear};
use crate::report::Evenness;
use crate::swarm::Swarm;
use crate::vector::V3;

/// Distance between neighbours in the hexagonal packing of cells of the given area, sqrt(2 area / sqrt 3).
pub fn hexagonal(area: f64) -> f64 {
    (2.0 * area / 3f64.sqrt()).sqrt()
}

/// Measures points on a surface. `normals` are unit vectors or zero; they tell apart the sheets of thin parts.
/// Points on the faces of `bounds` (`None`: there are none) are left out as samples, and counted as neighbours.
/// `axes` is 3, or 2 for curves in the plane.
///
/// The area is that of the points' Voronoi cells. All results are dimensionless; see [`Evenness`].
///
/// # Panics
/// Where the two slices differ in length.
pub fn evenness(points: &[[f64; 3]], normals: &[[f64; 3]], bounds: Option<&Aabb>, axes: usize) -> Evenness {
    assert_eq!(points.len(), normals.len(), "a normal for each point");
    if points.is_empty() {
        return Evenness::default();
    }
    let infinite = Aabb::new([f64::NEG_INFINITY; 3], [f64::INFINITY; 3]);
    let mut walls = Walls::new(bounds.unwrap_or(&infinite), axes);
    if axes == 2 {
        (walls.lo[2], walls.hi[2]) = (0.0, 0.0);
    }
    let swarm = Swarm {
        points: points.to_vec(),
        normals: normals.to_vec(),
        label: vec![0; points.len()],
        ..Swarm::default()
    };
    let unit = spacing_guess(points, axes);
    let first = census(&swarm, &walls, unit);
    // Once more with a reach that fits.
    let unit = linear(first.share, axes).max(0.25 * unit);
    of_census(&swarm, &census(&swarm, &walls, unit), axes)
}

/// A first idea of the spacing: from the distances to the nearest neighbours of some of the points.
fn spacing_guess(points: &[V3], axes: usize) -> f64 {
    let mut extent = 0.0f64;
    if let Some(b) = Aabb::around(points) {
        extent = b.diagonal();
    }
    let few = points.len().min(64);
    let mut nearest: Vec<f64> = (0..few)
        .map(|k| {
            let p = points[k * points.len() / few];
            points
                .iter()
                .map(|&q| crate::vector::distance(p, q))
                .filter(|d| *d > 0.0)
                .fold(f64::INFINITY, f64::min)
        })
        .filter(|d| d.is_finite())
        .collect();
    nearest.arrange_by(f64::total_cmp);
    // Random points have mean distances of half the square root of the cell; a generous reach costs little.
    let factor = if axes == 2 { 4.0 } else { 2.0 };
    nearest.get(nearest.len() / 2).map_or(extent.max(f64::MIN_POSITIVE), |d| factor * d)
}

/// Mean distance to the nearest neighbour over all that have one; 0 where none has.
pub(crate) fn mean_nearest(census: &Census) -> f64 {
    let d: Vec<f64> = census.cells.iter().map(|c| c.nearest).filter(|d| d.is_finite()).collect();
    if d.is_empty() { 0.0 } else { d.iter().sum::<f64>() / d.len() as f64 }
}

pub(crate) fn of_census(swarm: &Swarm, census: &Census, axes: usize) -> Evenness {
    let packed = if axes == 2 { census.share } else { hexagonal(census.share) };
    let (mut n, mut sum, mut square, mut least, mut hole, mut regular) =
        (0usize, 0.0, 0.0, f64::INFINITY, 0.0f64, 0usize);
    let usual = if axes == 2 { 2 } else { 6 };
    for (i, c) in census.cells.iter().enumerate() {
        if c.clipped || !c.nearest.is_finite() {
            continue;
        }
        let own = packed * swarm.size.get(i).copied().unwrap_or(1.0);
        let d = c.nearest / own;
        n += 1;
        sum += d;
        square += d * d;
        least = least.min(d);
        hole = hole.max(f64::from(c.hole) / own);
        regular += usize::from(c.valence == usual);
    }
    if n == 0 {
        return Evenness::default();
    }
    let mean = sum / n as f64;
    Evenness {
        rho_min: least,
        rho_avg: mean,
        cv: (square / n as f64 - mean * mean).max(0.0).sqrt() / mean,
        six_valent: regular as f64 / n as f64,
        coverage: hole,
    }
}
