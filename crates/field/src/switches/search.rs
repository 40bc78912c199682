//! Interval search: the boxes that may hold a point with F = 0 and an open switch.

use rayon::prelude::*;

use super::{Route, Step, SwitchBox, Switches, What, is_switch};
use crate::field::cells::{halves, longest};
use crate::interval::Interval;
use crate::prune::{Fate, Kept, Scratch};
use crate::surface::Aabb;
use crate::tape::Code;

/// Points at which it is looked for what F depends on.
const PROBES: usize = 64;
/// ∂F/∂(a switch), over the largest derivative, up to which F does not depend on it.
const IDLE: f64 = 1e-12;

impl Switches<'_> {
    /// Boxes of side `side` or less (larger if they would be more than about `most`) which together contain every point
    /// in `bounds` where F = 0 and a switch that matters has equal sides, in a spatially coherent order; and the largest
    /// side of one.
    pub fn boxes(&self, bounds: &Aabb, side: f64, most: usize) -> (Vec<SwitchBox>, f64) {
        let matters = self.matters(bounds);
        let listed = |i: &usize| {
            matters[*i] && (is_switch(&self.whole.tape.instrs[*i]) || self.squares(*i as u32).len() > 1)
        };
        if !(0..matters.len()).any(|i| listed(&i)) {
            return (Vec::new(), longest(bounds));
        }
        let mut level = vec![*bounds];
        let mut present = longest(bounds);
        while present > side && level.len() * 4 <= most && !level.is_empty() {
            let next: Vec<Vec<Aabb>> = level
                .par_iter()
                .with_min_len(8)
                .map_init(Scratch::default, |scratch, b| {
                    self.open(&halves(b, self.whole.axes), &matters, scratch)
                        .into_iter()
                        .map(|b| b.bounds)
                        .collect()
                })
                .collect();
            level = next.into_iter().flatten().collect();
            present *= 0.5;
        }
        let found: Vec<Vec<SwitchBox>> = level
            .par_chunks(crate::lanes::LANES)
            .with_min_len(8)
            .map_init(Scratch::default, |scratch, boxes| self.open(boxes, &matters, scratch))
            .collect();
        (found.into_iter().flatten().collect(), present)
    }

    /// Which instructions F depends on. A minimum that is only taken out of a sum of exponentials (as in `smooth_union`, against
    /// overflow) cancels: ∂F/∂(that minimum) is 0 wherever it is reached, and what it is made of does not matter either.
    fn matters(&self, bounds: &Aabb) -> Vec<bool> {
        let tape = self.whole.tape;
        let n = tape.instrs.len();
        let (mut seen, mut moves) = (vec![false; n], vec![false; n]);
        let (mut values, mut adjoints) = (Vec::new(), crate::plain::Adjoints::default());
        for k in 0..PROBES {
            // Points of a lattice that no symmetry knows of.
            let part = |a: usize| (0.5 + k as f64 * [0.754_877_666, 0.569_840_291, 0.618_033_989][a]).fract();
            let at = |a: usize| bounds.lo[a] + part(a) * (bounds.hi[a] - bounds.lo[a]);
            let mut inputs = [0.0; crate::MAX_AXES];
            (0..self.whole.axes.min(3)).for_each(|a| inputs[a] = at(a));
            crate::plain::forward(tape, self.whole.uniforms, &inputs, &mut values);
            crate::plain::reverse(tape, self.whole.uniforms, &values, &mut adjoints);
            let adjoints: &[f64] = &adjoints.list[..n];
            let most = adjoints.iter().fold(0.0f64, |m, a| m.max(a.abs()));
            for i in (0..n).filter(|&i| is_switch(&tape.instrs[i]) && adjoints[i] != 0.0) {
                seen[i] = true;
                let idle = adjoints[i].abs() <= IDLE * most;
                moves[i] |= !idle;
            }
        }
        let mut out = vec![false; n];
        out[n - 1] = true;
        for i in (0..n).rev() {
            let idle = seen[i] && !moves[i];
            if !out[i] || idle {
                out[i] = false;
                continue;
            }
            tape.instrs[i].slots().for_each(|k| out[tape.instrs[i].args[k] as usize] = true);
        }
        out
    }

    /// Those among up to eight boxes that may hold such a point.
    fn open(&self, boxes: &[Aabb], matters: &[bool], scratch: &mut Scratch) -> Vec<SwitchBox> {
        let (tape, spans) = (self.whole.tape, &self.whole.spans);
        scratch.pass.run(tape, spans, boxes, self.whole.axes, false);
        tape.decide(spans, 0.0, boxes.len(), scratch);
        let one = |(lane, bounds): (usize, &Aabb)| {
            if !scratch.pass.result(lane).has_zero() {
                return None;
            }
            let kept = scratch.kept(lane);
            let open = |k: &&Kept| matters[k.instr as usize] && self.is_open(k, lane, scratch);
            let switches: Vec<u32> = kept.iter().filter(open).map(|k| k.instr).collect();
            let tip = |k: &&Kept| matters[k.instr as usize] && self.is_tip(k, lane, scratch);
            let tips: Vec<u32> = kept.iter().filter(tip).map(|k| k.instr).collect();
            if switches.is_empty() && tips.is_empty() {
                return None;
            }
            Some(SwitchBox { bounds: *bounds, switches, tips })
        };
        boxes.iter().enumerate().filter_map(one).collect()
    }

    /// What of the function matters in each of up to eight boxes.
    pub fn routes(&self, boxes: &[Aabb]) -> Vec<Route> {
        let mut scratch = Scratch::default();
        let (tape, spans) = (self.whole.tape, &self.whole.spans);
        let Some(boxes) = boxes.get(..boxes.len().min(crate::lanes::LANES)).filter(|b| !b.is_empty()) else {
            return Vec::new();
        };
        scratch.pass.run(tape, spans, boxes, self.whole.axes, false);
        tape.decide(spans, 0.0, boxes.len(), &mut scratch);
        let step = |lane: usize, k: &Kept| {
            let what = match k.fate {
                Fate::Stay => What::Compute,
                Fate::Take(side) => What::Take(side),
                Fate::Point => What::Constant(scratch.pass.value(k.instr as usize, lane).lo),
                Fate::Tail => What::Constant(0.0),
            };
            Step { instr: k.instr, what }
        };
        (0..boxes.len())
            .map(|lane| Route { steps: scratch.kept(lane).iter().map(|k| step(lane, k)).collect() })
            .collect()
    }

    /// Whether an instruction that is reached is the root of a sum of squares that may be 0 within the box.
    fn is_tip(&self, kept: &Kept, lane: usize, scratch: &Scratch) -> bool {
        let instr = &self.whole.tape.instrs[kept.instr as usize];
        if !matches!((kept.fate, instr.code), (Fate::Stay, Code::Op(crate::Op::Sqrt, _))) {
            return false;
        }
        let positive = scratch.pass.value(instr.args[0] as usize, lane).lo > 0.0;
        !positive && self.squares(kept.instr).len() > 1
    }

    /// Whether an instruction that is reached may switch within the box.
    fn is_open(&self, kept: &Kept, lane: usize, scratch: &Scratch) -> bool {
        let instr = &self.whole.tape.instrs[kept.instr as usize];
        if !(matches!(kept.fate, Fate::Stay) && is_switch(instr)) {
            return false;
        }
        let value = |k: usize| -> Interval {
            if instr.slots().contains(&k) {
                scratch.pass.value(instr.args[k] as usize, lane)
            } else {
                crate::plain::uniform(self.whole.tape, &self.whole.spans, instr.args[k])
            }
        };
        match instr.code {
            Code::Op(crate::Op::Abs, _) => value(0).has_zero(),
            Code::Op(crate::Op::Mod, _) => {
                let turns = value(0) / value(1);
                !(turns.lo.floor() == turns.hi.floor() && turns.lo.is_finite())
            }
            _ => true,
        }
    }
}
