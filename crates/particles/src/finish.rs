//! From floaters to samples: projected to rounding, measured, with curvature.

use isoswarm_field::arrange::Arrange;
use isoswarm_field::{Aabb, Surface};
use rayon::prelude::*;

use crate::Error;
use crate::constraint::{Target, project};
use crate::creases::Creases;
use crate::curvature;
use crate::edges;
use crate::metrics::{mean_nearest, of_census};
use crate::options::Phase;
use crate::population::{Census, census, faces};
use crate::report::{Evenness, Report, Samples, Status};
use crate::run::Run;
use crate::seeding::{Seeds, divide, in_order};
use crate::swarm::{FREE, Swarm};
use crate::vector::{self, add, distance};

/// What the surface may be off, in square roots of the mean cell, from where the last projection starts. Newton's method
/// squares it.
const NEARLY: f64 = 1e-6;
/// The same for the surface on which ways between components are looked for.
const WALKED: f64 = 1e-3;
/// The same where curvatures are measured.
const MEASURED: f64 = 1e-9;
/// Uniform seeds whose estimate of the area is good to a few percent, and how far off the sum of the cells may be from it.
const TRUSTED: usize = 500;
const UNFIT: f64 = 1.1;
/// Spacings over the radius of curvature from which on a place is finer than the samples on it.
const FINE: f64 = 1.0;

impl Samples {
    /// No samples: there is no surface, or the search for it was stopped.
    pub(crate) fn none(status: Status, certified: bool, run: &Run<'_>) -> Self {
        Self {
            points: Vec::new(),
            normals: Vec::new(),
            radii: Vec::new(),
            areas: Vec::new(),
            curvatures: Vec::new(),
            component: Vec::new(),
            creases: None,
            report: Report {
                status,
                components: 0,
                certified,
                resolution: 0.0,
                max_error: 0.0,
                evenness: Evenness::default(),
                spacing: 0.0,
                area: 0.0,
                on_bounds: 0,
                singular: 0,
                steps: run.steps,
                evaluations: run.evaluations,
                births: 0,
                deaths: 0,
                more: None,
                warnings: run.warnings.clone(),
            },
        }
    }
}

/// Projects the swarm to |F|/|∇F| ≤ 1e-13 of the diameter where that can be had; what each floater is off then.
pub(crate) fn project_exactly(
    run: &mut Run<'_>,
    surface: &dyn Surface,
    seeds: &Seeds<'_>,
    swarm: &mut Swarm,
    unit: f64,
) -> Result<Vec<f64>, Error> {
    swarm.velocity = Vec::new();
    let diameter = Aabb::around(&swarm.points).map_or(0.0, |b| b.diagonal()).max(unit);
    let target = Target { tolerance: 1e-14 * diameter, longest: 0.5 * unit, least: seeds.least, rounds: 64 };
    let Swarm { points, normals, .. } = swarm;
    let sketch = surface.sketch(NEARLY * unit);
    if let Some(sketch) = sketch.as_deref() {
        // The first of the way where a look costs less.
        let near = Target { tolerance: NEARLY * unit, rounds: 4, ..target };
        project(sketch, &mut run.evaluations, &seeds.given, points, normals, near)?;
    }
    Ok(project(surface, &mut run.evaluations, &seeds.given, points, normals, target)?)
}

/// Projects the swarm exactly, and measures it.
pub(crate) fn finish(
    run: &mut Run<'_>,
    surface: &dyn Surface,
    seeds: &Seeds<'_>,
    mut swarm: Swarm,
    unit: f64,
    status: Status,
    creases: Option<Creases>,
) -> Result<Samples, Error> {
    run.tell(Phase::Finishing, 0.9, swarm.len());
    let walls = seeds.walls;
    let left = project_exactly(run, surface, seeds, &mut swarm, unit)?;
    if let Some(creases) = &creases {
        put_creases_first(&mut swarm, creases, unit);
    }
    let max_error = left.into_iter().filter(|d| d.is_finite()).fold(0.0, f64::max);
    let singular = (0..swarm.len()).filter(|&i| swarm.normals[i] == [0.0; 3] && !swarm.is_held(i)).count();
    let faces = faces(&walls, unit);
    let on_bounds = swarm.points.par_iter().with_min_len(4096).filter(|p| faces.touches(**p)).count();
    let mut first = census(&swarm, &walls, unit);
    if let Some(creases) = &creases {
        edges::areas(&swarm, creases, &walls, unit, &mut first);
    }
    let per_label = swarm.per_label();
    for (cell, &l) in first.cells.iter_mut().zip(&swarm.label) {
        // Alone on its component, as far as it sees: the component's area says more than the reach of its sight.
        if cell.valence == 0 {
            let known = seeds.label_area[l as usize] / f64::from(per_label[l as usize]);
            first.area += known - cell.area;
            cell.area = known;
        }
    }
    if creases.is_none() && run.stop.is_none() {
        fit_areas(&mut first, &swarm, seeds, run);
    }
    let measured = surface.sketch(MEASURED * unit);
    let mut curvatures =
        curvature::principal(measured.as_deref().unwrap_or(surface), &swarm, &first.lists, walls.axes);
    drop(measured);
    if let Some(creases) = &creases {
        // Undefined there.
        curvatures[..creases.points.len()].fill([f64::NAN; 2]);
    }
    let evenness = of_census(&swarm, &first, walls.axes);
    let spacing = mean_nearest(&first);
    // A run that was stopped looks for nothing any more.
    let (component, components) = if run.stop.is_none() && seeds.too_coarse_for(swarm.len()) {
        let sketch = surface.sketch(WALKED * unit);
        divide(sketch.as_deref().unwrap_or(surface), run, &walls, &swarm, &first.lists, unit)?
    } else {
        in_order(swarm.label.clone())
    };
    if !seeds.certified {
        run.warnings
            .push("not certified: there may be small components that the random search did not meet".into());
    }
    let thin = seeds.back_to_back();
    if thin {
        run.warnings.push(
            "sheets of the surface lie back to back, far closer than the samples: whether they are one piece, joined at a rim, is \
             not known, so that `components` is uncertain and nothing is certified; sample a thicker sheet, or one side of it"
                .into(),
        );
    }
    if seeds.rough() {
        run.warnings.push(format!(
            "the surface bends within the {:.3} of a box of the first search: components smaller than that may have been missed \
             between others",
            seeds.region.side
        ));
    }
    if singular > 0 {
        run.warnings.push(format!("{singular} samples rest where the gradient vanishes and have no normal"));
    }
    let fine = curvatures.par_iter().with_min_len(4096).filter(|k| k[0].abs() * spacing > FINE).count();
    if 100 * fine > curvatures.len() {
        run.warnings.push(format!(
            "{:.0} % {}, and are less even there; more samples resolve it",
            100.0 * fine as f64 / curvatures.len() as f64,
            Report::UNRESOLVED,
        ));
    }
    run.tell(Phase::Finishing, 1.0, swarm.len());
    Ok(Samples {
        radii: first.cells.iter().map(|c| 0.5 * c.mean).collect(),
        areas: first.cells.iter().map(|c| c.area).collect(),
        curvatures,
        component,
        creases,
        report: Report {
            status,
            components,
            certified: seeds.certified && !thin,
            resolution: seeds.region.side,
            max_error,
            evenness,
            spacing,
            area: first.area,
            on_bounds,
            singular,
            steps: run.steps,
            evaluations: run.evaluations,
            births: run.births,
            deaths: run.deaths,
            more: None,
            warnings: run.warnings.clone(),
        },
        points: swarm.points,
        normals: swarm.normals,
    })
}

/// Where cells in tangent planes do not add up to the area that the search has found, as for few samples on a surface
/// that bends between them, scales them to it, component by component.
fn fit_areas(census: &mut Census, swarm: &Swarm, seeds: &Seeds<'_>, run: &mut Run<'_>) {
    let off = census.area / seeds.area;
    if seeds.uniform < TRUSTED || (1.0 / UNFIT..UNFIT).contains(&off) {
        return;
    }
    let mut sums = vec![0.0; seeds.label_area.len()];
    census.cells.iter().zip(&swarm.label).for_each(|(c, &l)| sums[l as usize] += c.area);
    let per_label = swarm.per_label();
    for (cell, &l) in census.cells.iter_mut().zip(&swarm.label) {
        let (sum, known) = (sums[l as usize], seeds.label_area[l as usize]);
        let fits = sum.is_finite() && sum > 0.0;
        cell.area = if fits { cell.area * known / sum } else { known / f64::from(per_label[l as usize]) };
    }
    run.warnings.push(format!(
        "the surface bends too much between the samples for the areas of their cells, which add up to {:.4} where the search found \
         about {:.4}: `areas` were scaled to that and are rough; more samples give better ones",
        census.area, seeds.area
    ));
    census.area = census.cells.iter().map(|c| c.area).sum();
    census.share = census.area / swarm.len().max(1) as f64;
}

/// Brings the floaters on creases to the front, in the order of the creases' points and exactly there, with normals in the middle
/// of those around them.
fn put_creases_first(swarm: &mut Swarm, creases: &Creases, unit: f64) {
    let mut order: Vec<u32> = (0..swarm.len() as u32).collect();
    // Those that are free have the largest number and keep their order.
    order.arrange_by_key(|&i| swarm.held.get(i as usize).copied().unwrap_or(FREE));
    *swarm = swarm.pick(&order);
    for (i, (p, n)) in creases.points.iter().zip(creases.mean_normals()).enumerate() {
        (swarm.points[i], swarm.normals[i]) = (*p, n);
    }
    for i in 0..creases.points.len() {
        if swarm.normals[i] != [0.0; 3] {
            continue;
        }
        // A tip.
        let near = |j: &usize| distance(swarm.points[*j], swarm.points[i]) < 1.5 * unit;
        let sum = (0..swarm.len()).filter(near).fold([0.0; 3], |s, j| add(s, swarm.normals[j]));
        swarm.normals[i] = vector::unit(sum);
    }
}
