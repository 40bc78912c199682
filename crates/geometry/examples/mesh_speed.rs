//! Times of meshes of the four surfaces that are compared with CGAL and marching cubes:
//! `cargo run --release -p isoswarm-geometry --example mesh_speed -- [n | error] [rounds] [surface]`. Without `error`: 10,000 vertices; with
//! it: the distances that marching cubes reaches on a grid of 96³ cells.

use std::fmt::Write;
use std::time::Instant;

use isoswarm_field::{Aabb, Field, text};
use isoswarm_geometry::{MeshOptions, Resolution, mesh};
use isoswarm_particles::{Amount, Options, sample};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let what = args.next().unwrap_or_else(|| "10000".into());
    let rounds: usize = args.next().map_or(Ok(5), |a| a.parse())?;
    let only = args.next();
    let mut blobs = String::from("0.4");
    for i in 0..16u32 {
        let (t, r, z) = (0.8 * f64::from(i), 0.6 + 0.02 * f64::from(i), 0.11 * f64::from(i) - 0.8);
        write!(blobs, "-exp(-((x-({:?}))^2+(y-({:?}))^2+(z-({z:?}))^2)/0.09)", r * t.cos(), r * t.sin())?;
    }
    let surfaces = [
        ("sphere", "x^2+y^2+z^2-1", 1.25, 2.5e-4),
        ("torus", "(x^2+y^2+z^2+0.84)^2-4*(x^2+y^2)", 1.6, 1.1e-3),
        ("tanglecube", "x^4-5*x^2+y^4-5*y^2+z^4-5*z^2+11.8", 3.0, 4.5e-3),
        ("blobs", &blobs, 1.6, 2.9e-3),
    ];
    for (name, formula, half, error) in surfaces {
        if only.as_deref().is_some_and(|o| o != name) {
            continue;
        }
        let field = Field::new(&text::parse(formula, &[])?)?;
        let bounds = Aabb::new([-half; 3], [half; 3]);
        let resolution =
            if what == "error" { Resolution::Error(error) } else { Resolution::Count(what.parse()?) };
        let mut best = [f64::INFINITY; 2];
        let (mut made, mut busy) = (None, 0.0);
        for _ in 0..rounds.max(1) {
            let begin = Instant::now();
            if let Resolution::Count(n) = resolution {
                sample(&field, &bounds, Options { amount: Amount::Count(n), ..Options::default() })?;
                best[0] = best[0].min(begin.elapsed().as_secs_f64());
            }
            let (begin, before) = (Instant::now(), processor_time());
            made = Some(mesh(&field, &bounds, MeshOptions { resolution, ..MeshOptions::default() })?);
            busy += (processor_time() - before) / rounds.max(1) as f64;
            best[1] = best[1].min(begin.elapsed().as_secs_f64());
        }
        let Some(made) = made else { continue };
        let r = &made.report;
        println!(
            "{name:10} {:6} vertices {:6} faces  samples alone {:.3} s  mesh {:.3} s ({:.3} s of processor time)  Q {:.4}  least angle {:.1}  off {:.2e}  \
             evaluations {}  sound {}",
            made.mesh.points.len(),
            made.mesh.faces.len(),
            best[0],
            best[1],
            busy,
            r.quality.q_avg,
            r.quality.smallest_angle,
            r.max_distance,
            r.evaluations,
            r.is_sound(),
        );
        for w in &r.warnings {
            println!("           {w}");
        }
    }
    Ok(())
}

/// Of all threads so far, seconds; 0 where the system does not tell.
fn processor_time() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let one = |t: std::fs::DirEntry| -> f64 {
        let text = std::fs::read_to_string(t.path().join("schedstat")).unwrap_or_default();
        text.split_whitespace().next().and_then(|v| v.parse().ok()).unwrap_or(0.0)
    };
    1e-9 * tasks.map(one).sum::<f64>()
}
