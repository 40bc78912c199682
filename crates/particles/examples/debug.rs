#[path = "../tests/surfaces/mod.rs"]
mod surfaces;
use isoswarm_particles::*;
use surfaces::*;
fn main() {
    let f = cube(1.0);
    let s =
        sample(&f, &cube_bounds(1.2), Options { amount: Amount::Count(3000), ..Options::default() }).unwrap();
    let mut c = [0usize; 16];
    for &k in &s.component {
        c[k as usize] += 1;
    }
    println!("components {c:?}");
    for i in 0..s.points.len() {
        let v = f.at(s.points[i]).0;
        if v.abs() > 1e-9 {
            println!("{v:.2e} {:?} {:?}", s.points[i], s.normals[i]);
        }
        if s.component[i] > 0 && c[s.component[i] as usize] < 9 {
            println!("{:?} {}", s.points[i], s.component[i]);
        }
        for j in 0..i {
            let d = (0..3).map(|a| (s.points[i][a] - s.points[j][a]).powi(2)).sum::<f64>().sqrt();
            if d < 0.03 {
                println!("{d:.2e} {:?} {:?} {:?} {:?}", s.points[i], s.points[j], s.normals[i], s.normals[j]);
            }
        }
    }
}
