//! Draws the papers' figures: `cargo run --release -p isoswarm --example papers -- FOLDER`.
mod story;
fn main() {}
