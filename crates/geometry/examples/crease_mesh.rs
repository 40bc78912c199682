//! Meshes a formula and writes the triangles as OBJ, the edges that are creases as lines:
//! `cargo run -p isoswarm-geometry --example crease_mesh -- "box(2, 2, 2) - sphere(r=1.2)" 1.5 3000 out.obj`.

use std::fmt::Write;

use isoswarm_field::{Aabb, Field, text, vm};
use isoswarm_geometry::{MeshOptions, Resolution, mesh};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let formula = args.next().unwrap_or_else(|| "box(2, 2, 2) - sphere(r=1.2)".into());
    let half: f64 = args.next().map_or(Ok(1.5), |a| a.parse())?;
    let n: usize = args.next().map_or(Ok(3000), |a| a.parse())?;
    let model = if formula.ends_with(".vm") {
        vm::parse_vm(&std::fs::read_to_string(formula)?)?
    } else {
        text::parse(&formula, &[])?
    };
    let field = Field::new(&model)?;
    let options = MeshOptions { resolution: Resolution::Count(n), ..Default::default() };
    let made = mesh(&field, &Aabb::new([-half; 3], [half; 3]), options)?;
    let report = &made.report;
    println!("{} vertices, Euler characteristics {:?}", made.mesh.points.len(), report.topology.euler);
    println!(
        "faults {}, doubtful {}, intersections {}",
        report.topology.faults.len(),
        report.doubtful.len(),
        report.self_intersections.len()
    );
    println!(
        "volume {}, area {}, q {} {}",
        made.mesh.volume(),
        made.mesh.area(),
        report.quality.q_avg,
        report.quality.smallest_angle
    );
    println!("{:?}", report.warnings);
    if let Some(path) = args.next() {
        let mut out = String::new();
        made.mesh.points.iter().try_for_each(|p| writeln!(out, "v {} {} {}", p[0], p[1], p[2]))?;
        made.mesh.faces.iter().try_for_each(|f| writeln!(out, "f {} {} {}", f[0] + 1, f[1] + 1, f[2] + 1))?;
        report.creases.iter().try_for_each(|e| writeln!(out, "l {} {}", e[0] + 1, e[1] + 1))?;
        std::fs::write(path, out)?;
    }
    Ok(())
}
