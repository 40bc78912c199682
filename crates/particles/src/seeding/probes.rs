//! Boxes in which no line met the surface: is there something?

use isoswarm_field::arrange::Arrange;
use isoswarm_field::{Aabb, FieldError, Surface};
use rayon::prelude::*;

use super::lines::Roots;
use super::look;
use super::region::Region;
use crate::constraint::Walls;
use crate::run::Run;
use crate::vector::{V3, norm};

/// Newton steps from the middle of a box.
const STEPS: usize = 6;
/// Boxes in doubt that are subdivided; the rest stays in doubt.
const SUBDIVIDED: usize = 20_000;
/// How finely they are.
const PARTS: f64 = 8.0;
/// Boxes that one task looks at, at least.
const TASK: usize = 64;
/// Most parts of a box.
const MOST: usize = 1024;

/// Looks for roots in every box that has none. Gives the number of boxes in which, and around which, nothing was
/// found and which could not be shown to be empty either.
pub(crate) fn search(
    surface: &dyn Surface,
    region: &Region<'_>,
    run: &mut Run<'_>,
    walls: &Walls,
    least: f64,
    roots: &mut Roots,
) -> Result<usize, FieldError> {
    let mut explained = vec![false; region.boxes.len()];
    roots.owner.iter().for_each(|&o| explained[o as usize] = true);
    let bare: Vec<u32> = (0..region.boxes.len() as u32).filter(|&b| !explained[b as usize]).collect();
    let boxes: Vec<Aabb> = bare.iter().map(|&b| region.boxes[b as usize]).collect();
    let found = newton_from_centres(region.surface(), run, &boxes, walls, least)?;
    for (k, root) in found.into_iter().enumerate() {
        if let Some((p, g)) = root {
            roots.push(p, g, bare[k], false, u64::MAX);
            explained[bare[k] as usize] = true;
        }
    }
    let doubtful = far_from_roots(region, &bare, &explained, walls.axes);
    let mut left = doubtful.len().saturating_sub(SUBDIVIDED);
    let subdivide = |b: u32| {
        let whole = region.boxes[b as usize];
        let side = (0..walls.axes).map(|a| whole.hi[a] - whole.lo[a]).fold(0.0, f64::max);
        surface.cells(&whole, side / PARTS, MOST)
    };
    // Most are empty after all.
    let filled = |b: &&u32| subdivide(**b).is_none_or(|parts| !parts.boxes.is_empty());
    let doubtful: Vec<u32> =
        doubtful.par_iter().take(SUBDIVIDED).with_min_len(TASK).filter(filled).copied().collect();
    for b in doubtful {
        let Some(parts) = subdivide(b) else {
            left += 1;
            continue;
        };
        let found = newton_from_centres(parts.evaluate.as_ref(), run, &parts.boxes, walls, least)?;
        let before = roots.points.len();
        for (p, g) in found.into_iter().flatten() {
            roots.push(p, g, b, false, u64::MAX);
        }
        left += usize::from(roots.points.len() == before);
    }
    Ok(left)
}

/// For each box the point of the surface in it that Newton's method reaches from its middle, with the gradient there.
fn newton_from_centres(
    surface: &dyn Surface,
    run: &mut Run<'_>,
    boxes: &[Aabb],
    walls: &Walls,
    least: f64,
) -> Result<Vec<Option<(V3, V3)>>, FieldError> {
    let mut out = vec![None; boxes.len()];
    let mut active: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut points: Vec<V3> = boxes.iter().map(Aabb::middle).collect();
    let (mut value, mut gradient) = (Vec::new(), Vec::new());
    for _ in 0..STEPS {
        look(surface, run, &points, &mut value, &mut gradient)?;
        let (mut still, mut next) = (Vec::new(), Vec::new());
        for (k, &i) in active.iter().enumerate() {
            let b = &boxes[i as usize];
            let diagonal = b.diagonal();
            if value[k].abs() <= 1e-7 * diagonal * norm(gradient[k]) && norm(gradient[k]).is_finite() {
                if b.contains(points[k]) {
                    out[i as usize] = Some((points[k], gradient[k]));
                }
            } else if let Some(p) = walls.newton(points[k], value[k], gradient[k], diagonal, least) {
                // A start that leaves the neighbourhood of its box finds what others find.
                if b.grown(0.5 * diagonal).contains(p) {
                    still.push(i);
                    next.push(p);
                }
            }
        }
        (active, points) = (still, next);
        if active.is_empty() {
            break;
        }
    }
    Ok(out)
}

/// The boxes among `bare` without a root in themselves or in any box around them.
fn far_from_roots(region: &Region<'_>, bare: &[u32], explained: &[bool], axes: usize) -> Vec<u32> {
    // Boxes are all of one size: their places are whole numbers. The first axis comes last, and changes fastest.
    let Some(first) = region.boxes.first() else { return Vec::new() };
    let place = |b: &Aabb| {
        [2, 1, 0].map(|a| {
            let side = first.hi[a] - first.lo[a];
            if side > 0.0 { ((b.lo[a] - first.lo[a]) / side).round() as i64 } else { 0 }
        })
    };
    let known = region.boxes.iter().zip(explained).filter(|(_, e)| **e).map(|(b, _)| place(b));
    let mut known: Vec<[i64; 3]> = known.collect();
    known.arrange();
    let near = |[z, y, x]: [i64; 3]| {
        let flat = axes == 2;
        (if flat { z..=z } else { z - 1..=z + 1 }).any(|z| {
            (y - 1..=y + 1).any(|y| {
                let next = known.partition_point(|k| *k < [z, y, x - 1]);
                known.get(next).is_some_and(|k| *k <= [z, y, x + 1])
            })
        })
    };
    bare.par_iter()
        .copied()
        .with_min_len(TASK)
        .filter(|&b| !explained[b as usize] && !near(place(&region.boxes[b as usize])))
        .collect()
}
