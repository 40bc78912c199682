//! What a change of each parameter costs: the sensitivity of the surface to it (WH94 section 3, footnote 1).

use isoswarm_field::{FieldError, Parametric, SparseRows};

use crate::vector::dot;

/// Cost of a typical change of a parameter without any effect, as a part of the largest among all parameters.
const FLOOR: f64 = 1e-4;

/// The cost of a unit change of each parameter: the root mean square of how far it moves the surface at `points`,
/// |∂F/∂q| / |∂F/∂x| (model units for a unit of the parameter). With it a drag does not depend on the units of parameters, and
/// changes that move little of the surface are preferred.
///
/// A parameter that moves (almost) nothing at the points would be free of charge. It costs at least `1e-4` of what
/// the dearest one costs, both for a typical change (their scale).
pub fn sensitivity(surface: &dyn Parametric, points: &[[f64; 3]]) -> Result<Vec<f64>, FieldError> {
    let (n, m) = (points.len(), surface.freedom());
    let scales = surface.scales();
    let mut squares = vec![0.0; m];
    let (mut value, mut gradient) = (vec![0.0; n], vec![[0.0; 3]; n]);
    let rows = if n > 0 && m > 0 {
        surface.sparse_parameter_gradient(points, &mut value, &mut gradient)?
    } else {
        SparseRows::new(m)
    };
    let mut used = 0.0;
    for (i, g) in gradient.iter().enumerate().take(rows.len()) {
        let square = dot(*g, *g);
        if square > 0.0 && square.is_finite() && rows.row(i).1.iter().all(|v| v.is_finite()) {
            used += 1.0;
            rows.entries_of(i).for_each(|(j, v)| squares[j] += v * v / square);
        }
    }
    let mean = |s: f64| if used > 0.0 { (s / used).sqrt() } else { 0.0 };
    let dearest = squares.iter().zip(&scales).map(|(&s, scale)| mean(s) * scale).fold(0.0, f64::max);
    // Nothing is known: the declared scales are all there is.
    let dearest = if dearest > 0.0 { dearest } else { 1.0 / FLOOR };
    Ok(squares
        .iter()
        .zip(&scales)
        .map(|(&s, scale)| {
            let (cost, floor) = (mean(s), FLOOR * dearest / scale);
            (cost * cost + floor * floor).sqrt()
        })
        .collect())
}
