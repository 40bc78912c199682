//! Writes what is made from the table of kinds: `cargo run -p isoswarm-field --example reference`.

use isoswarm_field::{json, model::kinds};

fn main() -> std::io::Result<()> {
    let docs = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs");
    std::fs::write(format!("{docs}/iso.schema.json"), json::schema())?;
    std::fs::write(format!("{docs}/kinds.md"), kinds::kinds_markdown())
}
