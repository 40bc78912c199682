//! Even samples of parametric surfaces x(u, v): floaters live in (u, v) and repel each other in space (WH94 section 7).

mod domain;
mod relax;

use isoswarm_field::{Field, FieldError};

use crate::Error;
use crate::even::count_for_spacing;
use crate::metrics;
use crate::options::Amount;
use crate::report::Evenness;
use crate::rng::{Rng, Stream};
use crate::vector::{V3, add, cross, distance, dot, norm, unit};
use domain::{Poles, hilbert};

pub use domain::{Domain, Wrap};

/// Cells of the lattice along each axis from which the area is found, and the first places are drawn.
const CELLS: usize = 256;
/// An edge that is shorter than this part of the surface's size is a pole.
const POLE: f64 = 1e-7;
/// Places along an edge that are looked at.
const ALONG: usize = 33;

/// A surface x(u, v) in space.
#[derive(Clone, Copy, Debug)]
pub struct Patch<'a> {
    field: &'a Field,
    domain: Domain,
    poles: Poles,
    size: f64,
}

/// Samples of a patch; all vectors have the same length.
#[derive(Clone, Debug, PartialEq)]
pub struct PatchSamples {
    /// Parameters (u, v).
    pub uv: Vec<[f64; 2]>,
    /// Positions, model units.
    pub points: Vec<[f64; 3]>,
    /// Unit normals along x_u × x_v; on a surface with one side their sign changes somewhere.
    pub normals: Vec<[f64; 3]>,
    /// Area of the surface, by quadrature (model units squared).
    pub area: f64,
    /// Mean distance between a sample and its nearest neighbour.
    pub spacing: f64,
    /// How evenly they lie; on a surface with boundaries the samples there count as if it went on.
    pub evenness: Evenness,
    /// Steps of relaxation.
    pub steps: usize,
    /// Whether the floaters had come to rest.
    pub settled: bool,
}

/// x, x_u and x_v at a number of places.
#[derive(Clone, Debug, Default)]
pub(crate) struct Places {
    pub(crate) x: Vec<V3>,
    pub(crate) xu: Vec<V3>,
    pub(crate) xv: Vec<V3>,
}

impl<'a> Patch<'a> {
    /// A surface from a field with three components, the coordinates x, y and z, in two axes, u and v.
    ///
    /// # Errors
    /// Another field; ranges that are not finite or empty; edges that are said to be one and are not.
    pub fn new(field: &'a Field, domain: Domain) -> Result<Self, Error> {
        let wrong = |name, expected: &str, given: String| {
            Err(Error::Option { name, expected: expected.into(), given })
        };
        if field.components() != 3 || field.axes() != 2 {
            let given = format!("{} components in {} axes", field.components(), field.axes());
            return wrong("field", "the coordinates x, y and z as functions of u and v", given);
        }
        for (a, name) in [(0, "u"), (1, "v")] {
            let (lo, hi) = (domain.lo[a], domain.hi[a]);
            if !(lo < hi && lo.is_finite() && hi.is_finite()) {
                return wrong(name, "a finite range (lo, hi) with lo < hi", format!("({lo}, {hi})"));
            }
        }
        let mut patch = Self { field, domain, poles: Poles::default(), size: 0.0 };
        let lattice: Vec<[f64; 2]> = (0..ALONG * ALONG)
            .map(|k| patch.at([k % ALONG, k / ALONG].map(|i| i as f64 / (ALONG - 1) as f64)))
            .collect();
        let x = patch.look(&lattice)?.x;
        if let Some(k) = x.iter().position(|p| p.iter().any(|v| !v.is_finite())) {
            return wrong(
                "x(u, v)",
                "finite numbers all over the domain",
                format!("{:?} at {:?}", x[k], lattice[k]),
            );
        }
        let bounds = isoswarm_field::Aabb::around(&x);
        patch.size = bounds.map_or(0.0, |b| b.diagonal());
        for a in 0..2 {
            let edge = |end: usize| -> Vec<V3> {
                let i = if end == 0 { 0 } else { ALONG - 1 };
                (0..ALONG).map(|j| if a == 0 { x[j * ALONG + i] } else { x[i * ALONG + j] }).collect()
            };
            let (first, last) = (edge(0), edge(1));
            for (end, edge) in [&first, &last].into_iter().enumerate() {
                let spread = edge.iter().map(|p| distance(*p, edge[0])).fold(0.0, f64::max);
                patch.poles[a][end] = domain.wrap[a] == Wrap::Open && spread < POLE * patch.size;
            }
            let other =
                |j: usize| if domain.wrap[a] == Wrap::Twisted { last[ALONG - 1 - j] } else { last[j] };
            let gap = (0..ALONG).map(|j| distance(first[j], other(j))).fold(0.0, f64::max);
            if domain.wrap[a] != Wrap::Open && gap > POLE * patch.size {
                let given = format!("edges up to {gap:.3e} apart at the ends of {}", ["u", "v"][a]);
                return wrong("periodic", "edges that are the same curve", given);
            }
        }
        Ok(patch)
    }

    /// The ranges of the parameters.
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// Which ends of which parameters are poles, where the surface closes in a point: `[axis][0 at lo, 1 at hi]`.
    pub fn poles(&self) -> [[bool; 2]; 2] {
        self.poles
    }

    /// The place at parts of the ranges, 0 to 1.
    fn at(&self, part: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|a| self.domain.lo[a] + part[a] * self.domain.length(a))
    }

    pub(crate) fn look(&self, uv: &[[f64; 2]]) -> Result<Places, FieldError> {
        let n = uv.len();
        let (mut value, mut slope) = (vec![0.0; 3 * n], vec![0.0; 6 * n]);
        self.field.gradient(uv.as_flattened(), &mut value, &mut slope)?;
        let rows = |k: usize| slope.chunks_exact(6).map(|s| [s[k], s[k + 2], s[k + 4]]).collect();
        let x = value.chunks_exact(3).map(|v| [v[0], v[1], v[2]]).collect();
        Ok(Places { x, xu: rows(0), xv: rows(1) })
    }

    /// x at the places.
    pub fn points(&self, uv: &[[f64; 2]]) -> Result<Vec<[f64; 3]>, FieldError> {
        Ok(self.look(uv)?.x)
    }

    /// Unit normals at the places; those at poles are the means of what is around them.
    pub fn normals(&self, uv: &[[f64; 2]]) -> Result<Vec<[f64; 3]>, FieldError> {
        let found = self.look(uv)?;
        let mut out: Vec<V3> = (0..uv.len()).map(|i| unit(cross(found.xu[i], found.xv[i]))).collect();
        for (i, p) in uv.iter().enumerate() {
            let Some((a, end)) = self.pole_at(*p) else { continue };
            let step = 1e-4 * self.domain.length(a) * if end == 0 { 1.0 } else { -1.0 };
            let around: Vec<[f64; 2]> = (0..8)
                .map(|k| {
                    let mut q = *p;
                    q[a] += step;
                    q[1 - a] = self.domain.lo[1 - a] + self.domain.length(1 - a) * (k as f64 + 0.5) / 8.0;
                    q
                })
                .collect();
            let near = self.look(&around)?;
            let sum = (0..8).fold([0.0; 3], |s, k| add(s, unit(cross(near.xu[k], near.xv[k]))));
            out[i] = unit(sum);
        }
        Ok(out)
    }

    /// The pole that a place is at: axis and end.
    fn pole_at(&self, p: [f64; 2]) -> Option<(usize, usize)> {
        (0..4).map(|k| (k / 2, k % 2)).find(|&(a, end)| {
            let edge = if end == 0 { self.domain.lo[a] } else { self.domain.hi[a] };
            self.poles[a][end] && (p[a] - edge).abs() <= 1e-12 * self.domain.length(a)
        })
    }

    /// Areas of the lattice's cells in the order of Hilbert's curve, by the midpoint rule.
    fn cells(&self) -> Result<Vec<f64>, FieldError> {
        let middle = |d: usize| self.at(hilbert(CELLS, d).map(|i| (i as f64 + 0.5) / CELLS as f64));
        let uv: Vec<[f64; 2]> = (0..CELLS * CELLS).map(middle).collect();
        let found = self.look(&uv)?;
        let share = self.domain.length(0) * self.domain.length(1) / (CELLS * CELLS) as f64;
        Ok((0..uv.len()).map(|i| norm(cross(found.xu[i], found.xv[i])) * share).collect())
    }

    /// Spreads floaters evenly over the surface. Poles and corners between open edges get one each, which stays.
    ///
    /// # Errors
    /// Amounts that make no sense, fewer samples than poles and corners, more than `most`, and what the field reports.
    pub fn sample(&self, amount: Amount, seed: u64, most: usize) -> Result<PatchSamples, Error> {
        let cells = self.cells()?;
        let area: f64 = cells.iter().sum();
        let wrong = |name, expected: &str, given: String| {
            Err(Error::Option { name, expected: expected.into(), given })
        };
        if !(area > 0.0 && area.is_finite()) {
            return wrong("x(u, v)", "a surface with an area above 0", format!("{area}"));
        }
        let estimate = match amount {
            Amount::Count(n) => n as f64,
            Amount::Spacing(s) if s > 0.0 && s.is_finite() => count_for_spacing(area, s, 3),
            Amount::Spacing(s) => return wrong("spacing", "a positive, finite length", s.to_string()),
        };
        if estimate > most as f64 {
            return Err(Error::TooMany { estimate, bytes: 200.0 * estimate, limit: most });
        }
        let fixed = self.fixed();
        let n = estimate.round() as usize;
        if n <= fixed.len() {
            let expected = format!("more samples than the {} at poles and corners", fixed.len());
            return wrong("n", &expected, n.to_string());
        }
        let mut uv = fixed.clone();
        uv.extend(self.draw(&cells, n - fixed.len(), Rng::new(seed, Stream::Probes)));
        let relaxed = relax::relax(self, uv, fixed.len(), (area / n as f64).sqrt())?;
        let points = self.points(&relaxed.uv)?;
        let normals = self.normals(&relaxed.uv)?;
        let evenness = metrics::evenness(&points, &normals, None, 3);
        let spacing = evenness.rho_avg * metrics::hexagonal(area / n as f64);
        let (steps, settled) = (relaxed.steps, relaxed.settled);
        Ok(PatchSamples { uv: relaxed.uv, points, normals, area, spacing, evenness, steps, settled })
    }

    /// Poles, and corners of the rectangle that are corners of the surface.
    fn fixed(&self) -> Vec<[f64; 2]> {
        let mut out = Vec::new();
        for a in 0..2 {
            for end in 0..2 {
                if self.poles[a][end] {
                    let mut p = self.at([0.5; 2]);
                    p[a] = if end == 0 { self.domain.lo[a] } else { self.domain.hi[a] };
                    out.push(p);
                }
            }
        }
        if self.domain.wrap == [Wrap::Open; 2] {
            for k in 0..4 {
                let ends = [k & 1, k >> 1];
                if !(0..2).any(|a| self.poles[a][ends[a]]) {
                    out.push(self.at(ends.map(|e| e as f64)));
                }
            }
        }
        out
    }

    /// Places uniform by area, one in each of `n` equal shares along Hilbert's curve.
    fn draw(&self, cells: &[f64], n: usize, rng: Rng) -> Vec<[f64; 2]> {
        let area: f64 = cells.iter().sum();
        let (mut cell, mut before) = (0, 0.0);
        (0..n)
            .map(|k| {
                let own = rng.child(k as u64);
                let aim = area * (k as f64 + own.unit(0)) / n as f64;
                while cell + 1 < cells.len() && before + cells[cell] < aim {
                    before += cells[cell];
                    cell += 1;
                }
                let corner = hilbert(CELLS, cell);
                self.at([0, 1].map(|a| (corner[a] as f64 + own.unit(a as u64 + 1)) / CELLS as f64))
            })
            .collect()
    }
}

/// The change of (u, v) that moves a point along `d` as nearly as the tangent plane allows.
pub(crate) fn pull_back(xu: V3, xv: V3, d: V3) -> [f64; 2] {
    let (e, f, g) = (dot(xu, xu), dot(xu, xv), dot(xv, xv));
    let (a, b) = (dot(xu, d), dot(xv, d));
    let det = e * g - f * f;
    if det > 1e-14 * (e + g) * (e + g) {
        return [(g * a - f * b) / det, (e * b - f * a) / det];
    }
    // At a pole only one parameter moves the point.
    if e >= g { [if e > 0.0 { a / e } else { 0.0 }, 0.0] } else { [0.0, b / g] }
}
