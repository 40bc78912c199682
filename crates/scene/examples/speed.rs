//! Steps a second of a scene while control points are dragged.
//!
//! `cargo run --release -p isoswarm-scene --example speed -- [paper|thousand|local] [steps]`: WH94's largest run (8 blobby
//! cylinders, 56 parameters, 10 pins, 500 floaters); 250 blobs, about 1000 parameters, 100 pins, 20,000 floaters; 2500 blobs.
//! One line of JSON.

use std::time::Instant;

use isoswarm_field::{Model, text};
use isoswarm_scene::{Amount, Command, Hand, PinRef, Scene, Settings};

type V3 = [f64; 3];

/// `n` points spread over a ball by the golden angle.
fn spread(n: usize, radius: f64) -> Vec<V3> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    (0..n)
        .map(|i| {
            let z = 1.0 - (2 * i + 1) as f64 / n as f64;
            let (r, t) = ((1.0 - z * z).sqrt(), golden * i as f64);
            [radius * r * t.cos(), radius * r * t.sin(), radius * z]
        })
        .collect()
}

fn cylinders() -> Model {
    let ends = spread(16, 1.0);
    let rods: Vec<String> = (0..8)
        .map(|i| {
            let (a, b) = (ends[i], ends[15 - i].map(|v| 0.8 * v));
            format!("{}, {}, {}, {}, {}, {}, 0.35", a[0], a[1], a[2], b[0], b[1], b[2])
        })
        .collect();
    text::parse(&format!("blobby_cylinders(0.5, {})", rods.join(", ")), &[]).unwrap()
}

fn blobs(n: usize) -> Model {
    let size = (4.0 * std::f64::consts::PI / n as f64).sqrt();
    let rows: Vec<String> =
        spread(n, 1.0).iter().map(|c| format!("{}, {}, {}, {}", c[0], c[1], c[2], 0.8 * size)).collect();
    text::parse(&format!("blobs(0.5, {})", rows.join(", ")), &[]).unwrap()
}

fn main() {
    let mut args = std::env::args().skip(1);
    let which = args.next().unwrap_or_else(|| "paper".into());
    let steps: usize = args.next().map_or(2000, |s| s.parse().expect("a number of steps"));
    let (model, pins, floaters) = match which.as_str() {
        "paper" => (cylinders(), 10, 500),
        "thousand" => (blobs(250), 100, 20_000),
        "local" => (blobs(2500), 100, 20_000),
        other => panic!("expected paper, thousand or local, given {other}"),
    };
    let settings = Settings { amount: Amount::Count(floaters), ..Settings::default() };
    let mut scene = Scene::new(&model, settings).unwrap();
    // Four numbers a sphere, seven a cylinder.
    scene.apply(Command::Freeze { pattern: "*/bias".into(), frozen: true }).unwrap();
    let at: Vec<V3> = {
        let p = &scene.frame().floaters.points;
        (0..pins).map(|k| p[k * p.len() / pins]).collect()
    };
    let ids: Vec<u64> = at.iter().map(|&p| scene.pin(p).unwrap()).collect();
    // The first pin is led around a circle; the others hold.
    let goal = |k: usize| {
        let t = k as f64 * 0.02;
        let p = at[0];
        [p[0] * (1.0 + 0.05 * t.sin()), p[1] * (1.0 + 0.05 * t.sin()), p[2] + 0.05 * (t.cos() - 1.0)]
    };
    let chunk = 10;
    let start = Instant::now();
    for k in 0..steps / chunk {
        let hands = vec![Hand { pin: PinRef::Number(ids[0]), to: goal(k * chunk) }];
        scene.apply(Command::Grab { hands, radius: None }).unwrap();
        scene.step(chunk).unwrap();
    }
    let seconds = start.elapsed().as_secs_f64();
    let residual = scene.residuals().unwrap().into_iter().fold(0.0, f64::max);
    println!(
        "{{\"part\": \"{which}\", \"parameters\": {}, \"pins\": {pins}, \"floaters\": {}, \"steps\": {steps}, \
         \"steps_per_second\": {:.1}, \"largest_pin_distance\": {residual:.2e}}}",
        scene.field().q().len(),
        scene.frame().floaters.len(),
        (steps / chunk * chunk) as f64 / seconds
    );
}
