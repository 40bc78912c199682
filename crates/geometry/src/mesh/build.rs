//! Meshes of surfaces.

use isoswarm_field::vector::{V3, cross, dot, sub};
use isoswarm_field::{Aabb, Surface};
use isoswarm_particles as particles;
use isoswarm_particles::{Amount, Density, Options, ProgressFn, Samples, Status};

use super::connect::Triangles;
use super::report::MeshReport;
use super::smooth::smooth;
use super::stitch::stitch;
use super::{Mesh, Topology};

/// How fine a mesh is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Resolution {
    /// About so many vertices: repairs insert and remove some.
    Count(usize),
    /// Mean distance between neighbours, model units.
    Spacing(f64),
}

/// What [`mesh`] is asked for.
pub struct MeshOptions<'a> {
    /// How fine. Default: 10,000 vertices.
    pub resolution: Resolution,
    /// Where triangles are smaller. Default: uniform.
    pub density: Density<'a>,
    /// Rounds of smoothing, 0 to leave the vertices where the samples are. Default: 10.
    pub smoothing: usize,
    /// Seed of every random choice. Default: 0.
    pub seed: u64,
    /// Most vertices that are accepted. Default: 20 million.
    pub most: usize,
    /// Progress and cancellation of the sampling.
    pub progress: Option<&'a mut ProgressFn<'a>>,
}

impl Default for MeshOptions<'_> {
    fn default() -> Self {
        Self {
            resolution: Resolution::Count(10_000),
            density: Density::Uniform,
            smoothing: SMOOTHING,
            seed: 0,
            most: 20_000_000,
            progress: None,
        }
    }
}

/// Default rounds of smoothing.
pub(super) const SMOOTHING: usize = 10;

/// A mesh and the account of how it was made.
#[derive(Clone, Debug, PartialEq)]
pub struct Meshed {
    /// The triangles.
    pub mesh: Mesh,
    /// What is known of them.
    pub report: MeshReport,
}

/// Meshes the part of F = 0 in `bounds`: samples it evenly and joins the samples by triangles.
///
/// # Errors
/// Those of [`isoswarm_particles::sample`].
pub fn mesh(
    surface: &dyn Surface,
    bounds: &Aabb,
    options: MeshOptions<'_>,
) -> Result<Meshed, particles::Error> {
    let MeshOptions { resolution, density, smoothing, seed, most, progress } = options;
    let amount = match resolution {
        Resolution::Count(n) => Amount::Count(n),
        Resolution::Spacing(s) => Amount::Spacing(s),
    };
    let samples = particles::sample(
        surface,
        bounds,
        Options { amount, density, seed, most, progress, ..Options::default() },
    )?;
    mesh_samples(surface, bounds, &samples, smoothing)
}

/// Meshes samples of the part of F = 0 in `bounds`, and smooths the mesh in so many rounds (0: the vertices are the samples).
///
/// # Errors
/// What the field reports.
pub fn mesh_samples(
    surface: &dyn Surface,
    bounds: &Aabb,
    samples: &Samples,
    smoothing: usize,
) -> Result<Meshed, particles::Error> {
    let mut points = samples.points.clone();
    let mut normals = samples.normals.clone();
    let spacing: Vec<f64> = samples.radii.iter().map(|r| 2.0 * r).collect();
    let mean = spacing.iter().sum::<f64>() / spacing.len().max(1) as f64;
    let even = spacing.iter().all(|s| (s / mean - 1.0).abs() < 0.5);
    let stitched =
        stitch(&points, &normals, bounds, if even { std::slice::from_ref(&mean) } else { &spacing });
    let mut report = MeshReport { filled: stitched.filled, ..MeshReport::default() };
    let mut triangles = Triangles::new(stitched.faces);
    let fixed: Vec<bool> = points.iter().map(|p| on_face(*p, bounds, mean)).collect();
    let boundary = |t: &Triangles| {
        let mut edge = vec![false; fixed.len()];
        for (f, a) in t.across.iter().enumerate() {
            for k in 0..3 {
                if a[k] == super::connect::NONE {
                    edge[t.faces[f][k] as usize] = true;
                    edge[t.faces[f][(k + 1) % 3] as usize] = true;
                }
            }
        }
        edge
    };
    let held: Vec<bool> = fixed.iter().zip(boundary(&triangles)).map(|(a, b)| *a || b).collect();
    report.flips = triangles.delaunay(&points, |_, _| false);
    for _ in 0..smoothing {
        let moved = smooth(surface, &triangles, &mut points, &mut normals, &held)?;
        report.flips += triangles.delaunay(&points, |_, _| false);
        if moved < 1e-3 {
            break;
        }
    }
    let mesh = Mesh { points, normals, faces: triangles.faces, ..Mesh::default() };
    let topology = mesh.topology();
    report.describe(&mesh, &topology, samples, &stitched.holes, &stitched.left_out);
    Ok(Meshed { mesh, report })
}

/// Whether a point lies on a face of the bounds, but for rounding.
pub(super) fn on_face(p: V3, bounds: &Aabb, spacing: f64) -> bool {
    (0..3).any(|a| {
        (p[a] - bounds.lo[a]).abs() <= 1e-4 * spacing || (bounds.hi[a] - p[a]).abs() <= 1e-4 * spacing
    })
}
