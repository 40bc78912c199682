//! How pins become equations, and a step of the scene.

use isoswarm_particles::control::{self, ControlStep, Pin, StepOptions, sensitivity};
use isoswarm_particles::project;

use crate::Error;
use crate::hold::Hold;
use crate::scene::Now;
use crate::vector::{V3, norm, sub, unit};

/// Pins hold within this part of the model's size.
const TOLERANCE: f64 = 1e-10;
/// The rest shape has been reached where what is left moves the surface by less than this part of its size in a step.
const NEAR: f64 = 1e-14;
/// Floaters at which the parameters' costs are measured, and steps until they are measured again.
const MEASURED: usize = 64;
const MEASURED_EVERY: u64 = 16;
/// What it costs a gripped patch not to move with its pin.
const GRIP_SOFTNESS: f64 = 0.1;
/// Points of a gripped patch around its pin.
const GRIP_POINTS: usize = 6;
/// Parts of a step that are tried, one after the other, until what is under an adapter can follow.
const FOLLOWED: [f64; 5] = [1.0, 0.25, 0.06, 0.015, 0.004];

/// How much a box grows, as a part of its diagonal, where the surface has come to it and no box is found.
const WIDER: f64 = 0.25;
/// No further than to so many times the size that the surface had when its floaters were last settled: it may have no end.
const WIDEST: f64 = 8.0;

/// A control point of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct ScenePin {
    /// Its number: never used twice.
    pub id: u64,
    /// Its name, if it has one.
    pub name: Option<String>,
    /// Where and how it holds.
    pub pin: Pin,
    /// Radius of the patch that moves with it (model units).
    pub grip: Option<f64>,
    /// The patch: offsets from the pin.
    pub(crate) patch: Vec<V3>,
}

impl ScenePin {
    /// Lays the patch around the pin: points of the surface at the grip's radius.
    pub(crate) fn lay_patch(&mut self, now: &Now) -> Result<(), Error> {
        let Some(radius) = self.grip.map(|r| r.min(now.swarm.size)) else { return Ok(()) };
        let field = &now.state.field;
        let (mut f, mut g) = ([0.0], [[0.0; 3]]);
        isoswarm_field::Surface::value_gradient(field, &[self.pin.at], &mut f, &mut g)?;
        let (u, v) = isoswarm_particles::control::tangents(g[0]);
        let mut points: Vec<V3> = (0..GRIP_POINTS)
            .map(|k| {
                if field.axes() == 2 {
                    // To both sides along the curve.
                    let s = radius * (k as f64 - 2.5) / 2.5;
                    let n = unit(g[0]).unwrap_or_default();
                    return [self.pin.at[0] - s * n[1], self.pin.at[1] + s * n[0], 0.0];
                }
                let t = k as f64 * (std::f64::consts::TAU / GRIP_POINTS as f64);
                let (s, c) = (isoswarm_field::math::sin(t), isoswarm_field::math::cos(t));
                [0, 1, 2].map(|a| self.pin.at[a] + radius * (c * u[a] + s * v[a]))
            })
            .collect();
        project(field, &mut points, now.swarm.size)?;
        self.patch = points.iter().map(|p| sub(*p, self.pin.at)).collect();
        Ok(())
    }
}

/// The parameters' costs and when they were measured.
#[derive(Clone, Debug, Default)]
pub(crate) struct Metric {
    costs: Vec<f64>,
    at: u64,
    stale: bool,
}

impl Metric {
    pub(crate) fn stale() -> Self {
        Self { stale: true, ..Self::default() }
    }
}

impl Now {
    /// One step in the order of WH94 section 5: desired velocities of the pins, those of the parameters (Q, then eqs. 7 and 8),
    /// the parameters and pins move; then the floaters' repulsion, velocities (eq. 5, with the surface's motion taken at
    /// its end), radii, births and deaths.
    pub(crate) fn step(&mut self) -> Result<Option<ControlStep>, Error> {
        let before = self.state.settings.follow.then(|| (self.state.field.clone(), self.state.field.q()));
        let report = self.move_and_hand_over()?;
        if let Some((field, q)) = before {
            let now = self.state.field.q();
            self.swarm.follow(&field, &now.iter().zip(&q).map(|(b, a)| b - a).collect::<Vec<_>>())?;
        }
        self.keep_in_view()?;
        if let Some(focus) = self.state.settings.focus {
            let held = |p: &&ScenePin| self.hold.as_ref().is_none_or(|h| h.holds(p.id));
            let points: Vec<V3> = self.state.pins.iter().filter(held).map(|p| p.pin.at).collect();
            self.swarm.look_at(&points, focus);
        }
        if self.state.settings.curvature > 0.0 {
            self.swarm.look_at_bends(&self.state.field, self.state.settings.curvature);
        }
        let moving = report.as_ref().is_some_and(|r| r.q_change.iter().any(|v| *v != 0.0));
        let settings = &self.state.settings;
        if !self.swarm.step(&self.state.field, &self.state.bounds, settings.seed, moving)? {
            // The surface has jumped away from all of them, or it is gone.
            let settled = self.swarm.settled(&self.state.field, &self.state.bounds, settings)?;
            self.swarm = settled.ok_or_else(|| Error::Vanished { what: "this step".into() })?;
        }
        self.clock += 1;
        Ok(report)
    }

    /// Pins and parameters, and what is under an adapter after them: by a smaller part of the step where it cannot follow, as where
    /// the deformation folds space over. Where no part will do, all stays as it was and the step is stuck.
    fn move_and_hand_over(&mut self) -> Result<Option<ControlStep>, Error> {
        if self.state.adapting.is_none() {
            return self.move_surface(1.0);
        }
        let (q, pins, hold) = (self.state.field.q(), self.state.pins.clone(), self.hold.clone());
        let mut stuck = None;
        for part in FOLLOWED {
            let Some(report) = self.move_surface(part)? else { return Ok(None) };
            let Err(error) = self.hand_over() else { return Ok(Some(report)) };
            if report.q_change.iter().all(|v| *v == 0.0) {
                return Err(error);
            }
            self.state.field.set_q(&q)?;
            self.state.pins.clone_from(&pins);
            self.hold.clone_from(&hold);
            stuck = Some(report);
        }
        let Some(mut report) = stuck else { return Ok(None) };
        report.q_change.fill(0.0);
        report.slip.fill([0.0; 3]);
        (report.moved, report.stuck) = (0.0, true);
        if let Some(hold) = &mut self.hold {
            hold.add_slip(&self.state.pins, &report);
        }
        self.rested = self.hold.is_none();
        Ok(Some(report))
    }

    /// Pins and parameters, by a part of the longest step. `None` where nothing wants to move.
    fn move_surface(&mut self, part: f64) -> Result<Option<ControlStep>, Error> {
        let q = self.state.field.q();
        let desired = self.desired(&q);
        if q.is_empty() || (self.rested && self.hold.is_none() && desired.is_empty()) {
            return Ok(None);
        }
        let mut rows: Vec<Pin> = self.state.pins.iter().map(|p| p.pin).collect();
        if let Some(hold) = &mut self.hold {
            hold.advance(&self.state.pins, self.swarm.size * self.state.settings.speed);
            hold.set_targets(&self.state.pins, &mut rows);
        }
        let exact = rows.len();
        for (i, p) in self.state.pins.iter().enumerate() {
            let shift = rows[i].target.map(|t| sub(t, rows[i].at));
            rows.extend(p.patch.iter().map(|o| {
                let at = [0, 1, 2].map(|a| p.pin.at[a] + o[a]);
                let target = shift.map(|s| [0, 1, 2].map(|a| at[a] + s[a]));
                Pin { softness: GRIP_SOFTNESS, target, ..Pin::new(at) }
            }));
        }
        let patches = rows.len();
        if let Some(hold) = &self.hold {
            rows.extend(hold.region());
        }
        self.measure_costs()?;
        let settings = &self.state.settings;
        let options = StepOptions {
            longest: part * settings.speed * self.swarm.size,
            gain: if self.hold.as_ref().is_some_and(Hold::is_guided) { 1.0 } else { settings.gain },
            tolerance: TOLERANCE * self.swarm.size,
        };
        let mut report =
            control::step(&mut self.state.field, &mut rows, &self.metric.costs, &desired, &options)?;
        // Patches and regions are no pins: being soft, each row with a gradient counts one.
        report.rank -= report.residual[exact..].iter().filter(|r| r.is_finite()).count().min(report.rank);
        for (p, row) in self.state.pins.iter_mut().zip(&rows[..exact]) {
            p.pin.at = row.at;
            if self.state.field.axes() == 2 {
                p.pin.at[2] = 0.0;
            }
        }
        self.follow_patches(&rows[exact..patches])?;
        if let Some(hold) = &mut self.hold {
            hold.take_region(&rows[patches..]);
            hold.add_slip(&self.state.pins, &report);
        }
        let met = report.residual[..exact].iter().all(|r| *r <= options.tolerance);
        let still = report.q_change.iter().all(|v| *v == 0.0);
        self.rested = self.hold.is_none() && desired.is_empty() && (met || still || report.stuck);
        Ok(Some(report))
    }

    /// Q: part of the way back to the rest shape; empty where there is none.
    fn desired(&self, q: &[f64]) -> Vec<f64> {
        let recovery = self.state.settings.recovery;
        let params = self.state.field.parameters();
        match &self.state.rest {
            Some(rest) if recovery > 0.0 && rest.len() == params.len() => {
                let free = params.iter().zip(rest).filter(|(p, _)| p.is_free());
                let way: Vec<f64> = free.zip(q).map(|((_, r), q)| recovery * (r - q)).collect();
                // Near enough once the surface would hardly notice.
                let cost = |j: usize| self.metric.costs.get(j).copied().unwrap_or(f64::INFINITY);
                let least = NEAR * self.swarm.size;
                let far = way.iter().enumerate().any(|(j, w)| w.abs() * cost(j) > least);
                if far { way } else { Vec::new() }
            }
            _ => Vec::new(),
        }
    }

    fn measure_costs(&mut self) -> Result<(), Error> {
        let free = self.state.field.q().len();
        let m = &self.metric;
        if !m.stale && m.costs.len() == free && self.clock < m.at + MEASURED_EVERY {
            return Ok(());
        }
        let floaters = &self.swarm.floaters.points;
        let mut points: Vec<V3> =
            floaters.iter().step_by(floaters.len().div_ceil(MEASURED).max(1)).copied().collect();
        points.extend(self.state.pins.iter().map(|p| p.pin.at));
        let costs = sensitivity(&self.state.field, &points)?;
        self.metric = Metric { costs, at: self.clock, stale: false };
        Ok(())
    }

    /// The patches lie on the surface again, wherever it has gone.
    fn follow_patches(&mut self, rows: &[Pin]) -> Result<(), Error> {
        if rows.is_empty() {
            return Ok(());
        }
        let mut points: Vec<V3> = rows.iter().map(|r| r.at).collect();
        project(&self.state.field, &mut points, self.swarm.size)?;
        let mut points = points.into_iter();
        for p in &mut self.state.pins {
            for offset in &mut p.patch {
                let q = points.next().unwrap_or(p.pin.at);
                *offset = sub(q, p.pin.at);
            }
        }
        Ok(())
    }

    /// New floaters where a drag has brought up a part of the surface that the old ones do not lead to.
    pub(crate) fn look_around(&mut self) -> Result<(), Error> {
        let (field, settings) = (&self.state.field, &self.state.settings);
        self.state.bounds = match crate::swarm::bounds_of(field, settings) {
            Err(Error::Unbounded) => self.state.bounds,
            found => found?,
        };
        if let Some(settled) = self.swarm.settled(field, &self.state.bounds, settings)? {
            self.swarm = settled;
        }
        Ok(())
    }

    /// Finds new bounds where the surface has come to those that were found before.
    fn keep_in_view(&mut self) -> Result<(), Error> {
        let b = &self.state.bounds;
        let touches = |p: &V3| (0..self.state.field.axes()).any(|a| p[a] <= b.lo[a] || p[a] >= b.hi[a]);
        if self.state.settings.bounds.is_none() && self.swarm.floaters.points.iter().any(touches) {
            self.state.bounds = match crate::swarm::bounds_of(&self.state.field, &self.state.settings) {
                Err(Error::Unbounded) if b.diagonal() < WIDEST * self.swarm.size => {
                    b.grown(WIDER * b.diagonal())
                }
                Err(Error::Unbounded) => *b,
                found => found?,
            };
        }
        Ok(())
    }

    /// Distances between pins and the surface, in the order of the pins.
    pub(crate) fn residuals(&self) -> Result<Vec<f64>, Error> {
        let points: Vec<V3> = self.state.pins.iter().map(|p| p.pin.at).collect();
        let (mut f, mut g) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
        isoswarm_field::Surface::value_gradient(&self.state.field, &points, &mut f, &mut g)?;
        Ok(f.iter().zip(&g).map(|(f, g)| f.abs() / norm(*g)).collect())
    }
}
