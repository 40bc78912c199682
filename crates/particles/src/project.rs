//! Points onto a surface, one by one: without spreading them.

use isoswarm_field::{Aabb, FieldError, Surface};

use crate::constraint::{self, Target, Walls};

/// Most evaluations of a point.
const ROUNDS: usize = 100;

/// Moves points onto F = 0 by safeguarded Newton steps along the gradient, and gives the distance |F|/|∇F| that is left
/// at each: infinite where the gradient vanishes off the surface or nothing finite was found, 0 where F = 0.
///
/// `size` is a length to measure steps against, such as the diagonal of the surface's bounds (model units, above 0;
/// infinite where none is known): a step is at most a tenth of it. Points that do not get nearer stay where they are.
pub fn project(surface: &dyn Surface, points: &mut [[f64; 3]], size: f64) -> Result<Vec<f64>, FieldError> {
    let walls = Walls::new(&Aabb::new([f64::NEG_INFINITY; 3], [f64::INFINITY; 3]), surface.axes());
    let target = Target { tolerance: 0.0, longest: 0.1 * size, least: 0.0, rounds: ROUNDS };
    let mut normals = vec![[0.0; 3]; points.len()];
    let mut left = constraint::project(surface, &mut 0, &walls, points, &mut normals, target)?;
    let (mut value, mut gradient) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    surface.value_gradient(points, &mut value, &mut gradient)?;
    for (left, value) in left.iter_mut().zip(&value) {
        if *value == 0.0 {
            *left = 0.0;
        }
    }
    Ok(left)
}

#[cfg(test)]
mod tests {
    use super::*;
    use isoswarm_field::{Field, text};

    fn surface(formula: &str) -> Field {
        Field::new(&text::parse(formula, &[]).unwrap()).unwrap()
    }

    #[test]
    fn a_point_goes_to_the_sphere_along_its_radius() {
        let mut points = [[3.0, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, -1.0]];
        let left = project(&surface("x^2 + y^2 + z^2 - 1"), &mut points, 4.0).unwrap();
        assert!(left.iter().all(|d| *d <= 1e-15), "{left:?}");
        for (p, q) in points.iter().zip([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]]) {
            assert!((0..3).all(|a| (p[a] - q[a]).abs() < 1e-15), "{p:?}");
        }
    }

    #[test]
    fn what_cannot_be_reached_is_said() {
        let mut points = [[0.0; 3], [0.0; 3]];
        assert!(project(&surface("x^2 + y^2 + z^2 - 1"), &mut points, 4.0).unwrap()[0].is_infinite());
        assert_eq!(points, [[0.0; 3]; 2]);
        // The tip of a cone is on it.
        assert_eq!(project(&surface("x^2 + y^2 - z^2"), &mut points, 4.0).unwrap(), [0.0, 0.0]);
        let none = project(&surface("x^2 + 1"), &mut [[2.0, 0.0, 0.0]], 4.0).unwrap();
        assert!(none[0] > 1e-3, "{none:?}");
    }
}
