//! What a run gives: the samples and the account of how it went.

use crate::creases::Creases;

/// How a run ended.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Status {
    /// Everything asked for was reached.
    #[default]
    Converged,
    /// The samples are usable, but something was not reached: the text says what and why.
    NotConverged(String),
    /// There is no surface in the bounds.
    Empty,
}

impl Status {
    /// `"converged"`, `"not converged"` or `"empty"`.
    pub fn name(&self) -> &'static str {
        match self {
            Status::Converged => "converged",
            Status::NotConverged(_) => "not converged",
            Status::Empty => "empty",
        }
    }
}

/// How evenly points lie on a surface. Dimensionless; samples on the faces of the bounds are left out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Evenness {
    /// Smallest distance between nearest neighbours over that of the hexagonal packing of as many points on as
    /// much area, sqrt(2 A / (sqrt(3) n)); 1 is perfect.
    pub rho_min: f64,
    /// Mean distance between nearest neighbours over that of the hexagonal packing.
    pub rho_avg: f64,
    /// Standard deviation of the distance between nearest neighbours over its mean; 0 is perfect.
    pub cv: f64,
    /// Part of the samples with exactly six neighbours in their Delaunay star (two, on a curve).
    pub six_valent: f64,
    /// Radius of the largest empty disc over the hexagonal packing's distance (.577 is perfect).
    pub coverage: f64,
}

/// How a run went.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// How it ended.
    pub status: Status,
    /// Connected components found.
    pub components: usize,
    /// Whether interval arithmetic accounts for the whole of the bounds: every box of the first search, of at most
    /// `resolution`, that may hold a piece of the surface holds a sample, is next to one that does, or has been shown to be empty.
    /// So no component was missed but for those that are smaller than a box or two and that close to another. `false`: random
    /// search only, or sheets so thin that what belongs together is not known.
    pub certified: bool,
    /// Largest side of the boxes of the first search (model units; 0 where nothing was found).
    pub resolution: f64,
    /// Largest |F|/|∇F| over the samples with a gradient (model units).
    pub max_error: f64,
    /// Evenness of the samples (relative to `density` where that is not uniform).
    pub evenness: Evenness,
    /// Mean distance between a sample and its nearest neighbour (model units).
    pub spacing: f64,
    /// Area (length, in the plane) of the surface, from the samples' Voronoi cells (model units).
    pub area: f64,
    /// Samples on the faces of the bounds, which clip the surface there.
    pub on_bounds: usize,
    /// Samples that rest where the gradient vanishes; their normal is (0, 0, 0).
    pub singular: usize,
    /// Steps taken, all resolutions together.
    pub steps: usize,
    /// Points at which the field was evaluated.
    pub evaluations: u64,
    /// Floaters born by fission or refinement.
    pub births: u64,
    /// Floaters that died.
    pub deaths: u64,
    /// Samples that were taken instead of those asked for, as creases need them ([`Options::more`](crate::Options::more)).
    pub more: Option<usize>,
    /// What the user should know besides the status, a sentence each.
    pub warnings: Vec<String>,
}

impl Report {
    /// What the warning of details finer than the spacing says.
    pub const UNRESOLVED: &str = "of the samples lie where the surface bends within less than their spacing";
}

/// Points on a surface, in a spatially coherent order. All vectors have the same length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples {
    /// Positions (model units).
    pub points: Vec<[f64; 3]>,
    /// Outward unit normals; zero where the gradient vanishes.
    pub normals: Vec<[f64; 3]>,
    /// Radius of the disc that each sample stands for: half the mean distance to its neighbours (model units).
    pub radii: Vec<f64>,
    /// Area (length, in the plane) of each sample's Voronoi cell in its tangent plane (model units squared).
    pub areas: Vec<f64>,
    /// Principal curvatures, largest magnitude first (1/model units; positive where the surface is convex seen from
    /// outside); in the plane the curvature and 0. NaN where they are undefined.
    pub curvatures: Vec<[f64; 2]>,
    /// Connected component of each sample, numbered from 0 in the order of their first samples.
    pub component: Vec<u32>,
    /// The surface's edges and corners, where that was asked for: their points are the first samples, in their order.
    pub creases: Option<Creases>,
    /// How the run went.
    pub report: Report,
}
