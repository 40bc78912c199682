use isoswarm_field::text;
use isoswarm_scene::{Amount, Scene, Settings};
use std::collections::HashMap;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let f = args.get(1).cloned().unwrap_or("shell(gyroid(period=1.1), thickness=0.32) & sphere(1)".into());
    let n: usize = args.get(2).and_then(|s| s.parse().ok()).unwrap_or(9000);
    let steps: usize = args.get(3).and_then(|s| s.parse().ok()).unwrap_or(400);
    let bounds = args.get(4).and_then(|s| s.parse::<f64>().ok()).map(|r| [[-r; 3], [r; 3]]);
    let s = Settings { amount: Amount::Count(n), bounds, ..Settings::default() };
    let mut scene = Scene::new(&text::parse(&f, &[]).unwrap(), s).unwrap();
    let mut normals: HashMap<u64, [f64; 3]> = HashMap::new();
    let (mut b, mut d, mut flips) = (0, 0, 0);
    for k in 0..steps {
        let before: HashMap<u64, [f64; 3]> =
            scene.frame().floaters.id.iter().copied().zip(scene.frame().floaters.points.iter().copied()).collect();
        scene.step(1).unwrap();
        let fr = scene.frame();
        let f = &fr.floaters;
        let mut most = 0.0f64;
        let mut movers = 0;
        let mut at_flip = vec![];
        for i in 0..f.len() {
            if let Some(n) = normals.get(&f.id[i]) {
                let m = f.normals[i];
                if n[0] * m[0] + n[1] * m[1] + n[2] * m[2] < 0.5 {
                    flips += 1;
                    at_flip.push(f.id[i]);
                }
            }
            normals.insert(f.id[i], f.normals[i]);
            if let Some(p) = before.get(&f.id[i]) {
                let q = f.points[i];
                let dd = (0..3).map(|a| (p[a] - q[a]).powi(2)).sum::<f64>().sqrt() / fr.spacing;
                most = most.max(dd);
                movers += usize::from(dd > 0.02);
            }
        }
        if k % 20 == 19 {
            println!(
                "{k:4} n {} births {} deaths {} flips {flips} largest move {most:.3} movers {movers} off {:.2e}",
                f.len(),
                fr.births - b,
                fr.deaths - d,
                f.off / fr.spacing
            );
            (b, d, flips) = (fr.births, fr.deaths, 0);
            if k + 1 == steps {
                let s: f64 = f.sigma.iter().sum::<f64>() / f.len() as f64;
                let young: Vec<usize> = (0..f.len()).filter(|&i| f.id[i] + 200 > *f.id.iter().max().unwrap()).collect();
                for i in young.into_iter().take(40) {
                    let p = f.points[i];
                    let r = (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
                    let mut opp = 9.0f64;
                    let mut mind = f64::INFINITY;
                    let mut mino = f64::INFINITY;
                    for j in 0..f.len() {
                        if j == i { continue; }
                        let q = f.points[j];
                        let dd = (0..3).map(|a| (p[a] - q[a]).powi(2)).sum::<f64>().sqrt() / fr.spacing;
                        let c = (0..3).map(|a| f.normals[i][a] * f.normals[j][a]).sum::<f64>();
                        if dd < 1.0 { opp = opp.min(c); }
                        mind = mind.min(dd);
                        if c < -0.5 { mino = mino.min(dd); }
                    }
                    println!("id {} r {r:.4} sigma/mean {:.2} energy {:.2} nearest {mind:.2} opposing nearest {mino:.2} min cos {opp:.2} speed {:.2}", f.id[i], f.sigma[i]/s, f.energy[i],
                      (0..3).map(|a| f.velocity[i][a].powi(2)).sum::<f64>().sqrt()*0.05/fr.spacing);
                }
            }
        }
    }
}
