//! `isoswarm-web-bindgen <module.wasm> <folder> <name>`: JavaScript and TypeScript around a WebAssembly module.
//!
//! The same as `wasm-bindgen --target web`, with the version that the lock file has.

use anyhow::{Context, Result};
use wasm_bindgen_cli_support::Bindgen;

fn main() -> Result<()> {
    let mut given = std::env::args().skip(1);
    let module = given.next().context("expected the path of a .wasm module")?;
    let folder = given.next().context("expected a folder to write to")?;
    let name = given.next().context("expected a name for the files")?;
    Bindgen::new()
        .input_path(module)
        .out_name(&name)
        .typescript(true)
        .omit_default_module_path(true)
        .web(true)?
        .generate(folder)
}
