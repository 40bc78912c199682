//! Boxes that may hold the surface.

use isoswarm_field::{Aabb, FieldError, Surface};

use super::look;
use crate::run::Run;
use crate::vector::{V3, norm};

/// Boxes, and how to evaluate the field in them.
pub(crate) struct Region<'s> {
    /// Disjoint boxes (degenerate along unused axes) in a spatially coherent order.
    pub(crate) boxes: Vec<Aabb>,
    /// Largest side.
    pub(crate) side: f64,
    /// Whether the boxes contain every zero in the bounds for certain.
    pub(crate) certified: bool,
    evaluate: Evaluate<'s>,
}

enum Evaluate<'s> {
    Pruned(Box<dyn Surface + 's>),
    Whole(&'s dyn Surface),
}

impl Region<'_> {
    /// Evaluates points in the boxes, fast if they come in the order of the boxes.
    pub(crate) fn surface(&self) -> &dyn Surface {
        match &self.evaluate {
            Evaluate::Pruned(s) => s.as_ref(),
            Evaluate::Whole(s) => *s,
        }
    }
}

/// About `aim` boxes that together contain the surface.
pub(crate) fn find<'s>(
    surface: &'s dyn Surface,
    run: &mut Run<'_>,
    bounds: &Aabb,
    axes: usize,
    aim: usize,
) -> Result<Region<'s>, FieldError> {
    match by_intervals(surface, bounds, axes, aim) {
        Some(region) => Ok(region),
        None => by_samples(surface, run, bounds, axes, aim),
    }
}

/// The dimension of the surface is one less than that of space: so boxes multiply when sides shrink.
fn shrink(boxes: usize, aim: usize, axes: usize) -> f64 {
    let ratio = aim as f64 / boxes.max(1) as f64;
    if axes == 2 { ratio } else { ratio.sqrt() }
}

fn by_intervals<'s>(surface: &'s dyn Surface, bounds: &Aabb, axes: usize, aim: usize) -> Option<Region<'s>> {
    let side_of = |b: &Aabb| (0..axes).map(|a| b.hi[a] - b.lo[a]).fold(0.0, f64::max);
    let whole = side_of(bounds);
    let mut side = whole / if axes == 2 { 128.0 } else { 32.0 };
    let mut within = *bounds;
    loop {
        let cells = surface.cells(&within, side, 4 * aim)?;
        let found = cells.boxes.len();
        let enough = 3 * found >= aim || cells.side > 1.5 * side || side < 1e-9 * whole;
        if found == 0 || enough {
            return Some(Region {
                boxes: cells.boxes,
                side: cells.side,
                certified: true,
                evaluate: Evaluate::Pruned(cells.evaluate),
            });
        }
        let corners: Vec<V3> = cells.boxes.iter().flat_map(|b| [b.lo, b.hi]).collect();
        within = Aabb::around(&corners).unwrap_or(within);
        side /= shrink(found, aim, axes).clamp(1.5, 8.0);
    }
}

/// Boxes around which F changes sign between the centres of neighbours, or whose centre is nearer to the surface, by
/// |F|/|∇F|, than half again their half diagonal.
fn by_samples<'s>(
    surface: &'s dyn Surface,
    run: &mut Run<'_>,
    bounds: &Aabb,
    axes: usize,
    aim: usize,
) -> Result<Region<'s>, FieldError> {
    let per_axis = if axes == 2 { 128usize } else { 40 };
    let cells = |a: usize| if a < axes { per_axis } else { 1 };
    let step = [0, 1, 2].map(|a| (bounds.hi[a] - bounds.lo[a]) / cells(a) as f64);
    let half_diagonal = 0.5 * norm(step);
    let mut boxes = Vec::with_capacity(per_axis.pow(axes as u32));
    for z in 0..cells(2) {
        for y in 0..cells(1) {
            for x in 0..cells(0) {
                let at = [x, y, z];
                let corner = |up: usize| {
                    [0, 1, 2].map(|a| {
                        // The last face is the bound itself, to the bit.
                        if at[a] + up == cells(a) {
                            bounds.hi[a]
                        } else {
                            bounds.lo[a] + (at[a] + up) as f64 * step[a]
                        }
                    })
                };
                boxes.push(Aabb::new(corner(0), corner(1)));
            }
        }
    }
    let (mut value, mut gradient) = (Vec::new(), Vec::new());
    look(surface, run, &middles(&boxes), &mut value, &mut gradient)?;
    let stride = [1, cells(0), cells(0) * cells(1)];
    let mut keep: Vec<bool> =
        (0..boxes.len()).map(|i| value[i].abs() <= 1.5 * half_diagonal * norm(gradient[i])).collect();
    for i in 0..boxes.len() {
        let at = [i % cells(0), i / cells(0) % cells(1), i / (cells(0) * cells(1))];
        for a in 0..axes {
            if at[a] + 1 < cells(a) && (value[i] < 0.0) != (value[i + stride[a]] < 0.0) {
                keep[i] = true;
                keep[i + stride[a]] = true;
            }
        }
    }
    let mut kept: Vec<Aabb> = boxes.iter().zip(&keep).filter(|(_, k)| **k).map(|(b, _)| *b).collect();
    let mut side = step.iter().fold(0.0, |m: f64, &s| m.max(s));
    // Where few are left the surface is small in its bounds: look closer.
    for _ in 0..12 {
        if kept.is_empty() || 3 * kept.len() >= aim {
            break;
        }
        let (children, closer) = halve(&kept, axes);
        look(surface, run, &middles(&children), &mut value, &mut gradient)?;
        let half_diagonal = 0.5 * children.first().map_or(0.0, Aabb::diagonal);
        let near = |i: usize| value[i].abs() <= 2.0 * half_diagonal * norm(gradient[i]);
        let family = 1 << axes;
        let mixed = |i: usize| {
            let first = i / family * family;
            (first..first + family).any(|k| (value[k] < 0.0) != (value[first] < 0.0))
        };
        let next: Vec<Aabb> =
            (0..children.len()).filter(|&i| near(i) || mixed(i)).map(|i| children[i]).collect();
        if next.len() > 4 * aim {
            break;
        }
        kept = next;
        side *= closer;
    }
    Ok(Region { boxes: kept, side, certified: false, evaluate: Evaluate::Whole(surface) })
}

fn middles(boxes: &[Aabb]) -> Vec<V3> {
    boxes.iter().map(Aabb::middle).collect()
}

/// Every box cut in half along each axis; the children of a box follow each other.
fn halve(boxes: &[Aabb], axes: usize) -> (Vec<Aabb>, f64) {
    let mut children = Vec::with_capacity(boxes.len() << axes);
    for b in boxes {
        let middle = b.middle();
        for k in 0..1usize << axes {
            let mut child = *b;
            for a in 0..axes {
                if k >> a & 1 == 0 {
                    child.hi[a] = middle[a];
                } else {
                    child.lo[a] = middle[a];
                }
            }
            children.push(child);
        }
    }
    (children, 0.5)
}
