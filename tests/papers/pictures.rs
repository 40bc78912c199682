//! Draws the papers' figures, from the first moment to the last:
//! `cargo run --release -p isoswarm --example papers -- FOLDER` (docs/images if none is given).

mod story;

use std::error::Error;
use std::path::PathBuf;

use isoswarm::geometry::{Coloring, Picture, PictureOptions, PointCloud, Style, render};
use isoswarm::scene::Scene;

const SURFACE: [f64; 3] = [0.33, 0.58, 0.70];
const PIN: [f64; 3] = [0.90, 0.33, 0.13];

/// The scene as discs, with its pins in another colour.
fn draw(scene: &Scene, lens: f64) -> Result<Picture, Box<dyn Error>> {
    let samples = scene.samples(Some(2500))?;
    let (points, normals, radii) = (samples.points, samples.normals, samples.radii);
    let size = 0.03 * story::diameter(scene);
    let pinned = |q: &[f64; 3]| {
        let near = |p: [f64; 3]| (0..3).map(|a| (p[a] - q[a]).powi(2)).sum::<f64>() < size * size;
        scene.pins().iter().any(|pin| near(pin.pin.at))
    };
    let colors: Vec<[f64; 3]> = points.iter().map(|q| if pinned(q) { PIN } else { SURFACE }).collect();
    let cloud = PointCloud::new(&points).with_normals(&normals).with_radii(&radii).with_colors(&colors);
    let options = PictureOptions {
        width: 360,
        height: 360,
        azimuth: -1.2,
        elevation: 0.45,
        up: [0.0, 1.0, 0.0],
        margin: lens,
        style: Style::Discs,
        coloring: Coloring::Given,
        shadow: 0.5,
        ..PictureOptions::default()
    };
    Ok(render(&cloud, &options)?)
}

/// Pictures of one height side by side.
fn strip(frames: &[Picture]) -> Picture {
    let height = frames[0].height;
    let width = frames.iter().map(|f| f.width).sum();
    let row = |f: &Picture, y: u32| {
        let bytes = 4 * f.width as usize;
        f.rgba[y as usize * bytes..][..bytes].to_vec()
    };
    let rgba = (0..height).flat_map(|y| frames.iter().flat_map(move |f| row(f, y))).collect();
    Picture { width, height, rgba }
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args()
        .nth(1)
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../docs/images"), PathBuf::from);
    std::fs::create_dir_all(&folder)?;
    for name in ["three_cylinders", "quartic", "dumbbell", "ellipsoid"] {
        let mut scene = story::open(name);
        let mut frames = vec![draw(&scene, 0.15)?];
        for entry in story::script(name) {
            if scene.apply(entry.command)?.drag.is_some() {
                frames.push(draw(&scene, 0.15)?);
            }
        }
        strip(&frames).save(folder.join(format!("{name}.png")))?;
        println!("{name}: {} pictures", frames.len());
    }
    Ok(())
}
