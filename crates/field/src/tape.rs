//! A graph compiled for evaluation: first what depends on the parameters alone (the uniforms, computed once per
//! call), then one instruction a line for what depends on the coordinates.

use std::sync::Arc;

use crate::graph::{Expr, Graph, Node};
use crate::op::{Op, apply};
use crate::scalar::Scalar;

/// Where the two operands of a binary instruction lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mode {
    /// Both are slots (or there is only one).
    Slots,
    /// The first is a slot, the second a uniform.
    SlotUniform,
    /// The first is a uniform, the second a slot.
    UniformSlot,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Code {
    /// Coordinate or leaf output number `a`.
    Input,
    /// Uniform number `a`, the same for all points.
    Uniform,
    /// An operation.
    Op(Op, Mode),
}

/// One instruction; its result is known by its number. Operands that the operation lacks repeat another.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Instr {
    pub code: Code,
    pub args: [u32; 3],
}

impl Instr {
    pub(crate) fn new(code: Code, args: [u32; 3]) -> Self {
        Self { code, args }
    }

    /// Which operands are results of other instructions, as a range of operand numbers.
    #[inline(always)]
    pub(crate) fn slots(&self) -> std::ops::Range<usize> {
        match self.code {
            Code::Input | Code::Uniform => 0..0,
            Code::Op(op, Mode::Slots) => 0..op.arity(),
            Code::Op(_, Mode::SlotUniform) => 0..1,
            Code::Op(_, Mode::UniformSlot) => 1..2,
        }
    }
}

/// A value that depends on the parameters alone.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Uniform {
    Const(f64),
    Param(u32),
    Op(Op, [u32; 3]),
}

/// The part of a model that is computed once per call.
#[derive(Clone, Debug, Default)]
pub(crate) struct UniformProgram {
    pub list: Vec<Uniform>,
}

impl UniformProgram {
    /// The values at the given parameters.
    pub(crate) fn evaluate<V: Scalar>(&self, params: &[V]) -> Vec<V> {
        let mut out: Vec<V> = Vec::with_capacity(self.list.len());
        for u in &self.list {
            let v = match *u {
                Uniform::Const(c) => V::from_f64(c),
                Uniform::Param(p) => params[p as usize],
                Uniform::Op(op, [a, b, c]) => apply(op, out[a as usize], out[b as usize], out[c as usize]),
            };
            out.push(v);
        }
        out
    }

    /// The rate of change of each uniform when the parameters change at the rates `rates`.
    pub(crate) fn rates(&self, values: &[f64], rates: &[f64]) -> Vec<f64> {
        use crate::op::pull;
        let mut out: Vec<f64> = Vec::with_capacity(self.list.len());
        for (i, u) in self.list.iter().enumerate() {
            let v = match *u {
                Uniform::Const(_) => 0.0,
                Uniform::Param(p) => rates[p as usize],
                Uniform::Op(op, args) => {
                    let [a, b, _] = args.map(|s| values[s as usize]);
                    (0..op.arity())
                        .filter(|&k| out[args[k] as usize] != 0.0)
                        .map(|k| pull(op, k, out[args[k] as usize], a, b, values[i]))
                        .sum()
                }
            };
            out.push(v);
        }
        out
    }
}

/// A compiled scalar function of the coordinates and the parameters.
#[derive(Clone, Debug)]
pub struct Tape {
    pub(crate) uniforms: Arc<UniformProgram>,
    /// Constants of this tape alone; their numbers follow the uniforms'.
    pub(crate) own: Vec<f64>,
    /// In order, all used, the result last.
    pub(crate) instrs: Vec<Instr>,
    /// Number of Exp instructions of the tape that pruning started from.
    pub(crate) exps: usize,
}

impl Tape {
    /// Compiles the function `root` of the graph.
    pub fn new(graph: &Graph, root: Node) -> Tape {
        Compiler::new(graph).compile(root)
    }

    /// Number of instructions that are carried out for each point.
    pub fn len(&self) -> usize {
        self.instrs.len()
    }

    /// Whether there is nothing to compute (never: a constant is one instruction).
    pub fn is_empty(&self) -> bool {
        self.instrs.is_empty()
    }

    /// The instruction that reads input `number`.
    pub(crate) fn input(&self, number: usize) -> Option<usize> {
        self.instrs.iter().position(|i| i.code == Code::Input && i.args[0] as usize == number)
    }

    /// Whether an instruction may jump where its operands do not.
    pub(crate) fn jumps(&self) -> bool {
        use Op::{Atan2, Ceil, Choose, Floor, Less, Mod, Round};
        self.instrs
            .iter()
            .any(|i| matches!(i.code, Code::Op(Floor | Ceil | Round | Less | Choose | Mod | Atan2, _)))
    }

    /// Number of instructions that are minima, maxima or selections.
    pub fn choices(&self) -> usize {
        let choice = |i: &&Instr| matches!(i.code, Code::Op(Op::Min | Op::Max | Op::Choose, _));
        self.instrs.iter().filter(choice).count()
    }
}

/// Where a graph node went.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    Unseen,
    Uniform(u32),
    Slot(u32),
}

struct Compiler<'a> {
    graph: &'a Graph,
    /// For each node, whether it depends on an input.
    varies: Vec<bool>,
    place: Vec<Place>,
    program: UniformProgram,
    instrs: Vec<Instr>,
}

impl<'a> Compiler<'a> {
    fn new(graph: &'a Graph) -> Self {
        let mut varies: Vec<bool> = Vec::with_capacity(graph.len());
        for e in &graph.exprs {
            varies.push(match e {
                Expr::Const(_) | Expr::Param(_) => false,
                Expr::Input(_) => true,
                Expr::Op(_, args) => args.iter().any(|a| varies[a.0 as usize]),
            });
        }
        let place = vec![Place::Unseen; graph.len()];
        Self { graph, varies, place, program: UniformProgram::default(), instrs: Vec::new() }
    }

    fn compile(mut self, root: Node) -> Tape {
        // Depth first, so that a value is computed shortly before its use; an explicit stack bounds nothing.
        let mut stack = vec![(root, false)];
        while let Some((node, ready)) = stack.pop() {
            if self.place[node.0 as usize] != Place::Unseen {
                continue;
            }
            match self.graph.exprs[node.0 as usize] {
                Expr::Op(op, args) if !ready => {
                    stack.push((node, true));
                    stack.extend(args[..op.arity()].iter().rev().map(|&a| (a, false)));
                }
                e => self.place[node.0 as usize] = self.emit(node, e),
            }
        }
        let slot = self.slot(root);
        debug_assert_eq!(slot as usize + 1, self.instrs.len());
        let exps = self.instrs.iter().filter(|i| matches!(i.code, Code::Op(Op::Exp, _))).count();
        Tape { uniforms: Arc::new(self.program), own: Vec::new(), instrs: self.instrs, exps }
    }

    fn emit(&mut self, node: Node, e: Expr) -> Place {
        let place = |c: &Self, n: Node| c.place[n.0 as usize];
        if !self.varies[node.0 as usize] {
            let number = |n: Node| match place(self, n) {
                Place::Uniform(u) => u,
                _ => unreachable!("an operand of a uniform is a uniform"),
            };
            let u = match e {
                Expr::Const(bits) => Uniform::Const(f64::from_bits(bits)),
                Expr::Param(p) => Uniform::Param(p),
                Expr::Op(op, mut args) => {
                    let filler = args[0];
                    args[op.arity()..].fill(filler);
                    Uniform::Op(op, args.map(number))
                }
                Expr::Input(_) => unreachable!("an input varies"),
            };
            self.program.list.push(u);
            return Place::Uniform(self.program.list.len() as u32 - 1);
        }
        let instr = match e {
            Expr::Input(a) => Instr::new(Code::Input, [a; 3]),
            Expr::Op(op, nodes) => {
                let (a, b) = (place(self, nodes[0]), place(self, nodes[1]));
                match (op.arity(), a, b) {
                    (1, Place::Slot(a), _) => Instr::new(Code::Op(op, Mode::Slots), [a; 3]),
                    (2, Place::Slot(a), Place::Uniform(b)) if op.takes_uniform_second() => {
                        Instr::new(Code::Op(op, Mode::SlotUniform), [a, b, a])
                    }
                    (2, Place::Uniform(a), Place::Slot(b)) if op.commutes() => {
                        Instr::new(Code::Op(op, Mode::SlotUniform), [b, a, b])
                    }
                    (2, Place::Uniform(a), Place::Slot(b)) if op.takes_uniform_first() => {
                        Instr::new(Code::Op(op, Mode::UniformSlot), [a, b, b])
                    }
                    (2, Place::Slot(a), Place::Slot(b)) => Instr::new(Code::Op(op, Mode::Slots), [a, b, a]),
                    _ => {
                        let mut args = [0; 3];
                        for k in 0..op.arity() {
                            args[k] = self.slot(nodes[k]);
                        }
                        let first = args[0];
                        args[op.arity()..].fill(first);
                        Instr::new(Code::Op(op, Mode::Slots), args)
                    }
                }
            }
            Expr::Const(_) | Expr::Param(_) => unreachable!("constants and parameters do not vary"),
        };
        self.instrs.push(instr);
        Place::Slot(self.instrs.len() as u32 - 1)
    }

    /// The slot of a node, broadcasting it if it is a uniform.
    fn slot(&mut self, node: Node) -> u32 {
        match self.place[node.0 as usize] {
            Place::Slot(s) => s,
            Place::Uniform(u) => {
                self.instrs.push(Instr::new(Code::Uniform, [u; 3]));
                self.instrs.len() as u32 - 1
            }
            Place::Unseen => unreachable!("operands come first"),
        }
    }
}
