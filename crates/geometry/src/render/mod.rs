//! Where rays meet the surface F = 0: a walk through the rays' space by boxes, with intervals and pruned tapes.
//!
//! Rays come in square tiles of [`SIDE`] × [`SIDE`] that point in about the same direction, such as the pixels of a picture. Tile and depth
//! are cut again and again into cells, nearest first; a cell where the range of F excludes zero is left behind, in the others
//! the tape is pruned. In a small cell where the derivative along all its rays has one sign each ray has one root at most, between
//! ends of different sign, and Newton's method inside the bracket finds it. Where that is open each ray is cut by itself until
//! it is known (`isolate`). So no crossing is missed between samples: there are no samples.

mod bundle;
mod clip;
mod isolate;
mod refine;
mod view;
mod walk;

use std::sync::atomic::{AtomicBool, Ordering};

use isoswarm_field::{Field, Pieces};

use crate::GeometryError;
pub use bundle::{Ray, SIDE};
pub use clip::{Clip, Plane};
pub use view::{Pose, View};

/// Where a ray meets the surface, or the cut through the solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Number of the ray in its tile.
    pub ray: u16,
    /// The point is origin + t · direction.
    pub t: f64,
    /// ∂F/∂x there, not scaled; on a cut the plane's normal.
    pub gradient: [f64; 3],
    /// The face of the clip region on which the solid is cut, if it is not the surface itself.
    pub cut: Option<u16>,
}

/// What a cast looks for.
#[derive(Clone, Copy, Debug)]
pub struct CastOptions {
    /// Crossings of each ray that are wanted, from the first on, 1 to 65535.
    pub layers: u16,
    /// Whether a ray that enters the clip region inside the solid meets a cut there.
    pub capped: bool,
}

impl Default for CastOptions {
    fn default() -> Self {
        Self { layers: 1, capped: true }
    }
}

/// Casts rays at the surface of one field.
pub struct Caster<'a> {
    pieces: Pieces<'a>,
}

impl<'a> Caster<'a> {
    /// A caster for a field of one equation in space without opaque functions.
    ///
    /// # Errors
    /// [`GeometryError::Option`] for other fields.
    pub fn new(field: &'a Field) -> Result<Self, GeometryError> {
        let pieces = field.pieces().ok_or_else(|| GeometryError::Option {
            name: "field",
            expected: "one equation of x, y and z without opaque functions",
            given: format!("{} equations of {} coordinates", field.components(), field.axes()),
        })?;
        Ok(Self { pieces })
    }

    /// The crossings of a tile's rays, ray by ray, nearest first. A ray whose `near` is not below its `far` is left out.
    ///
    /// # Errors
    /// [`GeometryError::Option`] for another number of rays than [`SIDE`]², [`GeometryError::Cancelled`] soon after `stop` became true.
    pub fn tile(
        &self,
        rays: &[Ray],
        options: &CastOptions,
        stop: &AtomicBool,
    ) -> Result<Vec<Hit>, GeometryError> {
        if rays.len() != SIDE * SIDE {
            let (name, expected) = ("rays", "64 rows of 64 rays");
            return Err(GeometryError::Option { name, expected, given: rays.len().to_string() });
        }
        let hits = walk::Walk::new(&self.pieces, bundle::Bundle::new(rays), options, stop).run();
        if stop.load(Ordering::Relaxed) { Err(GeometryError::Cancelled) } else { Ok(hits) }
    }
}
