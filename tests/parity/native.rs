//! The bits of scenes after steps and scripts, as JSON by the names of `cases.json`: compared with WebAssembly's by
//! `web/tests/client/parity.test.ts`.
//!
//! `cargo run -p isoswarm --example parity > build/parity.json`

use std::collections::{BTreeMap, HashMap};
use std::error::Error;
use std::ops::ControlFlow;
use std::path::Path;

use isoswarm::field::text;
use isoswarm::scene::{Scene, Settings, script_from_json};
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Case {
    name: String,
    text: Option<String>,
    model: Option<String>,
    #[serde(default)]
    settings: Settings,
    script: Option<String>,
    steps: usize,
}

/// FNV-1a over 64-bit words.
struct Hash(u64);

impl Hash {
    fn add(&mut self, word: u64) {
        self.0 = (self.0 ^ word).wrapping_mul(0x0000_0100_0000_01b3);
    }
}

/// Positions, identities and parameters.
fn hash(scene: &Scene) -> String {
    let mut hash = Hash(0xcbf2_9ce4_8422_2325);
    let floaters = scene.frame().floaters;
    floaters.points.iter().flatten().for_each(|v| hash.add(v.to_bits()));
    floaters.id.iter().for_each(|id| hash.add(*id));
    scene.field().parameters().iter().for_each(|p| hash.add(p.value.to_bits()));
    format!("{:016x}", hash.0)
}

fn run(case: &Case, models: &Path) -> Result<String, Box<dyn Error>> {
    let read = |name: &str, kind: &str| std::fs::read_to_string(models.join(format!("{name}.{kind}.json")));
    let mut scene = match (&case.text, &case.model) {
        (Some(formula), None) => Scene::new(&text::parse(formula, &[])?, case.settings.clone())?,
        (None, Some(model)) => {
            Scene::from_json(&read(model, "iso")?, case.settings.clone(), &HashMap::new())?
        }
        _ => return Err("a case has either a text or a model".into()),
    };
    if let Some(script) = &case.script {
        let entries = script_from_json(&read(script, "script")?)?;
        scene.replay(&entries, &mut |_, _| ControlFlow::Continue(()))?;
    }
    scene.step(case.steps)?;
    Ok(hash(&scene))
}

fn main() -> Result<(), Box<dyn Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let cases: Vec<Case> =
        serde_json::from_str(&std::fs::read_to_string(root.join("tests/parity/cases.json"))?)?;
    let mut hashes = BTreeMap::new();
    for case in &cases {
        let hash = run(case, &root.join("models")).map_err(|e| format!("{}: {e}", case.name))?;
        hashes.insert(&case.name, hash);
    }
    println!("{}", serde_json::to_string_pretty(&hashes)?);
    Ok(())
}
