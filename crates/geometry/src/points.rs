//! Borrowed columns: the only input this crate knows.

use crate::GeometryError;

/// Points with whatever is known about each, as borrowed columns. Only `points` is needed; every other column that is
/// there has the same number of rows.
///
/// Columns are public for struct-update syntax; [`check`](Self::check) is called by everything that takes a cloud.
#[derive(Clone, Copy, Debug, Default)]
pub struct PointCloud<'a> {
    /// Positions, shape (n, 3), model units, finite.
    pub points: &'a [[f64; 3]],
    /// Directions that point out of the solid, shape (n, 3), finite. Any length; a zero vector means "unknown".
    pub normals: Option<&'a [[f64; 3]]>,
    /// Radius of the disc that stands for each point, shape (n,), model units, finite, not negative. About 0.58 times
    /// the distance to the nearest neighbour makes discs overlap slightly (the repulsion radius of a floater).
    pub radii: Option<&'a [f64]>,
    /// Area that each point stands for, shape (n,), squared model units, finite, not negative.
    pub areas: Option<&'a [f64]>,
    /// Principal curvatures k1, k2, shape (n, 2), 1 / model units. NaN or infinite where the surface has none (a crease,
    /// an apex): files keep such values, pictures draw them as flat.
    pub curvatures: Option<&'a [[f64; 2]]>,
    /// sRGB colours, shape (n, 3), each in 0..=1. Pictures and PLY files use them.
    pub colors: Option<&'a [[f64; 3]]>,
}

impl<'a> PointCloud<'a> {
    /// A cloud of bare points, shape (n, 3).
    pub fn new(points: &'a [[f64; 3]]) -> Self {
        Self { points, ..Self::default() }
    }

    /// The same cloud with normals, shape (n, 3).
    pub fn with_normals(self, normals: &'a [[f64; 3]]) -> Self {
        Self { normals: Some(normals), ..self }
    }

    /// The same cloud with disc radii, shape (n,).
    pub fn with_radii(self, radii: &'a [f64]) -> Self {
        Self { radii: Some(radii), ..self }
    }

    /// The same cloud with areas, shape (n,).
    pub fn with_areas(self, areas: &'a [f64]) -> Self {
        Self { areas: Some(areas), ..self }
    }

    /// The same cloud with principal curvatures, shape (n, 2).
    pub fn with_curvatures(self, curvatures: &'a [[f64; 2]]) -> Self {
        Self { curvatures: Some(curvatures), ..self }
    }

    /// The same cloud with sRGB colours in 0..=1, shape (n, 3).
    pub fn with_colors(self, colors: &'a [[f64; 3]]) -> Self {
        Self { colors: Some(colors), ..self }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Lowest and highest corner of the points (radii left out), or nothing if there is no point.
    pub fn bounds(&self) -> Option<([f64; 3], [f64; 3])> {
        let first = *self.points.first()?;
        Some(self.points.iter().fold((first, first), |(lo, hi), p| {
            (std::array::from_fn(|k| lo[k].min(p[k])), std::array::from_fn(|k| hi[k].max(p[k])))
        }))
    }

    /// Checks that all columns are equally long and hold numbers that make sense, as their documentation says.
    ///
    /// # Errors
    /// [`GeometryError::ColumnLength`], [`GeometryError::NotFinite`], [`GeometryError::OutOfRange`], each naming the
    /// column and the first offending row.
    pub fn check(&self) -> Result<(), GeometryError> {
        let n = self.len();
        let same = |column, given: Option<usize>| match given {
            Some(given) if given != n => Err(GeometryError::ColumnLength { column, expected: n, given }),
            _ => Ok(()),
        };
        same("normals", self.normals.map(<[_]>::len))?;
        same("radii", self.radii.map(<[_]>::len))?;
        same("areas", self.areas.map(<[_]>::len))?;
        same("curvatures", self.curvatures.map(<[_]>::len))?;
        same("colors", self.colors.map(<[_]>::len))?;
        finite("points", self.points.as_flattened(), 3)?;
        finite("normals", self.normals.unwrap_or_default().as_flattened(), 3)?;
        for (column, values) in [("radii", self.radii), ("areas", self.areas)] {
            let values = values.unwrap_or_default();
            finite(column, values, 1)?;
            inside(column, values, 1, f64::MAX, "numbers that are not negative")?;
        }
        let colors = self.colors.unwrap_or_default().as_flattened();
        finite("colors", colors, 3)?;
        inside("colors", colors, 3, 1.0, "sRGB values from 0 to 1 (divide 8-bit colours by 255)")
    }
}

fn finite(column: &'static str, values: &[f64], width: usize) -> Result<(), GeometryError> {
    match values.iter().position(|v| !v.is_finite()) {
        Some(at) => Err(GeometryError::NotFinite { column, row: at / width, value: values[at] }),
        None => Ok(()),
    }
}

fn inside(
    column: &'static str,
    values: &[f64],
    width: usize,
    high: f64,
    expected: &'static str,
) -> Result<(), GeometryError> {
    match values.iter().position(|v| !(0.0..=high).contains(v)) {
        Some(at) => Err(GeometryError::OutOfRange { column, row: at / width, value: values[at], expected }),
        None => Ok(()),
    }
}
