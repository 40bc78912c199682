//! Birth and death of floaters at exact numbers: refinement to four times as many, and moves from crowded to sparse
//! places. Moves cure what repulsion is slow at: large-scale differences of density, within a component and between.

use isoswarm_field::arrange::Arrange;
use isoswarm_field::{FieldError, Surface};
use rayon::prelude::*;

use crate::constraint::{Target, Walls, project};
use crate::neighbors::Neighbors;
use crate::rng::Rng;
use crate::stars::{Cell, Desk, Stars};
use crate::swarm::Swarm;
use crate::vector::{V3, add, along, distance, dot, scale};

/// Reach of the lists that cells need, in square roots of the mean cell.
pub(crate) const REACH: f64 = 2.3;

/// Cells of a swarm and what their areas are compared with.
pub(crate) struct Census {
    pub(crate) cells: Vec<Cell>,
    pub(crate) lists: Neighbors,
    /// Mean area of the cells inside the bounds, for a floater of size 1.
    pub(crate) share: f64,
    /// Sum of the areas.
    pub(crate) area: f64,
}

/// Area (length, on curves) of a size-1 cell into its linear size.
pub(crate) fn linear(share: f64, axes: usize) -> f64 {
    if axes == 2 { share } else { share.sqrt() }
}

/// size² (size, on curves): what a cell's area is proportional to.
fn weight(size: &[f64], i: usize, axes: usize) -> f64 {
    match size.get(i) {
        None => 1.0,
        Some(s) if axes == 2 => *s,
        Some(s) => s * s,
    }
}

/// The bounds as cells see them: a floater that its last correction moved off a face by next to nothing is still on it.
/// `unit` is the square root of a cell.
pub(crate) fn faces(walls: &Walls, unit: f64) -> Walls {
    let mut faces = *walls;
    for a in 0..walls.axes {
        faces.lo[a] += ON_FACE * unit;
        faces.hi[a] -= ON_FACE * unit;
    }
    faces
}

/// Distance from a face, in square roots of a cell, up to which a floater counts as on it.
const ON_FACE: f64 = 1e-4;

/// Measures all cells; `unit` is about the square root of a size-1 cell.
pub(crate) fn census(swarm: &Swarm, walls: &Walls, unit: f64) -> Census {
    let lists = swarm.neighbors(REACH * unit);
    let stars = Stars {
        points: &swarm.points,
        normals: &swarm.normals,
        lists: &lists,
        walls: &faces(walls, unit),
        radius: 0.5 * REACH * unit,
        size: &swarm.size,
    };
    let mut cells = stars.cells();
    // What stands on a crease has no tangent plane, and its cell is no measure.
    (0..swarm.held.len()).filter(|&i| swarm.is_held(i)).for_each(|i| cells[i].clipped = true);
    let (mut inner, mut weights, mut area) = (0.0, 0.0, 0.0);
    let (mut all_weights, mut count) = (0.0, 0usize);
    for (i, c) in cells.iter().enumerate() {
        let w = weight(&swarm.size, i, walls.axes);
        area += c.area;
        all_weights += w;
        if !c.clipped {
            inner += c.area;
            weights += w;
            count += 1;
        }
    }
    let share = if count > 0 { inner / weights } else { area / all_weights.max(f64::MIN_POSITIVE) };
    Census { cells, lists, share, area }
}

/// Cell areas relative to what they should be, averaged over neighbourhoods; 1 for cells at the bounds.
fn sparseness(swarm: &Swarm, census: &Census, share: f64, axes: usize) -> (Vec<f64>, Vec<f64>) {
    let own: Vec<f64> =
        (0..swarm.len()).map(|i| census.cells[i].area / (share * weight(&swarm.size, i, axes))).collect();
    let smooth = |v: &[f64]| -> Vec<f64> {
        (0..v.len())
            .into_par_iter()
            .with_min_len(1024)
            .map(|i| {
                if census.cells[i].clipped {
                    return 1.0;
                }
                let (mut sum, mut count) = (v[i], 1.0);
                for &j in census.lists.of(i) {
                    let j = j as usize;
                    if !census.cells[j].clipped && swarm.label[j] == swarm.label[i] {
                        sum += v[j];
                        count += 1.0;
                    }
                }
                sum / count
            })
            .collect()
    };
    let once = smooth(&own);
    let twice = smooth(&once);
    (own, twice)
}

/// What [`balance`] did.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Turnover {
    pub(crate) births: usize,
    pub(crate) deaths: usize,
    /// Area of a size-1 cell afterwards.
    pub(crate) share: f64,
}

/// Where floaters live and multiply.
#[derive(Clone, Copy)]
pub(crate) struct Habitat<'a> {
    pub(crate) surface: &'a dyn Surface,
    pub(crate) walls: &'a Walls,
    /// Gradients up to this length count as zero.
    pub(crate) least: f64,
    /// Area (length, on curves) of each component, estimated.
    pub(crate) label_area: &'a [f64],
}

/// Brings the swarm to `n` floaters (never below one a component), given how many there are and the edges between them,
/// and moves floaters from where cells are small to where they are large. Children are set into the largest gap around their parent and projected. `unit` is the
/// linear size of a size-1 cell at present.
pub(crate) fn balance(
    swarm: &mut Swarm,
    habitat: &Habitat<'_>,
    count: &mut u64,
    unit: f64,
    n: impl FnOnce(usize, usize) -> usize,
    rng: Rng,
) -> Result<Turnover, FieldError> {
    let mut census = census(swarm, habitat.walls, unit);
    let now = swarm.len();
    // An edge is seen from both ends.
    let n = n(now, census.cells.iter().map(|c| c.valence as usize).sum::<usize>() / 2);
    let mut per_label = swarm.per_label();
    for i in 0..now {
        // A floater that sees nobody has no cell to speak of; it shares its component with others out of sight.
        let l = swarm.label[i] as usize;
        if census.cells[i].valence == 0 {
            census.cells[i].area = habitat.label_area[l] / f64::from(per_label[l]);
        }
    }
    let share = census.share * now as f64 / n as f64;
    let (own, smooth) = sparseness(swarm, &census, share, habitat.walls.axes);
    let excess = |i: usize| smooth[i] - 1.0;
    let births0: f64 = (0..now).map(|i| excess(i).max(0.0)).sum();
    let deaths0: f64 = (0..now).map(|i| (-excess(i)).max(0.0)).sum();
    let mean = (0.5 * (births0 + deaths0 - now.abs_diff(n) as f64)).max(0.0).round() as usize;
    let key = |i: usize, sign: f64, counter: u64| {
        sign * (excess(i) + 0.5 * (own[i] - smooth[i])) - rng.unit(2 * i as u64 + counter)
    };
    let mut alive = vec![true; now];
    let mut touched = vec![false; now];
    let crushed = crush(swarm, &census, unit, &mut alive, &mut per_label);
    let deaths = crushed.max(mean + now.saturating_sub(n));
    let mut done = Turnover { deaths: crushed, share, ..Turnover::default() };
    // Neighbours of one who died stay, unless there is no other way to the number that is asked for.
    for strict in [true, false] {
        if !strict && now - done.deaths <= n {
            break;
        }
        let enough = if strict { deaths } else { now - n };
        for i in ranked(now, |i| key(i, -1.0, 0)) {
            if done.deaths >= enough {
                break;
            }
            let label = swarm.label[i] as usize;
            if !alive[i]
                || swarm.is_held(i)
                || per_label[label] <= 1
                || (strict && (touched[i] || census.cells[i].clipped))
            {
                continue;
            }
            alive[i] = false;
            per_label[label] -= 1;
            done.deaths += 1;
            touched[i] = true;
            census.lists.of(i).iter().for_each(|&j| touched[j as usize] = true);
        }
    }
    let births = n.saturating_sub(now - done.deaths);
    let order = ranked(now, |i| key(i, 1.0, 1));
    let fertile: Vec<bool> = (0..now).map(|i| alive[i] && !swarm.is_held(i)).collect();
    let mut children = Children::default();
    // Parents whose children find no room are passed over; when all are, room is no condition any more.
    for round in 0..4 {
        let missing = births - children.points.len();
        if missing == 0 {
            break;
        }
        let parents = choose_parents(&census, missing, &order, &fertile, &mut touched, &mut children.times);
        children.bear(swarm, &census, habitat, count, unit, &parents, rng, round < 3)?;
    }
    done.births = children.points.len();
    drop(census);
    let born: Vec<(u32, Option<f64>)> =
        children.parent.iter().map(|&i| (swarm.label[i], swarm.size.get(i).copied())).collect();
    let mut place = 0;
    for i in (0..now).filter(|&i| alive[i]) {
        swarm.overwrite(place, i);
        place += 1;
    }
    swarm.truncate(place);
    for (k, (label, size)) in born.into_iter().enumerate() {
        swarm.push(children.points[k], children.normals[k], label, size);
    }
    Ok(done)
}

/// Children that are being born.
#[derive(Default)]
struct Children {
    points: Vec<V3>,
    normals: Vec<V3>,
    parent: Vec<usize>,
    /// How often each floater has tried.
    times: Vec<u8>,
}

impl Children {
    fn bear(
        &mut self,
        swarm: &Swarm,
        census: &Census,
        habitat: &Habitat<'_>,
        count: &mut u64,
        unit: f64,
        parents: &[usize],
        rng: Rng,
        room: bool,
    ) -> Result<(), FieldError> {
        let Habitat { surface, walls, least, .. } = *habitat;
        let mut points: Vec<V3> = parents
            .iter()
            .map(|&i| {
                // The farthest corner of the parent's cell; a second child of one parent goes the other way.
                let way = if self.times[i].is_multiple_of(2) { -0.7 } else { 1.0 };
                let place = add(swarm.points[i], scale(census.cells[i].corner.map(f64::from), way));
                // A little off, so that no two ever coincide and stay together.
                walls.clamp(along(
                    place,
                    0.05 * unit,
                    rng.child(u64::from(self.times[i])).direction(i as u64, walls.axes),
                ))
            })
            .collect();
        let mut normals: Vec<V3> = parents.iter().map(|&i| swarm.normals[i]).collect();
        let target = Target { tolerance: 1e-3 * unit, longest: unit, least, rounds: 6 };
        let left = project(surface, count, walls, &mut points, &mut normals, target)?;
        for (k, &i) in parents.iter().enumerate() {
            if !room && left[k] > 0.01 * unit {
                // Not on the surface: beside the parent, which is, and off by a little.
                let aside = rng.child(!0).direction(i as u64, walls.axes);
                let aside = walls.slide(swarm.points[i], swarm.normals[i], aside);
                points[k] = walls.clamp(along(swarm.points[i], 1e-3 * unit, aside));
                normals[k] = swarm.normals[i];
            }
            let reach = OVERLAP * unit * swarm.size.get(i).copied().unwrap_or(1.0);
            if room && (left[k] > 0.01 * unit || distance(points[k], swarm.points[i]) < reach) {
                continue;
            }
            self.points.push(points[k]);
            self.normals.push(normals[k]);
            self.parent.push(i);
        }
        Ok(())
    }
}

/// Two floaters closer than this part of the linear size of a cell are one too many.
const OVERLAP: f64 = 0.35;

/// And this part is one spot.
const SPOT: f64 = 1e-4;

/// Floaters closer than this part of the linear size of a cell to a point of a crease are too close: the balls around the
/// points of a crease protect it (Cheng, Dey and Ramos 2010), so that no edge between floaters crosses it.
pub(crate) const PROTECTED: f64 = 0.6;

/// Floaters on top of each other: the force between them vanishes with their distance, so that pressure (at the bounds
/// above all) can hold them together. One of each pair dies. Gives how many.
fn crush(swarm: &Swarm, census: &Census, unit: f64, alive: &mut [bool], per_label: &mut [u32]) -> usize {
    let mut dead = 0;
    for i in on_one_spot(&swarm.points, SPOT * unit) {
        if !swarm.is_held(i) && per_label[swarm.label[i] as usize] > 1 {
            alive[i] = false;
            per_label[swarm.label[i] as usize] -= 1;
            dead += 1;
        }
    }
    for i in 0..swarm.len() {
        if !alive[i] {
            continue;
        }
        let reach = OVERLAP * unit * swarm.size.get(i).copied().unwrap_or(1.0);
        // Floaters keep farther from those on creases, which do not give way.
        let beside = PROTECTED * unit * swarm.size.get(i).copied().unwrap_or(1.0);
        if swarm.is_held(i) || census.cells[i].nearest >= beside || per_label[swarm.label[i] as usize] <= 1 {
            continue;
        }
        let on = |&j: &u32| {
            let j = j as usize;
            let apart = distance(swarm.points[i], swarm.points[j]);
            if swarm.is_held(j) {
                return apart < beside;
            }
            j < i && alive[j] && swarm.label[j] == swarm.label[i] && apart < reach
        };
        if census.lists.of(i).iter().any(on) {
            alive[i] = false;
            per_label[swarm.label[i] as usize] -= 1;
            dead += 1;
        }
    }
    dead
}

/// All points but one of each group that are within `reach` of another on their way along a direction in which no surface is
/// likely to lie. Normals do not count: on one spot, as at a singular point, there may be any.
fn on_one_spot(points: &[V3], reach: f64) -> Vec<usize> {
    const WAY: V3 = [0.613, 0.531, 0.585];
    // Enough where no surface lies in it; where one does, not every pair is seen.
    const PLACES: usize = 64;
    let mut along: Vec<(f64, u32)> = points.iter().zip(0..).map(|(p, i)| (dot(*p, WAY), i)).collect();
    along.arrange_together(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut found = Vec::new();
    for (k, &(at, i)) in along.iter().enumerate() {
        let mut before = along[..k].iter().rev().take(PLACES).take_while(|(there, _)| at - there <= reach);
        if before.any(|&(_, j)| distance(points[i as usize], points[j as usize]) <= reach) {
            found.push(i as usize);
        }
    }
    found
}

/// Indices by falling key.
fn ranked(n: usize, key: impl Fn(usize) -> f64 + Sync) -> Vec<usize> {
    let mut keyed: Vec<(f64, usize)> =
        (0..n).into_par_iter().with_min_len(4096).map(|i| (key(i), i)).collect();
    keyed.arrange_together(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    keyed.into_iter().map(|(_, i)| i).collect()
}

/// Up to `births` floaters in the given order; no two neighbours and none at the bounds as long as there are others,
/// none twice before all others have tried once.
fn choose_parents(
    census: &Census,
    births: usize,
    order: &[usize],
    alive: &[bool],
    touched: &mut [bool],
    times: &mut Vec<u8>,
) -> Vec<usize> {
    times.resize(alive.len(), 0);
    let mut parents = Vec::with_capacity(births);
    let fewest = (0..alive.len()).filter(|&i| alive[i]).map(|i| times[i]).min().unwrap_or(0);
    for round in 0..3 {
        for &i in order {
            if parents.len() == births {
                return parents;
            }
            let free = round > 0 || !(touched[i] || census.cells[i].clipped);
            if alive[i] && times[i] == fewest + u8::from(round == 2) && free {
                times[i] += 1;
                parents.push(i);
                touched[i] = true;
                census.lists.of(i).iter().for_each(|&j| touched[j as usize] = true);
            }
        }
    }
    parents
}

/// The edges of the Delaunay stars, each once, as seen from either end.
pub(crate) fn edges(swarm: &Swarm, walls: &Walls, unit: f64) -> Vec<(u32, u32)> {
    let lists = swarm.neighbors(REACH * unit);
    let stars = Stars {
        points: &swarm.points,
        normals: &swarm.normals,
        lists: &lists,
        walls,
        radius: 0.5 * REACH * unit,
        size: &swarm.size,
    };
    let rows: Vec<Vec<(u32, u32)>> = (0..swarm.len().div_ceil(1024))
        .into_par_iter()
        .map(|c| {
            let mut out = Vec::with_capacity(6 * 1024);
            let mut desk = Desk::new();
            for i in c * 1024..((c + 1) * 1024).min(swarm.len()) {
                stars.cell(i, &mut desk, |j, _| out.push((i.min(j as usize) as u32, j.max(i as u32))));
            }
            out
        })
        .collect();
    let mut all: Vec<(u32, u32)> = rows.into_iter().flatten().collect();
    all.arrange_together(Ord::cmp);
    all.dedup();
    all
}

/// Adds a floater in the middle of every edge of the Delaunay stars: four times as many (twice, on curves), in the
/// same order as before, so that what a coarse level has settled stays settled.
pub(crate) fn refine(
    swarm: &mut Swarm,
    habitat: &Habitat<'_>,
    count: &mut u64,
    unit: f64,
) -> Result<usize, FieldError> {
    let Habitat { surface, walls, least, .. } = *habitat;
    let mut edges = edges(swarm, walls, unit);
    // Creases are refined along themselves.
    edges.retain(|&(i, j)| !(swarm.is_held(i as usize) && swarm.is_held(j as usize)));
    let mut points: Vec<V3> = edges
        .iter()
        .map(|&(i, j)| scale(add(swarm.points[i as usize], swarm.points[j as usize]), 0.5))
        .collect();
    let mut normals: Vec<V3> = edges.iter().map(|&(i, _)| swarm.normals[i as usize]).collect();
    let target = Target { tolerance: 1e-3 * unit, longest: 0.5 * unit, least, rounds: 4 };
    let left = project(surface, count, walls, &mut points, &mut normals, target)?;
    let before = swarm.len();
    for (k, &(i, j)) in edges.iter().enumerate() {
        if left[k] > 0.01 * unit {
            continue;
        }
        let (i, j) = (i as usize, j as usize);
        let size = swarm.size.get(i).map(|s| 0.5 * (s + swarm.size[j]));
        let label = if swarm.is_held(i) { swarm.label[j] } else { swarm.label[i] };
        swarm.push(points[k], normals[k], label, size);
    }
    Ok(swarm.len() - before)
}
