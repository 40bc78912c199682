//! What a user asks of [`sample`](crate::sample), and how they follow it.

use std::fmt;
use std::ops::ControlFlow;

use isoswarm_field::{Aabb, Surface};

use crate::Error;
use crate::creases::{CreaseOptions, Creases};

/// How many samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Amount {
    /// Exactly this many.
    Count(usize),
    /// As many as make the mean distance between a sample and its nearest neighbour equal to this length
    /// (model units), within 5 % at convergence.
    Spacing(f64),
}

/// How the samples are placed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Evenly: interval seeding, then floaters relaxed from coarse to fine. The default.
    #[default]
    Even,
    /// Independent points distributed uniformly by area, from random lines: for Monte Carlo.
    Random,
    /// WH94 section 4.3 and 4.4: adaptive radii, fission and death, from one floater per component.
    Adaptive,
    /// WH94 section 4.1: repulsion with one fixed radius, from random points.
    Simple,
    /// WH94 section 4.2: global fissioning, from one floater per component; every generation doubles.
    Fissioning,
}

/// A relative density by position: fills `density[i]` (> 0, finite; only ratios matter) for `points[i]`; called on
/// the calling thread for all points at once. A message stops the run.
pub type DensityFn<'a> = dyn Fn(&[[f64; 3]], &mut [f64]) -> Result<(), String> + 'a;

/// Where samples should be denser.
#[derive(Clone, Copy, Default)]
pub enum Density<'a> {
    /// The same everywhere.
    #[default]
    Uniform,
    /// Samples per area grow with the square of the curvature between one quarter and four times the mean:
    /// from the Hessian or, where there is none, from the normals of neighbours.
    Curvature,
    /// Samples per area proportional to the function.
    Function(&'a DensityFn<'a>),
}

impl fmt::Debug for Density<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Density::Uniform => "Uniform",
            Density::Curvature => "Curvature",
            Density::Function(_) => "Function(..)",
        })
    }
}

/// Which part of the work a [`Progress`] reports on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Looking for the surface and its components.
    Seeding,
    /// Spreading the floaters.
    Relaxing,
    /// Projecting, measuring and collecting the result.
    Finishing,
}

/// How far a run has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// The part of the work under way.
    pub phase: Phase,
    /// Estimated part of the whole work that is done, 0 to 1; never falls.
    pub fraction: f64,
    /// Floaters at present.
    pub floaters: usize,
    /// Steps taken so far.
    pub steps: usize,
}

/// Why a run was asked to stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The user does not want it any more.
    Cancelled,
    /// The time is up.
    TimeLimit,
}

impl Stop {
    /// What the report says.
    pub(crate) fn reason(self) -> &'static str {
        match self {
            Stop::Cancelled => "cancelled",
            Stop::TimeLimit => "the time limit was reached",
        }
    }
}

/// Called on the calling thread several times a second (at least once a step); `Break` ends the run, and what
/// there is so far is returned, marked as not converged.
pub type ProgressFn<'a> = dyn FnMut(&Progress) -> ControlFlow<Stop> + 'a;

/// A search for creases: [`creases::find`](crate::creases::find).
pub type FindCreases =
    fn(&dyn Surface, &Aabb, CreaseOptions<'_>, &mut dyn FnMut(f64) -> bool) -> Result<Creases, Error>;

/// What [`sample`](crate::sample) is asked for.
pub struct Options<'a> {
    /// How many samples. Default: 1000.
    pub amount: Amount,
    /// How they are placed. Default: evenly.
    pub method: Method,
    /// Where they are denser ([`Method::Even`], and [`Method::Random`] with a function). Default: uniform.
    pub density: Density<'a>,
    /// Whether samples are placed on the surface's edges and corners, and others kept off them
    /// ([`Method::Even`], in space): `Some(creases::find)`, see [`creases`](crate::creases). It is the search itself, so that a program
    /// that never asks for it need not hold it. Default: no.
    pub creases: Option<FindCreases>,
    /// Whether more samples than `amount` are taken where those on creases would be more than half of them: as many as are
    /// twice as many as these, at most `most`. Otherwise there are none on creases then. Default: no.
    pub more: bool,
    /// Whether samples on creases are equally far apart whatever the density function, as where that has poles: at a tip. Default: no.
    pub even_creases: bool,
    /// Seed of every random choice. Default: 0.
    pub seed: u64,
    /// Points to start from, from an earlier result on a surface that has changed; with [`Method::Even`].
    pub start: Option<&'a [[f64; 3]]>,
    /// Most samples that are accepted. Default: 20 million.
    pub most: usize,
    /// Most steps at full resolution. Default: 60 (`Even`), 400 (WH94's modes) for `None`.
    pub steps: Option<usize>,
    /// Progress and cancellation.
    pub progress: Option<&'a mut ProgressFn<'a>>,
}

impl Default for Options<'_> {
    fn default() -> Self {
        Self {
            amount: Amount::Count(1000),
            method: Method::default(),
            density: Density::default(),
            creases: None,
            more: false,
            even_creases: false,
            seed: 0,
            start: None,
            most: 20_000_000,
            steps: None,
            progress: None,
        }
    }
}

impl fmt::Debug for Options<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Options")
            .field("amount", &self.amount)
            .field("method", &self.method)
            .field("density", &self.density)
            .field("creases", &self.creases.is_some())
            .field("more", &self.more)
            .field("even_creases", &self.even_creases)
            .field("seed", &self.seed)
            .field("start", &self.start.map(<[_]>::len))
            .field("most", &self.most)
            .field("steps", &self.steps)
            .field("progress", &self.progress.is_some())
            .finish()
    }
}
