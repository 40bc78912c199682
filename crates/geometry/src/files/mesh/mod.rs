//! Meshes to files: PLY, OBJ, STL, GLB, 3MF, VTP, NPZ.

mod glb;
mod stl;
mod threemf;
mod vtp;

use std::borrow::Cow;
use std::io::{self, Write};
use std::path::Path;

use super::{ending_of, npz, ply, text, write_atomically};
use crate::{GeometryError, Mesh, PointCloud};

/// The file formats that a [`Mesh`] can be written in.
///
/// | format | holds |
/// |---|---|
/// | PLY | binary, little endian; `double` x y z, nx ny nz, k1, k2; triangles |
/// | OBJ | text; `v`, `vn` in the same order, `f` |
/// | STL | binary, single precision; triangles only, each with its normal |
/// | GLB | binary glTF 2.0, single precision about the mesh's middle, metres, Y up; POSITION, NORMAL and, where all of them are finite, `_CURVATURE` |
/// | 3MF | millimetres; triangles as an object of type `model` if they are closed, of type `surface` if not |
/// | VTP | VTK's XML PolyData with appended binary data; Normals, Curvatures, Ids |
/// | NPZ | NumPy arrays: points, faces (int64), normals, curvatures, ids, corner_normals (f · 3, 3) |
///
/// Columns that the mesh lacks are left out. Coordinates are written as they are, but for GLB: its axes are x, z, -y.
///
/// Viewers shade a crease sharply where its vertices have a normal on each side ([`Mesh::corner_normals`]). OBJ has these besides its
/// vertices, STL has a normal a triangle, 3MF none, NPZ has them as `corner_normals`; PLY, GLB and VTP have one normal a vertex, so that a
/// sharp file has the vertices of creases once a side ([`Mesh::sharp`]) and is open there for programs that go by the numbers of
/// vertices. GLB, VTP and OBJ are sharp unless something else is said, PLY is not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MeshFormat {
    /// Stanford polygon format, binary, double precision.
    Ply,
    /// Wavefront object.
    Obj,
    /// Stereolithography, binary.
    Stl,
    /// Binary glTF 2.0.
    Glb,
    /// 3D Manufacturing Format, core specification 1.
    ThreeMf,
    /// VTK XML PolyData.
    Vtp,
    /// Zip of NumPy arrays.
    Npz,
}

impl MeshFormat {
    /// The endings that [`from_path`](Self::from_path) knows, without the dot, in lower case.
    pub const ENDINGS: &[&str] = &["ply", "obj", "stl", "glb", "3mf", "vtp", "npz"];

    /// The format that a path's ending names; upper and lower case are alike.
    ///
    /// # Errors
    /// [`GeometryError::UnknownFormat`], which lists the known endings.
    pub fn from_path(path: &Path) -> Result<Self, GeometryError> {
        let ending = ending_of(path);
        match ending.as_str() {
            "ply" => Ok(Self::Ply),
            "obj" => Ok(Self::Obj),
            "stl" => Ok(Self::Stl),
            "glb" => Ok(Self::Glb),
            "3mf" => Ok(Self::ThreeMf),
            "vtp" => Ok(Self::Vtp),
            "npz" => Ok(Self::Npz),
            _ => Err(GeometryError::UnknownFormat {
                path: path.to_owned(),
                ending,
                known: ".ply, .obj, .stl, .glb, .3mf, .vtp, .npz",
            }),
        }
    }

    /// Whether creases are sharp in a file unless something else is said.
    fn is_sharp(self) -> bool {
        matches!(self, Self::Obj | Self::Glb | Self::Vtp)
    }

    /// Writes the mesh, which must have passed [`Mesh::check`], to any writer. `sharp`: whether creases are, if not as is usual for the
    /// format.
    ///
    /// # Errors
    /// Whatever the writer reports.
    pub fn write(self, mesh: &Mesh, sharp: Option<bool>, out: &mut dyn Write) -> io::Result<()> {
        let split = if sharp.unwrap_or(self.is_sharp()) { mesh.sharp() } else { Cow::Borrowed(mesh) };
        match self {
            Self::Ply => ply::write(&split.cloud(), Some(&split.faces), out),
            Self::Obj => {
                let normals = Some(&split.normals[..]).filter(|n| !n.is_empty());
                let cloud = PointCloud { normals, ..mesh.cloud() };
                text::write_obj(&cloud, Some((&mesh.faces, &split.faces)), out)
            }
            Self::Stl => stl::write(mesh, out),
            Self::Glb => glb::write(&split, out),
            Self::ThreeMf => threemf::write(mesh, out),
            Self::Vtp => vtp::write(&split, out),
            Self::Npz => npz::write(&mesh.cloud(), Some(mesh), out),
        }
    }
}

/// Saves the mesh at `path`, in the [format](MeshFormat) that the path's ending names. An existing file is replaced in one
/// step, and only once the new one is safely on the disk. `sharp`: see [`MeshFormat::write`].
///
/// # Errors
/// [`GeometryError::UnknownFormat`] for any other ending; what [`Mesh::check`] says; [`GeometryError::Io`] if the disk is
/// full or the folder is missing or closed, in which case an earlier file is unchanged.
pub fn save_mesh(path: impl AsRef<Path>, mesh: &Mesh, sharp: Option<bool>) -> Result<(), GeometryError> {
    let format = MeshFormat::from_path(path.as_ref())?;
    mesh.check()?;
    write_atomically(path.as_ref(), |out| format.write(mesh, sharp, out))
}
