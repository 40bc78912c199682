//! Scenes and models from texts.

use std::collections::{BTreeMap, HashMap};

use isoswarm_field::{Model, json, text};
use isoswarm_scene::{FORMAT, Scene, Settings, script_from_json};
use serde::{Deserialize, Serialize};
use wasm_bindgen::JsValue;

use crate::failure::{Failure, Thrown};

/// See `Source` in `protocol.ts`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Source {
    text: String,
    #[serde(default)]
    parameters: BTreeMap<String, f64>,
    #[serde(default)]
    settings: Option<Settings>,
    #[serde(default)]
    script: Option<String>,
}

pub fn open(source: &str, floaters: &[f64]) -> Result<Scene, JsValue> {
    let source: Source = serde_json::from_str(source).map_err(|e| Failure::input(format!("source: {e}")))?;
    let settings = source.settings.unwrap_or_default();
    let mut scene = if is_file(&source.text) {
        Scene::from_json_with(&source.text, settings, &HashMap::new(), floaters.as_chunks().0).thrown()?
    } else {
        Scene::new(&formula(&source.text, &source.parameters)?, settings).thrown()?
    };
    if let Some(script) = &source.script {
        let entries = script_from_json(script).thrown()?;
        scene.replay(&entries, &mut |_, _| std::ops::ControlFlow::Continue(())).thrown()?;
    }
    Ok(scene)
}

fn is_file(text: &str) -> bool {
    text.trim_start().starts_with('{')
}

fn formula(source: &str, parameters: &BTreeMap<String, f64>) -> Result<Model, JsValue> {
    let parameters: Vec<(&str, f64)> = parameters.iter().map(|(k, v)| (k.as_str(), *v)).collect();
    text::parse(source, &parameters).thrown()
}

/// What a text is.
#[derive(Serialize)]
pub struct Checked {
    formula: Option<String>,
    parameters: usize,
}

pub fn check(source: &str, parameters: &str) -> Result<Checked, JsValue> {
    let parameters: BTreeMap<String, f64> =
        serde_json::from_str(parameters).map_err(|e| Failure::input(format!("parameters: {e}")))?;
    let model = if is_file(source) { file(source)? } else { formula(source, &parameters)? };
    Ok(Checked { formula: model.to_text().ok(), parameters: model.parameters().len() })
}

/// The model of a file of a model or of a scene.
fn file(source: &str) -> Result<Model, JsValue> {
    #[derive(Deserialize)]
    struct Whole<'a> {
        format: String,
        #[serde(borrow)]
        model: Option<&'a serde_json::value::RawValue>,
    }
    match serde_json::from_str::<Whole<'_>>(source) {
        Ok(Whole { format, model: Some(model) }) if format == FORMAT => json::from_json(model.get()).thrown(),
        _ => json::from_json(source).thrown(),
    }
}
