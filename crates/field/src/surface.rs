//! What the particles need to know of a surface, and nothing more.

use crate::switches::Switches;
use crate::{FieldError, SparseRows};

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest corner.
    pub lo: [f64; 3],
    /// Largest corner.
    pub hi: [f64; 3],
}

impl Aabb {
    /// The box with the two corners.
    pub fn new(lo: [f64; 3], hi: [f64; 3]) -> Self {
        Self { lo, hi }
    }

    /// The point in the middle.
    pub fn middle(&self) -> [f64; 3] {
        std::array::from_fn(|a| 0.5 * (self.lo[a] + self.hi[a]))
    }

    /// Length of the diagonal.
    pub fn diagonal(&self) -> f64 {
        (0..3).map(|a| (self.hi[a] - self.lo[a]).powi(2)).sum::<f64>().sqrt()
    }

    /// The box grown by `margin` on every side.
    pub fn grown(&self, margin: f64) -> Self {
        Self { lo: self.lo.map(|v| v - margin), hi: self.hi.map(|v| v + margin) }
    }

    /// Whether the point lies in the closed box.
    pub fn contains(&self, p: [f64; 3]) -> bool {
        (0..3).all(|a| self.lo[a] <= p[a] && p[a] <= self.hi[a])
    }

    /// The smallest box around the points; `None` where there are none.
    pub fn around(points: &[[f64; 3]]) -> Option<Self> {
        let first = *points.first()?;
        let mut b = Self { lo: first, hi: first };
        for p in points {
            for a in 0..3 {
                b.lo[a] = b.lo[a].min(p[a]);
                b.hi[a] = b.hi[a].max(p[a]);
            }
        }
        Some(b)
    }
}

/// A surface F(x) = 0 at fixed parameters, as the particles see it. F < 0 inside.
///
/// Points are always stored as `[f64; 3]`; where `axes()` is 2 the third coordinate is 0 and so is the third
/// component of every gradient.
pub trait Surface: Send + Sync {
    /// Number of coordinates that F depends on: 3 for surfaces in space, 2 for curves in the plane.
    fn axes(&self) -> usize {
        3
    }

    /// Whether it may be asked on any thread, not on that of the caller alone: so unless a function of the user's is called, which may
    /// rely on its thread.
    fn any_thread(&self) -> bool {
        false
    }

    /// F and ∂F/∂x at each point. Values that are not finite are passed on as they are.
    fn value_gradient(
        &self,
        points: &[[f64; 3]],
        value: &mut [f64],
        gradient: &mut [[f64; 3]],
    ) -> Result<(), FieldError>;

    /// The second derivatives at each point, in the order xx, xy, xz, yy, yz, zz.
    fn hessian(&self, points: &[[f64; 3]], hessian: &mut [[f64; 6]]) -> Result<(), FieldError>;

    /// A faster equivalent of `self` for points that stay within `margin` of where `points` are now (points
    /// beyond that are still evaluated correctly, only slower). `points` should be in a spatially coherent
    /// order, and later calls should pass the same points in the same order. `None`: use `self`.
    fn narrowed<'a>(
        &'a self,
        _points: &[[f64; 3]],
        _margin: f64,
    ) -> Result<Option<Box<dyn Surface + 'a>>, FieldError> {
        Ok(None)
    }

    /// A faster surface, where there is one, for points that are only on their way: its zeros lie within about `error`
    /// (a length) of those of `self`. `None`: use `self`.
    fn sketch<'a>(&'a self, _error: f64) -> Option<Box<dyn Surface + 'a>> {
        None
    }

    /// Boxes of side `side` or less which together contain every zero of F in `bounds`, found by interval
    /// subdivision; at most about `most` of them (the side grows until they fit). `None` where the surface
    /// has no intervals. The boxes come in a spatially coherent order, and `owner` evaluates in any of them fast.
    fn cells(&self, _bounds: &Aabb, _side: f64, _most: usize) -> Option<Cells<'_>> {
        None
    }

    /// The minima, maxima and other switches of F, along which the surface may have edges. `None` where they are not
    /// known.
    fn switches(&self) -> Option<Switches<'_>> {
        None
    }
}

/// A surface whose shape follows from a vector q of free parameters: F(x, q) = 0.
pub trait Parametric: Surface {
    /// Number of free parameters, the length of q.
    fn freedom(&self) -> usize;

    /// The vector q.
    fn q(&self) -> Vec<f64>;

    /// Takes on another q. Every number must be finite and within its limits.
    fn set_q(&mut self, q: &[f64]) -> Result<(), FieldError>;

    /// Smallest and largest value of each free parameter; infinite where there is none.
    fn limits(&self) -> Vec<(f64, f64)>;

    /// A typical change of each free parameter, above 0.
    fn scales(&self) -> Vec<f64>;

    /// F, ∂F/∂x and all of ∂F/∂q at each point: row-major, one row of [`Parametric::freedom`] numbers a point.
    fn parameter_gradient(
        &self,
        points: &[[f64; 3]],
        value: &mut [f64],
        gradient: &mut [[f64; 3]],
        q_gradient: &mut [f64],
    ) -> Result<(), FieldError>;

    /// The same with only those entries of ∂F/∂q that may be other than nothing: where a model is local, those of the few
    /// parameters that occur near a point. What is left out is 0, or belongs to exponentials that all together move the surface
    /// by no more than 1e-13 of its size; the other entries are those of [`Parametric::parameter_gradient`], but for the order of
    /// sums.
    fn sparse_parameter_gradient(
        &self,
        points: &[[f64; 3]],
        value: &mut [f64],
        gradient: &mut [[f64; 3]],
    ) -> Result<SparseRows, FieldError> {
        let m = self.freedom();
        let mut q = vec![0.0; points.len() * m];
        self.parameter_gradient(points, value, gradient, &mut q)?;
        Ok(SparseRows::all(m, points.len(), q))
    }
}

/// The result of an interval search: see [`Surface::cells`].
pub struct Cells<'a> {
    /// The boxes that may contain zeros.
    pub boxes: Vec<Aabb>,
    /// Largest side of a box.
    pub side: f64,
    /// Evaluates points that lie in the boxes (given in the order of the boxes) with pruned tapes.
    pub evaluate: Box<dyn Surface + 'a>,
}
