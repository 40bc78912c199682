//! What is under a finger: where a ray meets the surface, found from the floaters that cover it.

use isoswarm_field::Surface;
use isoswarm_field::arrange::Arrange;
use isoswarm_particles::project;

use crate::vector::{V3, norm, sub, unit};
use crate::{Error, Scene};

/// A floater's disc is taken to have so many of its radii: those of neighbours overlap, and no ray slips through.
const REACH: f64 = 1.5;
/// Most steps of Newton's method along a ray.
const ROUNDS: usize = 30;
/// Nearest discs that are tried before the ray is said to miss.
const TRIES: usize = 8;

/// A point of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Where (model units).
    pub at: [f64; 3],
    /// The unit normal there, which points out; zero where the gradient vanishes.
    pub normal: [f64; 3],
    /// How far along the ray, in lengths of its direction; 0 where there is no ray.
    pub t: f64,
}

impl Scene {
    /// Where a ray first meets the surface, as far as the floaters show it: F is solved along the ray from the nearest disc that it
    /// crosses. `direction` need not have length 1.
    ///
    /// # Errors
    /// A ray that is none, and what the field reports.
    pub fn pick(&self, origin: [f64; 3], direction: [f64; 3]) -> Result<Option<Hit>, Error> {
        crate::command::check_place("origin", origin, 3)?;
        let (d, length) = match (unit(direction), norm(direction)) {
            (Some(d), length) if length.is_finite() => (d, length),
            _ => {
                return Err(Error::option(
                    "direction",
                    "a direction that is not zero",
                    format!("{direction:?}"),
                ));
            }
        };
        let floaters = &self.now.swarm.floaters;
        let mut crossed: Vec<(f64, f64)> = Vec::new();
        for (i, p) in floaters.points.iter().enumerate() {
            let radius = REACH * floaters.sigma[i];
            let along = dot(sub(*p, origin), d);
            // Quick: the ray must pass the ball around the disc.
            if norm(sub(*p, at(origin, d, along))) > radius {
                continue;
            }
            let slope = dot(floaters.normals[i], d);
            let t =
                if slope.abs() > 0.05 { dot(sub(*p, origin), floaters.normals[i]) / slope } else { along };
            if t > 0.0 && norm(sub(at(origin, d, t), *p)) <= radius {
                crossed.push((t, radius));
            }
        }
        crossed.arrange_by(|a, b| a.0.total_cmp(&b.0));
        for &(t, radius) in crossed.iter().take(TRIES) {
            if let Some(t) = self.solve_along(origin, d, t, 2.0 * radius)? {
                return Ok(Some(Hit { t: t / length, ..self.hit(at(origin, d, t))? }));
            }
        }
        // The discs that it crosses stand for a surface that bends away just before it: the nearest point of that.
        let Some(&(t, _)) = crossed.first() else { return Ok(None) };
        Ok(self.nearest(at(origin, d, t))?.map(|h| Hit { t: dot(sub(h.at, origin), d) / length, ..h }))
    }

    /// The point of the surface to which Newton's method leads from a point; `None` where it leads nowhere.
    pub fn nearest(&self, point: [f64; 3]) -> Result<Option<Hit>, Error> {
        crate::command::check_place("point", point, 3)?;
        let mut place = [point];
        let left = project(self.field(), &mut place, self.now.swarm.size)?[0];
        if left > 1e-9 * self.now.swarm.size {
            return Ok(None);
        }
        Ok(Some(self.hit(place[0])?))
    }

    fn hit(&self, p: V3) -> Result<Hit, Error> {
        let (_, g) = self.value_gradient(p)?;
        Ok(Hit { at: p, normal: unit(g).unwrap_or_default(), t: 0.0 })
    }

    fn value_gradient(&self, p: V3) -> Result<(f64, V3), Error> {
        let (mut f, mut g) = ([0.0], [[0.0; 3]]);
        Surface::value_gradient(self.field(), &[p], &mut f, &mut g)?;
        Ok((f[0], g[0]))
    }

    /// F = 0 along the ray within `reach` of `start`.
    fn solve_along(&self, origin: V3, d: V3, start: f64, reach: f64) -> Result<Option<f64>, Error> {
        let mut t = start;
        for _ in 0..ROUNDS {
            let (f, g) = self.value_gradient(at(origin, d, t))?;
            let step = -f / dot(g, d);
            if !step.is_finite() {
                return Ok((f == 0.0).then_some(t));
            }
            t += step.clamp(-reach / 4.0, reach / 4.0);
            if (t - start).abs() > reach || t <= 0.0 {
                return Ok(None);
            }
            if step.abs() <= 1e-12 * self.now.swarm.size {
                return Ok(Some(t));
            }
        }
        Ok(None)
    }
}

fn dot(a: V3, b: V3) -> f64 {
    isoswarm_field::vector::dot(a, b)
}

fn at(origin: V3, d: V3, t: f64) -> V3 {
    [0, 1, 2].map(|a| origin[a] + t * d[a])
}
