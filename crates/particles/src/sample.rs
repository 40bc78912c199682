//! The main job: even samples of a surface.

use isoswarm_field::{Aabb, Surface};

use crate::{Error, Options, Samples};

/// Samples the part of the surface that lies in `bounds`.
pub fn sample(_surface: &dyn Surface, bounds: &Aabb, _options: Options<'_>) -> Result<Samples, Error> {
    Err(Error::Bounds { given: format!("{bounds:?}") })
}
