//! One solve of a drag: pins have moved a little, and the parameters follow. The constraint system F(p_i, q) = 0 in fidget's
//! solver (Levenberg and Marquardt's method, f32) and in a step of isoswarm's control points (f64), pins and start alike.

use std::collections::HashMap;

use fidget::context::{Context, Node};
use fidget::eval::MathFunction;
use fidget::jit::JitFunction;
use fidget::solver::{Parameter, solve};
use fidget::var::Var;
use isoswarm_field::Field;
use isoswarm_particles::control::{Pin, StepOptions, step};
use isoswarm_particles::project;

use crate::blobs::{Blob, blobs, graph_at, reference};
use crate::ours;
use crate::timing::{Uniform, fastest, once};

/// How far each pin has moved, beside blobs of radius .1 to .3.
const MOVED: f64 = 0.02;

/// Most steps of isoswarm's.
const MOST_STEPS: usize = 100;

/// What a solve took and left.
pub struct Solved {
    /// Seconds.
    pub seconds: f64,
    /// Largest |F|/|∇F| at the pins.
    pub distance: f64,
}

/// A system of `n` pins on `count` blobs.
pub struct System {
    blobs: Vec<Blob>,
    pins: Vec<[f64; 3]>,
    field: Field,
    /// The field's parameter for each of the blobs' numbers.
    place: Vec<usize>,
}

impl System {
    /// Pins on the surface, then moved.
    pub fn new(count: usize, n: usize) -> Self {
        let blobs = blobs(count);
        let (field, place) = ours::field(&blobs);
        let mut u = Uniform(3);
        // Near as many blobs, on the surface.
        let mut pins: Vec<[f64; 3]> = (0..4 * n)
            .map(|i| [0, 1, 2].map(|a| blobs[i * count / (4 * n)][a] + u.between(-0.3, 0.3)))
            .collect();
        let left = project(&field, &mut pins, 4.0).expect("a field");
        let mut there = left.iter().map(|d| *d < 1e-9);
        pins.retain(|_| there.next().unwrap_or(false));
        let every = pins.len() / n;
        pins = pins.into_iter().step_by(every).take(n).collect();
        assert_eq!(pins.len(), n, "a quarter of the points find the surface");
        for p in &mut pins {
            *p = p.map(|v| v + MOVED * u.between(-1.0, 1.0));
        }
        Self { blobs, pins, field, place }
    }

    fn distance(&self, blobs: &[Blob]) -> f64 {
        let off = |p: &[f64; 3]| {
            let (f, g, _) = reference(blobs, *p);
            f.abs() / (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]).sqrt()
        };
        self.pins.iter().map(off).fold(0.0, f64::max)
    }

    /// How far off the pins are before.
    pub fn before(&self) -> f64 {
        self.distance(&self.blobs)
    }

    /// isoswarm's step, with corrections down to 1e-7.
    pub fn ours(&self, runs: usize) -> Solved {
        let start = self.field.q();
        let mut field = self.field.clone();
        let metric = vec![1.0; start.len()];
        let options = StepOptions { longest: 0.1, gain: 1.0, tolerance: 1e-7 };
        let seconds = fastest(runs, || {
            field.set_q(&start).expect("the start");
            let mut pins: Vec<Pin> = self.pins.iter().map(|p| Pin::new(*p)).collect();
            // Near by one step suffices.
            for _ in 0..MOST_STEPS {
                let report =
                    step(&mut field, &mut pins, &metric, &[], &options).expect("pins that make sense");
                if report.stuck || report.residual.iter().all(|d| *d <= options.tolerance) {
                    break;
                }
            }
        });
        let q = field.q();
        let mut blobs = self.blobs.clone();
        for (k, &i) in self.place.iter().enumerate() {
            blobs[k / 4][k % 4] = q[i];
        }
        Solved { seconds, distance: self.distance(&blobs) }
    }

    /// fidget's solver; its functions are compiled before.
    pub fn fidget(&self, runs: usize) -> Option<Solved> {
        let mut context = Context::new();
        let variables: Vec<Var> = (0..4 * self.blobs.len()).map(|_| Var::new()).collect();
        let mut parameters = HashMap::new();
        for (k, v) in variables.iter().enumerate() {
            parameters.insert(*v, Parameter::Free(self.blobs[k / 4][k % 4] as f32));
        }
        let equations: Vec<JitFunction> = self
            .pins
            .iter()
            .map(|p| {
                let at = p.map(|v| {
                    let var = Var::new();
                    parameters.insert(var, Parameter::Fixed(v as f32));
                    var
                });
                let at: [Node; 3] = at.map(|v| context.var(v));
                let root = graph_at(&mut context, at, &variables);
                JitFunction::new(&context, &[root]).expect("the node is in the context")
            })
            .collect();
        let mut found = None;
        let run = || found = solve(&equations, &parameters).ok();
        let seconds = if runs == 1 { once(run) } else { fastest(runs, run) };
        let found = found?;
        let mut blobs = self.blobs.clone();
        for (k, v) in variables.iter().enumerate() {
            blobs[k / 4][k % 4] = f64::from(found[v]);
        }
        Some(Solved { seconds, distance: self.distance(&blobs) })
    }
}
