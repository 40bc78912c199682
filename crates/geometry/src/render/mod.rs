//! Where rays meet the surface F = 0: a walk through the rays' space by boxes, with intervals and pruned tapes.
//!
//! Rays come in square tiles of [`SIDE`] × [`SIDE`] that point in about the same direction, such as the pixels of a picture. Tile and depth
//! are cut again and again into cells, nearest first; a cell where the range of F excludes zero is left behind, in the others
//! the tape is pruned. In a small cell where the derivative along all its rays has one sign each ray has one root at most, between
//! ends of different sign, and Newton's method inside the bracket finds it. Where that is open the cell is cut further, down to parts of
//! single rays. So no crossing is missed between samples: there are no samples.

mod bundle;
mod clip;
mod march;
mod refine;
mod search;
mod view;
mod walk;

use std::sync::atomic::{AtomicBool, Ordering};

use isoswarm_field::{Aabb, Field, Pieces};
use rayon::prelude::*;

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
    /// Whether a ray that enters the box of the clip region inside the solid meets a cut there.
    pub cap_box: bool,
    /// The same for its planes.
    pub cap_planes: bool,
    /// Whether rays meet the planes outside the solid too: a slice through the field.
    pub slices: bool,
}

impl Default for CastOptions {
    fn default() -> Self {
        Self { layers: 1, cap_box: true, cap_planes: true, slices: false }
    }
}

impl CastOptions {
    /// Whether a ray that enters by this face, inside the solid or not, meets something there.
    fn cuts(&self, face: u16, inside: bool) -> bool {
        if face < Clip::BOX_FACES {
            inside && self.cap_box
        } else {
            (inside && self.cap_planes) || self.slices
        }
    }
}

/// Casts rays at the surface of one field.
pub struct Caster<'a> {
    field: &'a Field,
    /// Nothing for opaque functions.
    pieces: Option<Pieces<'a>>,
    /// A bound on |∇F| that is guessed from samples, for opaque functions.
    slope: f64,
}

impl<'a> Caster<'a> {
    /// A caster for a field of one equation in space, looked at in a box. Where parts of it are opaque functions there are no
    /// intervals: rays march by F over a slope that is guessed from samples in the box, and may step over thin parts.
    ///
    /// # Errors
    /// [`GeometryError::Option`] for other fields; what an opaque function raises.
    pub fn new(field: &'a Field, bounds: &Aabb) -> Result<Self, GeometryError> {
        if field.components() != 1 || field.axes() != 3 {
            return Err(GeometryError::Option {
                name: "field",
                expected: "one equation of x, y and z",
                given: format!("{} equations of {} coordinates", field.components(), field.axes()),
            });
        }
        let pieces = field.pieces();
        let slope = if pieces.is_some() { 0.0 } else { march::slope(field, bounds)? };
        Ok(Self { field, pieces, slope })
    }

    /// Whether intervals prove that no crossing is missed.
    pub fn is_certified(&self) -> bool {
        self.pieces.is_some()
    }

    /// The crossings of tiles of rays, tile by tile in order, each ray by ray, nearest first. A ray whose `near` is not below its
    /// `far` is left out. `tile` makes the rays of a tile; it has [`SIDE`]² of them, or none.
    ///
    /// # Errors
    /// [`GeometryError::Option`] for another number of rays, [`GeometryError::Cancelled`] soon after `stop` became true; what an opaque
    /// function raises.
    pub fn tiles(
        &self,
        count: usize,
        tile: impl Fn(usize) -> Vec<Ray> + Sync,
        options: &CastOptions,
        stop: &AtomicBool,
    ) -> Result<Vec<Vec<Hit>>, GeometryError> {
        if self.pieces.is_some() {
            return (0..count).into_par_iter().map(|k| self.tile(&tile(k), options, stop)).collect();
        }
        // One call for many tiles: an opaque function is called for all points at once, on this thread.
        let mut hits = Vec::with_capacity(count);
        for first in (0..count).step_by(MARCHED) {
            let tiles: Vec<Vec<Ray>> = (first..(first + MARCHED).min(count)).map(&tile).collect();
            hits.extend(march::march(self.field, self.slope, &tiles, options, stop)?);
        }
        Ok(hits)
    }

    /// The crossings of one tile's rays: see [`Caster::tiles`].
    ///
    /// # Errors
    /// Those of [`Caster::tiles`].
    pub fn tile(
        &self,
        rays: &[Ray],
        options: &CastOptions,
        stop: &AtomicBool,
    ) -> Result<Vec<Hit>, GeometryError> {
        if rays.is_empty() {
            return Ok(Vec::new());
        }
        if rays.len() != SIDE * SIDE {
            let (name, expected) = ("rays", "64 rows of 64 rays");
            return Err(GeometryError::Option { name, expected, given: rays.len().to_string() });
        }
        let Some(pieces) = &self.pieces else {
            let hits = march::march(self.field, self.slope, &[rays.to_vec()], options, stop)?;
            return Ok(hits.into_iter().flatten().collect());
        };
        let hits = walk::Walk::new(pieces, bundle::Bundle::new(rays), options, stop).run();
        if stop.load(Ordering::Relaxed) { Err(GeometryError::Cancelled) } else { Ok(hits) }
    }
}

/// Tiles that march together.
const MARCHED: usize = 64;
