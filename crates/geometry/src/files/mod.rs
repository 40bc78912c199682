//! Point clouds and meshes to files, chosen by the file's ending and written atomically.

mod atomic;
mod mesh;
mod npz;
mod ply;
mod text;

use std::io::{self, Write};
use std::path::Path;

pub use atomic::write_atomically;
pub use mesh::{MeshFormat, save_mesh};

use crate::{GeometryError, PointCloud};

/// The file formats that a [`PointCloud`] can be written in.
///
/// | format | holds |
/// |---|---|
/// | PLY | binary, little endian; `double` x y z, nx ny nz, radius, area, k1, k2; `uchar` red green blue |
/// | OBJ | text; `v` and, in the same order, `vn` |
/// | CSV | text; a header of the PLY names, then a row a point, every number exact to the last bit |
/// | NPZ | NumPy arrays of float64: points, normals, radii, areas, curvatures, colors |
///
/// Columns that the cloud lacks are left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FileFormat {
    /// Stanford polygon format, binary, double precision.
    Ply,
    /// Wavefront object: vertices and vertex normals.
    Obj,
    /// Comma-separated values with a header.
    Csv,
    /// Zip of NumPy arrays, for `numpy.load`.
    Npz,
}

impl FileFormat {
    /// The endings that [`from_path`](Self::from_path) knows, without the dot, in lower case.
    pub const ENDINGS: &[&str] = &["ply", "obj", "csv", "npz"];

    /// The format that a path's ending names; upper and lower case are alike.
    ///
    /// # Errors
    /// [`GeometryError::UnknownFormat`], which lists the known endings.
    pub fn from_path(path: &Path) -> Result<Self, GeometryError> {
        let ending = ending_of(path);
        match ending.as_str() {
            "ply" => Ok(Self::Ply),
            "obj" => Ok(Self::Obj),
            "csv" => Ok(Self::Csv),
            "npz" => Ok(Self::Npz),
            _ => Err(GeometryError::UnknownFormat {
                path: path.to_owned(),
                ending,
                known: ".ply, .obj, .csv, .npz",
            }),
        }
    }

    /// Writes the cloud, which must have passed [`PointCloud::check`], to any writer.
    ///
    /// # Errors
    /// Whatever the writer reports.
    pub fn write(self, cloud: &PointCloud<'_>, out: &mut dyn Write) -> io::Result<()> {
        match self {
            Self::Ply => ply::write(cloud, None, out),
            Self::Obj => text::write_obj(cloud, None, out),
            Self::Csv => text::write_csv(cloud, out),
            Self::Npz => npz::write(cloud, None, out),
        }
    }
}

/// Saves the cloud at `path`, in the [format](FileFormat) that the path's ending names. An existing file is replaced in
/// one step, and only once the new one is safely on the disk.
///
/// # Errors
/// [`GeometryError::UnknownFormat`] for any other ending; what [`PointCloud::check`] says (numbers that are not finite
/// are refused, except curvatures); [`GeometryError::Io`] if the disk is full or the folder is missing or closed, in
/// which case an earlier file is unchanged.
pub fn save(path: impl AsRef<Path>, cloud: &PointCloud<'_>) -> Result<(), GeometryError> {
    let format = FileFormat::from_path(path.as_ref())?;
    cloud.check()?;
    write_atomically(path.as_ref(), |out| format.write(cloud, out))
}

/// A path's ending without the dot, in lower case; empty if it has none.
fn ending_of(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// The numeric columns of a cloud in the order of the PLY properties, with their names: what PLY and CSV share.
struct Columns<'a> {
    cloud: PointCloud<'a>,
}

impl Columns<'_> {
    fn names(&self) -> Vec<&'static str> {
        let mut names = vec!["x", "y", "z"];
        let c = &self.cloud;
        for (present, more) in [
            (c.normals.is_some(), &["nx", "ny", "nz"][..]),
            (c.radii.is_some(), &["radius"]),
            (c.areas.is_some(), &["area"]),
            (c.curvatures.is_some(), &["k1", "k2"]),
        ] {
            if present {
                names.extend(more);
            }
        }
        names
    }

    /// Fills `row` with the numbers of point `i`, in the order of `names`.
    fn row(&self, i: usize, row: &mut Vec<f64>) {
        let c = &self.cloud;
        row.clear();
        row.extend(c.points[i]);
        row.extend(c.normals.iter().flat_map(|v| v[i]));
        row.extend(c.radii.iter().map(|v| v[i]));
        row.extend(c.areas.iter().map(|v| v[i]));
        row.extend(c.curvatures.iter().flat_map(|v| v[i]));
    }
}
