import { describe, expect, it } from 'vitest';
import type { Command } from '../../src/client/protocol.ts';
import { inForce } from '../../src/client/tail.ts';

const set = (value: number, continued = false): Command => ({ do: 'set', path: 'sphere/r', value, continued });
const undo: Command = { do: 'undo' };
const redo: Command = { do: 'redo' };

describe('commands in force', () => {
  it('are those that undo has left', () => {
    expect(inForce([set(1), set(2), undo])).toEqual([set(1)]);
    expect(inForce([set(1), set(2), undo, undo, redo])).toEqual([set(1)]);
    expect(inForce([set(1), undo, redo, set(3)])).toEqual([set(1), set(3)]);
  });

  it('have a slider taken back whole', () => {
    const slide = [set(1), set(2, true), set(3, true)];
    expect(inForce([set(9), ...slide.slice(0, 1), set(2, true), undo])).toEqual([set(9)]);
    expect(inForce([...slide, undo, redo])).toEqual(slide);
  });

  it('forget what was undone after another command', () => {
    expect(inForce([set(1), undo, set(2), redo])).toEqual([set(2)]);
  });

  it('do not go back beyond the first', () => {
    expect(inForce([undo, set(1), undo, undo])).toEqual([]);
  });
});
