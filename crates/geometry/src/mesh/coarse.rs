//! Meshes made coarse to fine: few samples, stitched, and every triangle made four until there are as many as asked for.
//!
//! Few samples cost little to spread and to stitch, and what is done to their mesh (repair, valences, smoothing) costs little too. Its
//! children inherit its topology, and new vertices have six triangles; a few rounds of smoothing round off what is left of their
//! parents' edges. That is right where the coarse mesh resolves the surface; where it does not, or does not show that it does,
//! more samples are tried, and at last as many as there are to be vertices.

use isoswarm_field::vector::{V3, cross, distance, dot, norm, sub};
use isoswarm_field::{Aabb, FieldError, Surface, in_pool};
use isoswarm_particles as particles;
use isoswarm_particles::{Amount, Density, Error, Options, Progress, Report, Samples, Search, Status};
use rayon::prelude::*;

use super::build::{Draft, Meshed, Resolution, finish, improve};
use super::connect::Triangles;
use super::crease::Segments;
use super::error;
use super::report::MeshReport;
use super::sizes::{CELL, ErrorSizes, TURN as SHARP};
use super::smooth::smooth;
use super::subdivide::subdivide;
use super::vertices::Vertices;

/// Fewest samples, and as many for each component.
const FEWEST: f64 = 500.0;
/// The same where a distance is asked for, which counts more than good triangles.
const FEWEST_FOR_ERROR: f64 = 120.0;
/// Most subdivisions.
const LEVELS: u32 = 4;
/// Turn of the normal within the spacing, radians, up to which a coarse mesh resolves the surface.
const TURN: f64 = 1.25;
/// The same where a distance is asked for: more vertices come where it is larger.
const TURN_FOR_ERROR: f64 = 1.6;
/// The same where sizes see to it, with room for what samples differ.
const RESOLVED: f64 = 0.85;
/// The same beyond which few samples are not even tried.
const HOPELESS: f64 = 1.5;
/// Times the vertices that a distance takes that a coarse mesh may lead to.
const MORE: f64 = 1.3;
/// Steps in which samples are spread and settle where a distance is asked for: the mesh is smoothed.
const STEPS: usize = 24;
const SETTLING: usize = 4;
/// Cosine between a coarse triangle and the normals at its corners, at least.
const LEVEL: f64 = 0.6;
/// Rounds in which vertices come where a coarse mesh does not keep to it, if a distance is asked for, and rounds of smoothing in each.
const BENT: usize = 8;
const ROUNDS_WHERE_BENT: usize = 2;
/// Where it is more than one triangle in so many, the mesh does not resolve the surface.
const FEW_BENT: usize = 25;
/// The same cosine for the triangles of the result.
const FLAT: f64 = 0.85;
/// Rounds of smoothing after each subdivision.
const ROUNDS: usize = 6;
/// The same where a distance is asked for.
const ROUNDS_FOR_ERROR: usize = 3;

/// What [`mesh`] is asked for.
pub(super) struct Wish {
    pub(super) resolution: Resolution,
    pub(super) creases: bool,
    pub(super) smoothing: usize,
    pub(super) intersections: bool,
    pub(super) seed: u64,
    pub(super) most: usize,
}

/// A mesh from few samples; `None` where few do not resolve the surface.
pub(super) fn mesh(
    surface: &dyn Surface,
    bounds: &Aabb,
    wish: &Wish,
    progress: &mut dyn FnMut(&Progress) -> std::ops::ControlFlow<particles::Stop>,
) -> Result<Option<Meshed>, Error> {
    if matches!(wish.resolution, Resolution::Count(n) if (n as f64) < FEWEST * part(1)) {
        return Ok(None);
    }
    let stopped = std::cell::Cell::new(false);
    let mut tell = |p: &Progress| {
        let answer = progress(p);
        stopped.set(stopped.get() || answer.is_break());
        answer
    };
    let search = Search::new(surface, bounds, wish.seed, Some(&mut tell))?;
    let Some(extent) = search.extent().filter(|e| e.diagonal() > 0.0) else { return Ok(None) };
    let Some(plans) = plans(surface, &search, &extent, wish)? else { return Ok(None) };
    let mut level = plans.len() - 1;
    let mut evaluations = 0;
    while level > 0 {
        let Some(Plan { n, sizes }) = plans[level] else {
            level -= 1;
            continue;
        };
        let part = part(level as u32);
        // Few steps will do for a distance, but for the last chance before as many samples as vertices.
        let roughly = sizes.is_some() && level > 1;
        let density = |points: &[V3], out: &mut [f64]| match &sizes {
            Some(sizes) => sizes.density(surface, points, out),
            None => Ok(()),
        };
        let options = Options {
            amount: match wish.resolution {
                Resolution::Spacing(s) => Amount::Spacing(s * part.sqrt()),
                _ => Amount::Count((n / part).ceil() as usize),
            },
            density: if sizes.is_some() { Density::Function(&density) } else { Density::Uniform },
            creases: wish.creases.then_some(isoswarm_particles::creases::find),
            even_creases: true,
            most: wish.most,
            steps: roughly.then_some(SETTLING),
            progress: Some(&mut tell),
            ..Options::default()
        };
        let sampled = if roughly { search.sample_roughly(options, STEPS) } else { search.sample(options) };
        let samples = match sampled {
            Err(Error::TooFew { .. }) => {
                level -= 1;
                continue;
            }
            other => other?,
        };
        let Some(most) = turn(&samples) else { return Ok(None) };
        if stopped.get() {
            return Ok(None);
        }
        let before = samples.report.evaluations;
        if most <= if sizes.is_some() { TURN_FOR_ERROR } else { TURN }
            && let Some(mut made) = in_pool(surface, || refine(surface, bounds, samples, level as u32, wish))?
        {
            made.report.evaluations += evaluations;
            return Ok(Some(made));
        }
        evaluations += before;
        // Each level halves the turn.
        level -= 1;
        while level > 0 && 0.5 * most > 1.2 * TURN {
            level -= 1;
        }
    }
    Ok(None)
}

/// Samples of a level.
#[derive(Clone, Copy)]
struct Plan {
    /// Vertices in the end.
    n: f64,
    /// Where they are closer, if a distance is asked for.
    sizes: Option<ErrorSizes>,
}

/// What to try for each number of subdivisions, `None` where that is of no use; no plans at all where nothing is.
fn plans(
    surface: &dyn Surface,
    search: &Search<'_>,
    extent: &Aabb,
    wish: &Wish,
) -> Result<Option<Vec<Option<Plan>>>, Error> {
    let mut out = vec![None; LEVELS as usize + 1];
    let few = |n: f64| n.is_finite() && n <= wish.most as f64;
    if let Resolution::Error(e) = wish.resolution {
        if !(e > 0.0 && e.is_finite()) {
            return Ok(None);
        }
        let sizes = ErrorSizes::new(e, extent);
        let curvatures = std::cell::OnceCell::new();
        let count = |sizes: &ErrorSizes| {
            search.integral(|points, out| {
                sizes.of(curvatures.get_or_init(|| particles::principal_curvatures(surface, points)), out);
                Ok(())
            })
        };
        let least = count(&sizes)?;
        for level in 1..=LEVELS {
            let part = part(level);
            let sizes = sizes.with_turn(RESOLVED, part);
            let n = count(&sizes)?;
            let worthwhile = n <= MORE * least && n >= FEWEST_FOR_ERROR * part;
            out[level as usize] = (worthwhile && few(n)).then_some(Plan { n, sizes: Some(sizes) });
        }
        return Ok(Some(out));
    }
    let bend = std::cell::Cell::new(0.0f64);
    let area = search.integral(|points, out| {
        let bends = particles::principal_curvatures(surface, points).into_iter().map(|k| k[0].abs());
        bend.set(bends.filter(|b| b.is_finite()).fold(0.0, f64::max));
        out.fill(1.0);
        Ok(())
    })?;
    let n = match wish.resolution {
        Resolution::Count(n) => n as f64,
        Resolution::Spacing(s) if s > 0.0 && s.is_finite() => area / (CELL * s * s),
        _ => return Ok(None),
    };
    for level in 1..=LEVELS {
        let part = part(level);
        let turn = bend.get() * (part * area / (CELL * n)).sqrt();
        let worthwhile = n >= FEWEST * part && turn <= HOPELESS * TURN;
        out[level as usize] = (worthwhile && few(n)).then_some(Plan { n, sizes: None });
    }
    Ok(Some(out))
}

/// How many vertices come from one sample.
fn part(level: u32) -> f64 {
    4f64.powi(level as i32)
}

/// Largest turn of the normal within the spacing; `None` where more samples of this kind are of no use.
fn turn(samples: &Samples) -> Option<f64> {
    if samples.points.is_empty() || samples.creases.is_some() {
        return None;
    }
    let one = |i: usize| 2.0 * samples.radii[i] * samples.curvatures[i][0].abs();
    let mut turns = (0..samples.points.len()).map(one);
    turns.try_fold(0.0f64, |m, t| t.is_finite().then(|| m.max(t)))
}

/// Stitches samples and subdivides the triangles; `None` where the mesh is not in order at any stage.
fn refine(
    surface: &dyn Surface,
    bounds: &Aabb,
    mut samples: Samples,
    level: u32,
    wish: &Wish,
) -> Result<Option<Meshed>, FieldError> {
    let Draft { mut triangles, mut vertices, mut held, mut report } =
        Draft::stitch(surface, bounds, &samples)?;
    if !report.doubtful.is_empty() || !report.warnings.is_empty() {
        return Ok(None);
    }
    let segments = Segments::default();
    improve(surface, wish.smoothing, &segments, &mut triangles, &mut vertices, &mut held, &mut report)?;
    let error = match wish.resolution {
        Resolution::Error(e) => Some(e),
        _ => None,
    };
    if error.is_some() {
        if !level_out(surface, &mut triangles, &mut vertices, &mut held, &mut report)? {
            return Ok(None);
        }
    } else if !faces_outwards(&triangles.faces, &vertices.points, &vertices.normals, LEVEL) {
        return Ok(None);
    }
    let rounds = if error.is_some() { ROUNDS_FOR_ERROR } else { ROUNDS };
    for _ in 0..level {
        let mut finer = subdivide(surface, &triangles, &mut vertices)?;
        for _ in 0..if error.is_some() { BENT } else { 0 } {
            let Err(bent) = finer else { break };
            if !split_bent(surface, bent, &mut triangles, &mut vertices, &mut held, &mut report)? {
                return Ok(None);
            }
            finer = subdivide(surface, &triangles, &mut vertices)?;
        }
        let Ok(finer) = finer else { return Ok(None) };
        triangles = finer;
        held.resize(vertices.len(), false);
        improve(surface, rounds, &segments, &mut triangles, &mut vertices, &mut held, &mut report)?;
    }
    if let Some(most) = error {
        error::refine(surface, most, &segments, &mut triangles, &mut vertices, &mut held, &mut report)?;
    }
    if !faces_outwards(&triangles.faces, &vertices.points, &vertices.normals, FLAT) {
        return Ok(None);
    }
    let spacing = vertices.spacing.clone();
    // How even the few samples were is of no concern any more, nor what they did not resolve.
    samples.report.status = Status::Converged;
    samples.report.warnings.retain(|w| !w.contains(Report::UNRESOLVED));
    let out = finish(surface, &samples, wish.intersections, true, None, vertices, triangles.faces, report)?;
    // Finer features, which the few samples have not seen: as many samples as vertices see more of them.
    let bends = |(k, s): (&[f64; 2], &f64)| k[0].abs() * s > SHARP;
    let seen = error.is_some() || !out.mesh.curvatures.iter().zip(&spacing).any(bends);
    let whole = out.report.is_sound() && out.report.topology.components() == samples.report.components;
    Ok((seen && whole).then_some(out))
}

/// Puts vertices on the longest edges of triangles that do not lie along the surface at their corners: where it bends more than the
/// samples resolve. Whether these were few; what is left of them has to pass as triangles of the result.
fn level_out(
    surface: &dyn Surface,
    triangles: &mut Triangles,
    vertices: &mut Vertices,
    held: &mut Vec<bool>,
    report: &mut MeshReport,
) -> Result<bool, FieldError> {
    for _ in 0..BENT {
        let bent = |f: &usize| !is_level(&triangles.faces[*f], &vertices.points, &vertices.normals, LEVEL);
        let longest = |f: usize| {
            let v = triangles.faces[f];
            let side =
                |k: usize| distance(vertices.points[v[k] as usize], vertices.points[v[(k + 1) % 3] as usize]);
            let k = (0..3).max_by(|&i, &j| side(i).total_cmp(&side(j))).unwrap_or(0);
            (f as u32, k as u8)
        };
        let edges: Vec<(u32, u8)> = (0..triangles.faces.len()).filter(bent).map(longest).collect();
        if edges.is_empty() {
            break;
        }
        if !split_bent(surface, edges, triangles, vertices, held, report)? {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Puts vertices on edges over a bend and smooths; nothing, and false, where these are too many.
fn split_bent(
    surface: &dyn Surface,
    edges: Vec<(u32, u8)>,
    triangles: &mut Triangles,
    vertices: &mut Vertices,
    held: &mut Vec<bool>,
    report: &mut MeshReport,
) -> Result<bool, FieldError> {
    if FEW_BENT * edges.len() > triangles.faces.len() {
        return Ok(false);
    }
    error::split(surface, triangles, vertices, held, report, edges)?;
    report.flips += triangles.delaunay(&vertices.points, |_, _| false);
    for _ in 0..ROUNDS_WHERE_BENT {
        smooth(surface, triangles, vertices, held)?;
        report.evaluations += vertices.len() as u64;
        report.flips += triangles.delaunay(&vertices.points, |_, _| false);
    }
    Ok(true)
}

/// Whether every triangle lies along the surface at its corners: the cosine between them is above `least`.
fn faces_outwards(faces: &[[u32; 3]], points: &[V3], normals: &[V3], least: f64) -> bool {
    faces.par_iter().with_min_len(2048).all(|f| is_level(f, points, normals, least))
}

fn is_level(f: &[u32; 3], points: &[V3], normals: &[V3], least: f64) -> bool {
    let [a, b, c] = f.map(|v| points[v as usize]);
    let front = cross(sub(b, a), sub(c, a));
    let length = norm(front);
    f.iter().all(|&v| dot(front, normals[v as usize]) > least * length)
}
