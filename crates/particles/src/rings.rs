//! The neighbours of each sample in their order around it: what triangles are made of.

use isoswarm_field::Aabb;
use rayon::prelude::*;

use crate::constraint::Walls;
use crate::fences::{Fences, View};
use crate::neighbors::{Grid, Neighbors, Reach};
use crate::population::faces;
use crate::stars::{Desk, OPEN, Stars, WALL};
use crate::swarm::same_sheet;
use crate::vector::V3;

/// Reach in local spacings: cells of even samples end well within half of it.
const REACH: f64 = 2.4;
/// How often the reach is doubled for samples whose cells stay open.
const DOUBLINGS: usize = 3;
/// Samples that one task handles.
const CHUNK: usize = 128;

/// For each sample the neighbours whose bisectors bound its Voronoi cell in the tangent plane, counter-clockwise seen from
/// where its normal points: its Delaunay star. Memory: 4 bytes an entry, about seven entries a sample.
#[derive(Clone, Debug, Default)]
pub struct Rings {
    start: Vec<u32>,
    entries: Vec<u32>,
}

impl Rings {
    /// The entry of a direction without a neighbour.
    pub const OPEN: u32 = OPEN;
    /// The entry of a face of the bounds.
    pub const WALL: u32 = WALL;
    /// The entry of what lies beyond the border of a piece.
    pub const FENCE: u32 = WALL - 1;

    /// Finds the rings of points on a surface in `bounds`, of which some may lie on the faces. `normals` are unit vectors or zero;
    /// those on other sheets of thin parts do not count as neighbours. `spacing`: the distance between neighbours at each
    /// point (model units, > 0), or one for all.
    ///
    /// # Panics
    /// Where the lengths differ.
    pub fn find(points: &[V3], normals: &[V3], bounds: &Aabb, spacing: &[f64]) -> Self {
        Self::find_on_pieces(points, normals, bounds, spacing, &[])
    }

    /// [`Rings::find`] on a surface cut into pieces: `borders` holds for each sample who comes after it and before it on the border of its
    /// piece, which lies on the left, `u32::MAX` for nobody. Rings do not reach over borders: they are those of constrained Delaunay
    /// triangulations. Without any borders it is empty.
    ///
    /// # Panics
    /// Where the lengths differ.
    pub fn find_on_pieces(
        points: &[V3],
        normals: &[V3],
        bounds: &Aabb,
        spacing: &[f64],
        borders: &[[u32; 2]],
    ) -> Self {
        assert!(
            borders.is_empty() || borders.len() == points.len(),
            "an entry of the borders for each point"
        );
        assert_eq!(points.len(), normals.len(), "a normal for each point");
        assert!(spacing.len() == 1 || spacing.len() == points.len(), "a spacing for each point, or one");
        let reach: Vec<f64> = spacing.iter().map(|s| REACH * s).collect();
        let keep = |i: usize, j: usize| same_sheet(points[i], points[j], normals[i], normals[j]);
        let lists = match reach[..] {
            [one] => Neighbors::find(points, Reach::Same(one), keep),
            _ => Neighbors::find(points, Reach::Each(&reach), keep),
        };
        let mean = spacing.iter().sum::<f64>() / spacing.len() as f64;
        let walls = faces(&Walls::new(bounds, 3), mean);
        let stars = Stars { points, normals, lists: &lists, walls: &walls, radius: mean, size: &[] };
        let side = |p: V3, a: usize| i8::from(p[a] >= walls.hi[a]) - i8::from(p[a] <= walls.lo[a]);
        let fences = (!borders.is_empty()).then(|| {
            let sides = points.iter().map(|&p| [0, 1, 2].map(|a| side(p, a))).collect();
            Fences::new(points, normals, spacing, borders, sides)
        });
        let fenced = |i: usize| fences.as_ref().filter(|f| f.matter(i));
        let radius = |i: usize| 0.5 * reach[if reach.len() == 1 { 0 } else { i }];
        let mut grids = Vec::new();
        let parts = |list: &[u32], grids: &[(f64, Grid)]| -> Vec<(Vec<u32>, Vec<u32>)> {
            list.par_chunks(CHUNK)
                .map(|chunk| {
                    let (mut desk, mut counts, mut entries) =
                        (Desk::new(), Vec::new(), Vec::with_capacity(8 * CHUNK));
                    let (mut others, mut view) = (Vec::new(), View::default());
                    for &i in chunk {
                        let (i, before) = (i as usize, entries.len());
                        match (fenced(i), grids.last()) {
                            (Some(fences), _) => fences.ring(i, &mut view, &mut entries),
                            (_, None) => stars.ring(i, lists.of(i), radius(i), &mut desk, &mut entries),
                            (_, Some((factor, grid))) => {
                                others.clear();
                                let wide = factor * radius(i);
                                grid.near(points[i], 2.0 * wide, |j| {
                                    if j as usize != i && keep(i, j as usize) {
                                        others.push(j);
                                    }
                                });
                                stars.ring(i, &others, wide, &mut desk, &mut entries);
                            }
                        }
                        counts.push((entries.len() - before) as u32);
                    }
                    (counts, entries)
                })
                .collect()
        };
        let all: Vec<u32> = (0..points.len() as u32).collect();
        let mut out = Self::join(parts(&all, &grids));
        for k in 1..=DOUBLINGS {
            let open = |i: usize| fenced(i).is_none() && out.of(i).contains(&OPEN);
            let open: Vec<u32> = all.iter().copied().filter(|&i| open(i as usize)).collect();
            if open.is_empty() {
                break;
            }
            let factor = 2f64.powi(k as i32);
            grids.push((factor, Grid::new(points, None, factor * REACH * mean)));
            let redone = Self::join(parts(&open, &grids));
            out.replace(&open, &redone);
        }
        out
    }

    /// How many samples there are.
    pub fn len(&self) -> usize {
        self.start.len().saturating_sub(1)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The ring of sample `i`: numbers of samples, [`Rings::OPEN`], [`Rings::WALL`] or [`Rings::FENCE`].
    #[inline(always)]
    pub fn of(&self, i: usize) -> &[u32] {
        &self.entries[self.start[i] as usize..self.start[i + 1] as usize]
    }

    /// Where in all entries the ring of sample `i` starts.
    #[inline(always)]
    pub fn start(&self, i: usize) -> usize {
        self.start[i] as usize
    }

    /// The number of entries of all rings.
    pub fn entries(&self) -> usize {
        self.entries.len()
    }

    fn join(parts: Vec<(Vec<u32>, Vec<u32>)>) -> Self {
        let mut out = Self { start: vec![0], entries: Vec::new() };
        for (counts, entries) in parts {
            let mut at = out.entries.len() as u32;
            for c in counts {
                at += c;
                out.start.push(at);
            }
            out.entries.extend_from_slice(&entries);
        }
        out
    }

    /// Puts the rings `by` in the place of those of `samples` (rising numbers).
    fn replace(&mut self, samples: &[u32], by: &Self) {
        let mut next = Self { start: vec![0], entries: Vec::with_capacity(self.entries.len()) };
        let mut k = 0;
        for i in 0..self.len() {
            let row = if samples.get(k) == Some(&(i as u32)) {
                k += 1;
                by.of(k - 1)
            } else {
                self.of(i)
            };
            next.entries.extend_from_slice(row);
            next.start.push(next.entries.len() as u32);
        }
        *self = next;
    }
}
