//! Finds the creases of a formula: `cargo run -p isoswarm-particles --example creases -- "box(2, 2, 2)" 1.5 0.1`. A name that ends in
//! `.vm` is read as a file.

use isoswarm_field::{Aabb, Field, text, vm};
use isoswarm_particles::creases::{CreaseOptions, creases};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let formula = args.next().unwrap_or_else(|| "box(2, 2, 2)".into());
    let half: f64 = args.next().map_or(Ok(1.5), |a| a.parse())?;
    let spacing: f64 = args.next().map_or(Ok(0.1), |a| a.parse())?;
    let model = if formula.ends_with(".vm") {
        vm::parse_vm(&std::fs::read_to_string(formula)?)?
    } else {
        text::parse(&formula, &[])?
    };
    let field = Field::new(&model)?;
    let found = creases(&field, &Aabb::new([-half; 3], [half; 3]), CreaseOptions::new(spacing))?;
    for e in &found.edges {
        let ends = [e.points[0], e.points[e.points.len() - 1]].map(|i| found.points[i as usize]);
        println!(
            "{:.6} {} {:?} from {:?} to {:?}",
            e.length,
            if e.closed { "closed" } else { "" },
            e.ends,
            ends[0],
            ends[1]
        );
    }
    println!(
        "{} edges, {} corners, {} points, length {}",
        found.edges.len(),
        found.corners.len(),
        found.points.len(),
        found.length()
    );
    println!("{:?}", found.warnings);
    Ok(())
}
