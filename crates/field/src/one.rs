//! The two sweeps over a program of registers, one number at a time and without a loop for each operation: little
//! code, where that counts for more than time. The same bits as [`crate::eval`], which does it in blocks.

use crate::op::{apply, pull};
use crate::program::Program;
use crate::scalar::Scalar;
use crate::tape::{Code, Mode};

/// The values of the first two operands: registers or uniforms.
fn operands<V: Scalar>(
    program: &Program,
    uniforms: &[V],
    registers: &[V],
    mode: Mode,
    args: [u32; 3],
) -> [V; 2] {
    let slot = |k: usize| registers[args[k] as usize];
    let uniform = |k: usize| program.uniform(uniforms, args[k]);
    match mode {
        Mode::Slots => [slot(0), slot(1)],
        Mode::SlotUniform => [slot(0), uniform(1)],
        Mode::UniformSlot => [uniform(0), slot(1)],
    }
}

/// The forward sweep; `inputs[k]` is coordinate k. The result is in register `root`.
pub(crate) fn forward<V: Scalar>(program: &Program, uniforms: &[V], inputs: &[V], registers: &mut [V]) {
    for step in &program.forward {
        registers[step.out as usize] = match step.code {
            Code::Input => inputs[step.args[0] as usize],
            Code::Uniform => program.uniform(uniforms, step.args[0]),
            Code::Op(op, mode) => {
                let [a, b] = operands(program, uniforms, registers, mode, step.args);
                let c = if op.arity() == 3 { registers[step.args[2] as usize] } else { b };
                apply(op, a, b, c)
            }
        };
    }
}

/// The reverse sweep, after [`forward`]: leaves ∂F/∂x in the registers `input_adjoints`.
pub(crate) fn reverse<V: Scalar>(program: &Program, uniforms: &[V], registers: &[V], adjoints: &mut [V]) {
    adjoints[program.root_adjoint as usize] = V::from_f64(1.0);
    for back in &program.backward {
        let Code::Op(op, mode) = back.code else { continue };
        let r = registers[back.value as usize];
        let [a, b] = operands(program, uniforms, registers, mode, back.args);
        for k in (0..3).rev().filter(|k| back.skip & (1 << k) == 0) {
            let (g, target) = (adjoints[back.adjoint as usize], &mut adjoints[back.adjoints[k] as usize]);
            let share = pull(op, k, g, a, b, r);
            *target = if back.fresh & (1 << k) != 0 { share } else { *target + share };
        }
    }
}
