//! Area and volume of a surface of `models/surfaces.json` for a number of seeds, against its exact values: how far they
//! are off, in how many seeds the errors that are reported hold, and how wide they are. `measures NAME|all [N] [SEEDS]`.
//!
//! Where the file knows a value by quadrature or by counting only, the truth is this program's own, from four times the samples
//! and another seed (marked `own`).

use isoswarm_field::{Aabb, Field, text};
use isoswarm_geometry::{MeasureOptions, Measures, MeshOptions, Resolution, measure, mesh};

/// Seed of the samples of a truth of our own.
const OTHER: u64 = 1_000_003;

struct Surface {
    field: Field,
    bounds: Aabb,
}

impl Surface {
    fn measured(&self, n: usize, seed: u64, tolerance: f64) -> Result<Measures, Box<dyn std::error::Error>> {
        let options = MeshOptions { resolution: Resolution::Count(n), seed, ..Default::default() };
        let meshed = mesh(&self.field, &self.bounds, options)?;
        let options = MeasureOptions {
            tolerance,
            curvature: false,
            weights: false,
            bounds: Some(self.bounds),
            ..Default::default()
        };
        Ok(measure(&self.field, &meshed.mesh, options)?)
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize, otherwise: usize| arguments.get(k).map_or(Ok(otherwise), |a| a.parse());
    let (n, seeds) = (number(1, 10_000)?, number(2, 20)?);
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/surfaces.json");
    let all: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(file)?)?;
    let wanted = arguments.first().map(String::as_str);
    println!(
        "relative: median error, largest, median bar; bars that hold of all seeds; median of bar over error"
    );
    for s in all.as_array().into_iter().flatten() {
        let name = s["name"].as_str().unwrap_or_default();
        let smooth = s["smooth"] == true && s["compact"] == true;
        if wanted.map_or(!smooth, |w| w != name && !(w == "all" && smooth)) {
            continue;
        }
        let corner = |k: usize| [0, 1, 2].map(|a| s["bbox"][k][a].as_f64().unwrap_or(0.0));
        let field = Field::new(&text::parse(s["expr"].as_str().unwrap_or_default(), &[])?)?;
        let surface = Surface { field, bounds: Aabb::new(corner(0), corner(1)) };
        let own = s["area_kind"] != "exact" || s["volume_kind"] != "exact";
        let mut truth = [s["area"].as_f64().unwrap_or(f64::NAN), s["volume"].as_f64().unwrap_or(f64::NAN)];
        if own {
            let m = surface.measured(4 * n, OTHER, 1e-14)?;
            let values = [Some(m.area), m.volume].map(|e| e.map_or(f64::NAN, |e| e.value));
            for (k, kind) in ["area_kind", "volume_kind"].into_iter().enumerate() {
                truth[k] = if s[kind] == "exact" { truth[k] } else { values[k] };
            }
        }
        let (mut off, mut bar, mut ratio, mut held) =
            ([vec![], vec![]], [vec![], vec![]], [vec![], vec![]], [0; 2]);
        let (mut notes, mut reliable) = (0, 0);
        for seed in 0..seeds as u64 {
            let m = surface.measured(n, seed, MeasureOptions::default().tolerance)?;
            notes += usize::from(!m.notes.is_empty());
            reliable += usize::from(m.reliable);
            for (k, e) in [Some(m.area), m.volume].into_iter().enumerate() {
                let Some(e) = e else { continue };
                let error = (e.value - truth[k]).abs();
                off[k].push(error / truth[k]);
                bar[k].push(e.error / truth[k]);
                ratio[k].push(e.error / error.max(f64::EPSILON * truth[k]));
                held[k] += usize::from(error <= e.error);
            }
        }
        let median = |v: &mut Vec<f64>| {
            v.sort_by(f64::total_cmp);
            v.get(v.len() / 2).copied().unwrap_or(f64::NAN)
        };
        print!("{name:<18}{:<4}", if own { "own" } else { "" });
        for (k, what) in ["area", "volume"].into_iter().enumerate() {
            let (o, b, r) = (median(&mut off[k]), median(&mut bar[k]), median(&mut ratio[k]));
            let most = off[k].last().unwrap_or(&f64::NAN);
            print!("  {what} {o:.1e} {most:.1e} {b:.1e} {:>3}/{} {r:4.1}", held[k], off[k].len());
        }
        println!("  noted {notes}, reliable {reliable}");
    }
    Ok(())
}
