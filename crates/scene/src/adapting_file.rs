//! The adapter that is on, in the file of a scene: all that its next step depends on, so that a scene goes on to the same bits.

use isoswarm_field::model::adapters::inverse;
use isoswarm_field::{Field, FieldError, Model, ParamInfo};
use isoswarm_particles::control::FieldPoints;
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use crate::adapting::Adapting;
use crate::file::to_text;
use crate::scene::Now;
use crate::{Error, TransferReport};

/// An adapter that is on a part of a scene. The scene's model has it; what is here tells what it is to hand over, and how far the
/// part has followed.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct AdaptingRecord<'a> {
    /// The part that is adapted, in the model without the adapter.
    path: String,
    /// The adapter's node, in the scene's model.
    adapter: String,
    /// The adapter's parameters that can be moved, in the scene's model.
    own: Vec<String>,
    /// The model without the adapter.
    #[serde(borrow)]
    #[cfg_attr(feature = "schema", schemars(with = "serde_json::Value"))]
    pub(crate) original: &'a RawValue,
    /// The part's free parameters, as they have followed so far.
    part: Vec<f64>,
    /// The box that clips the surface (model units).
    pub(crate) bounds: [[f64; 3]; 2],
    /// Field points, those on the part's surface first.
    points: Vec<PointRecord>,
    /// How many of them are on the surface.
    on: usize,
    /// How well the part follows.
    report: ReportRecord,
}

/// A field point: where the deformation is followed.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
struct PointRecord {
    /// Before the deformation (model units).
    from: [f64; 3],
    /// Where it has been carried (model units).
    to: [f64; 3],
    /// The part's function there before it.
    value: f64,
    /// A length for a unit of the function.
    length: f64,
}

/// See [`TransferReport`]; null is what is no finite number.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
struct ReportRecord {
    rms: Option<f64>,
    largest: Option<f64>,
    relative: Option<f64>,
    rank: usize,
    freedom: usize,
    at_limit: Vec<String>,
}

impl ReportRecord {
    fn of(r: &TransferReport) -> Self {
        let known = |v: f64| v.is_finite().then_some(v);
        Self {
            rms: known(r.rms),
            largest: known(r.largest),
            relative: known(r.relative),
            rank: r.rank,
            freedom: r.freedom,
            at_limit: r.at_limit.clone(),
        }
    }

    fn report(&self) -> TransferReport {
        let number = |v: Option<f64>| v.unwrap_or(f64::NAN);
        TransferReport {
            rms: number(self.rms),
            largest: number(self.largest),
            relative: number(self.relative),
            rank: self.rank,
            freedom: self.freedom,
            at_limit: self.at_limit.clone(),
        }
    }
}

fn refused<T>(reason: impl Into<String>) -> Result<T, Error> {
    Err(Error::Field(FieldError::Invalid(reason.into())))
}

impl Adapting {
    /// As the text of an object, with the text of the model without the adapter.
    pub(crate) fn to_text(&self, original: &str, now: &Now) -> String {
        let params = now.state.field.parameters();
        let own: Vec<&str> = self.own.iter().map(|&i| params[i].path.as_str()).collect();
        let f = &self.field;
        let points: Vec<String> = (0..f.points.len())
            .map(|i| {
                let (from, to) = (f.points[i], self.moved[i]);
                to_text(&PointRecord { from, to, value: f.values[i], length: f.lengths[i] })
            })
            .collect();
        let b = &now.state.bounds;
        format!(
            "{{\n    \"path\": {},\n    \"adapter\": {},\n    \"own\": {},\n    \"original\": {original},\n    \"part\": {},\n    \
             \"bounds\": {},\n    \"points\": [\n      {}\n    ],\n    \"on\": {},\n    \"report\": {}\n  }}",
            to_text(&self.path),
            to_text(&self.adapter),
            to_text(&own),
            to_text(&self.operand.q()),
            to_text(&[b.lo, b.hi]),
            points.join(",\n      "),
            f.on,
            to_text(&ReportRecord::of(&self.report)),
        )
    }

    /// The adapter of a file, on the model `whole`.
    ///
    /// # Errors
    /// What does not fit together.
    pub(crate) fn of_record(
        record: &AdaptingRecord<'_>,
        original: Model,
        whole: &Model,
    ) -> Result<Self, Error> {
        let mut operand = Field::new(&original.node(&record.path)?)?;
        operand.set_q(&record.part)?;
        let node = whole.node(&record.adapter)?;
        let params = whole.parameters();
        let expected = original.with_node(&record.path, &node)?.parameters();
        let same =
            |(a, b): (&ParamInfo, &ParamInfo)| a.path == b.path && a.value.to_bits() == b.value.to_bits();
        if expected.len() != params.len() || !expected.iter().zip(&params).all(same) {
            return refused(
                "expected the scene's model to be `original` with the adapter in it, given another one",
            );
        }
        let inside = format!("{}/", record.adapter);
        let find = |path: &String| {
            let mine = |p: &&ParamInfo| p.path == *path && !p.discrete;
            let name = path.strip_prefix(&inside).filter(|n| !n.contains('/'));
            match (name, params.iter().find(mine)) {
                (Some(name), Some(_)) => Ok(name.to_string()),
                _ => refused(format!("own: expected parameters of `{}`, given `{path}`", record.adapter)),
            }
        };
        let names: Vec<String> = record.own.iter().map(find).collect::<Result<_, _>>()?;
        let own: Vec<usize> = (0..params.len()).filter(|&i| record.own.contains(&params[i].path)).collect();
        // D⁻¹ moves with the adapter's own parameters, whether one of them is locked now or not.
        let free = node.edit("*", |p| p.frozen = true)?;
        let root = free.nodes()[0].path.clone();
        let free =
            names.iter().try_fold(free, |m, name| m.edit(&format!("{root}/{name}"), |p| p.frozen = false))?;
        let [x, y, z] = inverse(&free)?;
        let inverse = [Field::new(&x)?, Field::new(&y)?, Field::new(&z)?];
        if own.is_empty() || inverse.iter().any(|f| f.free().len() != own.len()) {
            return refused(format!("own: expected the parameters that `{}` is moved by", record.adapter));
        }
        let p = &record.points;
        let numbers = p.iter().flat_map(|p| p.from.into_iter().chain(p.to).chain([p.value, p.length]));
        let bounds = record.bounds.iter().flatten();
        if record.on > p.len() || p.is_empty() || !numbers.chain(bounds.copied()).all(f64::is_finite) {
            return refused(format!(
                "expected finite numbers and field points of which at least `on` are there, given {} points with on = {}",
                p.len(),
                record.on
            ));
        }
        let axes = operand.axes();
        if !(0..axes).all(|a| record.bounds[0][a] < record.bounds[1][a]) {
            return refused(format!("bounds: expected the corners of a box, given {:?}", record.bounds));
        }
        let field = FieldPoints {
            points: p.iter().map(|p| p.from).collect(),
            values: p.iter().map(|p| p.value).collect(),
            lengths: p.iter().map(|p| p.length).collect(),
            on: record.on,
        };
        Ok(Self {
            path: record.path.clone(),
            adapter: record.adapter.clone(),
            original,
            operand,
            inverse,
            moved: p.iter().map(|p| p.to).collect(),
            field,
            own,
            report: record.report.report(),
        })
    }
}
