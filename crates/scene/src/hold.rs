//! What is being dragged, and how it went.

use isoswarm_field::math::{cos, sin};
use isoswarm_particles::control::{ControlStep, Pin};

use crate::control::ScenePin;
use crate::vector::{V3, norm, sub};

/// What it costs a region not to follow its pin.
const REGION_SOFTNESS: f64 = 0.1;
/// Most floaters of a region that are followed.
const REGION_MOST: usize = 400;
/// Steps without progress after which a drag ends.
const PATIENCE: usize = 12;
/// Progress that counts, as a part of the longest step.
const PROGRESS: f64 = 1e-3;

/// A floater of a region that follows a pin.
#[derive(Clone, Debug)]
struct Follower {
    at: V3,
    pin: u64,
    from: V3,
    pin_from: V3,
    part: f64,
}

/// A rigid motion about a centre, done bit by bit.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    pub(crate) centre: V3,
    pub(crate) rotation: V3,
    pub(crate) translation: V3,
    /// Part that has been asked for.
    done: f64,
    from: Vec<(u64, V3)>,
}

impl Motion {
    pub(crate) fn new(centre: V3, rotation: V3, translation: V3, from: Vec<(u64, V3)>) -> Self {
        Self { centre, rotation, translation, done: 0.0, from }
    }

    /// Where a point is after a part of the motion.
    fn place(&self, p: V3, part: f64) -> V3 {
        let angle = norm(self.rotation) * part;
        let r = sub(p, self.centre);
        let turned = if angle == 0.0 {
            r
        } else {
            // Rodrigues' formula.
            let n = self.rotation.map(|v| v / norm(self.rotation));
            let (s, c) = (sin(angle), cos(angle));
            let along = (n[0] * r[0] + n[1] * r[1] + n[2] * r[2]) * (1.0 - c);
            let cross = [n[1] * r[2] - n[2] * r[1], n[2] * r[0] - n[0] * r[2], n[0] * r[1] - n[1] * r[0]];
            [0, 1, 2].map(|k| r[k] * c + cross[k] * s + n[k] * along)
        };
        [0, 1, 2].map(|k| self.centre[k] + turned[k] + part * self.translation[k])
    }

    /// Longest way of a pin.
    fn length(&self) -> f64 {
        let arc = |p: V3| norm(self.rotation) * norm(sub(p, self.centre)) + norm(self.translation);
        self.from.iter().map(|&(_, p)| arc(p)).fold(0.0, f64::max)
    }
}

/// What is being dragged.
#[derive(Clone, Debug, Default)]
pub(crate) struct Hold {
    /// Pins and where they go.
    targets: Vec<(u64, V3)>,
    followers: Vec<Follower>,
    motion: Option<Motion>,
    slip: Vec<(u64, V3)>,
    pub(crate) steps: usize,
    pub(crate) last: ControlStep,
    /// The least that has remained, by each measure of [`Hold::left`].
    best: [f64; 3],
    waited: usize,
}

impl Hold {
    pub(crate) fn new(targets: Vec<(u64, V3)>) -> Self {
        let slip = targets.iter().map(|&(id, _)| (id, [0.0; 3])).collect();
        Self { targets, slip, best: [f64::INFINITY; 3], ..Self::default() }
    }

    pub(crate) fn turning(motion: Motion) -> Self {
        let targets = motion.from.clone();
        Self { motion: Some(motion), ..Self::new(targets) }
    }

    /// The same with other targets: the hand moves on.
    pub(crate) fn aim(&mut self, targets: Vec<(u64, V3)>) {
        for &(id, _) in &targets {
            if self.slip.iter().all(|(i, _)| *i != id) {
                self.slip.push((id, [0.0; 3]));
            }
        }
        self.targets = targets;
        (self.best, self.waited) = ([f64::INFINITY; 3], 0);
    }

    /// Takes the floaters within a radius of each pin along, less and less towards the edge: (1 - t²)².
    pub(crate) fn take_along(&mut self, pins: &[ScenePin], floaters: &[V3], radius: f64) {
        for &(id, _) in &self.targets {
            let Some(centre) = pins.iter().find(|p| p.id == id).map(|p| p.pin.at) else { continue };
            let mut near: Vec<V3> =
                floaters.iter().copied().filter(|&p| norm(sub(p, centre)) < radius).collect();
            let every = near.len().div_ceil(REGION_MOST).max(1);
            near = near.into_iter().step_by(every).collect();
            self.followers.extend(near.into_iter().map(|at| {
                let t = norm(sub(at, centre)) / radius;
                let part = (1.0 - t * t) * (1.0 - t * t);
                Follower { at, pin: id, from: at, pin_from: centre, part }
            }));
        }
    }

    /// Whether this pin is being dragged.
    pub(crate) fn holds(&self, id: u64) -> bool {
        self.targets.iter().any(|(i, _)| *i == id)
    }

    pub(crate) fn is_guided(&self) -> bool {
        self.motion.is_some()
    }

    /// Asks for the next bit of a motion once the pins have come close to the last one.
    pub(crate) fn advance(&mut self, pins: &[ScenePin], longest: f64) {
        let close = self.distance(pins) < 0.5 * longest;
        let Some(motion) = &mut self.motion else { return };
        if !close || motion.done >= 1.0 {
            return;
        }
        motion.done = (motion.done + longest / motion.length().max(longest)).min(1.0);
        let motion = motion.clone();
        self.targets = motion.from.iter().map(|&(id, p)| (id, motion.place(p, motion.done))).collect();
    }

    pub(crate) fn set_targets(&self, pins: &[ScenePin], rows: &mut [Pin]) {
        for (p, row) in pins.iter().zip(rows) {
            row.target = self.targets.iter().find(|(id, _)| *id == p.id).map(|(_, t)| *t);
        }
    }

    /// The region as soft pins.
    pub(crate) fn region(&self) -> impl Iterator<Item = Pin> + '_ {
        self.followers.iter().map(|f| {
            let target = self.targets.iter().find(|(id, _)| *id == f.pin).map(|(_, t)| {
                let way = sub(*t, f.pin_from);
                [0, 1, 2].map(|k| f.from[k] + f.part * way[k])
            });
            Pin { softness: REGION_SOFTNESS, target, ..Pin::new(f.at) }
        })
    }

    pub(crate) fn take_region(&mut self, rows: &[Pin]) {
        self.followers.iter_mut().zip(rows).for_each(|(f, row)| f.at = row.at);
    }

    pub(crate) fn add_slip(&mut self, pins: &[ScenePin], report: &ControlStep) {
        for (p, s) in pins.iter().zip(&report.slip) {
            if let Some((_, sum)) = self.slip.iter_mut().find(|(id, _)| *id == p.id) {
                (0..3).for_each(|a| sum[a] += s[a]);
            }
        }
        self.last = report.clone();
        self.steps += 1;
    }

    /// The distances between pins and where they shall go now, along what their guides allow: the largest, their sum, and the root
    /// of the sum of their squares.
    fn left(&self, pins: &[ScenePin]) -> [f64; 3] {
        let way = |p: &ScenePin, t: V3| norm(p.pin.guide.allowed(sub(t, p.pin.at)));
        let of = |(id, t): &(u64, V3)| pins.iter().find(|p| p.id == *id).map_or(0.0, |p| way(p, *t));
        let (mut largest, mut sum, mut square) = (0.0f64, 0.0, 0.0f64);
        for d in self.targets.iter().map(of) {
            (largest, sum, square) = (largest.max(d), sum + d, square + d * d);
        }
        // Of a single pin they are the same, to the last bit.
        [largest, sum, if self.targets.len() > 1 { square.sqrt() } else { largest }]
    }

    /// The largest of these distances.
    fn distance(&self, pins: &[ScenePin]) -> f64 {
        self.left(pins)[0]
    }

    /// The largest distance between a pin and the end of its way.
    pub(crate) fn remaining(&self, pins: &[ScenePin]) -> f64 {
        self.distance(pins) + self.motion_left()
    }

    /// What of a rigid motion has not been asked for.
    fn motion_left(&self) -> f64 {
        self.motion.as_ref().map_or(0.0, |m| (1.0 - m.done) * m.length())
    }

    /// Whether there has been no progress for a while, be it of the pin that is farthest off or of all together (one
    /// that cannot move does not end the way of the others); to be asked once a step.
    pub(crate) fn is_stalled(&mut self, pins: &[ScenePin], longest: f64) -> bool {
        let (left, way) = (self.left(pins), self.motion_left());
        let mut progress = false;
        for (best, now) in self.best.iter_mut().zip(left.map(|d| d + way)) {
            if now < *best - PROGRESS * longest {
                (*best, progress) = (now, true);
            }
        }
        self.waited = if progress { 0 } else { self.waited + 1 };
        self.waited >= PATIENCE
    }

    pub(crate) fn slip(&self) -> Vec<(u64, V3)> {
        self.slip.clone()
    }
}
