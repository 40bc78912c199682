/** Changes as often as a slider moves: only the last one counts, and those of one pull are one step of undo. */
import type { Command } from '../../client/protocol.ts';
import { adopt, ask, complain, poke } from './session.ts';

interface Wish {
  command: Command;
  /** Which pull it belongs to. */
  pull: number;
}

let wish: Wish | null = null;
let busy = false;
let pull = 0;
/** The pull that the last step of undo belongs to. */
let settled = -1;

/** Carries a command out as soon as the last one is done; those in between are left out. */
export function sendLatest(command: Command): void {
  wish = { command, pull };
  if (!busy) void carryOut();
}

/** The hand has let go: what comes now is another step of undo. */
export function endGesture(): void {
  pull++;
}

async function carryOut(): Promise<void> {
  busy = true;
  while (wish) {
    const now: Wish = wish;
    wish = null;
    const goesOn = settled === now.pull;
    const continued = goesOn && now.command.do === 'set';
    const command: Command = now.command.do === 'set' && goesOn ? { ...now.command, continued } : now.command;
    // What the core cannot continue is undone and done anew, without a frame between.
    const undone = goesOn && !continued ? ask('apply', { command: { do: 'undo' } }) : null;
    const done = ask('apply', { command });
    try {
      await undone;
      adopt((await done).state);
      settled = now.pull;
    } catch (error) {
      wish = null;
      settled = -1;
      if (undone) adopt((await ask('apply', { command: { do: 'redo' } })).state);
      complain(error);
      poke();
    }
  }
  busy = false;
}
