//! Scenes and scripts of `models/`.

use std::ops::ControlFlow;
use std::path::PathBuf;

use isoswarm::field::Surface;
use isoswarm::scene::{Change, Entry, Scene, Settings, script_from_json};

/// A file of `models/`.
pub fn read(name: &str) -> String {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../models").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The scene of this name as it begins.
pub fn open(name: &str) -> Scene {
    let text = read(&format!("{name}.iso.json"));
    Scene::from_json(&text, Settings::default(), &Default::default()).unwrap()
}

/// The commands of its script.
pub fn script(name: &str) -> Vec<Entry> {
    script_from_json(&read(&format!("{name}.script.json"))).unwrap()
}

#[allow(dead_code)]
/// The scene after its script, and what each command did.
pub fn play(name: &str) -> (Scene, Vec<Change>) {
    let mut scene = open(name);
    let changes = scene.replay(&script(name), &mut |_, _| ControlFlow::Continue(())).unwrap();
    (scene, changes)
}

/// Largest diagonal of the floaters' box.
#[allow(dead_code)] // not for pictures
pub fn diameter(scene: &Scene) -> f64 {
    isoswarm::field::Aabb::around(&scene.frame().floaters.points).unwrap().diagonal()
}

/// Largest |F|/|∇F| over the floaters.
#[allow(dead_code)]
pub fn off_surface(scene: &Scene) -> f64 {
    let points = &scene.frame().floaters.points;
    let (mut f, mut g) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    scene.field().value_gradient(points, &mut f, &mut g).unwrap();
    let size = |g: &[f64; 3]| (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]).sqrt();
    f.iter().zip(&g).map(|(f, g)| f.abs() / size(g)).fold(0.0, f64::max)
}

/// A parameter's present value.
#[allow(dead_code)]
pub fn value(scene: &Scene, path: &str) -> f64 {
    scene.field().parameters()[scene.field().parameter(path).unwrap()].value
}
