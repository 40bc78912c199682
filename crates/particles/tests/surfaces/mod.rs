//! Analytic surfaces for the tests, with intervals from Lipschitz constants.
#![allow(dead_code)]

use isoswarm_field::{Aabb, Cells, FieldError, Surface};
use rayon::prelude::*;

type Point = [f64; 3];
type Function = Box<dyn Fn(Point) -> (f64, Point) + Send + Sync>;

/// A surface from a function that gives F and its gradient.
pub struct Analytic {
    f: Function,
    /// |F(x) - F(y)| ≤ lipschitz |x - y| in the bounds that are used; `None`: no intervals.
    lipschitz: Option<f64>,
    axes: usize,
    hessian: bool,
}

impl Analytic {
    pub fn new(f: impl Fn(Point) -> (f64, Point) + Send + Sync + 'static) -> Self {
        Self { f: Box::new(f), lipschitz: None, axes: 3, hessian: true }
    }

    pub fn lipschitz(self, l: f64) -> Self {
        Self { lipschitz: Some(l), ..self }
    }

    pub fn plane(self) -> Self {
        Self { axes: 2, ..self }
    }

    pub fn without_hessian(self) -> Self {
        Self { hessian: false, ..self }
    }

    pub fn at(&self, p: Point) -> (f64, Point) {
        (self.f)(p)
    }
}

impl Surface for Analytic {
    fn axes(&self) -> usize {
        self.axes
    }

    fn value_gradient(
        &self,
        points: &[Point],
        value: &mut [f64],
        gradient: &mut [Point],
    ) -> Result<(), FieldError> {
        points.par_chunks(512).zip(value.par_chunks_mut(512)).zip(gradient.par_chunks_mut(512)).for_each(
            |((p, v), g)| {
                for k in 0..p.len() {
                    (v[k], g[k]) = (self.f)(p[k]);
                }
            },
        );
        Ok(())
    }

    fn hessian(&self, points: &[Point], hessian: &mut [[f64; 6]]) -> Result<(), FieldError> {
        if !self.hessian {
            return Err(FieldError::Invalid("no second derivatives".into()));
        }
        let h = 1e-5;
        for (p, out) in points.iter().zip(hessian) {
            let mut m = [[0.0; 3]; 3];
            for a in 0..3 {
                let (mut q, mut r) = (*p, *p);
                q[a] += h;
                r[a] -= h;
                let (gq, gr) = ((self.f)(q).1, (self.f)(r).1);
                for b in 0..3 {
                    m[a][b] = (gq[b] - gr[b]) / (2.0 * h);
                }
            }
            *out = [m[0][0], m[0][1], m[0][2], m[1][1], m[1][2], m[2][2]];
        }
        Ok(())
    }

    fn cells(&self, bounds: &Aabb, side: f64, most: usize) -> Option<Cells<'_>> {
        let lipschitz = self.lipschitz?;
        let mut boxes = vec![*bounds];
        loop {
            boxes.retain(|b| {
                let c = [0, 1, 2].map(|a| 0.5 * (b.lo[a] + b.hi[a]));
                (self.f)(c).0.abs() <= lipschitz * 0.5 * b.diagonal() * 1.000_001
            });
            let longest = |b: &Aabb| (0..3).map(|a| b.hi[a] - b.lo[a]).fold(0.0, f64::max);
            let widest = boxes.iter().map(longest).fold(0.0, f64::max);
            if widest <= side || 2 * boxes.len() > most {
                return Some(Cells { boxes, side: widest, evaluate: Box::new(Same(self)) });
            }
            boxes = boxes
                .into_iter()
                .flat_map(|b| {
                    let a =
                        (0..3).max_by(|&i, &j| (b.hi[i] - b.lo[i]).total_cmp(&(b.hi[j] - b.lo[j]))).unwrap();
                    let m = 0.5 * (b.lo[a] + b.hi[a]);
                    let (mut low, mut high) = (b, b);
                    low.hi[a] = m;
                    high.lo[a] = m;
                    [low, high]
                })
                .collect();
        }
    }
}

struct Same<'a>(&'a Analytic);

impl Surface for Same<'_> {
    fn axes(&self) -> usize {
        self.0.axes
    }
    fn value_gradient(&self, p: &[Point], v: &mut [f64], g: &mut [Point]) -> Result<(), FieldError> {
        self.0.value_gradient(p, v, g)
    }
    fn hessian(&self, p: &[Point], h: &mut [[f64; 6]]) -> Result<(), FieldError> {
        self.0.hessian(p, h)
    }
}

fn length(p: Point) -> f64 {
    (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt()
}

pub fn cube_bounds(half: f64) -> Aabb {
    Aabb::new([-half; 3], [half; 3])
}

/// Signed distance to a sphere.
pub fn sphere(centre: Point, r: f64) -> Analytic {
    Analytic::new(move |p| ball(p, centre, r)).lipschitz(1.0)
}

fn ball(p: Point, c: Point, r: f64) -> (f64, Point) {
    let d = [p[0] - c[0], p[1] - c[1], p[2] - c[2]];
    let l = length(d);
    (l - r, if l > 0.0 { d.map(|v| v / l) } else { [0.0; 3] })
}

fn least(a: (f64, Point), b: (f64, Point)) -> (f64, Point) {
    if a.0 <= b.0 { a } else { b }
}

/// The union of spheres.
pub fn spheres(balls: Vec<(Point, f64)>) -> Analytic {
    Analytic::new(move |p| balls.iter().map(|&(c, r)| ball(p, c, r)).reduce(least).unwrap()).lipschitz(1.0)
}

/// Concentric shells: F is the distance to the nearest of the radii, its sign alternates.
pub fn shells(radii: Vec<f64>) -> Analytic {
    Analytic::new(move |p| {
        let l = length(p);
        let (k, d) =
            radii.iter().map(|r| l - r).enumerate().min_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).unwrap();
        let s = if k % 2 == 0 { 1.0 } else { -1.0 };
        (s * d, p.map(|v| s * v / l.max(1e-300)))
    })
    .lipschitz(1.0)
}

/// Signed distance to a torus around z.
pub fn torus(major: f64, minor: f64) -> Analytic {
    Analytic::new(move |p| {
        let rho = (p[0] * p[0] + p[1] * p[1]).sqrt().max(1e-300);
        let q = [rho - major, p[2]];
        let l = (q[0] * q[0] + q[1] * q[1]).sqrt().max(1e-300);
        (l - minor, [q[0] / l * p[0] / rho, q[0] / l * p[1] / rho, q[1] / l])
    })
    .lipschitz(1.0)
}

/// x²/a² + y²/b² + z²/c² - 1.
pub fn ellipsoid(axes: Point) -> Analytic {
    let steep = 2.0 * 1.3 / axes.iter().fold(f64::INFINITY, |m, &a| m.min(a * a));
    Analytic::new(move |p| {
        let f = (0..3).map(|a| (p[a] / axes[a]).powi(2)).sum::<f64>() - 1.0;
        (f, [0, 1, 2].map(|a| 2.0 * p[a] / (axes[a] * axes[a])))
    })
    .lipschitz(steep)
}

pub fn gyroid(frequency: f64) -> Analytic {
    Analytic::new(move |p| {
        let s = p.map(|v| (frequency * v).sin());
        let c = p.map(|v| (frequency * v).cos());
        let f = s[0] * c[1] + s[1] * c[2] + s[2] * c[0];
        let g = [c[0] * c[1] - s[2] * s[0], c[1] * c[2] - s[0] * s[1], c[2] * c[0] - s[1] * s[2]];
        (f, g.map(|v| frequency * v))
    })
    .lipschitz(2.0 * frequency)
}

/// max(|x|, |y|, |z|) - half.
pub fn cube(half: f64) -> Analytic {
    Analytic::new(move |p| {
        let a = (0..3).max_by(|&i, &j| p[i].abs().total_cmp(&p[j].abs())).unwrap();
        let mut g = [0.0; 3];
        g[a] = p[a].signum();
        (p[a].abs() - half, g)
    })
    .lipschitz(1.0)
}

/// Taubin's heart, whose gradient vanishes on its waist.
pub fn heart() -> Analytic {
    Analytic::new(|[x, y, z]| {
        let a = x * x + 2.25 * y * y + z * z - 1.0;
        let f = a * a * a - x * x * z * z * z - 0.1125 * y * y * z * z * z;
        let b = 3.0 * a * a;
        let g = [
            b * 2.0 * x - 2.0 * x * z * z * z,
            b * 4.5 * y - 0.225 * y * z * z * z,
            b * 2.0 * z - 3.0 * z * z * (x * x + 0.1125 * y * y),
        ];
        (f, g)
    })
}

/// The double cone x² + y² = z².
pub fn cone() -> Analytic {
    Analytic::new(|[x, y, z]| (x * x + y * y - z * z, [2.0 * x, 2.0 * y, -2.0 * z])).lipschitz(4.0)
}

/// b - Σ exp(-|x - c|²/s²).
pub fn blobs(centres: Vec<Point>, s: f64, b: f64) -> Analytic {
    let steep = 0.86 * centres.len() as f64 / s;
    Analytic::new(move |p| {
        let (mut f, mut g) = (b, [0.0; 3]);
        for c in &centres {
            let d = [p[0] - c[0], p[1] - c[1], p[2] - c[2]];
            let e = (-(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) / (s * s)).exp();
            f -= e;
            for a in 0..3 {
                g[a] += 2.0 * d[a] / (s * s) * e;
            }
        }
        (f, g)
    })
    .lipschitz(steep)
}

/// 16 blobs that hang together.
pub fn sixteen() -> Analytic {
    let centres = (0..16)
        .map(|i| {
            let t = f64::from(i) * 0.8;
            [
                (0.6 + 0.02 * f64::from(i)) * t.cos(),
                (0.6 + 0.02 * f64::from(i)) * t.sin(),
                0.11 * f64::from(i) - 0.8,
            ]
        })
        .collect();
    Analytic { lipschitz: Some(6.0), ..blobs(centres, 0.3, 0.4) }
}

/// A circle in the plane z = 0 (signed distance).
pub fn circle(r: f64) -> Analytic {
    Analytic::new(move |p| ball([p[0], p[1], 0.0], [0.0; 3], r)).lipschitz(1.0).plane()
}

/// An ellipse in the plane z = 0.
pub fn ellipse(a: f64, b: f64) -> Analytic {
    Analytic::new(move |[x, y, _]| {
        ((x / a).powi(2) + (y / b).powi(2) - 1.0, [2.0 * x / (a * a), 2.0 * y / (b * b), 0.0])
    })
    .lipschitz(2.6 / a.min(b))
    .plane()
}

/// 1 + x² + y² + z²: no surface.
pub fn nowhere() -> Analytic {
    Analytic::new(|[x, y, z]| (1.0 + x * x + y * y + z * z, [2.0 * x, 2.0 * y, 2.0 * z])).lipschitz(8.0)
}
