#[path = "../tests/surfaces/mod.rs"]
mod surfaces;
use isoswarm_particles::*;
use surfaces::*;
fn main() {
    let pi = std::f64::consts::PI;
    for seed in 0..3 {
        let s = sample(
            &gyroid(1.0),
            &cube_bounds(pi),
            Options { amount: Amount::Count(5000), seed, ..Options::default() },
        )
        .unwrap();
        let mut c = [0usize; 16];
        for &k in &s.component {
            c[k as usize] += 1;
        }
        println!("components {c:?}");
        for i in 0..s.points.len() {
            for j in 0..i {
                let d = (0..3).map(|a| (s.points[i][a] - s.points[j][a]).powi(2)).sum::<f64>().sqrt();
                if d < 0.1 {
                    println!(
                        "{d:.2e} {:?} {:?} {:?} {:?}",
                        s.points[i], s.points[j], s.normals[i], s.normals[j]
                    );
                }
            }
            if s.component[i] > 0 && c[s.component[i] as usize] < 5 {
                println!("{:?} {}", s.points[i], s.component[i]);
            }
        }
    }
}
