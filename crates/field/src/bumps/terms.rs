//! The terms of a sum on a tape, each as a piece with parameters of its own: what a bump's derivatives by parameters need.
//!
//! Most terms differ in their parameters only. Such terms have one program, whose lanes are pairs of a term and a point.

use rustc_hash::FxHashMap;

use crate::arrange::Arrange;
use crate::closed::{After, Closer, Piece, Source};
use crate::op::Op;
use crate::program::Program;
use crate::tape::{Code, Mode, Tape, Uniform};

/// Pieces together may have so many times the instructions of the tape: more, where they share much, are not worth it.
const SHARED: usize = 8;

/// A sum of exponentials and constants.
#[derive(Debug)]
pub(crate) struct Terms {
    /// Programs, and how many sources each has.
    pub shapes: Vec<(Program, usize)>,
    terms: Vec<Term>,
    sources: Vec<Source>,
    /// The term of each exponential, by the number of its instruction.
    of: FxHashMap<u32, u32>,
    /// The terms that do not depend on the point, but on parameters.
    pub everywhere: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Term {
    shape: u32,
    first: u32,
}

/// What lies between a term and the result.
#[derive(Clone, Copy, Debug)]
struct Link {
    after: After,
    next: Option<u32>,
}

/// A term and its way to the result.
struct Found {
    /// The exponential's instruction, or the constant's uniform.
    root: Root,
    way: Option<u32>,
}

enum Root {
    Exp(u32),
    Uniform(u32),
}

impl Terms {
    /// `None` where the tape is no such sum.
    pub(crate) fn of(tape: &Tape) -> Option<Terms> {
        let (found, links) = terms(tape)?;
        let mut closer = Closer::new(tape);
        let mut cone = Cone { tape, seen: vec![false; tape.instrs.len()], list: Vec::new() };
        let mut known: FxHashMap<Vec<u32>, u32> = FxHashMap::default();
        let mut all = Terms {
            shapes: Vec::new(),
            terms: Vec::new(),
            sources: Vec::new(),
            of: FxHashMap::default(),
            everywhere: Vec::new(),
        };
        let mut budget = SHARED * (tape.instrs.len() + tape.uniforms.list.len());
        for f in found {
            let mut after = Vec::new();
            let mut at = f.way;
            while let Some(k) = at {
                after.push(links[k as usize].after);
                at = links[k as usize].next;
            }
            let piece = match f.root {
                Root::Exp(i) => closer.close(cone.of(i), &after),
                Root::Uniform(u) => closer.close_uniform(u, &after),
            };
            budget = budget.checked_sub(piece.instrs.len())?;
            let moves = piece.sources.iter().any(|s| matches!(s, Source::Param(_)));
            let number = all.terms.len() as u32;
            match f.root {
                Root::Exp(i) => {
                    all.of.insert(i, number);
                }
                Root::Uniform(_) if moves => all.everywhere.push(number),
                Root::Uniform(_) => continue,
            }
            let shapes = &mut all.shapes;
            let shape = *known.entry(key(&piece)).or_insert_with(|| {
                shapes.push((piece.program(), piece.sources.len()));
                shapes.len() as u32 - 1
            });
            all.terms.push(Term { shape, first: all.sources.len() as u32 });
            all.sources.extend(piece.sources);
        }
        Some(all)
    }

    /// The term of an exponential.
    pub(crate) fn term(&self, exp: u32) -> Option<u32> {
        self.of.get(&exp).copied()
    }

    /// The number of a term's program.
    pub(crate) fn shape(&self, term: u32) -> usize {
        self.terms[term as usize].shape as usize
    }

    /// What a term's inputs beyond the coordinates are.
    pub(crate) fn sources(&self, term: u32) -> &[Source] {
        let Term { shape, first } = self.terms[term as usize];
        &self.sources[first as usize..][..self.shapes[shape as usize].1]
    }
}

/// Pieces with the same key differ in their sources only.
fn key(piece: &Piece) -> Vec<u32> {
    let code = |c: Code| match c {
        Code::Op(op, _) => op as u32,
        _ => u32::MAX,
    };
    piece.instrs.iter().flat_map(|i| [code(i.code), i.args[0], i.args[1], i.args[2]]).collect()
}

/// What an exponential is made of.
struct Cone<'a> {
    tape: &'a Tape,
    seen: Vec<bool>,
    list: Vec<u32>,
}

impl Cone<'_> {
    fn of(&mut self, root: u32) -> &[u32] {
        self.list.clear();
        self.list.push(root);
        self.seen[root as usize] = true;
        let mut k = 0;
        while k < self.list.len() {
            let instr = self.tape.instrs[self.list[k] as usize];
            for a in instr.slots().map(|o| instr.args[o]) {
                if !std::mem::replace(&mut self.seen[a as usize], true) {
                    self.list.push(a);
                }
            }
            k += 1;
        }
        self.list.iter().for_each(|&i| self.seen[i as usize] = false);
        self.list.arrange();
        &self.list
    }
}

/// From the result back through sums, signs and constant factors.
fn terms(tape: &Tape) -> Option<(Vec<Found>, Vec<Link>)> {
    let n = tape.instrs.len();
    // For each instruction that has been reached, its way to the result.
    let mut ways: Vec<Option<Option<u32>>> = vec![None; n];
    ways[n - 1] = Some(None);
    let (mut found, mut links) = (Vec::new(), Vec::new());
    for i in (0..n).rev() {
        let Some(way) = ways[i] else { continue };
        let instr = tape.instrs[i];
        let mut link = |after| {
            links.push(Link { after, next: way });
            Some(links.len() as u32 - 1)
        };
        let (op, mode) = match instr.code {
            Code::Input => return None,
            Code::Uniform => {
                found.push(Found { root: Root::Uniform(instr.args[0]), way });
                continue;
            }
            Code::Op(Op::Exp, _) => {
                found.push(Found { root: Root::Exp(i as u32), way });
                continue;
            }
            Code::Op(op, mode) => (op, mode),
        };
        let on = match (op, mode) {
            (Op::Add, _) => [way, way],
            (Op::Sub, _) => [way, link(After::Neg)],
            (Op::Neg, _) => [link(After::Neg); 2],
            (Op::Mul | Op::Div, Mode::SlotUniform) => [link(After::By(op, instr.args[1])); 2],
            _ => return None,
        };
        let scaled = matches!(op, Op::Mul | Op::Div);
        for k in (0..op.arity()).filter(|&k| !(scaled && k == 1)) {
            if instr.slots().contains(&k) {
                let slot = &mut ways[instr.args[k] as usize];
                if slot.replace(on[k]).is_some() {
                    return None;
                }
            } else {
                found.push(Found { root: Root::Uniform(instr.args[k]), way: on[k] });
            }
        }
    }
    let constant = |f: &Found| matches!(f.root, Root::Uniform(u) if matches!(tape.uniforms.list.get(u as usize), None | Some(Uniform::Const(_))) && f.way.is_none());
    found.retain(|f| !constant(f));
    Some((found, links))
}
