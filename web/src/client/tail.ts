/** Commands that the last saved scene has not got yet. */
import type { Command } from './protocol.js';

/** Whether undo takes a command back together with the one before it. */
function goesOn(command: Command, before: Command | undefined): boolean {
  return command.do === 'set' && command.continued === true && before?.do === 'set' && before.path === command.path;
}

/** What undo takes back at once: a command, or a slider's many. */
function last(commands: Command[]): Command[] {
  let from = commands.length - 1;
  while (from > 0 && goesOn(commands[from]!, commands[from - 1])) from--;
  return commands.splice(Math.max(from, 0));
}

/**
 * The commands that are in force after all of these, for a scene whose own undo begins anew: undo takes the last away, redo
 * brings it back. What would go back beyond the first is left out.
 */
export function inForce(commands: readonly Command[]): Command[] {
  const done: Command[] = [];
  const undone: Command[][] = [];
  for (const command of commands) {
    if (command.do === 'undo') {
      if (done.length > 0) undone.push(last(done));
    } else if (command.do === 'redo') {
      done.push(...(undone.pop() ?? []));
    } else {
      done.push(command);
      undone.length = 0;
    }
  }
  return done;
}
