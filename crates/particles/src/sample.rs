//! The main job: even samples of a surface.

use isoswarm_field::{Aabb, Surface};

use crate::Error;
use crate::even::{self, Spread};
use crate::finish::finish;
use crate::options::{Amount, Options, Phase};
use crate::report::{Samples, Status};
use crate::run::Run;
use crate::seeding;

/// Samples the part of the surface that lies in `bounds`.
pub fn sample(surface: &dyn Surface, bounds: &Aabb, options: Options<'_>) -> Result<Samples, Error> {
    let Options { amount, seed, progress, steps, .. } = options;
    let mut run = Run::new(seed, progress);
    run.tell(Phase::Seeding, 0.0, 0);
    let aim = match amount {
        Amount::Count(n) => n.min(6000),
        Amount::Spacing(_) => 6000,
    };
    let talk = std::env::var("TALK").is_ok();
    let t = std::time::Instant::now();
    let (seeds, certified) = seeding::seed(surface, &mut run.evaluations, bounds, aim, seed)?;
    if talk {
        eprintln!("seeding {:?}", t.elapsed());
    }
    let Some(seeds) = seeds else {
        return Ok(Samples::empty(certified, &run));
    };
    if talk {
        eprintln!(
            "boxes {} roots {} uniform {} area {} components {}",
            seeds.region.boxes.len(),
            seeds.points.len(),
            seeds.uniform,
            seeds.area,
            seeds.components
        );
    }
    let t = std::time::Instant::now();
    let Spread { swarm, unit, unmet } =
        even::spread(&mut run, surface, &seeds, amount, steps.unwrap_or(even::SETTLING_STEPS))?;
    if talk {
        eprintln!("spread {:?}", t.elapsed());
    }
    let t = std::time::Instant::now();
    let status = unmet.map_or(Status::Converged, Status::NotConverged);
    let s = finish(&mut run, surface, bounds, &seeds, swarm, unit, status);
    if talk {
        eprintln!("finish {:?}", t.elapsed());
    }
    s
}
