//! Meshes of surfaces: samples, stitched, repaired, smoothed, checked.

use std::ops::ControlFlow;

use isoswarm_field::vector::V3;
use isoswarm_field::{Aabb, FieldError, Surface};
use isoswarm_particles as particles;
use isoswarm_particles::creases::Creases;
use isoswarm_particles::{Density, Progress, ProgressFn, Samples};

use super::connect::{NONE, Triangles};
use super::crease::Segments;
use super::repair::{open_places, stitch_whole};
use super::report::MeshReport;
use super::vertices::{Vertices, pull};
use super::{
    Mesh, bend, border, circumsphere, coarse, corners, crease, error, pieces, sizes, smooth, valence,
};

/// How fine a mesh is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Resolution {
    /// About so many vertices: corners of the bounds, repairs and the mending of valences add some and take some.
    Count(usize),
    /// Mean distance between neighbours, model units.
    Spacing(f64),
    /// Largest distance between triangles and surface, model units. Triangles are as large as curvature allows; the distance
    /// is measured at their centres and at the middles of their edges, and they are refined where it is larger.
    Error(f64),
}

/// Which triangles are taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rule {
    /// The Delaunay stars of the vertices in their tangent planes, stitched, repaired and smoothed. The default.
    #[default]
    Delaunay,
    /// Three neighbours whose smallest circumscribed sphere is empty (Szeliski and Tonnesen 1992), as they are: to compare. Nothing is
    /// repaired or smoothed.
    Circumsphere,
}

/// What [`mesh`] is asked for.
pub struct MeshOptions<'a> {
    /// How fine. Default: 10,000 vertices.
    pub resolution: Resolution,
    /// Which triangles. Default: Delaunay.
    pub rule: Rule,
    /// Where triangles are smaller; not with [`Resolution::Error`]. Default: uniform, but where the surface bends within
    /// less than the spacing.
    pub density: Density<'a>,
    /// Whether vertices are placed on the surface's edges and corners, so that no triangle crosses them. Where these would be more than half
    /// of the vertices asked for, there are more of them, and a warning says so. Default: yes.
    pub creases: bool,
    /// Most rounds of smoothing, 0 to leave the vertices where the samples are. Default: 16.
    pub smoothing: usize,
    /// Whether to look for triangles that pass through each other. Default: yes.
    pub intersections: bool,
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
            rule: Rule::default(),
            density: Density::Uniform,
            creases: true,
            smoothing: SMOOTHING,
            intersections: true,
            seed: 0,
            most: 20_000_000,
            progress: None,
        }
    }
}

/// Default rounds of smoothing.
const SMOOTHING: usize = 16;
/// Rounds after which valences are mended.
const MENDING: [usize; 2] = [4, 9];
/// Root mean square move, in lengths of edges, that ends the smoothing.
const SMOOTH: f64 = 2e-3;
/// How far vertices may move while one narrowed field serves them, in spacings.
const MARGIN: f64 = 0.5;

/// A mesh and the account of how it was made.
#[derive(Clone, Debug, PartialEq)]
pub struct Meshed {
    /// The triangles, with normals and curvatures at the vertices; `ids` number the vertices.
    pub mesh: Mesh,
    /// What is known of them.
    pub report: MeshReport,
}

/// Meshes the part of F = 0 in `bounds`: samples it evenly and joins the samples by triangles. Closed surfaces that the
/// samples resolve give closed manifolds, clipped ones have their boundary on the faces of the bounds. The report says
/// what was reached and where it was not.
///
/// # Errors
/// Those of [`isoswarm_particles::sample`]; a resolution that is not above 0; a surface in the plane.
pub fn mesh(
    surface: &dyn Surface,
    bounds: &Aabb,
    options: MeshOptions<'_>,
) -> Result<Meshed, particles::Error> {
    let MeshOptions { resolution, rule, density, creases, smoothing, intersections, seed, most, progress } =
        options;
    in_space(surface)?;
    let (mut progress, mut furthest) = (progress, 0.0f64);
    let mut tell = |p: &Progress| {
        // Of several runs the later ones do not begin anew.
        furthest = furthest.max(p.fraction);
        match &mut progress {
            Some(f) => f(&Progress { fraction: furthest, ..*p }),
            None => ControlFlow::Continue(()),
        }
    };
    if rule == Rule::Delaunay && smoothing > 0 && matches!(density, Density::Uniform) {
        let wish = coarse::Wish { resolution, creases, smoothing, intersections, seed, most };
        if let Some(made) = coarse::mesh(surface, bounds, &wish, &mut tell)? {
            return Ok(made);
        }
    }
    let sizes::Sampled { samples, evaluations, warnings } =
        sizes::sample(surface, bounds, resolution, density, creases, (seed, most), Some(&mut tell))?;
    let settings = MeshOptions { resolution, rule, smoothing, intersections, ..MeshOptions::default() };
    let mut out = mesh_samples(surface, bounds, &samples, &settings)?;
    out.report.evaluations += evaluations;
    out.report.warnings.extend(warnings);
    Ok(out)
}

/// Meshes samples of the part of F = 0 in `bounds`. Of the options, those that do not concern sampling count; smooth in 0 rounds
/// to leave the samples where they are.
///
/// # Errors
/// What the field reports; a surface in the plane.
pub fn mesh_samples(
    surface: &dyn Surface,
    bounds: &Aabb,
    samples: &Samples,
    options: &MeshOptions<'_>,
) -> Result<Meshed, particles::Error> {
    in_space(surface)?;
    if options.rule == Rule::Circumsphere {
        let vertices = Vertices::of(samples, bounds);
        let report = MeshReport { evaluations: samples.report.evaluations, ..MeshReport::default() };
        let faces = circumsphere::triangles(&vertices.points, &vertices.normals, &vertices.reach());
        return Ok(finish(surface, samples, options.intersections, false, None, vertices, faces, report)?);
    }
    let Draft { mut triangles, mut vertices, mut held, mut report } =
        Draft::stitch(surface, bounds, samples)?;
    let mut creases = samples.creases.clone();
    let mut segments = Segments::of(creases.as_ref());
    (0..vertices.len()).for_each(|v| held[v] |= vertices.on_crease(v));
    let (flips, missing) = segments.insert(&mut triangles, &vertices);
    report.flips += flips;
    if creases.is_some() {
        bend::refine(surface, &segments, &mut triangles, &mut vertices, &mut held, &mut report)?;
    }
    improve(surface, options.smoothing, &segments, &mut triangles, &mut vertices, &mut held, &mut report)?;
    if creases.is_some() {
        bend::refine(surface, &segments, &mut triangles, &mut vertices, &mut held, &mut report)?;
    }
    if !missing.is_empty() {
        // What was in the way may have moved.
        let (flips, missing) = segments.insert(&mut triangles, &vertices);
        report.flips += flips + triangles.delaunay(&vertices.points, |a, b| segments.joins(&vertices, a, b));
        report.not_on_creases(&vertices, &missing);
    }
    if let Resolution::Error(most) = options.resolution {
        if let Some(c) = &mut creases {
            let (t, v) = (&mut triangles, &mut vertices);
            segments = crease::refine(surface, bounds, c, most, t, v, &mut held, &mut report)?;
        }
        error::refine(surface, most, &segments, &mut triangles, &mut vertices, &mut held, &mut report)?;
    }
    for v in open_places(&vertices, &triangles, &[]) {
        let p = vertices.points[v as usize];
        if !report.doubtful.contains(&p) && report.doubtful.len() < MeshReport::MOST_PLACES {
            report.doubtful.push(p);
        }
    }
    report.creases = segments.edges(&vertices);
    report.corners = crease::corners(creases.as_ref(), &vertices);
    let moved = options.smoothing > 0;
    let creases = creases.as_ref();
    Ok(finish(surface, samples, options.intersections, moved, creases, vertices, triangles.faces, report)?)
}

/// A mesh under construction.
pub(super) struct Draft {
    pub(super) triangles: Triangles,
    pub(super) vertices: Vertices,
    /// Vertices that stay where they are.
    pub(super) held: Vec<bool>,
    pub(super) report: MeshReport,
}

impl Draft {
    /// Samples joined by triangles, repaired where that left holes.
    pub(super) fn stitch(
        surface: &dyn Surface,
        bounds: &Aabb,
        samples: &Samples,
    ) -> Result<Self, FieldError> {
        let mut report = MeshReport { evaluations: samples.report.evaluations, ..MeshReport::default() };
        let mut vertices = Vertices::of(samples, bounds);
        let (came, went) = corners::place(surface, bounds, &mut vertices)?;
        let (more, fewer) = border::clear(surface, bounds, &mut vertices)?;
        let close = samples.creases.as_ref().map_or(0, |c| pieces::clear(&mut vertices, c));
        let repaired = stitch_whole(surface, bounds, &mut vertices, samples.creases.as_ref())?;
        report.inserted = came + more + repaired.inserted;
        report.removed = went + fewer + close;
        report.filled = repaired.filled;
        let mut triangles = repaired.triangles;
        let mut held = vec![false; vertices.len()];
        repaired.open.iter().for_each(|&v| held[v as usize] = true);
        report.doubtful.extend(repaired.open.iter().map(|&v| vertices.points[v as usize]));
        report.left_out(&vertices, &repaired.left_out);
        if !repaired.left_out.is_empty() {
            let mut dead = vec![false; vertices.len()];
            repaired.left_out.iter().for_each(|&v| dead[v as usize] = true);
            valence::drop_vertices(&mut triangles, &mut vertices, &mut held, &dead);
            report.removed += repaired.left_out.len();
        }
        Ok(Self { triangles, vertices, held, report })
    }
}

fn in_space(surface: &dyn Surface) -> Result<(), particles::Error> {
    if surface.axes() == 3 {
        return Ok(());
    }
    Err(particles::Error::Option {
        name: "surface",
        expected: "a surface in space".into(),
        given: "a curve in the plane, which has no triangles; use its samples".into(),
    })
}

/// Flips, smooths and mends.
pub(super) fn improve(
    surface: &dyn Surface,
    rounds: usize,
    segments: &Segments,
    triangles: &mut Triangles,
    vertices: &mut Vertices,
    held: &mut Vec<bool>,
    report: &mut MeshReport,
) -> Result<(), FieldError> {
    report.flips += triangles.delaunay(&vertices.points, |a, b| segments.joins(vertices, a, b));
    let mut round = 0;
    while round < rounds {
        // One narrowed field as long as the vertices keep their numbers.
        let narrowed = surface.narrowed(&vertices.points, MARGIN * vertices.mean())?;
        let field = narrowed.as_deref().unwrap_or(surface);
        while round < rounds {
            let moved = smooth::smooth(field, triangles, vertices, held)?;
            report.evaluations += vertices.len() as u64;
            report.flips += triangles.delaunay(&vertices.points, |a, b| segments.joins(vertices, a, b));
            round += 1;
            if moved < SMOOTH {
                return Ok(());
            }
            if MENDING.contains(&round) {
                let (came, went) = valence::mend(triangles, vertices, held);
                report.inserted += came;
                report.removed += went;
                if came + went > 0 {
                    break;
                }
            }
        }
    }
    Ok(())
}

/// Brings the vertices to the surface to rounding, where they have `moved`, and measures the mesh.
pub(super) fn finish(
    surface: &dyn Surface,
    samples: &Samples,
    intersections: bool,
    moved: bool,
    creases: Option<&Creases>,
    mut vertices: Vertices,
    faces: Vec<[u32; 3]>,
    mut report: MeshReport,
) -> Result<Meshed, FieldError> {
    let spacing = vertices.spacing.clone();
    let Vertices { points, normals, faces: walls, crease, .. } = &mut vertices;
    if moved {
        // What is on a crease is there to rounding, and has more than one normal.
        let on_crease: Vec<(usize, V3, V3)> =
            (0..points.len()).filter(|&i| crease[i] != NONE).map(|i| (i, points[i], normals[i])).collect();
        pull(surface, points, normals, walls, |i| 0.1 * spacing[i], 3)?;
        on_crease.into_iter().for_each(|(i, p, n)| (points[i], normals[i]) = (p, n));
        report.evaluations += 3 * points.len() as u64;
    }
    let ids = (0..points.len() as u64).collect();
    let curvatures = particles::principal_curvatures(surface, points);
    let Vertices { points, normals, crease, .. } = vertices;
    let mut mesh = Mesh { points, normals, curvatures, ids, faces, ..Mesh::default() };
    if let Some(creases) = creases {
        mesh.corner_normals = crease::corner_normals(creases, &crease, &mesh);
    }
    report.describe(surface, &mesh, samples, intersections)?;
    Ok(Meshed { mesh, report })
}
