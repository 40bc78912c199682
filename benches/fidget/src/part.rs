//! A machined part of our own design, as a tape in fidget's plain-text `.vm` form.
//!
//! A base plate with chamfered corners carries a row of cooling fins of an arched profile, drilled crosswise; bosses with counterbored
//! holes, hexagonal nut pockets, slots and an oil gallery are cut into it. Half of the operations are minima and maxima.

use std::collections::HashMap;
use std::fmt::Write;

/// Box in which the part lies, with a margin.
pub const BOX: ([f32; 3], [f32; 3]) = ([-1.1, -0.8, -0.45], [1.1, 0.8, 0.55]);

/// One line of the tape; equal lines are written once.
type Node = usize;

#[derive(Default)]
struct Tape {
    text: String,
    known: HashMap<String, Node>,
    operations: usize,
    choices: usize,
}

impl Tape {
    fn line(&mut self, body: String) -> Node {
        if let Some(&node) = self.known.get(&body) {
            return node;
        }
        let node = self.known.len();
        writeln!(self.text, "_{node:x} {body}").expect("a String takes everything");
        let name = body.split(' ').next().unwrap_or_default();
        self.operations += usize::from(name != "const" && !name.starts_with("var-"));
        self.choices += usize::from(name == "min" || name == "max");
        self.known.insert(body, node);
        node
    }

    fn constant(&mut self, value: f64) -> Node {
        self.line(format!("const {value:?}"))
    }

    fn unary(&mut self, name: &str, a: Node) -> Node {
        self.line(format!("{name} _{a:x}"))
    }

    fn binary(&mut self, name: &str, a: Node, b: Node) -> Node {
        self.line(format!("{name} _{a:x} _{b:x}"))
    }

    fn minus(&mut self, a: Node, value: f64) -> Node {
        let c = self.constant(value);
        self.binary("sub", a, c)
    }

    /// value - a: negative where a lies above.
    fn above(&mut self, value: f64, a: Node) -> Node {
        let c = self.constant(value);
        self.binary("sub", c, a)
    }

    fn union(&mut self, a: Node, b: Node) -> Node {
        self.binary("min", a, b)
    }

    fn intersection(&mut self, a: Node, b: Node) -> Node {
        self.binary("max", a, b)
    }

    /// lo <= a <= hi.
    fn between(&mut self, a: Node, lo: f64, hi: f64) -> Node {
        let (below, above) = (self.above(lo, a), self.minus(a, hi));
        self.intersection(below, above)
    }

    /// Outside of lo <= a <= hi: the negative of `between`.
    fn not_between(&mut self, a: Node, lo: f64, hi: f64) -> Node {
        let (below, above) = (self.minus(a, lo), self.above(hi, a));
        self.union(below, above)
    }

    /// Distance from (u, v) to (cu, cv).
    fn distance(&mut self, u: Node, v: Node, cu: f64, cv: f64) -> Node {
        let (du, dv) = (self.minus(u, cu), self.minus(v, cv));
        let (du, dv) = (self.unary("square", du), self.unary("square", dv));
        let sum = self.binary("add", du, dv);
        self.unary("sqrt", sum)
    }
}

/// The tape's text, its number of operations, and how many of those are minima and maxima.
pub fn text() -> (String, usize, usize) {
    let mut t = Tape::default();
    let [x, y, z] = ["var-x", "var-y", "var-z"].map(|v| t.line(v.to_string()));

    // Base plate with chamfered corners and edges.
    let mut part = t.between(z, -0.3, -0.15);
    let (ax, ay) = (t.unary("abs", x), t.unary("abs", y));
    let side = t.minus(ax, 1.0);
    part = t.intersection(part, side);
    let front = t.minus(ay, 0.7);
    part = t.intersection(part, front);
    let sum = t.binary("add", ax, ay);
    let chamfer = t.minus(sum, 1.58);
    part = t.intersection(part, chamfer);

    // Cooling fins; profile and length follow an arch, every other fin is notched.
    for i in 0..24 {
        let centre = -0.69 + 0.06 * i as f64;
        let arch = 1.0 - (centre / 0.8f64).powi(2);
        let mut fin = t.between(x, centre - 0.013, centre + 0.013);
        let along = t.between(y, -0.2 - 0.2 * arch, 0.2 + 0.18 * arch);
        fin = t.intersection(fin, along);
        let up = t.between(z, -0.2, 0.02 + 0.4 * arch);
        fin = t.intersection(fin, up);
        if i % 2 == 0 {
            let shift = 0.002 * i as f64;
            let along = t.not_between(y, -0.06 - shift, 0.05 + 0.5 * shift);
            let floor = t.minus(z, 0.3 * arch - 0.06);
            let notch = t.union(along, floor);
            fin = t.intersection(fin, notch);
        }
        part = t.union(part, fin);
    }

    // Crosswise drillings through the fins.
    for (cy, cz, r) in
        [(-0.2, 0.0, 0.04), (0.2, 0.0, 0.04), (-0.12, 0.15, 0.03), (0.12, 0.15, 0.03), (0.0, -0.07, 0.05)]
    {
        let d = t.distance(y, z, cy, cz);
        let hole = t.above(r, d);
        part = t.intersection(part, hole);
    }

    // Bosses along the long edges, each with a counterbored through hole.
    for i in 0..11 {
        for (row, cy) in [-0.55, 0.55].into_iter().enumerate() {
            let cx = -0.85 + 0.17 * i as f64;
            let top = -0.02 - 0.01 * ((i * 3 + row * 5) % 7) as f64;
            let d = t.distance(x, y, cx, cy);
            let mut boss = t.minus(d, 0.07);
            let height = t.between(z, -0.28, top);
            boss = t.intersection(boss, height);
            part = t.union(part, boss);
            let hole = t.above(0.025, d);
            part = t.intersection(part, hole);
            let (wall, floor) = (t.above(0.045, d), t.minus(z, top - 0.05));
            let counterbore = t.union(wall, floor);
            part = t.intersection(part, counterbore);
        }
    }

    // Hexagonal nut pockets between the fins' ends and the bosses, each turned by its own angle.
    for i in 0..7 {
        let (cx, cy) = (-0.72 + 0.24 * i as f64, if i % 2 == 0 { -0.42 } else { 0.42 });
        let (u, v) = (t.minus(x, cx), t.minus(y, cy));
        let mut hexagon = t.minus(z, -0.19 - 0.004 * i as f64);
        for k in 0..3 {
            let (sin, cos) = (0.1 * i as f64 + k as f64 * std::f64::consts::FRAC_PI_3).sin_cos();
            let (cos, sin) = (t.constant(cos), t.constant(sin));
            let (a, b) = (t.binary("mul", u, cos), t.binary("mul", v, sin));
            let across = t.binary("add", a, b);
            let face = t.not_between(across, -0.035, 0.035);
            hexagon = t.union(hexagon, face);
        }
        part = t.intersection(part, hexagon);
    }

    // Slots along the short edges, cut through.
    for i in 0..8 {
        for (lo, hi) in [(-1.05, -0.93), (0.93, 1.05)] {
            let cy = -0.42 + 0.12 * i as f64;
            let along = t.not_between(x, lo, hi);
            let across = t.not_between(y, cy - 0.02, cy + 0.015 + 0.001 * i as f64);
            let slot = t.union(along, across);
            part = t.intersection(part, slot);
        }
    }

    // Shallow rectangular pockets in the underside.
    let shallow = t.above(-0.27, z);
    for i in 0..7 {
        let along = t.not_between(x, -0.83 + 0.24 * i as f64, -0.61 + 0.24 * i as f64);
        for j in 0..6 {
            let across = t.not_between(y, -0.44 + 0.15 * j as f64, -0.31 + 0.15 * j as f64);
            let pocket = t.union(along, across);
            let pocket = t.union(pocket, shallow);
            part = t.intersection(part, pocket);
        }
    }

    // A gallery below the fins that leads out on both sides.
    let d = t.distance(y, z, 0.3, -0.225);
    let gallery = t.above(0.035, d);
    t.intersection(part, gallery);
    (t.text, t.operations, t.choices)
}
