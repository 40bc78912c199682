//! Interval search: the boxes that may hold a point with F = 0 and an open switch.

use rayon::prelude::*;

use super::{Route, Step, SwitchBox, Switches, What, is_switch};
use crate::field::cells::{halves, longest};
use crate::interval::Interval;
use crate::prune::{Fate, Kept, Scratch};
use crate::surface::Aabb;
use crate::tape::Code;

impl Switches<'_> {
    /// Boxes of side `side` or less (larger if they would be more than about `most`) which together contain every point
    /// in `bounds` where F = 0 and a switch that matters has equal sides, in a spatially coherent order; and the largest
    /// side of one.
    pub fn boxes(&self, bounds: &Aabb, side: f64, most: usize) -> (Vec<SwitchBox>, f64) {
        let mut level = vec![*bounds];
        let mut present = longest(bounds);
        while present > side && level.len() * 4 <= most && !level.is_empty() {
            let next: Vec<Vec<Aabb>> = level
                .par_iter()
                .with_min_len(8)
                .map_init(Scratch::default, |scratch, b| {
                    self.open(&halves(b, self.whole.axes), scratch).into_iter().map(|b| b.bounds).collect()
                })
                .collect();
            level = next.into_iter().flatten().collect();
            present *= 0.5;
        }
        let found: Vec<Vec<SwitchBox>> = level
            .par_chunks(crate::lanes::LANES)
            .with_min_len(8)
            .map_init(Scratch::default, |scratch, boxes| self.open(boxes, scratch))
            .collect();
        (found.into_iter().flatten().collect(), present)
    }

    /// The halves of a box along its longer axes, as far as they may hold such a point.
    pub fn divide(&self, bounds: &Aabb) -> Vec<SwitchBox> {
        self.open(&halves(bounds, self.whole.axes), &mut Scratch::default())
    }

    /// Those among up to eight boxes that may hold such a point.
    fn open(&self, boxes: &[Aabb], scratch: &mut Scratch) -> Vec<SwitchBox> {
        let (tape, spans) = (self.whole.tape, &self.whole.spans);
        scratch.pass.run(tape, spans, boxes, self.whole.axes, false);
        tape.decide(spans, 0.0, boxes.len(), scratch);
        let one = |(lane, bounds): (usize, &Aabb)| {
            if !scratch.pass.result(lane).has_zero() {
                return None;
            }
            let kept = scratch.kept(lane);
            let open = |k: &&Kept| self.is_open(k, lane, scratch);
            let switches: Vec<u32> = kept.iter().filter(open).map(|k| k.instr).collect();
            let tip = |k: &&Kept| self.is_tip(k, lane, scratch);
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
        matches!(kept.fate, Fate::Stay)
            && matches!(instr.code, Code::Op(crate::Op::Sqrt, _))
            && !(scratch.pass.value(instr.args[0] as usize, lane).lo > 0.0)
            && self.squares(kept.instr).len() > 1
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
