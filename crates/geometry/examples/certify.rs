//! Proofs of the topology of the surfaces of `models/surfaces.json`. `certify [NAME | all]`; without, those that are smooth
//! and closed.

use isoswarm_field::{Aabb, Field, text};
use isoswarm_geometry::{CertifyOptions, certify};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let wanted = std::env::args().nth(1);
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/surfaces.json");
    let all: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(file)?)?;
    for s in all.as_array().into_iter().flatten() {
        let name = s["name"].as_str().unwrap_or_default();
        let good = s["smooth"] == true && s["compact"] == true;
        if wanted.as_deref().map_or(!good, |w| w != name && w != "all") {
            continue;
        }
        let corner = |k: usize| [0, 1, 2].map(|a| s["bbox"][k][a].as_f64().unwrap_or(0.0));
        let field = Field::new(&text::parse(s["expr"].as_str().unwrap_or_default(), &[])?)?;
        let began = std::time::Instant::now();
        let c = certify(&field, &Aabb::new(corner(0), corner(1)), CertifyOptions::default())?;
        println!(
            "{name:<20}{} (chi {:?}, said {}; {:?} critical points, {} boxes, {} doubtful, {:.2} s) {:?}",
            c,
            c.euler,
            s["euler"],
            c.critical,
            c.boxes,
            c.doubtful.len(),
            began.elapsed().as_secs_f64(),
            c.components
                .iter()
                .filter_map(|c| c.inside.clone())
                .filter(|i| !i.is_empty())
                .collect::<Vec<_>>()
        );
    }
    Ok(())
}
