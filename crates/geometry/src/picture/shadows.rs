//! Shadows of the key light on solids, by rays: no depth map that thin parts slip through, and none whose cells show.
//!
//! The light is a small disc of the sky, sampled in directions. A few go out from every place that faces the light; where they do not
//! agree, in the penumbra, all do. Of a pixel that is split into samples each sample asks two directions: the pixel's mean is
//! that of all.

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

/// A grid of pixels, or of samples, with the fragment of each.
struct Grid {
    width: usize,
    height: usize,
    fragment: Vec<u32>,
}

const NOTHING: u32 = u32::MAX;

impl Grid {
    fn new(width: usize, height: usize) -> Self {
        Self { width, height, fragment: vec![NOTHING; width * height] }
    }

    /// The fragments of pixels that are not split, and those of samples.
    fn of(buffer: &Buffer, height: usize) -> [Self; 2] {
        let (width, samples) = (buffer.width, buffer.samples);
        let mut pixels = Self::new(width, height);
        let mut split = Self::new(width * samples, height * samples);
        for y in 0..height {
            for x in 0..width {
                let span = buffer.pixel(x, y);
                if !span.split {
                    if span.count > 0 {
                        pixels.fragment[y * width + x] = span.first;
                    }
                    continue;
                }
                for k in 0..samples * samples {
                    let run = buffer.splits[span.first as usize + k];
                    if run.count > 0 {
                        let (sx, sy) = (x * samples + k % samples, y * samples + k / samples);
                        split.fragment[sy * width * samples + sx] = run.first;
                    }
                }
            }
        }
        [pixels, split]
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
        let [pixels, samples] = Grid::of(buffer, height);
        for k in FIRST {
            self.ask(buffer, &pixels, directions[k], &mut tally, |_, _| true)?;
            stage.tick();
        }
        let penumbra: Vec<bool> = tally.iter().map(|t| t.open != 0 && t.open != t.asked).collect();
        for k in (0..directions.len()).filter(|k| !FIRST.contains(k)) {
            self.ask(buffer, &pixels, directions[k], &mut tally, |_, f| penumbra[f])?;
            stage.tick();
        }
        let (side, all) = (buffer.samples, directions.len());
        for (k, direction) in directions.iter().enumerate() {
            // The samples of a pixel share the directions out, two each.
            let turn = |place: usize| {
                let (x, y) = (place % samples.width, place / samples.width);
                let first = 2 * (y % side * side + x % side);
                let asked =
                    |m: usize| if 2 * side * side < all { m * all / (2 * side * side) } else { m % all };
                asked(first) == k || asked(first + 1) == k
            };
            self.ask(buffer, &samples, *direction, &mut tally, |place, _| turn(place))?;
            stage.tick();
        }
        for (f, t) in buffer.fragments.iter_mut().zip(tally) {
            f.key = if t.asked > 0 { f32::from(t.open) / f32::from(t.asked) } else { 0.0 };
        }
        Ok(())
    }

    /// Sends a ray from each fragment of a grid that is wanted, by its place and its number.
    fn ask(
        &self,
        buffer: &Buffer,
        grid: &Grid,
        toward: vector::V3,
        tally: &mut [Tally],
        wanted: impl Fn(usize, usize) -> bool + Sync,
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
                    let place = y * grid.width + x;
                    let f = grid.fragment[place];
                    if f != NOTHING && wanted(place, f as usize) {
                        asked.push((i as u16, f));
                    }
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
