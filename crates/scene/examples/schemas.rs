//! Writes the schemas of scenes and scripts: `cargo run -p isoswarm-scene --example schemas`.

fn main() -> std::io::Result<()> {
    let docs = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs");
    isoswarm_scene::schemas()
        .iter()
        .try_for_each(|(name, text)| std::fs::write(format!("{docs}/{name}"), text))
}
