//! A cold fit of many blobs to points, for the benchmarks (`make bench ARGS=fit`):
//! `cargo run --release -p isoswarm-particles --example fit -- smooth 250 5000 5`
//! takes the kind of blobs (`smooth` or `gaussians`), their number, the number of points, how often to run (the fastest counts), or
//! whether to serve the problem to another program (`serve`) instead of solving it. Prints its result as JSON.
//!
//! As a server it writes two 64-bit integers n and m and the start q, then answers requests: `r` or `j` and m numbers q give the n
//! residuals or the n × m derivatives. Numbers are in the machine's own order.

use std::io::{Read, Write};
use std::ops::ControlFlow;
use std::time::Instant;

use isoswarm_field::{Aabb, Field, Parametric, text};
use isoswarm_particles::control::{FitOptions, FitProgress, fit, fit_residuals};
use isoswarm_particles::rng::{Rng, Stream};
use isoswarm_particles::{Amount, Method, Options, sample};

/// Centre and radius of each blob: as they are, or as they are guessed.
fn blobs(n: usize, radii: (f64, f64), guessed: bool) -> Vec<[f64; 4]> {
    let rng = Rng::new(1, Stream::Jitter);
    let unit = |i: usize, k: usize| rng.unit((8 * i + k) as u64);
    let blob = |i: usize| {
        let mut b = [0.0; 4];
        for a in 0..3 {
            b[a] = 2.0 * unit(i, a) - 1.0;
            if guessed {
                b[a] += 0.1 * (2.0 * unit(i, a + 4) - 1.0);
            }
        }
        let (lo, hi) = radii;
        b[3] = if guessed { 0.5 * (lo + hi) } else { lo + (hi - lo) * unit(i, 3) };
        b
    };
    (0..n).map(blob).collect()
}

/// The formula and its parameters: centre and radius of each blob, without limits (not every peer knows limits).
fn field(kind: &str, blobs: &[[f64; 4]]) -> Result<Field, Box<dyn std::error::Error>> {
    let names: Vec<[String; 4]> =
        (0..blobs.len()).map(|i| ["a", "b", "c", "r"].map(|n| format!("{n}{i}"))).collect();
    let mut values = Vec::new();
    let mut terms = Vec::new();
    for ([a, b, c, r], blob) in names.iter().zip(blobs) {
        values.extend([a, b, c, r].into_iter().map(String::as_str).zip(*blob));
        let square = format!("(x - {a})^2 + (y - {b})^2 + (z - {c})^2");
        terms.push(match kind {
            "smooth" => format!("sqrt({square}) - {r}"),
            _ => format!("exp(2 - 2*({square})/{r}^2)"),
        });
    }
    let formula = match kind {
        "smooth" => format!("smooth_union({}, k=1/8)", terms.join(", ")),
        _ => format!("1 - ({})", terms.join(" + ")),
    };
    let mut field = Field::new(&text::parse(&formula, &values)?)?;
    if let Ok(k) = field.parameter("smooth_union/k") {
        field.set_frozen(k, true);
    }
    Ok(field)
}

/// Answers requests for residuals and derivatives until the input ends.
fn serve(mut surface: Field, points: &[[f64; 3]]) -> Result<(), Box<dyn std::error::Error>> {
    let (mut input, mut output) = (std::io::stdin().lock(), std::io::stdout().lock());
    let bytes = |numbers: &[f64]| -> Vec<u8> { numbers.iter().flat_map(|v| v.to_ne_bytes()).collect() };
    let m = surface.freedom();
    output.write_all(&(points.len() as u64).to_ne_bytes())?;
    output.write_all(&(m as u64).to_ne_bytes())?;
    output.write_all(&bytes(&surface.q()))?;
    output.flush()?;
    let (mut what, mut q) = ([0], vec![0; 8 * m]);
    while input.read_exact(&mut what).is_ok() {
        input.read_exact(&mut q)?;
        let q: Vec<f64> = q
            .as_chunks::<8>()
            .0
            .iter()
            .map(|b| f64::from_ne_bytes(*b))
            .map(|v| v.clamp(-1e300, 1e300))
            .collect();
        Parametric::set_q(&mut surface, &q)?;
        let (f, j) = fit_residuals(&surface, points, &FitOptions::default())?;
        output.write_all(&bytes(if what == *b"j" { &j } else { &f }))?;
        output.flush()?;
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().collect();
    let kind = args.get(1).map_or("smooth", String::as_str);
    let number = |i: usize, default: usize| args.get(i).map_or(Ok(default), |s| s.parse());
    let (count, n) = (number(2, 250)?, number(3, 5000)?);
    let radii = if kind == "smooth" { (0.1, 0.3) } else { (0.15, 0.3) };
    let truth = field(kind, &blobs(count, radii, false))?;
    let bounds = Aabb::new([-2.5; 3], [2.5; 3]);
    let options = Options { amount: Amount::Count(n), method: Method::Random, ..Options::default() };
    let mut points = sample(&truth, &bounds, options)?.points;
    let rng = Rng::new(2, Stream::Jitter);
    for (i, p) in points.iter_mut().enumerate() {
        // Noise of a thousandth of the models' width.
        let d = rng.direction(i as u64, 3);
        p.iter_mut().zip(d).for_each(|(p, d)| *p += 2e-3 * d);
    }
    let start = field(kind, &blobs(count, radii, true))?;
    if args.get(4).is_some_and(|s| s == "serve") {
        return serve(start, &points);
    }
    let runs = number(4, 1)?;
    let mut seconds = f64::INFINITY;
    let mut best = None;
    for _ in 0..runs.max(1) {
        let mut surface = start.clone();
        let clock = Instant::now();
        let mut log = Vec::new();
        let mut watch = |p: &FitProgress| {
            log.push((clock.elapsed().as_secs_f64(), p.rms));
            ControlFlow::Continue(())
        };
        let options = FitOptions { tolerance: 1e-2, progress: Some(&mut watch), ..FitOptions::default() };
        let result = fit(&mut surface, &points, options)?;
        let time = clock.elapsed().as_secs_f64();
        if time < seconds {
            (seconds, best) = (time, Some((result, log)));
        }
    }
    let (result, log) = best.ok_or("no run")?;
    let log: Vec<String> = log.iter().map(|(t, rms)| format!("[{t:.6}, {rms:e}]")).collect();
    println!(
        "{{\"parameters\": {}, \"points\": {}, \"seconds\": {seconds}, \"rms\": {:e}, \"largest\": {:e}, \"rank\": {}, \
         \"iterations\": {}, \"evaluations\": {}, \"status\": \"{:?}\", \"log\": [{}]}}",
        result.freedom,
        points.len(),
        result.rms,
        result.largest,
        result.rank,
        result.iterations,
        result.evaluations,
        result.status,
        log.join(", ")
    );
    Ok(())
}
