//! Meshes that follow a swarm.

use std::collections::HashSet;

use isoswarm_field::{Aabb, Field, text};
use isoswarm_geometry::LiveMesh;
use isoswarm_particles::floaters::{Floaters, Parameters};
use isoswarm_particles::{Amount, Options, sample};

const SPHERE: &str = "x^2+y^2+z^2-1";

fn field(formula: &str) -> Field {
    Field::new(&text::parse(formula, &[]).unwrap()).unwrap()
}

fn cube(half: f64) -> Aabb {
    Aabb::new([-half; 3], [half; 3])
}

/// The unit sphere's point stretched to an ellipsoid, with its normal.
fn stretched(p: [f64; 3], s: [f64; 3]) -> ([f64; 3], [f64; 3]) {
    let n = [0, 1, 2].map(|a| p[a] / s[a]);
    let l = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
    ([0, 1, 2].map(|a| p[a] * s[a]), n.map(|c| c / l))
}

#[test]
fn a_live_mesh_follows() {
    let s = sample(&field(SPHERE), &cube(1.3), Options { amount: Amount::Count(3000), ..Options::default() })
        .unwrap();
    let mut live = LiveMesh::new(cube(3.0));
    let mut ids: Vec<u64> = (0..3000).collect();
    let mut points = s.points.clone();
    for frame in 0..30u64 {
        let t = 0.02 * frame as f64;
        let shape = [1.0 + t, 1.0 / (1.0 + t), 1.0];
        if frame > 0 {
            // Some die; as many are born in the middle between two of the others.
            for k in 0..5u64 {
                let i = ((frame * 97 + k * 571) % points.len() as u64) as usize;
                points.remove(i);
                ids.remove(i);
                let f = live.mesh().faces[((frame * 31 + k * 1013) % 5000) as usize];
                let at = |v: u32| live.mesh().ids[v as usize];
                let row = |id: u64| ids.iter().position(|&x| x == id);
                let (Some(a), Some(b), Some(c)) = (row(at(f[0])), row(at(f[1])), row(at(f[2]))) else {
                    continue;
                };
                let m = [0, 1, 2].map(|x| points[a][x] + 0.9 * points[b][x] + 1.1 * points[c][x]);
                let l = (m[0] * m[0] + m[1] * m[1] + m[2] * m[2]).sqrt();
                points.push(m.map(|x| x / l));
                ids.push(3000 + 10 * frame + k);
            }
        }
        let (now, normals): (Vec<_>, Vec<_>) = points.iter().map(|&p| stretched(p, shape)).unzip();
        let done = live.update(&now, &normals, &ids, s.report.spacing);
        assert_eq!(done.stitched, frame == 0, "frame {frame}: {done:?}");
        assert_eq!(done.open, 0, "frame {frame}: {done:?}");
        let t = live.mesh().topology();
        assert!(t.is_closed() && t.euler == [2], "frame {frame}: {t:?}");
        if frame > 0 {
            assert!(done.died == 5 && done.born > 0, "{done:?}");
        }
    }
    // Another surface: all is new.
    let other = sample(
        &field("(x^2+y^2+z^2+0.84)^2-4*(x^2+y^2)"),
        &cube(1.6),
        Options { amount: Amount::Count(3000), ..Options::default() },
    )
    .unwrap();
    let ids: Vec<u64> = (10_000..13_000).collect();
    let done = live.update(&other.points, &other.normals, &ids, other.report.spacing);
    assert!(done.stitched && done.open == 0);
    assert_eq!(live.mesh().topology().genus(), [1]);
}

/// Two blobs, so far to the left and right of the middle.
fn two_blobs(apart: f64) -> Field {
    field(&format!("0.5-exp(-((x-({apart}))^2+y^2+z^2)/0.5)-exp(-((x+({apart}))^2+y^2+z^2)/0.5)"))
}

#[test]
fn a_live_mesh_follows_blobs_that_merge_and_part() {
    let bounds = cube(2.5);
    let spacing = 0.07;
    let options = Options { amount: Amount::Spacing(spacing), ..Options::default() };
    let s = sample(&two_blobs(1.0), &bounds, options).unwrap();
    let parameters = Parameters::live(2.0, 0.5 * s.report.spacing);
    let mut floaters = Floaters::new(&s.points, parameters.sigma_hat);
    let mut live = LiveMesh::new(bounds);
    let (mut evaluations, mut stitched, mut restitched, mut sums) = (0, 0, 0, Vec::new());
    let frames = 60;
    for frame in 0..=2 * frames {
        // From two blobs to one and back.
        let way = 1.0 - f64::from(frames - i32::abs(frame - frames)) / f64::from(frames);
        let surface = two_blobs(0.5 + 0.5 * way);
        for k in 0..4 {
            floaters
                .step(&surface, &bounds, &[], &parameters, (5 * frame + k) as u64, &mut evaluations)
                .unwrap();
        }
        let before = live.mesh().ids.clone();
        let done = live.update(&floaters.points, &floaters.normals, &floaters.id, s.report.spacing);
        stitched += usize::from(done.stitched);
        restitched += usize::from(done.restitched > 0);
        let t = live.mesh().topology();
        // Row by row the vertices are the floaters, whatever happened.
        assert_eq!(live.mesh().ids, floaters.id);
        assert!(frame == 0 || before.iter().filter(|id| floaters.id.contains(id)).count() * 2 > before.len());
        if done.restitched > 0 {
            // The triangles are those that stitching all gives.
            let mut anew = LiveMesh::new(bounds);
            anew.update(&floaters.points, &floaters.normals, &floaters.id, s.report.spacing);
            let set = |m: &LiveMesh| m.mesh().faces.iter().map(|&f| least_first(f)).collect::<HashSet<_>>();
            assert_eq!(set(&live), set(&anew), "frame {frame}");
        }
        sums.push((t.is_closed() && done.open == 0, t.total_euler(), t.components()));
    }
    // At both ends there is no doubt; while the neck forms or breaks it is thinner than the spacing, and what is open is told.
    let whole = sums.iter().filter(|s| s.0).count();
    assert_eq!(sums[0], (true, 4, 2));
    assert_eq!(sums[frames as usize], (true, 2, 1));
    assert_eq!(sums[2 * frames as usize], (true, 4, 2), "{sums:?}");
    assert!(sums.iter().filter(|s| s.0).all(|s| (s.1, s.2) == (4, 2) || (s.1, s.2) == (2, 1)), "{sums:?}");
    assert!(whole + 2 >= sums.len(), "{} of {} frames: {sums:?}", whole, sums.len());
    // Where the topology changes triangles are made anew around that place, and everywhere in the first frame only.
    assert!(stitched == 1 && (2..12).contains(&restitched), "{stitched}, {restitched} of {}", sums.len());
}

/// A triangle from its smallest vertex on.
fn least_first([a, b, c]: [u32; 3]) -> [u32; 3] {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}
