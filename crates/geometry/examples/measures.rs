//! Area and volume of a surface of `models/surfaces.json` for a number of seeds, against its exact values: how far they
//! are off, and whether the errors that are reported hold. `measures NAME [N] [SEEDS]`.

use isoswarm_field::{Aabb, Field, text};
use isoswarm_geometry::{MeasureOptions, MeshOptions, Resolution, measure, mesh};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize, otherwise: usize| arguments.get(k).map_or(Ok(otherwise), |a| a.parse());
    let (n, seeds) = (number(1, 10_000)?, number(2, 20)?);
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/surfaces.json");
    let all: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(file)?)?;
    let wanted = arguments.first().map(String::as_str);
    for s in all.as_array().into_iter().flatten() {
        let name = s["name"].as_str().unwrap_or_default();
        let smooth = s["smooth"] == true && s["compact"] == true;
        if wanted.map_or(!smooth, |w| w != name && !(w == "all" && smooth)) {
            continue;
        }
        let corner = |k: usize| [0, 1, 2].map(|a| s["bbox"][k][a].as_f64().unwrap_or(0.0));
        let bounds = Aabb::new(corner(0), corner(1));
        let field = Field::new(&text::parse(s["expr"].as_str().unwrap_or_default(), &[])?)?;
        let truth = [s["area"].as_f64().unwrap_or(f64::NAN), s["volume"].as_f64().unwrap_or(f64::NAN)];
        let (mut off, mut bar, mut held) = ([vec![], vec![]], [vec![], vec![]], [0; 2]);
        let mut notes = 0;
        for seed in 0..seeds as u64 {
            let options = MeshOptions { resolution: Resolution::Count(n), seed, ..Default::default() };
            let meshed = mesh(&field, &bounds, options)?;
            let options = MeasureOptions {
                curvature: false,
                weights: false,
                bounds: Some(bounds),
                ..Default::default()
            };
            let m = measure(&field, &meshed.mesh, options)?;
            notes += usize::from(!m.notes.is_empty());
            for (k, e) in [Some(m.area), m.volume].into_iter().enumerate() {
                let Some(e) = e else { continue };
                off[k].push((e.value / truth[k] - 1.0).abs());
                bar[k].push(e.error / truth[k]);
                held[k] += usize::from((e.value - truth[k]).abs() <= e.error);
            }
        }
        let median = |v: &mut Vec<f64>| {
            v.sort_by(f64::total_cmp);
            v.get(v.len() / 2).copied().unwrap_or(f64::NAN)
        };
        let known = s["area_rel_err"].as_f64().unwrap_or(f64::NAN);
        print!("{name:<20}known to {known:.0e}");
        for k in 0..2 {
            let (o, b) = (median(&mut off[k]), median(&mut bar[k]));
            print!(
                "  off {o:.1e} (most {:.1e}) bar {b:.1e} held {}/{}",
                off[k].last().unwrap_or(&f64::NAN),
                held[k],
                off[k].len()
            );
        }
        println!("  noted {notes}");
    }
    Ok(())
}
