#[path = "../tests/surfaces/mod.rs"]
mod surfaces;
use isoswarm_field::{Aabb, Surface};
use isoswarm_particles::*;
use surfaces::*;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let n: usize = args.get(1).map_or(5000, |s| s.parse().unwrap());
    let which = args.get(2).cloned().unwrap_or_default();
    let pi = std::f64::consts::PI;
    let all: Vec<(&str, Box<dyn Surface>, Aabb)> = vec![
        ("sphere", Box::new(sphere([0.0; 3], 1.0)), cube_bounds(1.25)),
        ("torus", Box::new(torus(1.0, 0.4)), cube_bounds(1.5)),
        ("blobs", Box::new(sixteen()), cube_bounds(2.5)),
        ("gyroid", Box::new(gyroid(1.0)), cube_bounds(pi)),
        ("cube", Box::new(cube(1.0)), cube_bounds(1.2)),
        ("pancake", Box::new(ellipsoid([1.0, 1.0, 0.05])), cube_bounds(1.1)),
        ("shells", Box::new(shells(vec![0.5, 0.6, 1.0])), cube_bounds(1.1)),
        ("heart", Box::new(heart()), cube_bounds(1.5)),
        ("cone", Box::new(cone()), cube_bounds(1.0)),
        ("ellipse", Box::new(ellipse(1.0, 0.3)), cube_bounds(1.1)),
    ];
    for (name, s, b) in &all {
        if !which.is_empty() && !which.split(',').any(|w| w == *name) {
            continue;
        }
        for seed in 0..args.get(3).map_or(1, |s| s.parse().unwrap()) {
            let t = std::time::Instant::now();
            let r = sample(s.as_ref(), b, Options { amount: Amount::Count(n), seed, ..Options::default() });
            let t = t.elapsed().as_secs_f64();
            match r {
                Ok(s) => {
                    let (r, e) = (&s.report, &s.report.evenness);
                    println!(
                        "{name:8} {t:.3}s n {} rho_min {:.3} rho_avg {:.4} cv {:.4} six {:.3} cover {:.3} comp {} cert {} err {:.1e} area {:.4} nn {:.4} bd {} sing {} steps {} evals/n {:.1} births {} deaths {} {:?}",
                        s.points.len(),
                        e.rho_min,
                        e.rho_avg,
                        e.cv,
                        e.six_valent,
                        e.coverage,
                        r.components,
                        r.certified,
                        r.max_error,
                        r.area,
                        r.spacing,
                        r.on_bounds,
                        r.singular,
                        r.steps,
                        r.evaluations as f64 / n as f64,
                        r.births,
                        r.deaths,
                        r.status
                    );
                }
                Err(e) => println!("{name}: {e}"),
            }
        }
    }
}
