//! Creases: the curves along which a surface has an edge, and the corners where they meet.
//!
//! A surface made of minima and maxima has edges where one of them switches: on the curves F = G = 0, G the difference
//! of its operands. Boxes that may hold such points are found by interval subdivision, points in them by Newton's
//! method, and from these the curves are followed to their ends.

mod finer;
mod network;
mod sides;
mod solve;
mod spread;
mod trace;

use isoswarm_field::switches::{Desk, Switches};
use isoswarm_field::{Aabb, Surface};

use crate::Error;
use crate::vector::{V3, dot};
pub use finer::{Finer, refine};
use network::{Line, Network};
use solve::Solver;
pub use trace::End;
use trace::{Knot, Tracer};

/// Relative distances between points by position: fills `sizes[i]` (> 0, finite; 1 for the spacing that is asked for) for `points[i]`.
pub type SizeFn<'a> = dyn Fn(&[V3], &mut [f64]) -> Result<(), Error> + 'a;

/// What is asked of [`creases`].
#[derive(Clone, Copy)]
pub struct CreaseOptions<'a> {
    /// Distance between points along a crease (> 0, model units); each edge gets the whole number of parts that comes
    /// nearest to it, and more where it or one of its sides would turn by more than .7 radians from point to point.
    pub spacing: f64,
    /// Least angle between the normals of the two sides (radians). Default: .02.
    pub angle: f64,
    /// Most boxes that the surface is divided into to find creases; smaller closed creases than a box may be missed
    /// where others are near. Default: 60,000.
    pub boxes: usize,
    /// Most points: where there would be more, they are farther apart, at most [`CreaseOptions::STRETCH`] times the spacing.
    /// Default: any number.
    pub most: usize,
    /// Where points are closer and where farther apart; the least size counts of those on the crease and beside it. Default: the
    /// same everywhere.
    pub sizes: Option<&'a SizeFn<'a>>,
}

impl CreaseOptions<'_> {
    /// How much farther apart points may be for the sake of their number: what lies between creases still keeps off them.
    pub const STRETCH: f64 = 1.2;

    /// The defaults for a spacing.
    pub fn new(spacing: f64) -> Self {
        Self { spacing, angle: ANGLE, boxes: 60_000, most: usize::MAX, sizes: None }
    }
}

/// Least angle between the normals of the two sides, unless another is asked for (radians).
const ANGLE: f64 = 0.02;

/// An edge: a crease from end to end, or a closed one.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// Numbers of its points in [`Creases::points`], in order; a closed edge does not repeat the first.
    pub points: Vec<u32>,
    /// Outward unit normals of the surface at each of its points, on the left and on the right side for who walks along
    /// the points on the outside.
    pub normals: Vec<[V3; 2]>,
    /// Whether it is closed.
    pub closed: bool,
    /// How it begins and ends; meaningless where it is closed.
    pub ends: [End; 2],
    /// Arc length (model units).
    pub length: f64,
    /// The switch that it is the crease of.
    switch: u32,
    /// By how much it or one of its sides turns (radians).
    turn: f64,
    /// Its length where every part of it is measured in its size.
    measure: f64,
}

impl Edge {
    /// The parts that it is divided into for a spacing.
    fn parts(&self, spacing: f64) -> usize {
        let least = if self.closed { 3.0 } else { 1.0 };
        (self.measure / spacing).round().max(least).max((self.turn / TURN).ceil()) as usize
    }

    /// Points that are neither of its ends, of so many parts.
    fn between(&self, parts: usize) -> usize {
        if self.closed { parts } else { parts.saturating_sub(1) }
    }

    /// Pairs of points that follow each other.
    pub fn segments(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        let n = self.points.len();
        let count = if self.closed { n } else { n.saturating_sub(1) };
        (0..count).map(move |k| [self.points[k], self.points[(k + 1) % n]])
    }
}

/// All creases of a surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Creases {
    /// Points on creases: first the ends of edges, each once, then tips (such as a cone's), then the others, edge by edge.
    pub points: Vec<V3>,
    /// Numbers of the points that are corners or tips.
    pub corners: Vec<u32>,
    /// The edges.
    pub edges: Vec<Edge>,
    /// Whether intervals vouch for every crease lying in one of the boxes that were searched.
    pub certified: bool,
    /// What should be known besides, a sentence each.
    pub warnings: Vec<String>,
}

impl Creases {
    /// For each point the outward unit normals of the sides that meet there, some more than once; none at tips.
    pub fn side_normals(&self) -> Vec<Vec<V3>> {
        let mut sides: Vec<Vec<V3>> = vec![Vec::new(); self.points.len()];
        for edge in &self.edges {
            for (&p, pair) in edge.points.iter().zip(&edge.normals) {
                sides[p as usize].extend_from_slice(pair);
            }
        }
        sides
    }

    /// For each point the unit vector whose largest angle to the normals of the sides that meet there is smallest; zero at tips.
    pub fn mean_normals(&self) -> Vec<V3> {
        self.side_normals().iter().map(|normals| middle(normals)).collect()
    }

    /// How many points there would be for another spacing (> 0, model units).
    pub fn count(&self, spacing: f64) -> usize {
        let inner = |e: &Edge| e.points.len().saturating_sub(if e.closed { 0 } else { 2 });
        let ends = self.points.len() - self.edges.iter().map(inner).sum::<usize>();
        ends + self.edges.iter().map(|e| e.between(e.parts(spacing))).sum::<usize>()
    }

    /// The spacing that was asked for, or the least above it that leads to `most` points, or the widest there may be.
    fn spacing_for(&self, CreaseOptions { spacing, most, .. }: &CreaseOptions<'_>) -> f64 {
        if self.count(*spacing) <= *most {
            return *spacing;
        }
        let (mut low, mut high) = (*spacing, CreaseOptions::STRETCH * spacing);
        for _ in 0..STRETCHES {
            let middle = 0.5 * (low + high);
            if self.count(middle) > *most { low = middle } else { high = middle }
        }
        high
    }

    /// Length of all edges (model units).
    pub fn length(&self) -> f64 {
        self.edges.iter().fold(0.0, |sum, e| sum + e.length)
    }
}

/// The middle of unit vectors: the centre of the smallest ball around them (Badoiu and Clarkson 2003), as a unit vector.
fn middle(normals: &[V3]) -> V3 {
    let mut centre = crate::vector::unit(normals.iter().fold([0.0; 3], |s, n| crate::vector::add(s, *n)));
    if normals.len() < 3 {
        return centre;
    }
    for k in 1..=ROUNDS {
        let far = normals.iter().max_by(|a, b| {
            crate::vector::distance(**a, centre).total_cmp(&crate::vector::distance(**b, centre))
        });
        if let Some(far) = far {
            centre = crate::vector::along(centre, 1.0 / (k + 1) as f64, crate::vector::sub(*far, centre));
        }
    }
    crate::vector::unit(centre)
}

/// Rounds of the search for a middle.
const ROUNDS: usize = 100;

/// Trace steps over the spacing and over the side of a box.
const STEP: f64 = 0.5;
/// Sides of boxes over the bounds' longest side, at most.
const COARSEST: f64 = 1.0 / 48.0;
/// Turn of a crease or of its sides from point to point, on average (radians).
const TURN: f64 = 0.7;
/// Halvings of what is between the spacing asked for and the widest.
const STRETCHES: usize = 10;
/// How far beside a crease sizes are looked at, over the spacing.
const BESIDE: f64 = 0.5;
/// Radius of the circle that sides are looked at on, over the size of the coordinates.
const RADIUS: f64 = 1e-6;

/// Finds the creases of the surface F = 0 in `bounds` (finite corners, lo < hi). Surfaces in the plane have none.
///
/// # Errors
/// A spacing or bounds that make no sense, and whatever the field reports.
///
/// ```
/// use isoswarm_field::{Aabb, Field, text};
/// use isoswarm_particles::creases::{CreaseOptions, creases};
/// let cube = Field::new(&text::parse("max(abs(x), max(abs(y), abs(z))) - 1", &[])?)?;
/// let found = creases(&cube, &Aabb::new([-1.2; 3], [1.2; 3]), CreaseOptions::new(0.1))?;
/// assert_eq!((found.corners.len(), found.edges.len()), (8, 12));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn creases(surface: &dyn Surface, bounds: &Aabb, options: CreaseOptions<'_>) -> Result<Creases, Error> {
    find(surface, bounds, options, &mut |_| true)
}

/// [`creases`], with a function that is told which part of the search is done and says whether to go on; else there are none.
///
/// # Errors
/// As for [`creases`].
pub fn find(
    surface: &dyn Surface,
    bounds: &Aabb,
    options: CreaseOptions<'_>,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<Creases, Error> {
    check(surface, bounds, &options)?;
    if surface.axes() != 3 {
        return Ok(Creases { certified: true, ..Creases::default() });
    }
    let Some(switches) = surface.switches() else {
        let warning =
            "creases are not known: the surface has an opaque part, whose minima and maxima cannot be seen";
        return Ok(Creases { warnings: vec![warning.into()], ..Creases::default() });
    };
    if switches.is_empty() {
        return Ok(Creases { certified: true, ..Creases::default() });
    }
    let longest = longest(bounds);
    let (boxes, side) = switches.boxes(bounds, options.spacing.min(COARSEST * longest), options.boxes);
    let step = STEP * options.spacing.min(side);
    let mut tracer = Tracer::new(surface, &switches, bounds, step, options.angle);
    let tips = network::tips(&mut tracer, &boxes)?;
    tracer.tips.clone_from(&tips);
    let Some(mut network) = network::find(&mut tracer, &boxes, go_on)? else {
        return Ok(Creases::default());
    };
    network.drop_around(&tips, tracer.step);
    collect(&mut tracer, &network, &tips, &options)
}

fn longest(bounds: &Aabb) -> f64 {
    (0..3).map(|a| bounds.hi[a] - bounds.lo[a]).fold(0.0, f64::max)
}

impl<'a> Tracer<'a> {
    /// For steps of `step` and creases of at least an angle.
    fn new(
        surface: &'a dyn Surface,
        switches: &'a Switches<'a>,
        bounds: &Aabb,
        step: f64,
        least: f64,
    ) -> Self {
        let size = |a: usize| bounds.lo[a].abs().max(bounds.hi[a].abs());
        let scale = (0..3).map(size).fold(longest(bounds), f64::max);
        Self {
            solver: Solver::new(switches, scale),
            surface,
            bounds: *bounds,
            step,
            radius: RADIUS * scale,
            least,
            evaluations: 0,
            desk: Desk::default(),
            near: None,
            tips: Vec::new(),
        }
    }
}

/// Points on the lines of a network at the spacing.
fn collect(
    tracer: &mut Tracer<'_>,
    network: &Network,
    tips: &[V3],
    options: &CreaseOptions<'_>,
) -> Result<Creases, Error> {
    let (ends, numbers) = network.corners(tracer.step);
    let mut out = Creases { points: ends, certified: true, ..Creases::default() };
    let mut is_corner = vec![false; out.points.len()];
    // Tips without an edge; others are corners already.
    for tip in tips {
        let near = |p: &V3| crate::vector::distance(*p, *tip) <= 1e-3 * tracer.step;
        if !out.points.iter().any(near) {
            out.points.push(*tip);
            is_corner.push(true);
        }
    }
    let measures: Vec<Vec<f64>> =
        network.lines.iter().map(|line| line.measure(options)).collect::<Result<_, _>>()?;
    out.edges = network.lines.iter().zip(&measures).map(|(line, m)| line.edge(m.iter().sum())).collect();
    let spacing = out.spacing_for(options);
    for (e, (line, numbers)) in network.lines.iter().zip(&numbers).enumerate() {
        let mut edge = out.edges[e].clone();
        let parts = line.parts(edge.parts(spacing), &measures[e]);
        let last = parts.len() - 1;
        for (k, &(p, t)) in parts.iter().enumerate() {
            let end = (!edge.closed && (k == 0 || k == last)).then(|| usize::from(k != 0));
            if let Some(e) = end {
                is_corner[numbers[e]] |= edge.ends[e] == End::Corner;
                edge.points.push(numbers[e] as u32);
                let knot = if e == 0 { &line.knots[0] } else { &line.knots[line.knots.len() - 1] };
                edge.normals.push(knot.sides.map(|s| s.normal));
                continue;
            }
            let knot = settle(tracer, line, p, t)?;
            edge.points.push(out.points.len() as u32);
            out.points.push(knot.p);
            edge.normals.push(knot.sides.map(|s| s.normal));
        }
        out.edges[e] = edge;
    }
    out.corners = (0..is_corner.len() as u32).filter(|&i| is_corner[i as usize]).collect();
    let lost = network.doubts;
    if lost > 0 {
        out.warnings.push(format!(
            "{lost} ends of creases could not be followed further: the surface has details there that are finer than the \
             search; a smaller spacing may resolve them"
        ));
    }
    Ok(out)
}

impl Line {
    /// Between knots the length in sizes, where there are any.
    fn measure(&self, options: &CreaseOptions<'_>) -> Result<Vec<f64>, Error> {
        let mut out = self.lengths();
        let Some(sizes) = options.sizes else { return Ok(out) };
        let places = self.places(BESIDE * options.spacing);
        let mut size = vec![1.0; places.len()];
        sizes(&places, &mut size)?;
        let least: Vec<f64> = size.chunks_exact(3).map(|s| s[0].min(s[1]).min(s[2])).collect();
        // No part turns by more than where sizes are equal.
        for (k, (m, turn)) in out.iter_mut().zip(self.turns()).enumerate() {
            let size = least[k].min(least[(k + 1) % least.len()]);
            *m = (*m / size).max(options.spacing * turn / TURN);
        }
        Ok(out)
    }

    /// The edge without its points.
    fn edge(&self, measure: f64) -> Edge {
        Edge {
            points: Vec::new(),
            normals: Vec::new(),
            closed: self.ends.is_none(),
            ends: self.ends.unwrap_or([End::Lost; 2]),
            length: self.length(),
            switch: self.switch,
            turn: self.turn(),
            measure,
        }
    }
}

/// The point of a line near a guess.
fn settle(tracer: &mut Tracer<'_>, line: &Line, p: V3, t: V3) -> Result<Knot, Error> {
    if let Some(at) = tracer.near(p, line.switch, tracer.step) {
        let t = if dot(at.t, t) < 0.0 { at.t.map(|c| -c) } else { at.t };
        if let Some(knot) = tracer.knot(at.p, t)? {
            return Ok(knot);
        }
    }
    let nearest = line
        .knots
        .iter()
        .min_by(|a, b| crate::vector::distance(a.p, p).total_cmp(&crate::vector::distance(b.p, p)));
    Ok(nearest.unwrap_or(&line.knots[0]).clone())
}

fn check(surface: &dyn Surface, bounds: &Aabb, options: &CreaseOptions<'_>) -> Result<(), Error> {
    let fine = |a: usize| bounds.lo[a].is_finite() && bounds.hi[a].is_finite() && bounds.lo[a] < bounds.hi[a];
    if !(0..surface.axes()).all(fine) {
        return Err(Error::Bounds { given: format!("{:?} to {:?}", bounds.lo, bounds.hi) });
    }
    let wrong = |name, expected: &str, given: f64| Error::Option {
        name,
        expected: expected.into(),
        given: given.to_string(),
    };
    if !(options.spacing.is_finite() && options.spacing > 0.0) {
        return Err(wrong("spacing", "a positive, finite length", options.spacing));
    }
    if !(options.angle > 0.0 && options.angle < 3.0) {
        return Err(wrong("angle", "an angle in radians between 0 and 3", options.angle));
    }
    Ok(())
}
