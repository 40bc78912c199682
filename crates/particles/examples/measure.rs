//! Evenness, speed and memory of `sample` on a few surfaces, to be read by people:
//! `cargo run --release -p isoswarm-particles --example measure -- 100000 blobs`
//! takes the number of samples and a name of a surface, a formula, or `all`; a third argument is the seed.

use std::f64::consts::PI;
use std::time::Instant;

use isoswarm_field::{Aabb, Field, text};
use isoswarm_particles::{Amount, Method, Options, sample};

/// 16 blobs on a spiral that hang together.
fn blobs() -> String {
    let blob = |i: u32| {
        let t = f64::from(i) * 0.8;
        let r = 0.6 + 0.02 * f64::from(i);
        let (x, y, z) = (r * t.cos(), r * t.sin(), 0.11 * f64::from(i) - 0.8);
        format!("exp(-((x - {x:.6})^2 + (y - {y:.6})^2 + (z - {z:.6})^2) / 0.09)").replace("- -", "+ ")
    };
    format!("0.4 - ({})", (0..16).map(blob).collect::<Vec<_>>().join(" + "))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().collect();
    let n = args.get(1).map_or(Ok(5000), |s| s.parse())?;
    let which = args.get(2).map_or("all", String::as_str);
    let seed = args.get(3).map_or(Ok(0), |s| s.parse())?;
    let method = match args.get(4).map(String::as_str) {
        Some("random") => Method::Random,
        Some("adaptive") => Method::Adaptive,
        Some("simple") => Method::Simple,
        Some("fissioning") => Method::Fissioning,
        _ => Method::Even,
    };
    let cube = |h: f64| Aabb::new([-h; 3], [h; 3]);
    let mut surfaces = vec![
        ("sphere", "x^2 + y^2 + z^2 - 1".to_string(), cube(1.25)),
        ("torus", "(x^2 + y^2 + z^2 + 0.84)^2 - 4*(x^2 + y^2)".to_string(), cube(1.6)),
        ("blobs", blobs(), cube(2.0)),
        ("gyroid", "sin(x)*cos(y) + sin(y)*cos(z) + sin(z)*cos(x)".to_string(), cube(PI)),
    ];
    if which != "all" && surfaces.iter().all(|s| s.0 != which) {
        surfaces = vec![("formula", which.to_string(), cube(2.0))];
    }
    for (name, formula, bounds) in
        surfaces.iter().filter(|s| which == "all" || s.0 == which || s.0 == "formula")
    {
        let field = Field::new(&text::parse(formula, &[])?)?;
        let clock = Instant::now();
        let s =
            sample(&field, bounds, Options { amount: Amount::Count(n), method, seed, ..Options::default() })?;
        let (r, e) = (&s.report, &s.report.evenness);
        println!(
            "{name}: {:.3} s, {} samples, rho_min {:.3}, rho_avg {:.3}, CV {:.4}, six-valent {:.3}, coverage {:.3}, \
             off {:.1e}, spacing {:.5}, area {:.5}, {} components, certified {}, {} steps, {:.0} evaluations a sample, {:?}",
            clock.elapsed().as_secs_f64(),
            s.points.len(),
            e.rho_min,
            e.rho_avg,
            e.cv,
            e.six_valent,
            e.coverage,
            r.max_error,
            r.spacing,
            r.area,
            r.components,
            r.certified,
            r.steps,
            r.evaluations as f64 / s.points.len().max(1) as f64,
            r.status,
        );
    }
    Ok(())
}
