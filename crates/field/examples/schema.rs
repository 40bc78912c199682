//! Prints the JSON schema of `.iso.json` files: `cargo run -p isoswarm-field --example schema > docs/iso.schema.json`.

fn main() {
    print!("{}", isoswarm_field::json::schema());
}
