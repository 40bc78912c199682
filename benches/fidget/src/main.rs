//! isoswarm beside fidget 0.5.1, one thread. Prints one JSON object.
//!
//! `part`: writes the tape of the CSG part to standard output. `gradients`: 250 smooth-min blobs with 1000 parameters. `solve`: one
//! solve of a drag with 48, 200 and 1000 parameters. `csg [MODEL.vm
//! [lo hi]]`: a model at 100,000 points of its surface. `render`: pictures of 512 × 512 of three models.

mod blobs;
mod csg;
mod ours;
mod part;
mod render;
mod solve;
mod timing;

use csg::{Descent, Model, Region};
use serde_json::{Value, json};

const RUNS: usize = 15;
const POINTS: usize = 100_000;

fn main() {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("the first pool");
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.first().map(String::as_str) {
        Some("part") => print_part(),
        Some("gradients") => println!("{}", gradients()),
        Some("csg") => println!("{}", csg(&arguments[1..])),
        Some("render") => println!("{}", renders()),
        Some("solve") => {
            println!("{}", solves(arguments.get(1).map_or(1000, |m| m.parse().expect("a number"))))
        }
        _ => {
            eprintln!("usage: isoswarm-bench-fidget part | gradients | solve [M] | csg [MODEL.vm [LO HI]] | render");
            std::process::exit(2);
        }
    }
}

fn renders() -> Value {
    let (part, _, _) = part::text();
    let models = render::models(&part);
    Value::Array(models.iter().map(|(name, model)| render::compare(name, model, 5)).collect())
}

fn print_part() {
    let (text, operations, choices) = part::text();
    println!(
        "# A base plate with fins, bosses and drillings: {operations} operations, {choices} of them min or max."
    );
    println!("# Written by `cargo run --release -- part` in benches/fidget.");
    print!("{text}");
}

fn gradients() -> Value {
    let blobs = blobs::blobs(250);
    let points = blobs::points(128);
    let best = [8, 32, 64, 128].map(|batch| (batch, blobs::fidget(&blobs, &points, batch, 3)));
    let (batch, (seconds, error)) =
        best.into_iter().min_by(|a, b| a.1.0.total_cmp(&b.1.0)).expect("four batch sizes");
    let many = blobs::points(4096);
    let best = [16, 64, 256, 1024].map(|batch| (batch, ours::blobs(&blobs, &many, batch, RUNS)));
    let ours = best.into_iter().min_by(|a, b| a.1.0.total_cmp(&b.1.0)).expect("four batch sizes");
    json!({ "m": 1000, "isoswarm": { "us_per_point": 1e6 * ours.1.0, "batch": ours.0, "max_error_Fq": ours.1.1 }, "fidget": { "us_per_point": 1e6 * seconds, "batch": batch, "max_error_Fq": error } })
}

/// fidget only up to `most` parameters: a thousand take it minutes.
fn solves(most: usize) -> Value {
    let cases = [(12, 5, RUNS, 5), (50, 20, RUNS, 3), (250, 100, 5, 1)];
    let rows = cases.map(|(blobs, pins, runs, theirs)| {
        let system = solve::System::new(blobs, pins);
        let ours = system.ours(runs);
        let peer = (4 * blobs <= most)
            .then(|| system.fidget(theirs))
            .flatten()
            .map(|s| json!({ "ms": 1e3 * s.seconds, "distance": s.distance }));
        json!({
            "m": 4 * blobs, "pins": pins, "before": system.before(),
            "isoswarm": { "ms": 1e3 * ours.seconds, "distance": ours.distance }, "fidget": peer,
        })
    });
    json!(rows)
}

fn csg(arguments: &[String]) -> Value {
    let text = match arguments.first() {
        Some(path) => std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{path}: {e}")),
        None => part::text().0,
    };
    let number = |i: usize| arguments.get(i).map(|a| a.parse::<f32>().expect("a number"));
    let (lo, hi) = match (number(1), number(2)) {
        (Some(lo), Some(hi)) => ([lo; 3], [hi; 3]),
        _ => part::BOX,
    };
    let model = Model::new(&text);
    let mut points = model.surface_points(lo, hi, POINTS);
    let (operations, choices) = csg::count(&text);
    let micro = |seconds: f64| 1e6 * seconds / POINTS as f64;
    let whole = micro(model.whole(&points, RUNS));
    let ours = ours::Model::new(&text);
    let (mut simplified, mut pruned) = (Vec::new(), Vec::new());
    for most in [64, 128, 256, 512, 1024, 2048] {
        let tree = Region::octree(&mut points, most);
        let wide: Vec<[f64; 3]> = points.iter().map(|p| p.map(f64::from)).collect();
        let run = ours.pruned(&wide, most, RUNS);
        pruned.push(json!({
            "most": most, "leaves": run.regions.0, "us_per_point": micro(run.seconds.0),
            "build_us_per_point": micro(run.seconds.1), "mean_length": run.regions.1, "max_difference": run.difference,
        }));
        for descent in [Descent::Leaves, Descent::Tree] {
            let (seconds, length, difference) = model.simplified(&points, &tree, descent, RUNS);
            simplified.push(json!({
                "most": most, "leaves": tree.leaves(), "descent": format!("{descent:?}"), "us_per_point": micro(seconds),
                "mean_length": length, "max_difference": difference,
            }));
        }
    }
    let wide: Vec<[f64; 3]> = points.iter().map(|p| p.map(f64::from)).collect();
    let own = json!({
        "size": ours.operations(), "whole_us_per_point": micro(ours.whole(&wide, RUNS)), "pruned": pruned,
    });
    json!({
        "isoswarm": own, "operations": operations, "min_max": choices, "points": POINTS,
        "fidget": { "size": model.size(), "whole_us_per_point": whole, "simplified": simplified },
    })
}
