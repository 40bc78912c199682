//! Where the surface is: boxes that may hold it, points on it that are uniform by area, and its components.
//!
//! 1. [`region`]: boxes that together contain every zero, by interval subdivision, or, where a surface has no
//!    intervals, boxes where samples of F suggest a zero.
//! 2. [`lines`]: roots along random axis-parallel lines through the boxes, thinned so that they are uniform by area.
//! 3. [`probes`]: Newton's method from every box without a root, and subdivision of those that stay in doubt.
//! 4. [`components`]: which roots belong together.
//!
//! Where nothing is found [`absence`] tells why.

mod absence;
mod components;
mod lines;
mod probes;
mod region;
mod trace;

use isoswarm_field::{Aabb, FieldError, Surface};

use crate::constraint::Walls;
use crate::neighbors::{Grid, Neighbors, Reach};
use crate::options::Phase;
use crate::population::linear;
use crate::rng::{Rng, Stream};
use crate::run::Run;
use crate::swarm::{Swarm, same_sheet};
use crate::vector::{V3, distance, dot, norm, sub};
pub(crate) use components::{divide, in_order};
pub(crate) use lines::{Roots, cast, draw};
use rayon::prelude::*;
pub(crate) use region::Region;

/// Boxes to aim at: enough to isolate small parts, few enough to take milliseconds.
pub(crate) const BOXES: usize = 6_000;

/// Turn of the normal (radians, about) from seed to seed beyond which pieces of surface next to each other are taken for one.
const BENT: f64 = 0.4;

/// Gap between sheets that is far less than the distance of seeds, as a part of that.
const THIN: f64 = 0.1;

/// Seeds that are asked whether such a sheet is behind them.
const ASKED: usize = 500;

/// What is known of a surface before any floater moves.
pub(crate) struct Seeds<'s> {
    /// Where it may be.
    pub(crate) region: Region<'s>,
    /// Points on it. The first `uniform` of them are distributed uniformly by area; the others are finds besides.
    pub(crate) points: Vec<V3>,
    /// Unit normals at the points.
    pub(crate) normals: Vec<V3>,
    /// Connected component of each point.
    pub(crate) label: Vec<u32>,
    /// See `points`.
    pub(crate) uniform: usize,
    /// Number of components.
    pub(crate) components: usize,
    /// Unbiased estimate of the area (length, in the plane).
    pub(crate) area: f64,
    /// The same for each component; for those that no line met from the extent of what was found.
    pub(crate) label_area: Vec<f64>,
    /// How much the normal turns per length, on average over neighbours: 1/r on a sphere.
    pub(crate) bend: f64,
    /// Gradients up to this length count as zero.
    pub(crate) least: f64,
    /// Whether intervals vouch for all of it: see [`Report::certified`](crate::Report).
    pub(crate) certified: bool,
    /// The walls of the bounds; a little beyond those that were given where the surface lies in a face of them.
    pub(crate) walls: Walls,
    /// The walls of the bounds that were given.
    pub(crate) given: Walls,
}

/// Points that are evaluated between two reports to the run.
const WATCHED: usize = 1 << 13;

/// F and ∂F/∂x at many points, with reports in between. Fails as soon as the run is asked to stop: its `stop` says why.
fn look(
    surface: &dyn Surface,
    run: &mut Run<'_>,
    points: &[V3],
    value: &mut Vec<f64>,
    gradient: &mut Vec<V3>,
) -> Result<(), FieldError> {
    value.clear();
    gradient.clear();
    value.resize(points.len(), 0.0);
    gradient.resize(points.len(), [0.0; 3]);
    let parts = points.chunks(WATCHED).zip(value.chunks_mut(WATCHED)).zip(gradient.chunks_mut(WATCHED));
    for ((points, value), gradient) in parts {
        // How much there is to look at is not known: the first tenth of the way is never quite gone.
        let done = run.evaluations as f64;
        if !run.tell(Phase::Seeding, 0.1 * done / (done + 1e5), 0) {
            return Err(FieldError::Invalid("the search for the surface was stopped".into()));
        }
        run.evaluations += points.len() as u64;
        surface.value_gradient(points, value, gradient)?;
    }
    Ok(())
}

/// Looks for the surface in the bounds; `aim` is the number of uniform points wanted (about; at least some thousand
/// are drawn), `fine` that of the boxes and of the lines along each axis. `None` where there is no surface.
pub(crate) fn seed<'s>(
    surface: &'s dyn Surface,
    run: &mut Run<'_>,
    bounds: &Aabb,
    aim: usize,
    fine: usize,
) -> Result<(Option<Seeds<'s>>, bool), FieldError> {
    let given = Walls::new(bounds, surface.axes());
    seed_within(surface, run, given, given, (aim, fine))
}

/// The same within walls that may be a little beyond those that were given.
fn seed_within<'s>(
    surface: &'s dyn Surface,
    run: &mut Run<'_>,
    walls: Walls,
    given: Walls,
    (aim, fine): (usize, usize),
) -> Result<(Option<Seeds<'s>>, bool), FieldError> {
    let bounds = &Aabb::new(walls.lo, walls.hi);
    let region = region::find(surface, run, bounds, walls.axes, fine)?;
    if absence::nowhere_finite(surface, &region, run, bounds)? {
        return Ok((None, false));
    }
    if region.boxes.is_empty() {
        return Ok((None, region.certified));
    }
    let rng = Rng::new(run.seed, Stream::Lines);
    let mut roots = Roots::default();
    let cross = |b: &Aabb| {
        let s: Vec<f64> = (0..walls.axes).map(|a| b.hi[a] - b.lo[a]).collect();
        if walls.axes == 2 { 0.5 * (s[0] + s[1]) } else { (s[0] * s[1] + s[1] * s[2] + s[2] * s[0]) / 3.0 }
    };
    let mean_cross = region.boxes.iter().map(cross).sum::<f64>() / region.boxes.len() as f64;
    // Few boxes (a small or simple surface) get several lines each.
    let per_box = (fine as f64 / region.boxes.len() as f64).clamp(1.0, 64.0);
    let first = per_box / mean_cross;
    cast(&region, run, walls.axes, first, rng.child(0), &mut roots)?;
    let mut area = roots.area;
    if roots.kept() > 0 && (roots.kept() as f64) < 1.25 * aim as f64 {
        let more = (1.4 * aim as f64 / area - first).max(0.2 * first);
        cast(&region, run, walls.axes, more, rng.child(1), &mut roots)?;
        area = (roots.area - area) * more / (first + more) + area * first / (first + more);
    }
    let least = 1e-12 * scale_of(&roots.gradients);
    let doubt = probes::search(surface, &region, run, &walls, least, &mut roots)?;
    if (walls.lo, walls.hi) == (given.lo, given.hi)
        && let Some(wider) = beyond_faces(&walls, &roots, run)
    {
        return seed_within(surface, run, wider, given, (aim, fine));
    }
    let surely_none = roots.points.is_empty() && region.certified && doubt == 0;
    let unmet = roots.line.iter().all(|l| *l == u64::MAX);
    if unmet && !surely_none && absence::never_crosses(surface, &region, run, &walls, &roots)? {
        return Ok((None, false));
    }
    if roots.points.is_empty() {
        return Ok((None, region.certified && doubt == 0));
    }
    let certified = region.certified && doubt == 0;
    let (mut label, mut components) = components::label(surface, run, &walls, &roots, area, least)?;
    let (mut order, uniform) = roots.uniform_first();
    components = drop_touching(&walls, &roots, &mut order, &mut label, components);
    if components == 0 {
        return Ok((None, certified));
    }
    let normals: Vec<V3> = order.iter().map(|&i| crate::vector::unit(roots.gradients[i])).collect();
    let points: Vec<V3> = order.iter().map(|&i| roots.points[i]).collect();
    let bend =
        bend(&points[..uniform], &normals[..uniform], linear(area / uniform.max(1) as f64, walls.axes));
    let label_area = areas(&walls, &roots, &order, &label, components, area);
    Ok((
        Some(Seeds {
            label_area,
            points,
            normals,
            bend,
            label: order.iter().map(|&i| label[i]).collect(),
            uniform,
            components,
            area,
            least,
            certified,
            walls,
            given,
            region,
        }),
        certified,
    ))
}

impl Seeds<'_> {
    /// Whether the surface bends so much from seed to seed that `n` floaters, which are more, may tell apart what the
    /// seeds could not.
    pub(crate) fn too_coarse_for(&self, n: usize) -> bool {
        n > 2 * self.uniform && self.rough()
    }

    /// Whether the surface bends so much from seed to seed that pieces of it may be overlooked or taken for one.
    pub(crate) fn rough(&self) -> bool {
        let apart = linear(self.area / self.uniform.max(1) as f64, self.walls.axes);
        self.bend * apart > BENT
    }

    /// Whether much of the surface lies back to back, far closer than seeds are to each other: then a walk around the rim at
    /// which sheets may be one finds no way.
    pub(crate) fn back_to_back(&self) -> bool {
        let apart = linear(self.area / self.uniform.max(1) as f64, self.walls.axes);
        let grid = Grid::new(&self.points, None, apart);
        let faced = |i: &usize| {
            let (p, n) = (self.points[*i], self.normals[*i]);
            let mut found = false;
            grid.near(p, apart, |j| {
                let j = j as usize;
                let way = sub(self.points[j], p);
                found |=
                    norm(way) <= apart && dot(self.normals[j], n) < -0.5 && dot(way, n).abs() < THIN * apart;
            });
            found
        };
        // Not all of them need to be asked.
        let asked = (0..self.uniform).step_by(self.uniform.div_ceil(ASKED).max(1));
        4 * asked.clone().filter(faced).count() > asked.count()
    }

    /// The seeds that are uniform by area.
    pub(crate) fn uniform_swarm(&self) -> Swarm {
        let mut swarm = Swarm::default();
        for i in 0..self.uniform {
            swarm.push(self.points[i], self.normals[i], self.label[i], None);
        }
        swarm
    }

    /// The component of the seed that is nearest to each point, on its own sheet if there is one near.
    pub(crate) fn nearest_labels(&self, points: &[V3], normals: &[V3]) -> Vec<u32> {
        let reach = 3.0 * linear(self.area / self.uniform.max(1) as f64, self.walls.axes);
        let grid = Grid::new(&self.points, None, reach);
        points
            .par_iter()
            .zip(normals)
            .map(|(&p, &n)| {
                let mut radius = reach;
                loop {
                    let mut best = (f64::INFINITY, u32::MAX);
                    grid.near(p, radius, |j| {
                        let j = j as usize;
                        let d = distance(p, self.points[j]);
                        let other = !same_sheet(p, self.points[j], n, self.normals[j]);
                        // A seed on another sheet only counts where there is no better one.
                        let rank = if other { d + 4.0 * radius } else { d };
                        if (rank, self.label[j]) < best {
                            best = (rank, self.label[j]);
                        }
                    });
                    if best.1 != u32::MAX {
                        return best.1;
                    }
                    radius *= 4.0;
                }
            })
            .collect()
    }
}

/// How far beyond a face in which the surface lies it is looked for, in sides of the bounds.
const BEYOND: f64 = 1e-3;
/// Roots in a face, and one of how many, that make it one in which the surface lies: tangent points are few.
const IN_FACE: usize = 8;
const ONE_IN: usize = 50;

/// Walls a little beyond the faces of the bounds in which the surface lies, if there are such faces: on a face F need not change
/// its sign, and particles could not move.
fn beyond_faces(walls: &Walls, roots: &Roots, run: &mut Run<'_>) -> Option<Walls> {
    let (mut wider, mut found) = (*walls, Vec::new());
    for a in 0..walls.axes {
        let side = walls.hi[a] - walls.lo[a];
        for (upper, face) in [(false, walls.lo[a]), (true, walls.hi[a])] {
            let lies = |(p, g): &(&V3, &V3)| {
                (p[a] - face).abs() <= 1e-9 * side && g[a].abs() >= (1.0 - 1e-6) * norm(**g) && g[a] != 0.0
            };
            let many = roots.points.iter().zip(&roots.gradients).filter(lies).count();
            if many < IN_FACE || many * ONE_IN < roots.points.len() {
                continue;
            }
            found.push(format!("{} = {face}", ["x", "y", "z"][a]));
            if upper {
                wider.hi[a] += BEYOND * side;
            } else {
                wider.lo[a] -= BEYOND * side;
            }
        }
    }
    if found.is_empty() {
        return None;
    }
    let warning = format!(
        "the surface lies in a face of the bounds ({}), where rounding decides what is inside: enlarge the bounds",
        found.join(", ")
    );
    if !run.warnings.contains(&warning) {
        run.warnings.push(warning);
    }
    Some(wider)
}

/// How much the normal turns per length, on average over neighbours within `radius`.
fn bend(points: &[V3], normals: &[V3], radius: f64) -> f64 {
    let keep = |i: usize, j: usize| same_sheet(points[i], points[j], normals[i], normals[j]);
    let lists = Neighbors::find(points, Reach::Same(radius), keep);
    let (mut turn, mut way) = (0.0, 0.0);
    for i in 0..points.len() {
        for &j in lists.of(i) {
            turn += distance(normals[i], normals[j as usize]);
            way += distance(points[i], points[j as usize]);
        }
    }
    if way > 0.0 { turn / way } else { 0.0 }
}

fn areas(
    walls: &Walls,
    roots: &Roots,
    order: &[usize],
    label: &[u32],
    components: usize,
    area: f64,
) -> Vec<f64> {
    let mut uniform = vec![0usize; components];
    let mut boxes: Vec<Option<Aabb>> = vec![None; components];
    for &i in order {
        let (p, l) = (roots.points[i], label[i] as usize);
        uniform[l] += usize::from(roots.keep[i]);
        let b = boxes[l].get_or_insert(Aabb::new(p, p));
        for a in 0..3 {
            b.lo[a] = b.lo[a].min(p[a]);
            b.hi[a] = b.hi[a].max(p[a]);
        }
    }
    let each = area / uniform.iter().sum::<usize>().max(1) as f64;
    (0..components)
        .map(|l| match boxes[l] {
            Some(b) if uniform[l] == 0 => {
                let d = b.diagonal();
                if walls.axes == 2 { d } else { d * d }.min(each)
            }
            _ => uniform[l] as f64 * each,
        })
        .collect()
}

/// Leaves out components that only touch the bounds from outside, in points without area: no line met them and all
/// their roots lie on faces. Gives the number of those that stay.
fn drop_touching(
    walls: &Walls,
    roots: &Roots,
    order: &mut Vec<usize>,
    label: &mut [u32],
    components: usize,
) -> usize {
    let mut real = vec![false; components];
    for i in 0..roots.points.len() {
        real[label[i] as usize] |= roots.line[i] != u64::MAX || !walls.touches(roots.points[i]);
    }
    order.retain(|&i| real[label[i] as usize]);
    let mut number = vec![0u32; components];
    let mut kept = 0;
    for c in 0..components {
        number[c] = kept;
        kept += u32::from(real[c]);
    }
    label.iter_mut().for_each(|l| *l = number[*l as usize]);
    kept as usize
}

/// The median length of the gradients: what small gradients are compared with.
fn scale_of(gradients: &[V3]) -> f64 {
    let mut lengths: Vec<f64> = gradients.iter().map(|&g| norm(g)).filter(|l| l.is_finite()).collect();
    isoswarm_field::arrange::median(&mut lengths).unwrap_or(0.0)
}
