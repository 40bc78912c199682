//! Draws even points on a few surfaces whose formulas are known: `cargo run --release --example gallery -- FOLDER`.

use std::f64::consts::{PI, TAU};
use std::time::Instant;

use isoswarm_geometry::{Coloring, PictureOptions, PointCloud, Style, render};

/// Columns that own their numbers.
#[derive(Default)]
struct Cloud {
    points: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    radii: Vec<f64>,
    curvatures: Vec<[f64; 2]>,
}

impl Cloud {
    fn borrowed(&self) -> PointCloud<'_> {
        PointCloud::new(&self.points)
            .with_normals(&self.normals)
            .with_radii(&self.radii)
            .with_curvatures(&self.curvatures)
    }
}

fn norm(a: [f64; 3]) -> f64 {
    (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt()
}

fn unit(a: [f64; 3]) -> [f64; 3] {
    let l = norm(a);
    a.map(|v| v / l)
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The radius that covers a surface of this area with n discs.
fn covering(area: f64, n: usize) -> f64 {
    1.105 * (area / (n as f64 * PI)).sqrt()
}

/// Fibonacci points on the unit sphere.
fn sphere(n: usize) -> Cloud {
    let mut cloud = Cloud::default();
    for k in 0..n {
        let z = 1.0 - (2 * k + 1) as f64 / n as f64;
        let (r, a) = ((1.0 - z * z).sqrt(), 2.399963229728653 * k as f64);
        cloud.points.push([r * a.cos(), r * a.sin(), z]);
    }
    cloud.normals = cloud.points.clone();
    cloud.radii = vec![covering(4.0 * PI, n); n];
    cloud.curvatures = vec![[1.0; 2]; n];
    cloud
}

/// Even points on a tube of radius `r` around a closed curve.
fn tube(curve: impl Fn(f64) -> [f64; 3], r: f64, n: usize) -> Cloud {
    let mut cloud = Cloud::default();
    let steps = 20_000;
    let at = |k: usize| curve(TAU * k as f64 / steps as f64);
    let minus = |a: [f64; 3], b: [f64; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let length: f64 = (0..steps).map(|k| norm(minus(at(k + 1), at(k)))).sum();
    let spacing = (length * TAU * r / n as f64 * 2.0 / 3f64.sqrt()).sqrt();
    let around = (TAU * r / spacing).round() as usize;
    let ring_gap = length / (n as f64 / around as f64);
    let (mut travelled, mut ring) = (0.0, 0);
    let mut side = [0.3, 0.1, 1.0];
    for k in 0..steps {
        let step = minus(at(k + 1), at(k));
        travelled += norm(step);
        let t = unit(step);
        // Carried along without twist.
        let d = side[0] * t[0] + side[1] * t[1] + side[2] * t[2];
        side = unit([side[0] - d * t[0], side[1] - d * t[1], side[2] - d * t[2]]);
        if travelled < ring as f64 * ring_gap {
            continue;
        }
        let up = cross(t, side);
        for j in 0..around {
            let a = TAU * (j as f64 + 0.5 * (ring % 2) as f64) / around as f64;
            let m: [f64; 3] = std::array::from_fn(|i| a.cos() * side[i] + a.sin() * up[i]);
            let p = at(k);
            cloud.points.push(std::array::from_fn(|i| p[i] + r * m[i]));
            cloud.normals.push(m);
            cloud.curvatures.push([1.0 / r, 0.0]);
        }
        ring += 1;
    }
    cloud.radii = vec![covering(length * TAU * r, cloud.points.len()); cloud.points.len()];
    cloud
}

fn trefoil(n: usize) -> Cloud {
    let curve = |t: f64| {
        [t.sin() + 2.0 * (2.0 * t).sin(), t.cos() - 2.0 * (2.0 * t).cos(), -(3.0 * t).sin()].map(|v| v * 0.5)
    };
    tube(curve, 0.36, n)
}

fn torus(n: usize) -> Cloud {
    tube(|t| [t.cos(), t.sin(), 0.0], 0.42, n)
}

/// Points on F = 0 by dart throwing among projected random points.
fn implicit(f: impl Fn([f64; 3]) -> f64, half: f64, spacing: f64) -> Cloud {
    let gradient = |p: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|k| {
            let h = 1e-5;
            let (mut a, mut b) = (p, p);
            a[k] += h;
            b[k] -= h;
            (f(a) - f(b)) / (2.0 * h)
        })
    };
    let mut state = 1u64;
    let mut random = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let cells = (2.0 * half / spacing).ceil() as usize + 1;
    let mut grid = vec![Vec::<u32>::new(); cells * cells * cells];
    let cell = |p: [f64; 3]| p.map(|v| (((v + half) / spacing) as usize).min(cells - 1));
    let mut cloud = Cloud::default();
    let mut misses = 0;
    while misses < 3_000 {
        let mut p: [f64; 3] = std::array::from_fn(|_| half * (2.0 * random() - 1.0));
        for _ in 0..6 {
            let (v, g) = (f(p), gradient(p));
            let gg = g[0] * g[0] + g[1] * g[1] + g[2] * g[2];
            p = std::array::from_fn(|k| p[k] - (v / gg.max(1e-9)).clamp(-1.0, 1.0) * g[k]);
        }
        if p.iter().any(|v| v.is_nan() || v.abs() > half) || f(p).abs() > 1e-6 {
            continue;
        }
        let c = cell(p);
        let range = |v: usize| v.saturating_sub(1)..(v + 2).min(cells);
        let free = range(c[0]).all(|i| {
            range(c[1]).all(|j| {
                range(c[2]).all(|k| {
                    grid[(i * cells + j) * cells + k].iter().all(|&q| {
                        let q = cloud.points[q as usize];
                        norm([p[0] - q[0], p[1] - q[1], p[2] - q[2]]) > spacing
                    })
                })
            })
        });
        if free {
            misses = 0;
            grid[(c[0] * cells + c[1]) * cells + c[2]].push(cloud.points.len() as u32);
            cloud.points.push(p);
            cloud.normals.push(unit(gradient(p)));
        } else {
            misses += 1;
        }
    }
    cloud.radii = vec![0.72 * spacing; cloud.points.len()];
    cloud.curvatures = vec![[0.0; 2]; cloud.points.len()];
    cloud
}

fn gyroid(spacing: f64) -> Cloud {
    implicit(|[x, y, z]| x.sin() * y.cos() + y.sin() * z.cos() + z.sin() * x.cos(), PI, spacing)
}

/// Soft balls along a random walk: something like a molecule.
fn molecule(spacing: f64) -> Cloud {
    let mut state = 7u64;
    let mut random = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    let mut atoms: Vec<[f64; 3]> = vec![[0.0; 3]];
    while atoms.len() < 160 {
        let from = atoms[atoms.len() - 1];
        atoms.push(std::array::from_fn(|k| (from[k] + 0.5 * random()) * 0.975));
    }
    implicit(
        move |p| {
            let sum: f64 = atoms
                .iter()
                .map(|a| {
                    let d = norm([p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
                    if d < 0.6 { (-(d * d) / 0.018).exp() } else { 0.0 }
                })
                .sum();
            -(sum.max(1e-300)).ln() * 0.1 - 0.05
        },
        1.6,
        spacing,
    )
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "gallery".to_owned());
    let only = std::env::args().nth(2);
    std::fs::create_dir_all(&folder)?;
    let discs = PictureOptions { style: Style::Discs, ..Default::default() };
    let surface = PictureOptions::default();
    let slate = PictureOptions { body: Some([0.17, 0.20, 0.25]), ..discs };
    let open = PictureOptions { body: None, ..discs };
    let height = PictureOptions { coloring: Coloring::Height, ..surface };
    let pictures: [(&str, fn() -> Cloud, PictureOptions); 10] = [
        ("sphere-discs", || sphere(2_000), discs),
        ("sphere-surface", || sphere(100_000), surface),
        ("torus-discs", || torus(4_000), PictureOptions { elevation: 0.7, ..discs }),
        ("trefoil-discs", || trefoil(9_000), PictureOptions { elevation: 0.9, ..discs }),
        ("trefoil-surface", || trefoil(100_000), PictureOptions { elevation: 0.9, ..height }),
        ("sphere-open-discs", || sphere(2_000), open),
        ("trefoil-slate-discs", || trefoil(9_000), PictureOptions { elevation: 0.9, ..slate }),
        ("gyroid-surface", || gyroid(0.035), surface),
        ("gyroid-discs", || gyroid(0.12), discs),
        ("molecule-surface", || molecule(0.02), surface),
    ];
    for (name, cloud, options) in pictures {
        if only.as_ref().is_some_and(|only| !name.contains(only)) {
            continue;
        }
        let cloud = cloud();
        let start = Instant::now();
        let picture = render(&cloud.borrowed(), &options)?;
        println!("{name}: {} points, {:.2} s", cloud.points.len(), start.elapsed().as_secs_f64());
        picture.save(format!("{folder}/{name}.png"))?;
    }
    Ok(())
}
