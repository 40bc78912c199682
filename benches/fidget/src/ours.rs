//! The same two tasks with isoswarm, in f64, on one thread.

use crate::blobs::{Blob, K, reference};
use crate::timing::fastest;
use isoswarm_field::{Field, RegionOptions, Surface, text, vm};

/// The blobs as a field, and the place of each of their numbers among its parameters.
pub fn field(blobs: &[Blob]) -> (Field, Vec<usize>) {
    let mut formula = String::new();
    let mut parameters = Vec::new();
    for (i, b) in blobs.iter().enumerate() {
        let sign = if i == 0 { "" } else { " + " };
        formula += &format!("{sign}exp(-{K}*(sqrt((x-x{i})^2+(y-y{i})^2+(z-z{i})^2)-r{i}))");
        for (name, value) in ["x", "y", "z", "r"].iter().zip(b) {
            parameters.push((format!("{name}{i}"), *value));
        }
    }
    let named: Vec<(&str, f64)> = parameters.iter().map(|(n, v)| (n.as_str(), *v)).collect();
    let model = text::parse(&format!("-log({formula})/{K}"), &named).expect("a formula");
    let field = Field::new(&model).expect("a model");
    // The formula's own order of parameters.
    let place = named
        .iter()
        .map(|(n, _)| field.parameters().iter().position(|p| p.path == *n).expect("used"))
        .collect();
    (field, place)
}

/// Seconds a point for F, ∂F/∂x and all of ∂F/∂q, and the largest absolute error of ∂F/∂q.
pub fn blobs(blobs: &[Blob], points: &[[f64; 3]], batch: usize, runs: usize) -> (f64, f64) {
    let (field, place) = field(blobs);
    let m = place.len();
    let (mut value, mut gradient) = (vec![0.0; batch], vec![0.0; 3 * batch]);
    let mut q = vec![0.0; m * batch];
    let seconds = fastest(runs, || {
        for chunk in points.chunks_exact(batch) {
            field
                .parameter_gradient(chunk.as_flattened(), &mut value, &mut gradient, &mut q)
                .expect("arrays that fit");
        }
    });
    let last = points.chunks_exact(batch).next_back().expect("at least one batch of points");
    let mut error = 0f64;
    for (row, p) in q.chunks_exact(m).zip(last) {
        for (&k, expected) in place.iter().zip(reference(blobs, *p).2) {
            error = error.max((row[k] - expected).abs());
        }
    }
    (seconds / (points.len() / batch * batch) as f64, error)
}

/// A model in isoswarm's form.
pub struct Model(Field);

/// What pruning did.
pub struct Pruned {
    /// Seconds for everything, and for making the pruned tapes.
    pub seconds: (f64, f64),
    /// Number of regions, and the mean number of operations a point.
    pub regions: (usize, f64),
    /// Largest difference from the whole tape, of F and of ∂F/∂x.
    pub difference: f64,
}

impl Model {
    /// Reads a `.vm` text.
    pub fn new(text: &str) -> Self {
        Self(Field::new(&vm::parse_vm(text).expect("a .vm model")).expect("a model"))
    }

    /// Operations of the whole tape.
    pub fn operations(&self) -> usize {
        self.0.operations()
    }

    /// Seconds for F and ∂F/∂x at all points with the whole tape.
    pub fn whole(&self, points: &[[f64; 3]], runs: usize) -> f64 {
        let (mut value, mut gradient) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
        fastest(runs, || self.0.value_gradient(points, &mut value, &mut gradient).expect("arrays that fit"))
    }

    /// The same with tapes pruned for regions of at most `most` points, that time included.
    pub fn pruned(&self, points: &[[f64; 3]], most: usize, runs: usize) -> Pruned {
        let (mut value, mut gradient) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
        let options = RegionOptions { leaf: most, ..Default::default() };
        let narrow = || self.0.narrowed_for(points, 0.0, None, options).expect("a model with intervals");
        let all = fastest(runs, || {
            narrow().value_gradient(points, &mut value, &mut gradient).expect("arrays that fit")
        });
        let build = fastest(runs, narrow);
        let (mut v, mut g) = (value.clone(), gradient.clone());
        self.0.value_gradient(points, &mut v, &mut g).expect("arrays that fit");
        let off = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let difference = off(&value, &v).max(off(gradient.as_flattened(), g.as_flattened()));
        let narrowed = narrow();
        Pruned { seconds: (all, build), regions: (narrowed.regions(), narrowed.operations()), difference }
    }
}
