//! Why nothing was found: F is no number, or does not change its sign.

use isoswarm_field::{Aabb, FieldError, Surface};

use super::lines::Roots;
use super::look;
use super::region::Region;
use crate::constraint::Walls;
use crate::rng::{Rng, Stream};
use crate::run::Run;
use crate::vector::{V3, along, unit};

/// Points at which F is asked for a number: in the bounds, and in each box.
const IN_BOUNDS: usize = 2048;
const PER_BOX: usize = 2;
/// Roots on both sides of which the sign of F is looked at.
const ROOTS: usize = 512;
/// How far from a root, in boxes.
const ASIDE: [f64; 3] = [1e-2, 1e-4, 1e-6];

/// Points at random in the boxes, `each` in every one.
fn scattered(boxes: &[Aabb], each: usize, seed: u64) -> Vec<V3> {
    let rng = Rng::new(seed, Stream::Lines).child(!0);
    let at = |b: &Aabb, k: usize| {
        let own = rng.child(k as u64);
        [0, 1, 2].map(|a| b.lo[a] + own.unit(a as u64) * (b.hi[a] - b.lo[a]))
    };
    boxes
        .iter()
        .enumerate()
        .flat_map(|(i, b)| (0..each).map(move |k| (b, i * each + k)))
        .map(|(b, k)| at(b, k))
        .collect()
}

/// Whether F is a finite number nowhere that it was asked for: then there is nothing to look for, and a warning says so.
pub(crate) fn nowhere_finite(
    surface: &dyn Surface,
    region: &Region<'_>,
    run: &mut Run<'_>,
    bounds: &Aabb,
) -> Result<bool, FieldError> {
    let (mut value, mut gradient, mut asked) = (Vec::new(), Vec::new(), 0);
    for points in [scattered(&[*bounds], IN_BOUNDS, run.seed), scattered(&region.boxes, PER_BOX, run.seed)] {
        look(surface, run, &points, &mut value, &mut gradient)?;
        if value.iter().any(|v| v.is_finite()) {
            return Ok(false);
        }
        asked += points.len();
    }
    run.warnings.push(format!(
        "F is nowhere a finite number in the bounds (at none of {asked} points): check the field for divisions by zero and for \
         roots and logarithms of negative numbers, or choose other bounds"
    ));
    Ok(true)
}

/// Whether F is zero somewhere without a change of sign, given roots that no line met: then there is no surface
/// to sample, and a warning says so.
pub(crate) fn never_crosses(
    surface: &dyn Surface,
    region: &Region<'_>,
    run: &mut Run<'_>,
    walls: &Walls,
    roots: &Roots,
) -> Result<bool, FieldError> {
    let (mut value, mut gradient) = (Vec::new(), Vec::new());
    let stride = roots.points.len().div_ceil(ROOTS).max(1);
    let mut points = Vec::new();
    for i in (0..roots.points.len()).step_by(stride) {
        let n = unit(roots.gradients[i]);
        for h in ASIDE {
            points.extend([h, -h].map(|h| walls.clamp(along(roots.points[i], h * region.side, n))));
        }
    }
    look(surface, run, &points, &mut value, &mut gradient)?;
    if value.chunks_exact(2).any(|v| v[0] * v[1] < 0.0) {
        return Ok(false);
    }
    let mut points = scattered(&region.boxes, PER_BOX, run.seed);
    points.extend(scattered(&[Aabb::new(walls.lo, walls.hi)], IN_BOUNDS, run.seed));
    look(surface, run, &points, &mut value, &mut gradient)?;
    let (below, above) = (value.iter().any(|v| *v < 0.0), value.iter().any(|v| *v > 0.0));
    if below && above {
        return Ok(false);
    }
    let zero = value.iter().filter(|v| **v == 0.0).count();
    if 4 * zero > value.len() {
        run.warnings.push(
            "F is zero on a whole region of the bounds, which is no surface: check the field, or offset it (F - c = 0)".into(),
        );
    } else {
        run.warnings.push(format!(
            "F does not change its sign in the bounds (it is nowhere {}): where it touches zero without crossing it there is no \
             surface to sample; take the root of a square, leave out the absolute value, or offset the field (F - c = 0)",
            if below { "positive" } else { "negative" }
        ));
    }
    Ok(true)
}
