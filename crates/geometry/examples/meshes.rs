use isoswarm_field::{Aabb, Field, text};
use isoswarm_geometry::*;
use isoswarm_particles::*;
fn main() {
    let want: Vec<String> = std::env::args().skip(2).collect();
    let n: usize = std::env::args().nth(1).unwrap().parse().unwrap();
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/surfaces.json");
    let list: Vec<serde_json::Value> = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    for s in &list {
        let name = s["name"].as_str().unwrap();
        if want.is_empty() {
            if !(s["smooth"].as_bool().unwrap() && s["compact"].as_bool().unwrap()) {
                continue;
            }
        } else if !want.iter().any(|w| w == name) {
            continue;
        }
        let tags: Vec<&str> = s["tags"].as_array().unwrap().iter().map(|t| t.as_str().unwrap()).collect();
        let thin = tags.iter().any(|t| *t == "thin" || *t == "high-curvature-rim");
        let m = if thin && n == 20000 { 100_000 } else { n };
        let f = Field::new(&text::parse(s["expr"].as_str().unwrap(), &[]).unwrap()).unwrap();
        let b = &s["bbox"];
        let p = |k: usize| [0, 1, 2].map(|a| b[k][a].as_f64().unwrap());
        let bounds = Aabb::new(p(0), p(1));
        let t = std::time::Instant::now();
        let samples = match sample(&f, &bounds, Options { amount: Amount::Count(m), ..Default::default() }) {
            Ok(s) => s,
            Err(e) => {
                println!("{name}: {e}");
                continue;
            }
        };
        let ts = t.elapsed().as_secs_f64();
        let t = std::time::Instant::now();
        let r = mesh(&f, &bounds, MeshOptions { resolution: Resolution::Count(m), ..Default::default() })
            .unwrap();
        let tm = t.elapsed().as_secs_f64();
        let q = r.report.quality;
        let top = &r.report.topology;
        println!(
            "{name:20} n {} sample {ts:.2}s mesh {tm:.2}s chi {}/{} comp {}/{} closed {} manifold {} bnd {} faults {} filled {} Q {:.4} min {:.3} ang {:.1} <30 {:.5} val {:?} six {:.3} holes? {:?}",
            r.mesh.points.len(),
            top.total_euler(),
            s["euler"],
            top.components(),
            s["components"],
            top.is_closed(),
            top.is_manifold(),
            top.boundaries,
            top.faults.len(),
            r.report.filled,
            q.q_avg,
            q.q_min,
            q.smallest_angle,
            q.below_30,
            q.valence,
            q.six_valent,
            r.report.warnings
        );
        println!(
            "    inserted {} removed {} flips {} maxd {:.2e} inter {} doubtful {}",
            r.report.inserted,
            r.report.removed,
            r.report.flips,
            r.report.max_distance,
            r.report.self_intersections.len(),
            r.report.doubtful.len()
        );
        if std::env::var("OPEN").is_ok() {
            _open(&r.mesh, &bounds);
        }
        let mut kinds = std::collections::BTreeMap::new();
        for f in &top.faults {
            *kinds.entry(format!("{f:?}").split(' ').next().unwrap().to_string()).or_insert(0) += 1;
        }
        if !kinds.is_empty() {
            println!("    {kinds:?}");
        }
    }
}
fn _open(m: &Mesh, b: &Aabb) {
    let mut e = std::collections::BTreeMap::new();
    for f in &m.faces {
        for k in 0..3 {
            let (x, y) = (f[k], f[(k + 1) % 3]);
            *e.entry((x.min(y), x.max(y))).or_insert(0) += 1;
        }
    }
    let on = |p: [f64; 3]| -> Vec<i32> {
        (0..3)
            .flat_map(|a| {
                let mut v = vec![];
                if (p[a] - b.lo[a]).abs() < 1e-9 {
                    v.push(-(a as i32) - 1)
                }
                if (p[a] - b.hi[a]).abs() < 1e-9 {
                    v.push(a as i32 + 1)
                }
                v
            })
            .collect()
    };
    let mut c = 0;
    for ((x, y), n) in &e {
        if *n == 1 {
            let (p, q) = (m.points[*x as usize], m.points[*y as usize]);
            if !on(p).iter().any(|a| on(q).contains(a)) {
                c += 1;
                if c < 12 {
                    println!("  open {x} {p:?} {:?} {y} {q:?} {:?}", on(p), on(q));
                }
            }
        }
    }
    println!("  {c} open edges off the bounds");
}
