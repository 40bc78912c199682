//! Changes of the tree.

use isoswarm_field::model::{Model, Param, Payload, kind};
use isoswarm_field::{Field, FieldError, text};

use crate::Error;
use crate::apply::Change;
use crate::scene::Scene;

impl Scene {
    /// A part from a formula or the text of a model file.
    pub(crate) fn read_part(&self, source: &str) -> Result<Model, Error> {
        let functions = |name: &str| self.functions.get(name).cloned();
        if source.trim_start().starts_with('{') {
            return Ok(isoswarm_field::json::from_json_with(source, &functions)?);
        }
        Ok(text::parse(source, &[])?)
    }

    /// Changes the tree; parameters that are still there keep their values.
    pub(crate) fn edit(
        &mut self,
        what: &str,
        change: &dyn Fn(&Model) -> Result<Model, FieldError>,
    ) -> Result<Change, Error> {
        self.idle("change the model")?;
        self.no_adapter("change the model")?;
        let before = self.model()?;
        let model = change(&before)?;
        let rest = self.carried_rest(&before, change)?;
        let field = Field::new(&model)?;
        if field.components() != 1 {
            return Err(Error::option("model", "one equation F = 0", format!("{}", field.components())));
        }
        let on = self.pins_on_the_surface()?;
        self.remember();
        (self.now.state.field, self.now.state.rest) = (field, rest);
        self.resettle(what)?;
        self.learn_functions(&model);
        // Pins that the surface has left would pull what there is of it to where a part was.
        let still = self.pins_on_the_surface()?;
        let lost: Vec<u64> = on.into_iter().filter(|id| !still.contains(id)).collect();
        self.now.state.pins.retain(|p| !lost.contains(&p.id));
        Ok(Change { model: true, parameters: true, lost, ..Change::default() })
    }

    /// The numbers of the pins that are within a spacing of the surface.
    fn pins_on_the_surface(&self) -> Result<Vec<u64>, Error> {
        let off = self.now.residuals()?;
        let pins = self.now.state.pins.iter().zip(off);
        Ok(pins.filter(|(_, off)| *off <= self.now.state.spacing).map(|(p, _)| p.id).collect())
    }
}

/// The path, or that of the whole model where it is empty.
pub(crate) fn or_root(model: &Model, path: &str) -> String {
    if path.is_empty() { model.nodes()[0].path.clone() } else { path.to_string() }
}

/// An operator of the table around a part.
pub(crate) fn wrap(
    inner: &Model,
    kind_name: &str,
    parameters: &std::collections::BTreeMap<String, f64>,
    name: Option<&str>,
) -> Result<Model, FieldError> {
    let k = kind(kind_name)
        .ok_or_else(|| FieldError::Invalid(format!("there is no kind called `{kind_name}`")))?;
    let mut params: Vec<Param> = k.params.iter().map(Param::from_spec).collect();
    for (name, value) in parameters {
        match params.iter_mut().find(|p| *p.name == **name) {
            Some(p) => p.value = *value,
            None => {
                let known: Vec<&str> = k.params.iter().map(|p| p.name).collect();
                return Err(FieldError::Invalid(format!(
                    "{kind_name} has no parameter `{name}`; it has: {}",
                    known.join(", ")
                )));
            }
        }
    }
    let m = Model::new(k, params, vec![inner.clone()], Payload::None)?;
    match name {
        Some(name) => m.named(name),
        None => Ok(m),
    }
}
