//! Shadows of the key light on solids, by rays: no depth map that thin parts slip through, and none whose cells show.
//!
//! The light is a small disc of the sky, sampled in directions. A few go out from every place that faces the light; where they do not
//! agree, in the penumbra, all do. Of a pixel that is split into samples two that differ ask for all.

use std::sync::atomic::AtomicBool;

use isoswarm_field::vector::dot;
use rayon::prelude::*;

use super::buffer::Buffer;
use super::light::key_directions;
use super::progress::Stage;
use super::scene::Scene;
use super::solid::Solid;
use super::vector;
use crate::GeometryError;
use crate::render::{CastOptions, Caster, Ray, SIDE};

/// How far off the surface rays begin, in parts of the scene's radius: less than a pixel of most pictures.
const LIFT: f64 = 4e-4;

/// Directions that are asked first: the middle of the light, and three places around it.
const FIRST: [usize; 4] = [0, 13, 14, 15];

/// What throws shadows, and by which rays.
pub(super) struct Shadows<'a> {
    pub solids: &'a [Solid<'a>],
    pub casters: &'a [Caster<'a>],
    pub scene: &'a Scene,
    pub stop: &'a AtomicBool,
}

/// Samples of a pixel whose normals differ by less than this cosine, and whose depths by less than this part of the scene's radius, share
/// their light.
const ALIKE: f32 = 0.8;
const NEAR: f32 = 0.02;

/// Pixels with a fragment each from which rays go out.
struct Grid {
    width: usize,
    height: usize,
    fragment: Vec<u32>,
}

const NOTHING: u32 = u32::MAX;

/// Which fragments send rays, in two layers of the picture: the one of a pixel, and of a pixel that is split two that differ.
struct Plan {
    layers: [Grid; 2],
    /// Fragments of samples, and those whose light they share.
    shared: Vec<[u32; 2]>,
}

impl Plan {
    fn new(buffer: &Buffer, height: usize) -> Self {
        let width = buffer.width;
        let layer = || Grid { width, height, fragment: vec![NOTHING; width * height] };
        let mut plan = Self { layers: [layer(), layer()], shared: Vec::new() };
        for k in 0..width * height {
            let span = buffer.pixels[k];
            if !span.split {
                if span.count > 0 {
                    plan.layers[0].fragment[k] = span.first;
                }
                continue;
            }
            let runs = &buffer.splits[span.first as usize..span.first as usize + usize::from(span.count)];
            plan.split(buffer, k, &runs.iter().filter(|r| r.count > 0).map(|r| r.first).collect::<Vec<_>>());
        }
        plan
    }

    /// The nearest fragments of a pixel's samples.
    fn split(&mut self, buffer: &Buffer, pixel: usize, samples: &[u32]) {
        let Some(&first) = samples.get(samples.len() / 2) else { return };
        let of = |f: u32| &buffer.fragments[f as usize];
        let alike = |f: u32| {
            vector::dot(of(f).normal, of(first).normal) > ALIKE
                && (of(f).depth - of(first).depth).abs() < NEAR
        };
        let second = samples.iter().copied().find(|f| !alike(*f)).unwrap_or(NOTHING);
        (self.layers[0].fragment[pixel], self.layers[1].fragment[pixel]) = (first, second);
        self.shared.extend(samples.iter().map(|&f| [f, if alike(f) { first } else { second }]));
    }
}

/// Directions that were asked, and those from which light comes.
#[derive(Clone, Copy, Default)]
struct Tally {
    asked: u8,
    open: u8,
}

impl Shadows<'_> {
    /// Sets the key light of a buffer's nearest fragments.
    pub fn cast(&self, buffer: &mut Buffer, height: usize, stage: &Stage) -> Result<(), GeometryError> {
        let directions = key_directions();
        let mut tally = vec![Tally::default(); buffer.fragments.len()];
        let plan = Plan::new(buffer, height);
        for grid in &plan.layers {
            for k in FIRST {
                self.ask(buffer, grid, directions[k], &mut tally, |_| true)?;
                stage.tick();
            }
            let penumbra: Vec<bool> = tally.iter().map(|t| t.open != 0 && t.open != t.asked).collect();
            for k in (0..directions.len()).filter(|k| !FIRST.contains(k)) {
                self.ask(buffer, grid, directions[k], &mut tally, |f| penumbra[f])?;
                stage.tick();
            }
        }
        for (f, t) in buffer.fragments.iter_mut().zip(tally) {
            f.key = if t.asked > 0 { f32::from(t.open) / f32::from(t.asked) } else { 0.0 };
        }
        for [f, other] in plan.shared {
            buffer.fragments[f as usize].key = buffer.fragments[other as usize].key;
        }
        Ok(())
    }

    /// Sends a ray from each fragment of a grid that is wanted.
    fn ask(
        &self,
        buffer: &Buffer,
        grid: &Grid,
        toward: vector::V3,
        tally: &mut [Tally],
        wanted: impl Fn(usize) -> bool + Sync,
    ) -> Result<(), GeometryError> {
        let columns = grid.width.div_ceil(SIDE);
        let direction = self.scene.place.direction(toward.map(f64::from));
        let found: Vec<Vec<(u32, bool)>> = (0..columns * grid.height.div_ceil(SIDE))
            .into_par_iter()
            .map(|k| {
                let (left, top) = (k % columns * SIDE, k / columns * SIDE);
                let mut asked: Vec<(u16, u32)> = Vec::new();
                for i in 0..SIDE * SIDE {
                    let (x, y) = (left + i % SIDE, top + i / SIDE);
                    if x >= grid.width || y >= grid.height {
                        continue;
                    }
                    let f = grid.fragment[y * grid.width + x];
                    if f != NOTHING && wanted(f as usize) {
                        asked.push((i as u16, f));
                    }
                }
                if asked.is_empty() {
                    return Ok(Vec::new());
                }
                self.tile(buffer, toward, direction, &asked)
            })
            .collect::<Result<_, GeometryError>>()?;
        for (f, open) in found.into_iter().flatten() {
            let t = &mut tally[f as usize];
            t.asked += 1;
            t.open += u8::from(open);
        }
        Ok(())
    }

    /// Whether light comes to each fragment of a tile.
    fn tile(
        &self,
        buffer: &Buffer,
        toward: vector::V3,
        direction: [f64; 3],
        asked: &[(u16, u32)],
    ) -> Result<Vec<(u32, bool)>, GeometryError> {
        let mut open: Vec<bool> = asked
            .iter()
            .map(|(_, f)| vector::dot(buffer.fragments[*f as usize].normal, toward) > 0.0)
            .collect();
        let nothing = Ray { origin: [0.0; 3], direction: [0.0; 3], near: 0.0, far: -1.0, face: None };
        let options = CastOptions { layers: 1, cap_box: false, cap_planes: false, slices: false };
        for (solid, caster) in self.solids.iter().zip(self.casters) {
            let mut rays = vec![nothing; SIDE * SIDE];
            let mut number = vec![usize::MAX; SIDE * SIDE];
            for (k, (i, f)) in asked.iter().enumerate().filter(|(k, _)| open[*k]) {
                let f = &buffer.fragments[*f as usize];
                let lifted = [0, 1, 2].map(|a| f64::from(f.position[a]) + LIFT * f64::from(f.normal[a]));
                rays[usize::from(*i)] = solid.clip.ray(self.scene.place.point(lifted), direction, 0.0);
                number[usize::from(*i)] = k;
            }
            if number.iter().all(|n| *n == usize::MAX) {
                continue;
            }
            for hit in caster.tile(&rays, &options, self.stop)? {
                // What begins inside, in a part thinner than the lift, only comes out.
                if dot(hit.gradient, direction) < 0.0 {
                    open[number[usize::from(hit.ray)]] = false;
                }
            }
        }
        Ok(asked.iter().map(|(_, f)| *f).zip(open).collect())
    }
}
