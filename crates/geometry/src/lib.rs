//! isoswarm-geometry: what comes off a swarm: triangles, measures, pictures, files.
//!
//! Points are taken as a [`PointCloud`], a bundle of borrowed columns; triangles as a [`Mesh`].
//!
//! ```
//! use isoswarm_geometry::{PictureOptions, PointCloud, Style, render};
//!
//! let points = [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]];
//! let radii = [0.4; 3];
//! let cloud = PointCloud::new(&points).with_normals(&points).with_radii(&radii);
//!
//! let picture = render(&cloud, &PictureOptions { width: 64, height: 48, style: Style::Discs, ..Default::default() })?;
//! assert_eq!(picture.rgba.len(), 64 * 48 * 4);
//! # Ok::<(), isoswarm_geometry::GeometryError>(())
//! ```
//!
//! [`save`] writes PLY, OBJ, CSV or NPZ, chosen by the file's ending, and never leaves half a file behind.

mod certify;
mod error;
mod files;
mod measure;
mod mesh;
mod picture;
mod points;
pub mod render;

pub use certify::{Certificate, CertifyOptions, Component, certify};
pub use error::GeometryError;
pub use files::{FileFormat, MeshFormat, save, save_mesh, write_atomically};
pub use measure::{Estimate, Integrand, MeasureOptions, Measures, Moment, measure};
pub use mesh::{
    FaceQuality, Fault, LiveMesh, LiveUpdate, Mesh, MeshOptions, MeshReport, Meshed, Quality, Resolution,
    Rule, Topology, mesh, mesh_patch, mesh_samples,
};
pub use picture::{
    Background, Coloring, Colormap, Drawn, MeshLook, MeshStyle, Picture, PictureOptions, Projection, Section,
    Solid, Style, Subject, animate, colors, draw, draw_told, render, render_framed, render_until,
};
pub use points::PointCloud;
