//! Triangles over samples of a parametric surface: Delaunay in the plane of its parameters, then flipped to Delaunay in
//! space.
//!
//! The plane is unrolled: beyond edges that hang together stand copies of the samples from the other end. Poles are the whole
//! edge of the rectangle; the triangles along it that collapse to an edge are left out, which closes the surface there.
//! Towards a pole lengths along the edge shrink to nothing; the plane is stretched the other way as much, as in Mercator's
//! map, so that a disc on the surface stays about a disc and the samples around the pole stand in a row before its edge.

use isoswarm_field::arrange::Arrange;
use isoswarm_field::vector::{distance, norm};
use isoswarm_particles::Error;
use isoswarm_particles::parametric::{Domain, Patch, PatchSamples, Wrap};
use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation};

use super::Mesh;
use super::connect::Triangles;

/// Copies reach this part of a range beyond its ends.
const BEYOND: f64 = 0.5;
/// Places along a pole's edge, at least.
const ALONG_POLE: usize = 16;

/// A sample or a copy of one in the plane.
struct Place {
    at: Point2<f64>,
    sample: u32,
}

impl HasPosition for Place {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.at
    }
}

/// Triangulates samples of a patch. Faces run counter-clockwise seen from where x_u × x_v points; on a surface with one
/// side they do not agree across a curve, and [`super::Topology`] says so.
///
/// # Errors
/// What the field reports; samples whose parameters are no numbers.
pub fn mesh_patch(patch: &Patch<'_>, samples: &PatchSamples) -> Result<Mesh, Error> {
    let domain = patch.domain();
    let map = Map::new(patch, samples)?;
    let places = unrolled(patch, &samples.uv, &map);
    let plane: DelaunayTriangulation<Place> = Triangulation::bulk_load(places).map_err(|e| {
        Error::Option { name: "uv", expected: "finite parameters".into(), given: e.to_string() }
    })?;
    let mut faces = Vec::new();
    for face in plane.inner_faces() {
        let corners = face.vertices();
        let centre = [0, 1].map(|a| {
            let of = |k: usize| {
                let p = corners[k].position();
                if a == 0 { p.x } else { p.y }
            };
            (of(0) + of(1) + of(2)) / (3.0 * map.scale[a])
        });
        let own = (0..2)
            .all(|a| domain.wrap[a] == Wrap::Open || (centre[a] >= domain.lo[a] && centre[a] < domain.hi[a]));
        let [a, b, c] = corners.map(|v| v.data().sample);
        if own && a != b && b != c && c != a {
            faces.push([a, b, c]);
        }
    }
    faces.arrange();
    let mut triangles = Triangles::new(faces);
    triangles.delaunay(&samples.points, |_, _| false);
    Ok(Mesh {
        points: samples.points.clone(),
        normals: samples.normals.clone(),
        faces: triangles.faces,
        ..Mesh::default()
    })
}

/// Root mean squares of |x_u| and |x_v|, relative to the larger.
fn scales(patch: &Patch<'_>, samples: &PatchSamples) -> Result<[f64; 2], Error> {
    let mut out = [0.0; 2];
    for (a, scale) in out.iter_mut().enumerate() {
        let step = 1e-5 * patch.domain().length(a);
        let aside = |s: f64| -> Vec<[f64; 2]> {
            let mut uv = samples.uv.clone();
            uv.iter_mut().for_each(|p| p[a] += s);
            uv
        };
        let (p, q) = (patch.points(&aside(-step))?, patch.points(&aside(step))?);
        let square: f64 = p
            .iter()
            .zip(&q)
            .map(|(p, q)| norm([0, 1, 2].map(|k| (q[k] - p[k]) / (2.0 * step))).powi(2))
            .filter(|s| s.is_finite())
            .sum();
        *scale = square.sqrt();
    }
    let most = out[0].max(out[1]);
    Ok(out.map(|s| (s / most).max(1e-3)))
}

/// Steps of the table of a stretched axis.
const STEPS: usize = 512;
/// Places across for each of them.
const ACROSS: usize = 16;
/// From the last samples to the edge of a pole, as a part of the edge's length; six samples stand around a pole.
const BEFORE_POLE: f64 = 1.0 / 8.0;

/// From parameters to a plane in which a unit is about as long both ways. Axes that hang together are only scaled.
struct Map {
    scale: [f64; 2],
    stretched: Option<Stretched>,
}

/// An axis that ends at a pole.
struct Stretched {
    axis: usize,
    ends: [f64; 2],
    poles: [bool; 2],
    /// Coordinates in the plane from end to end.
    table: Vec<f64>,
    /// Where the edges of the poles stand.
    edges: [f64; 2],
}

impl Map {
    fn new(patch: &Patch<'_>, samples: &PatchSamples) -> Result<Self, Error> {
        let (domain, poles) = (patch.domain(), patch.poles());
        let Some(axis) = (0..2).find(|&a| poles[a].contains(&true)) else {
            return Ok(Self { scale: scales(patch, samples)?, stretched: None });
        };
        let across = 1 - axis;
        let step = domain.length(axis) / STEPS as f64;
        let mut table = vec![0.0; STEPS + 1];
        for k in 0..STEPS {
            let mut at = [0.0; 2];
            at[axis] = domain.lo[axis] + (k as f64 + 0.5) * step;
            let aside = |a: usize, s: f64| -> Result<Vec<[f64; 3]>, Error> {
                let places = (0..ACROSS).map(|j| {
                    let mut q = at;
                    q[across] = domain.lo[across] + domain.length(across) * (j as f64 + 0.5) / ACROSS as f64;
                    q[a] += s;
                    q
                });
                Ok(patch.points(&places.collect::<Vec<_>>())?)
            };
            let length = |a: usize| -> Result<f64, Error> {
                let s = 1e-3 * if a == axis { step } else { domain.length(across) / ACROSS as f64 };
                let (p, q) = (aside(a, -s)?, aside(a, s)?);
                Ok(p.iter().zip(&q).map(|(p, q)| distance(*p, *q) / (2.0 * s)).sum())
            };
            let ratio = length(axis)? / length(across)?;
            table[k + 1] = table[k] + step * if ratio.is_finite() { ratio } else { 0.0 };
        }
        let mut s = Stretched {
            axis,
            ends: [domain.lo[axis], domain.hi[axis]],
            poles: poles[axis],
            table,
            edges: [0.0; 2],
        };
        let inner = samples.uv.iter().filter(|p| pole(patch, **p).is_none()).map(|p| s.at(p[axis]));
        let [lo, hi] = inner.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], w| [w.min(lo), w.max(hi)]);
        let gap = BEFORE_POLE * domain.length(across);
        s.edges = if lo <= hi { [lo - gap, hi + gap] } else { [s.table[0] - gap, s.table[STEPS] + gap] };
        Ok(Self { scale: [1.0; 2], stretched: Some(s) })
    }

    fn place(&self, q: [f64; 2], sample: usize) -> Place {
        let mut at = [q[0] * self.scale[0], q[1] * self.scale[1]];
        if let Some(s) = &self.stretched {
            at[s.axis] = s.coordinate(q[s.axis]);
        }
        Place { at: Point2::new(at[0], at[1]), sample: sample as u32 }
    }
}

impl Stretched {
    fn coordinate(&self, q: f64) -> f64 {
        match (0..2).find(|&end| self.poles[end] && q == self.ends[end]) {
            Some(end) => self.edges[end],
            None => self.at(q),
        }
    }

    /// From the table.
    fn at(&self, q: f64) -> f64 {
        let t = ((q - self.ends[0]) / (self.ends[1] - self.ends[0])).clamp(0.0, 1.0) * STEPS as f64;
        let k = (t as usize).min(STEPS - 1);
        self.table[k] + (t - k as f64) * (self.table[k + 1] - self.table[k])
    }
}

/// All samples with their copies, in the mapped plane.
fn unrolled(patch: &Patch<'_>, uv: &[[f64; 2]], map: &Map) -> Vec<Place> {
    let domain = patch.domain();
    let mut out = Vec::new();
    for (i, p) in uv.iter().enumerate() {
        let Some(a) = pole(patch, *p) else {
            copies(domain, *p, |q| out.push(map.place(q, i)));
            continue;
        };
        // A pole is a whole edge.
        let b = 1 - a;
        let count = ALONG_POLE.max((4.0 * (uv.len() as f64).sqrt()) as usize);
        for k in 0..count {
            let mut q = *p;
            q[b] = domain.lo[b] + domain.length(b) * k as f64 / count as f64;
            copies(domain, q, |q| out.push(map.place(q, i)));
        }
        if domain.wrap[b] == Wrap::Open {
            let mut q = *p;
            q[b] = domain.hi[b];
            out.push(map.place(q, i));
        }
    }
    out
}

/// The axis at whose end the pole lies that a sample is at.
fn pole(patch: &Patch<'_>, p: [f64; 2]) -> Option<usize> {
    let (domain, poles) = (patch.domain(), patch.poles());
    (0..2).find(|&a| (poles[a][0] && p[a] == domain.lo[a]) || (poles[a][1] && p[a] == domain.hi[a]))
}

/// Calls `each` with the place and its copies beyond edges that hang together.
fn copies(domain: &Domain, p: [f64; 2], mut each: impl FnMut([f64; 2])) {
    let turns = |a: usize| if domain.wrap[a] == Wrap::Open { 0..=0 } else { -1..=1 };
    for i in turns(0) {
        for j in turns(1) {
            let mut q = p;
            for (a, k) in [(0, i), (1, j)] {
                q[a] += f64::from(k) * domain.length(a);
                if k != 0 && domain.wrap[a] == Wrap::Twisted {
                    let b = 1 - a;
                    q[b] = domain.lo[b] + domain.hi[b] - p[b];
                }
            }
            let near = (0..2).all(|a| {
                let margin = BEYOND * domain.length(a);
                domain.wrap[a] == Wrap::Open
                    || (q[a] >= domain.lo[a] - margin && q[a] < domain.hi[a] + margin)
            });
            if near {
                each(q);
            }
        }
    }
}
