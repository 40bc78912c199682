//! Draws a model, and says how long casting one ray a pixel takes: `cast MODEL OUT.png [SIZE [BOUND]]`, MODEL a formula or a `.vm` file.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use isoswarm_field::{Aabb, Field, text, vm};
use isoswarm_geometry::render::{CastOptions, Caster, Clip, Pose, SIDE, View};
use isoswarm_geometry::{PictureOptions, Solid, Subject, draw};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let model = match arguments[1].strip_suffix(".vm") {
        Some(_) => vm::parse_vm(&std::fs::read_to_string(&arguments[1])?)?,
        None => text::parse(&arguments[1], &[])?,
    };
    let size: u32 = arguments.get(3).map_or(Ok(512), |s| s.parse())?;
    let field = Field::new(&model)?;
    let bounds = match arguments.get(4) {
        Some(b) => {
            let b: f64 = b.parse()?;
            Aabb::new([-b; 3], [b; 3])
        }
        None => field.bounds().ok_or("no bounds")?,
    };
    let stop = AtomicBool::new(false);
    let clip = Clip::new(bounds);
    cast(&field, &clip, f64::from(size), &stop)?;
    if arguments[2] != "-" {
        let start = Instant::now();
        let subject = Subject { solids: vec![Solid::new(&field, clip)], ..Subject::default() };
        let options = PictureOptions { width: size, height: size * 3 / 4, ..PictureOptions::default() };
        let drawn = draw(&subject, None, &options, &stop)?;
        println!("picture {:.3} s, certified {}", start.elapsed().as_secs_f64(), drawn.certified);
        drawn.picture.save(&arguments[2])?;
    }
    Ok(())
}

/// Hits of a square picture with a parallel camera on (2, -3, 1.2).
fn cast(field: &Field, clip: &Clip, size: f64, stop: &AtomicBool) -> Result<(), Box<dyn std::error::Error>> {
    let toward = isoswarm_field::vector::unit([2.0, -3.0, 1.2]);
    let right = isoswarm_field::vector::unit([3.0, 2.0, 0.0]);
    let up = isoswarm_field::vector::cross(toward, right);
    let b = &clip.bounds;
    let center = [0, 1, 2].map(|a| 0.5 * (b.lo[a] + b.hi[a]));
    let eye = [0, 1, 2].map(|a| center[a] + b.diagonal() * toward[a]);
    let view = View::parallel(Pose { eye, axes: [right, up, toward] }, b.diagonal(), size, size);
    let caster = Caster::new(field, b)?;
    let columns = (size as usize).div_ceil(SIDE);
    let at = |k: usize| (k * SIDE) as f64 + 0.5;
    let tile = |k: usize| view.tile(at(k % columns), at(k / columns), 1.0, clip, |_, _| true);
    for _ in 0..3 {
        let (start, cpu) = (Instant::now(), cpu());
        let hits = caster.tiles(columns * columns, tile, &CastOptions::default(), stop)?;
        let count: usize = hits.iter().map(Vec::len).sum();
        let (wall, cpu) = (start.elapsed().as_secs_f64(), self::cpu() - cpu);
        println!("{count} hits of {} rays: {wall:.3} s, {cpu:.3} s of processor time", size * size);
    }
    Ok(())
}

/// Processor time of this process, where the system tells.
fn cpu() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = text.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    let ticks = |k: usize| fields.get(k).and_then(|t| t.parse::<f64>().ok()).unwrap_or(f64::NAN);
    (ticks(11) + ticks(12)) / 100.0
}
