//! Evenness, speed and memory of `sample` on a few surfaces, to be read by people:
//! `cargo run --release -p isoswarm-particles --example measure -- 100000 blobs`
//! takes the number of samples and a name of a surface (`sixteen`, `protein`, ...), a formula, or `all`; then the seed,
//! the method, how often to run (the fastest counts), and the steps of settling at full resolution.

use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::time::Instant;

use isoswarm_field::{Aabb, Field, text};
use isoswarm_particles::{Amount, Method, Options, Phase, Progress, ProgressFn, Samples, sample};

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

/// Centre and radius of the 16 blobs of `make bench`.
const SIXTEEN: [[f64; 4]; 16] = [
    [0.133834, -0.138512, -0.811852, 0.464050],
    [-0.303841, 0.243018, -0.956690, 0.647841],
    [0.749265, 0.708099, -0.911392, 0.597152],
    [0.604842, -0.630410, 0.391248, 0.554640],
    [-0.689999, 0.383240, 0.917268, 0.602930],
    [0.969970, 0.326591, -0.672824, 0.610518],
    [-0.210179, -0.444010, 0.911339, 0.583329],
    [-0.401310, 0.122154, -0.185269, 0.520257],
    [-0.722545, -0.230517, 0.538830, 0.513815],
    [-0.172801, 0.358629, 0.163708, 0.583928],
    [-0.846956, 0.459770, 0.347952, 0.478766],
    [0.603865, -0.702137, 0.948998, 0.490263],
    [0.735307, 0.806140, 0.923890, 0.489363],
    [0.242338, -0.257640, -0.884069, 0.542049],
    [0.397187, 0.263184, 0.298074, 0.572863],
    [-0.986765, 0.891366, -0.225898, 0.550621],
];

/// F = 1 - Σ exp(2 - 2 |p - cᵢ|² / rᵢ²), and a box around it.
fn gaussians(balls: &[[f64; 4]], reach: f64) -> (String, Aabb) {
    let mut numbers = Vec::new();
    let mut bounds = Aabb::new([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for b in balls {
        numbers.push(b.map(|v| v.to_string()).join(", "));
        for a in 0..3 {
            bounds.lo[a] = bounds.lo[a].min(b[a] - reach * b[3]);
            bounds.hi[a] = bounds.hi[a].max(b[a] + reach * b[3]);
        }
    }
    (format!("gaussians(1, 2, {})", numbers.join(", ")), bounds)
}

/// The atoms of `models/1tii.pdb` without its water, van der Waals radii in ångström.
fn protein() -> Result<Vec<[f64; 4]>, Box<dyn std::error::Error>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/1tii.pdb");
    let mut balls = Vec::new();
    for line in std::fs::read_to_string(path)?.lines().filter(|l| l.starts_with("ATOM")) {
        let radius = match line[76..78].trim() {
            "C" => 1.70,
            "N" => 1.55,
            "O" => 1.52,
            "S" => 1.80,
            other => return Err(format!("no radius for {other}").into()),
        };
        let at = |k: usize| line[30 + 8 * k..38 + 8 * k].trim().parse::<f64>();
        balls.push([at(0)?, at(1)?, at(2)?, radius]);
    }
    Ok(balls)
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
    let runs: usize = args.get(5).map_or(Ok(1), |s| s.parse())?;
    let steps = args.get(6).map(|s| s.parse()).transpose()?;
    for (name, formula, bounds) in surfaces(which)? {
        let field = Field::new(&text::parse(&formula, &[])?)?;
        let (mut fastest, mut least) = (f64::INFINITY, f64::INFINITY);
        for run in 1..=runs {
            let mut log = Log::new();
            let mut watch = |p: &Progress| {
                log.note(p);
                ControlFlow::Continue(())
            };
            let progress: Option<&mut ProgressFn<'_>> = Some(&mut watch);
            let options =
                Options { amount: Amount::Count(n), method, seed, steps, progress, ..Options::default() };
            let s = sample(&field, &bounds, options)?;
            fastest = fastest.min(log.seconds());
            least = least.min(log.processor());
            if run == runs {
                log.print();
                describe(name, fastest, least, &s);
            }
        }
    }
    Ok(())
}

type Case = (&'static str, String, Aabb);

fn surfaces(which: &str) -> Result<Vec<Case>, Box<dyn std::error::Error>> {
    let cube = |h: f64| Aabb::new([-h; 3], [h; 3]);
    let usual = [
        ("sphere", "x^2 + y^2 + z^2 - 1".to_string(), cube(1.25)),
        ("torus", "(x^2 + y^2 + z^2 + 0.84)^2 - 4*(x^2 + y^2)".to_string(), cube(1.6)),
        ("blobs", blobs(), cube(2.0)),
        ("gyroid", "sin(x)*cos(y) + sin(y)*cos(z) + sin(z)*cos(x)".to_string(), cube(PI)),
    ];
    let (sixteen, around) = gaussians(&SIXTEEN, 1.55);
    Ok(match which {
        "all" => usual.to_vec(),
        "sixteen" => vec![("sixteen", sixteen, around)],
        "protein" => {
            let (formula, bounds) = gaussians(&protein()?, 3.0);
            vec![("protein", formula, bounds)]
        }
        other => match usual.into_iter().find(|s| s.0 == other) {
            Some(known) => vec![known],
            None => vec![("formula", other.to_string(), cube(2.0))],
        },
    })
}

/// When each phase and each resolution began.
struct Log {
    clock: Instant,
    begin: f64,
    last: (Phase, usize),
    lines: Vec<String>,
}

impl Log {
    fn new() -> Self {
        Self { clock: Instant::now(), begin: processor(), last: (Phase::Seeding, 0), lines: Vec::new() }
    }

    fn processor(&self) -> f64 {
        processor() - self.begin
    }

    fn seconds(&self) -> f64 {
        self.clock.elapsed().as_secs_f64()
    }

    fn note(&mut self, p: &Progress) {
        if (p.phase, p.floaters) != self.last {
            self.last = (p.phase, p.floaters);
            let line = format!(
                "{:.3} s ({:.3} s of the processor): {:?}, {} floaters, step {}",
                self.seconds(),
                self.processor(),
                p.phase,
                p.floaters,
                p.steps
            );
            self.lines.push(line);
        }
    }

    fn print(&self) {
        self.lines.iter().for_each(|l| println!("  {l}"));
    }
}

/// Processor time of all threads so far in seconds, where the system tells it: on a busy machine it says more.
fn processor() -> f64 {
    let Ok(threads) = std::fs::read_dir("/proc/self/task") else { return f64::NAN };
    let running = |t: std::fs::DirEntry| std::fs::read_to_string(t.path().join("schedstat")).ok();
    let all = threads.flatten().filter_map(running);
    1e-9 * all.filter_map(|s| s.split_whitespace().next()?.parse::<f64>().ok()).sum::<f64>()
}

/// The high-water mark of this programme's memory in bytes, where the system tells it.
fn peak() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    Some(1024.0 * line.split_whitespace().next()?.parse::<f64>().ok()?)
}

fn describe(name: &str, seconds: f64, processor: f64, s: &Samples) {
    let (r, e) = (&s.report, &s.report.evenness);
    println!(
        "{name}: {seconds:.3} s, {processor:.3} s of the processor, {} samples, rho_min {:.3}, rho_avg {:.3}, CV {:.4}, six-valent {:.3}, coverage {:.3}, \
         off {:.1e}, spacing {:.5}, area {:.5}, {} components, certified {}, {} steps, {:.0} evaluations a sample, {:?}",
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
    if let Some(bytes) = peak() {
        println!("  {:.1} MB at most", 1e-6 * bytes);
    }
}
