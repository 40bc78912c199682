//! Meshes of surfaces: topology, boundary, quality, distance, what is said where it does not work, and what must not matter.

use isoswarm_field::vector::norm;
use isoswarm_field::{Aabb, Field, FieldError, Surface, text};
use isoswarm_geometry::{Mesh, MeshOptions, Meshed, Resolution, Rule, mesh, mesh_samples};
use isoswarm_particles::{Amount, Density, Options, sample};
use serde_json::Value;

const SPHERE: &str = "x^2+y^2+z^2-1";

fn field(formula: &str) -> Field {
    Field::new(&text::parse(formula, &[]).unwrap()).unwrap()
}

/// The models with what is known of them.
fn models() -> Vec<Value> {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/surfaces.json");
    serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap()
}

fn model(name: &str) -> (Field, Aabb) {
    let all = models();
    let m = all.iter().find(|m| m["name"] == name).unwrap();
    (field(m["expr"].as_str().unwrap()), bounds(m))
}

fn bounds(m: &Value) -> Aabb {
    let corner = |k: usize| [0, 1, 2].map(|a| m["bbox"][k][a].as_f64().unwrap());
    Aabb::new(corner(0), corner(1))
}

fn has(m: &Value, tag: &str) -> bool {
    m["tags"].as_array().unwrap().iter().any(|t| t == tag)
}

fn with<'a>(n: usize) -> MeshOptions<'a> {
    MeshOptions { resolution: Resolution::Count(n), ..MeshOptions::default() }
}

fn cube(half: f64) -> Aabb {
    Aabb::new([-half; 3], [half; 3])
}

/// Checks what the table of models says of a closed smooth surface.
fn is_right(m: &Value, n: usize) {
    let name = m["name"].as_str().unwrap();
    let Meshed { mesh: made, report } =
        mesh(&field(m["expr"].as_str().unwrap()), &bounds(m), with(n)).unwrap();
    let t = &report.topology;
    assert!(t.is_closed(), "{name}: {:?} {:?}", t.faults, report.warnings);
    assert_eq!(t.total_euler(), m["euler"].as_i64().unwrap(), "{name}");
    assert_eq!(t.components() as i64, m["components"].as_i64().unwrap(), "{name}");
    let mut genus = t.genus();
    genus.sort_unstable();
    let mut known: Vec<i64> = m["genus"].as_array().unwrap().iter().map(|g| g.as_i64().unwrap()).collect();
    known.sort_unstable();
    assert_eq!(genus, known, "{name}");
    assert!(report.self_intersections.is_empty(), "{name}");
    assert!(
        (made.points.len() as f64 / n as f64 - 1.0).abs() < 0.02,
        "{name}: {} vertices",
        made.points.len()
    );
    // Inscribed triangles fall short of the area; the volume also checks the orientation.
    let off = made.area() / m["area"].as_f64().unwrap() - 1.0;
    assert!(off.abs() < 3e-3 + m["area_rel_err"].as_f64().unwrap(), "{name}: area off by {off}");
    let off = made.volume() / m["volume"].as_f64().unwrap() - 1.0;
    assert!(off.abs() < 1e-2, "{name}: volume off by {off}");
}

#[test]
fn every_smooth_compact_surface_has_its_topology_at_20000() {
    let all = models();
    let good = all.iter().filter(|m| m["smooth"] == true && m["compact"] == true);
    let plain: Vec<&Value> = good.filter(|m| !has(m, "thin") && !has(m, "high-curvature-rim")).collect();
    assert!(plain.len() >= 12);
    for m in plain {
        is_right(m, 20_000);
    }
}

#[test]
fn every_thin_surface_has_its_topology_at_100000() {
    let all = models();
    let good = all.iter().filter(|m| m["smooth"] == true && m["compact"] == true);
    for m in good.filter(|m| has(m, "thin") || has(m, "high-curvature-rim")) {
        is_right(m, 100_000);
    }
}

/// Σ exp bumps on a helix that hang together, as the benchmarks have them.
fn sixteen_blobs() -> (Field, Aabb) {
    let blob = |i: i32| {
        let (t, r) = (f64::from(i) * 0.8, 0.6 + 0.02 * f64::from(i));
        let (x, y, z) = (r * t.cos(), r * t.sin(), 0.11 * f64::from(i) - 0.8);
        format!("-exp(-((x-({x}))^2+(y-({y}))^2+(z-({z}))^2)/0.09)")
    };
    (field(&format!("0.4{}", (0..16).map(blob).collect::<String>())), cube(2.0))
}

#[test]
fn triangles_are_good_at_10000() {
    for name in ["sphere", "torus", "tanglecube", "blobs"] {
        let (f, b) = if name == "blobs" { sixteen_blobs() } else { model(name) };
        let report = mesh(&f, &b, with(10_000)).unwrap().report;
        let q = report.quality;
        assert!(report.is_sound() && report.topology.is_closed(), "{name}: {:?}", report.warnings);
        assert!(q.q_avg >= 0.95, "{name}: {q:?}");
        assert!(q.smallest_angle >= 35.0, "{name}: {q:?}");
        assert!(q.valence[0] >= 5 && q.valence[1] <= 7, "{name}: {q:?}");
    }
}

#[test]
fn clipped_surfaces_end_on_the_bounds() {
    // Euler characteristics of the parts in the box: an annulus, a disc; the others have been counted on fine meshes.
    for (name, euler) in [
        ("hyperboloid1", Some(0)),
        ("monkey_saddle", Some(1)),
        ("gyroid", None),
        ("schwarz_p", Some(-4)),
        ("clebsch_cubic", None),
    ] {
        let (f, b) = model(name);
        let Meshed { mesh: made, report } = mesh(&f, &b, with(8000)).unwrap();
        let t = &report.topology;
        assert!(t.is_manifold() && t.boundaries > 0 && t.components() == 1, "{name}: {:?}", report.warnings);
        // Clebsch's cubic has necks that 8000 vertices bend around by more than 60 degrees.
        assert!(report.is_sound() || name == "clebsch_cubic", "{name}: {:?}", report.warnings);
        if let Some(euler) = euler {
            assert_eq!(t.total_euler(), euler, "{name}");
        }
        let faces = |p: [f64; 3]| -> Vec<(usize, bool)> {
            (0..3)
                .flat_map(|a| [(a, p[a] == b.lo[a], false), (a, p[a] == b.hi[a], true)])
                .filter(|x| x.1)
                .map(|x| (x.0, x.2))
                .collect()
        };
        for [v, w] in boundary(&made) {
            let (p, q) = (faces(made.points[v as usize]), faces(made.points[w as usize]));
            assert!(
                p.iter().any(|f| q.contains(f)),
                "{name}: the boundary leaves the bounds at {:?}",
                made.points[v as usize]
            );
        }
        assert!(made.points.iter().all(|p| b.contains(*p)), "{name}");
        assert!(report.quality.smallest_angle > 20.0, "{name}: {:?}", report.quality);
    }
    // The corners are where the surface meets the edges of the box.
    let made = mesh(&field("z - 0.1*x"), &Aabb::new([-1.0; 3], [1.0; 3]), with(200)).unwrap().mesh;
    for (x, y) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        assert!(made.points.iter().any(|p| p[0] == x && p[1] == y && (p[2] - 0.1 * x).abs() < 1e-12));
    }
}

#[test]
fn a_step_of_the_density_leaves_no_sample_out() {
    let f = field("x^2+y^2-z^2-0.25");
    let step = |points: &[[f64; 3]], out: &mut [f64]| {
        out.iter_mut().zip(points).for_each(|(d, p)| *d = if p[2] > 0.0 { 9.0 } else { 1.0 });
        Ok(())
    };
    for (n, seed) in [(1500, 0), (1500, 1), (1500, 2), (1500, 3), (4000, 2)] {
        let resolution = Resolution::Count(n);
        let options =
            MeshOptions { resolution, density: Density::Function(&step), seed, ..MeshOptions::default() };
        let Meshed { mesh: made, report } = mesh(&f, &cube(1.0), options).unwrap();
        assert!(report.is_sound() && report.topology.boundaries == 2, "{n} {seed}: {:?}", report.warnings);
        assert_eq!(report.topology.total_euler(), 0, "{n} {seed}");
        let up = made.points.iter().filter(|p| p[2] > 0.0).count();
        assert!(up > 2 * (made.points.len() - up), "{n} {seed}: {up}");
    }
}

/// Edges with one face.
fn boundary(m: &Mesh) -> Vec<[u32; 2]> {
    let mut edges: Vec<[u32; 2]> = m
        .faces
        .iter()
        .flat_map(|f| [[f[0], f[1]], [f[1], f[2]], [f[2], f[0]]])
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    edges.sort_unstable();
    edges.chunk_by(|a, b| a == b).filter(|c| c.len() == 1).map(|c| c[0]).collect()
}

#[test]
fn the_distance_asked_for_is_kept() {
    for (formula, half, off) in [
        (
            SPHERE,
            1.3,
            (|p: [f64; 3]| (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt() - 1.0) as fn([f64; 3]) -> f64,
        ),
        ("(sqrt(x^2+y^2)-1)^2+z^2-0.16", 1.6, |p| {
            ((p[0].hypot(p[1]) - 1.0).powi(2) + p[2] * p[2]).sqrt() - 0.4
        }),
    ] {
        for most in [1e-2, 1e-3] {
            let options = MeshOptions { resolution: Resolution::Error(most), ..MeshOptions::default() };
            let Meshed { mesh: made, report } = mesh(&field(formula), &cube(half), options).unwrap();
            assert!(report.is_sound() && report.topology.is_closed(), "{:?}", report.warnings);
            let mut worst = 0.0f64;
            for f in &made.faces {
                let [p, q, r] = f.map(|v| made.points[v as usize]);
                for w in [[1.0, 1.0, 1.0], [1.0, 1.0, 0.0], [0.0, 1.0, 1.0], [1.0, 0.0, 1.0]] {
                    let s: f64 = w.iter().sum();
                    let c = [0, 1, 2].map(|a| (w[0] * p[a] + w[1] * q[a] + w[2] * r[a]) / s);
                    worst = worst.max(off(c).abs());
                }
            }
            // The estimate |F|/|∇F| is right to first order.
            assert!(worst <= 1.05 * most, "{formula}: {worst} > {most}");
            assert!(
                worst > 0.2 * most,
                "{formula}: {worst}, far finer than {most}: {} vertices",
                made.points.len()
            );
        }
    }
}

/// A surface in other units.
struct Scaled<'a>(&'a Field, f64);

impl Surface for Scaled<'_> {
    fn value_gradient(&self, p: &[[f64; 3]], v: &mut [f64], g: &mut [[f64; 3]]) -> Result<(), FieldError> {
        let p: Vec<[f64; 3]> = p.iter().map(|p| p.map(|c| c / self.1)).collect();
        Surface::value_gradient(self.0, &p, v, g)?;
        g.iter_mut().for_each(|g| *g = g.map(|c| c / self.1));
        Ok(())
    }

    fn hessian(&self, p: &[[f64; 3]], h: &mut [[f64; 6]]) -> Result<(), FieldError> {
        let p: Vec<[f64; 3]> = p.iter().map(|p| p.map(|c| c / self.1)).collect();
        Surface::hessian(self.0, &p, h)?;
        h.iter_mut().for_each(|h| *h = h.map(|c| c / (self.1 * self.1)));
        Ok(())
    }
}

#[test]
fn the_unit_of_length_does_not_matter() {
    let (f, b) = model("torus");
    for unit in [1e-9, 1.0, 1e9] {
        let b = Aabb::new(b.lo.map(|v| v * unit), b.hi.map(|v| v * unit));
        let report = mesh(&Scaled(&f, unit), &b, with(1500)).unwrap().report;
        assert!(
            report.is_sound() && report.topology.is_closed() && report.topology.genus() == [1],
            "{unit}: {:?}",
            report.warnings
        );
        assert!(report.quality.q_avg > 0.93, "{unit}: {:?}", report.quality);
    }
}

#[test]
fn threads_do_not_matter() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let (f, b) = model("gyroid");
            mesh(&f, &b, with(3000)).unwrap()
        })
    };
    let (one, three) = (on(1), on(3));
    assert!(one == three);
}

#[test]
fn what_has_no_triangles_says_so() {
    let none = mesh(&field("x^2+y^2+z^2+1"), &cube(2.0), with(1000)).unwrap();
    assert!(none.mesh.faces.is_empty() && none.mesh.points.is_empty());
    assert!(none.report.warnings.iter().any(|w| w.contains("no surface")), "{:?}", none.report.warnings);
    // Fewer than four vertices on a component have no closed mesh.
    for n in 1..=7 {
        let few = mesh(&field(SPHERE), &cube(1.3), with(n)).unwrap();
        assert!(few.report.topology.is_closed() || !few.report.is_sound(), "{n}: {:?}", few.report);
        assert!(few.mesh.faces.iter().flatten().all(|&v| (v as usize) < few.mesh.points.len()));
    }
    let plane = Field::new(&text::parse("x^2+y^2-1", &[]).unwrap()).unwrap();
    assert!(
        mesh(&plane, &cube(2.0), MeshOptions { resolution: Resolution::Error(-1.0), ..with(9) }).is_err()
    );
}

#[test]
fn what_few_samples_do_not_resolve_gets_more_vertices() {
    let blob = |i: u32| {
        let (t, r, z) = (0.8 * f64::from(i), 0.6 + 0.02 * f64::from(i), 0.11 * f64::from(i) - 0.8);
        let (x, y) = (r * t.cos(), r * t.sin());
        format!("-exp(-((x-({x:?}))^2+(y-({y:?}))^2+(z-({z:?}))^2)/0.09)")
    };
    let blobs = format!("0.4{}", (0..16).map(blob).collect::<String>());
    let tanglecube = "x^4-5*x^2+y^4-5*y^2+z^4-5*z^2+11.8";
    for (formula, half, most, euler, evaluations) in
        [(tanglecube, 3.0, 4.5e-3, Some(-8), 400_000), (&blobs, 1.6, 2.9e-3, None, 200_000)]
    {
        let field = field(formula);
        let options = MeshOptions { resolution: Resolution::Error(most), ..MeshOptions::default() };
        let Meshed { mesh: made, report } = mesh(&field, &cube(half), options).unwrap();
        assert!(report.is_sound() && report.topology.is_closed(), "{:?}", report.warnings);
        assert_eq!(report.warnings, [""; 0]);
        assert!(euler.is_none_or(|e| report.topology.euler == [e]), "{:?}", report.topology.euler);
        // Centres and middles of edges, to first order.
        let at = |f: &[u32; 3], w: [f64; 3]| {
            let [p, q, r] = f.map(|v| made.points[v as usize]);
            [0, 1, 2].map(|a| w[0] * p[a] + w[1] * q[a] + w[2] * r[a])
        };
        let weights = [[1.0 / 3.0; 3], [0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]];
        let points: Vec<_> = made.faces.iter().flat_map(|f| weights.map(|w| at(f, w))).collect();
        let (mut value, mut gradient) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
        field.value_gradient(&points, &mut value, &mut gradient).unwrap();
        let off = value.iter().zip(&gradient).map(|(v, g)| v.abs() / norm(*g)).fold(0.0, f64::max);
        let q = &report.quality;
        println!(
            "{off:e} of {most:e}, {} evaluations, Q {}, {}",
            report.evaluations, q.q_avg, q.smallest_angle
        );
        assert!(off <= most * (1.0 + 1e-9) && off > 0.5 * most, "{off} instead of {most}");
        // Once, not again from four times the samples.
        assert!(report.evaluations < evaluations, "{}", report.evaluations);
        assert!(q.q_avg > 0.88 && q.smallest_angle > 24.0, "{q:?}");
    }
}

#[test]
fn singular_surfaces_say_where_they_are_doubtful() {
    // The apex of a double cone joins its halves in one point: no manifold.
    let (f, b) = model("cone");
    let cone = mesh(&f, &b, with(3000)).unwrap();
    let near = |p: &[f64; 3]| p.iter().all(|c| c.abs() < 0.2);
    let apart = cone.report.topology.components() == 2 && cone.report.topology.is_manifold();
    assert!(
        apart || cone.report.doubtful.iter().any(near),
        "{:?} {:?}",
        cone.report.warnings,
        cone.report.doubtful
    );
    for name in [
        "torus_horn",
        "heart",
        "cassini_lemniscate",
        "tanglecube_critical",
        "steiner_roman",
        "crosscap",
        "klein_bottle",
        "whitney_umbrella",
        "csg_classic",
    ] {
        let (f, b) = model(name);
        let r = mesh(&f, &b, with(4000)).unwrap().report;
        let t = &r.topology;
        // Never silently wrong: what is not a manifold has places.
        assert!(t.is_manifold() || !r.doubtful.is_empty(), "{name}: {:?}", r.warnings);
        assert!(r.is_sound() || !r.warnings.is_empty(), "{name}");
    }
}

#[test]
fn samples_are_the_vertices() {
    let (f, b) = model("torus");
    let samples = sample(&f, &b, Options { amount: Amount::Count(2000), ..Options::default() }).unwrap();
    let options = MeshOptions { smoothing: 0, ..MeshOptions::default() };
    let made = mesh_samples(&f, &b, &samples, &options).unwrap();
    assert_eq!(made.mesh.points, samples.points);
    assert!(made.report.topology.is_closed() && made.report.topology.genus() == [1]);
    let options = MeshOptions { rule: Rule::Circumsphere, ..options };
    let rule = mesh_samples(&f, &b, &samples, &options).unwrap();
    // All but the triangles where vertices are almost on one circle are the same.
    let sorted = |m: &Mesh| {
        let mut faces: Vec<[u32; 3]> = m
            .faces
            .iter()
            .map(|f| {
                let mut f = *f;
                f.sort_unstable();
                f
            })
            .collect();
        faces.sort_unstable();
        faces
    };
    let (a, b) = (sorted(&made.mesh), sorted(&rule.mesh));
    let common = a.iter().filter(|f| b.binary_search(f).is_ok()).count();
    assert!(common as f64 > 0.95 * a.len() as f64, "{common} of {}", a.len());
}

#[test]
fn a_function_of_the_user_is_called_on_its_thread() {
    use std::sync::Mutex;
    use std::thread::{ThreadId, current};
    /// A sphere that notes who asks.
    struct Noted(Mutex<Vec<ThreadId>>);
    impl Surface for Noted {
        fn value_gradient(
            &self,
            points: &[[f64; 3]],
            value: &mut [f64],
            gradient: &mut [[f64; 3]],
        ) -> Result<(), FieldError> {
            self.0.lock().unwrap().push(current().id());
            for ((p, v), g) in points.iter().zip(value).zip(gradient) {
                *v = p.iter().map(|c| c * c).sum::<f64>() - 1.0;
                *g = p.map(|c| 2.0 * c);
            }
            Ok(())
        }

        fn hessian(&self, _: &[[f64; 3]], hessian: &mut [[f64; 6]]) -> Result<(), FieldError> {
            self.0.lock().unwrap().push(current().id());
            hessian.fill([2.0, 0.0, 0.0, 2.0, 0.0, 2.0]);
            Ok(())
        }
    }
    let noted = Noted(Mutex::new(Vec::new()));
    let options = MeshOptions { resolution: Resolution::Error(2e-3), ..MeshOptions::default() };
    assert!(mesh(&noted, &cube(1.3), options).unwrap().report.is_sound());
    let asked = noted.0.into_inner().unwrap();
    assert!(asked.len() > 50 && asked.iter().all(|id| *id == current().id()));
}
