//! Pieces of a tape that need nothing from outside: parameters and constants are inputs like the coordinates. One reverse
//! sweep then gives the derivatives by just those parameters that occur in the piece.

use rustc_hash::FxHashMap;

use crate::MAX_AXES;
use crate::arrange::Arrange;
use crate::op::Op;
use crate::program::{Program, Purpose};
use crate::tape::{Code, Instr, Mode, Tape, Uniform};

/// What an input beyond the coordinates is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Source {
    Param(u32),
    Const(f64),
}

impl Source {
    /// Its value, given those of the model's parameters.
    #[inline(always)]
    pub(crate) fn value(self, params: &[f64]) -> f64 {
        match self {
            Source::Param(p) => params[p as usize],
            Source::Const(c) => c,
        }
    }
}

/// A step of what is done to a piece's result.
#[derive(Clone, Copy, Debug)]
pub(crate) enum After {
    Neg,
    /// Times (or divided by) a uniform.
    By(Op, u32),
}

/// The instructions of a piece; the result is the last. Input `MAX_AXES + k` is source k.
#[derive(Debug)]
pub(crate) struct Piece {
    pub instrs: Vec<Instr>,
    pub sources: Vec<Source>,
}

impl Piece {
    /// With registers, for derivatives with respect to all inputs.
    pub(crate) fn program(&self) -> Program {
        let tape =
            Tape { uniforms: Default::default(), own: Vec::new(), instrs: self.instrs.clone(), exps: 0 };
        Program::new(&tape, Purpose::Inputs)
    }
}

const NONE: u32 = u32::MAX;

/// Makes pieces of one tape after the other; keeps its working memory.
pub(crate) struct Closer<'a> {
    tape: &'a Tape,
    /// Slot in the piece of each instruction of the tape, and of each uniform that is needed.
    slots: Vec<u32>,
    uniforms: FxHashMap<u32, u32>,
    needed: Vec<u32>,
}

impl<'a> Closer<'a> {
    pub(crate) fn new(tape: &'a Tape) -> Self {
        Self {
            tape,
            slots: vec![NONE; tape.instrs.len()],
            uniforms: FxHashMap::default(),
            needed: Vec::new(),
        }
    }

    /// The piece that computes the last of `instrs`, which are in order and hold what each of them needs, and `after` that.
    pub(crate) fn close(&mut self, instrs: &[u32], after: &[After]) -> Piece {
        self.make(instrs, None, after)
    }

    /// The same for a uniform.
    pub(crate) fn close_uniform(&mut self, uniform: u32, after: &[After]) -> Piece {
        self.make(&[], Some(uniform), after)
    }

    fn make(&mut self, instrs: &[u32], uniform: Option<u32>, after: &[After]) -> Piece {
        self.collect(instrs, uniform, after);
        let mut piece = Piece { instrs: Vec::with_capacity(instrs.len()), sources: Vec::new() };
        let needed = std::mem::take(&mut self.needed);
        // Uniforms in their order, before everything else: sums of adjoints then are in the order of the whole tape.
        for &u in &needed {
            let slot = match self.tape.uniforms.list.get(u as usize) {
                None => {
                    let c = self.tape.own[u as usize - self.tape.uniforms.list.len()];
                    source(&mut piece, Source::Const(c))
                }
                Some(Uniform::Const(c)) => source(&mut piece, Source::Const(*c)),
                Some(Uniform::Param(p)) => source(&mut piece, Source::Param(*p)),
                Some(Uniform::Op(op, args)) => {
                    let args = args.map(|a| self.uniforms[&a]);
                    push(&mut piece, *op, args)
                }
            };
            self.uniforms.insert(u, slot);
        }
        let mut last = uniform.map_or(NONE, |u| self.uniforms[&u]);
        for &i in instrs {
            let instr = self.tape.instrs[i as usize];
            last = match instr.code {
                Code::Input => {
                    piece.instrs.push(instr);
                    piece.instrs.len() as u32 - 1
                }
                Code::Uniform => self.uniforms[&instr.args[0]],
                Code::Op(op, mode) => {
                    let of = |k: usize| {
                        let a = instr.args[k];
                        let uniform = matches!((mode, k), (Mode::SlotUniform, 1) | (Mode::UniformSlot, 0));
                        if uniform { self.uniforms[&a] } else { self.slots[a as usize] }
                    };
                    let args = [0, 1, 2].map(|k| if k < op.arity() { of(k) } else { of(0) });
                    push(&mut piece, op, args)
                }
            };
            self.slots[i as usize] = last;
        }
        for step in after {
            last = match *step {
                After::Neg => push(&mut piece, Op::Neg, [last; 3]),
                After::By(op, u) => push(&mut piece, op, [last, self.uniforms[&u], last]),
            };
        }
        if last as usize + 1 != piece.instrs.len() {
            // A uniform alone.
            for _ in 0..2 {
                last = push(&mut piece, Op::Neg, [last; 3]);
            }
        }
        self.uniforms.clear();
        self.needed = needed;
        piece
    }

    /// The uniforms that are needed, in order.
    fn collect(&mut self, instrs: &[u32], uniform: Option<u32>, after: &[After]) {
        self.needed.clear();
        let mut open: Vec<u32> = uniform.into_iter().collect();
        for &i in instrs {
            let instr = self.tape.instrs[i as usize];
            match instr.code {
                Code::Uniform | Code::Op(_, Mode::UniformSlot) => open.push(instr.args[0]),
                Code::Op(_, Mode::SlotUniform) => open.push(instr.args[1]),
                Code::Input | Code::Op(_, Mode::Slots) => {}
            }
        }
        open.extend(after.iter().filter_map(|a| if let After::By(_, u) = a { Some(*u) } else { None }));
        while let Some(u) = open.pop() {
            if self.uniforms.insert(u, NONE).is_none() {
                self.needed.push(u);
                if let Some(Uniform::Op(op, args)) = self.tape.uniforms.list.get(u as usize) {
                    open.extend(&args[..op.arity()]);
                }
            }
        }
        self.needed.arrange();
    }
}

fn source(piece: &mut Piece, s: Source) -> u32 {
    let input = (MAX_AXES + piece.sources.len()) as u32;
    piece.sources.push(s);
    piece.instrs.push(Instr::new(Code::Input, [input; 3]));
    piece.instrs.len() as u32 - 1
}

fn push(piece: &mut Piece, op: Op, args: [u32; 3]) -> u32 {
    piece.instrs.push(Instr::new(Code::Op(op, Mode::Slots), args));
    piece.instrs.len() as u32 - 1
}
