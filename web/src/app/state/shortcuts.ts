/** Keys, and what they do: one table for the page and for the help sheet. */
import { toggleSection } from '../viewport/cut.ts';
import type { Move } from '../viewport/eye.ts';
import { showChosen } from '../viewport/showChosen.ts';
import { stage } from '../viewport/Viewport.tsx';
import { deletePins, startAdapter } from './actions.ts';
import { open, saveFile } from './files.ts';
import { apply, pins, playing, redo, scene, setPlaying, stepOnce, undo } from './session.ts';
import { chosen, chosenPins, dialog, sheet, tool } from './ui.ts';
import { type Mode, setView, view } from './view.ts';

interface Shortcut {
  keys: string;
  group: string;
  label: string;
  run: () => void;
  /** `event.key` in lower case; with `ctrl` it needs Ctrl or Command. */
  key: string;
  ctrl?: boolean;
  shift?: boolean;
  /** Other values of `event.key` that do the same. */
  also?: readonly string[];
}

/** What a key turns the camera by (radians), and how much nearer it brings it. */
const TURN = Math.PI / 24;
const NEARER = 1.15;

const mode = (m: Mode) => () => setView({ mode: m });
const deform = (adapter: Parameters<typeof startAdapter>[1]) => () => void startAdapter(chosen.value ?? '', adapter);

const look = (by: Move) => () => stage.value?.eye.move(by);

export const SHORTCUTS: readonly Shortcut[] = [
  { group: 'Scene', keys: 'Ctrl Z', key: 'z', ctrl: true, label: 'undo', run: () => void undo() },
  { group: 'Scene', keys: 'Ctrl Shift Z', key: 'z', ctrl: true, shift: true, label: 'redo', run: () => void redo() },
  { group: 'Scene', keys: 'Ctrl S', key: 's', ctrl: true, label: 'save as a file', run: () => void saveFile() },
  { group: 'Scene', keys: 'Ctrl O', key: 'o', ctrl: true, label: 'open a file', run: () => document.getElementById('open-file')?.click() },
  { group: 'Scene', keys: 'G', key: 'g', label: 'gallery', run: () => (dialog.value = 'gallery') },
  { group: 'Scene', keys: 'A', key: 'a', label: 'add a shape', run: () => (dialog.value = 'add') },
  { group: 'Scene', keys: 'W', key: 'w', label: 'put into an operator', run: () => (dialog.value = 'wrap') },
  { group: 'Time', keys: 'Space', key: ' ', label: 'pause, or go on', run: () => setPlaying(!playing.value) },
  { group: 'Time', keys: '.', key: '.', label: 'one step', run: () => void stepOnce() },
  { group: 'Time', keys: 'Shift R', key: 'r', shift: true, label: 'start again', run: () => void open.again() },
  { group: 'Look', keys: 'F', key: 'f', label: 'show all', run: () => stage.value?.fit() },
  { group: 'Look', keys: 'Shift F', key: 'f', shift: true, label: 'show what is chosen', run: () => void showChosen() },
  { group: 'Look', keys: '←', key: 'arrowleft', label: 'go around to the left', run: look({ right: -TURN }) },
  { group: 'Look', keys: '→', key: 'arrowright', label: 'to the right', run: look({ right: TURN }) },
  { group: 'Look', keys: '↑', key: 'arrowup', label: 'up', run: look({ up: TURN }) },
  { group: 'Look', keys: '↓', key: 'arrowdown', label: 'down', run: look({ up: -TURN }) },
  { group: 'Look', keys: '+', key: '+', also: ['='], label: 'nearer', run: look({ nearer: NEARER }) },
  { group: 'Look', keys: '-', key: '-', also: ['_'], label: 'farther', run: look({ nearer: 1 / NEARER }) },
  { group: 'Look', keys: '1', key: '1', label: 'discs', run: mode('discs') },
  { group: 'Look', keys: '2', key: '2', label: 'points', run: mode('points') },
  { group: 'Look', keys: '3', key: '3', label: 'mesh', run: mode('mesh') },
  { group: 'Look', keys: 'O', key: 'o', label: 'orthographic', run: () => setView({ orthographic: !view.value.orthographic }) },
  { group: 'Look', keys: 'X', key: 'x', label: 'section plane', run: toggleSection },
  { group: 'Look', keys: '\\', key: '\\', label: 'panels away, or back', run: togglePanels },
  { group: 'Tools', keys: 'P', key: 'p', label: 'set pins', run: () => (tool.value = 'pin') },
  { group: 'Tools', keys: 'L', key: 'l', label: 'look only', run: () => (tool.value = 'look') },
  { group: 'Tools', keys: 'M', key: 'm', label: 'move the chosen part', run: deform('mover') },
  { group: 'Tools', keys: 'R', key: 'r', label: 'turn it', run: deform('rotate') },
  { group: 'Tools', keys: 'S', key: 's', label: 'scale it', run: deform('scale') },
  { group: 'Tools', keys: 'T', key: 't', label: 'twist it', run: deform('twist') },
  { group: 'Tools', keys: 'B', key: 'b', label: 'bend it', run: deform('bend') },
  { group: 'Tools', keys: 'Y', key: 'y', label: 'taper it', run: deform('taper') },
  { group: 'Tools', keys: 'Enter', key: 'enter', label: 'accept the deformation', run: () => scene.value?.adapter && void apply({ do: 'accept' }) },
  { group: 'Tools', keys: 'Del', key: 'delete', label: 'remove the chosen pins', run: () => void deletePins([...chosenPins.value]) },
  { group: 'Tools', keys: 'Esc', key: 'escape', label: 'cancel, or choose nothing', run: escape },
  { group: 'Help', keys: '?', key: '?', label: 'this sheet', run: () => (dialog.value = 'help') },
];

function togglePanels(): void {
  const on = view.value.tree || view.value.inspector;
  setView({ tree: !on, inspector: !on, figures: !on });
}

function escape(): void {
  if (sheet.value) sheet.value = null;
  else if (scene.value?.adapter) void apply({ do: 'cancel' });
  else if (pins.value.length > 0) chosenPins.value = new Set();
}

/** Listens for keys where nobody types and no dialog is open. */
export function listenForKeys(): void {
  addEventListener('keydown', event => {
    const target = event.target as HTMLElement;
    const typing = target.matches('input:not([type=range]):not([type=checkbox]), textarea, select');
    if (dialog.value || (typing && !event.ctrlKey && !event.metaKey)) return;
    const key = event.key.toLowerCase();
    if ((key === ' ' || key === 'enter') && target.closest('button, [role=button], [role=treeitem], a')) return;
    // Widgets that arrows move in keep them.
    if (key.startsWith('arrow') && target.closest('input, [role=tree], [role=menu], [role=radiogroup], [role=tablist], [role=slider]')) return;
    const ctrl = event.ctrlKey || event.metaKey;
    if (typing && key === 'z') return;
    const all = SHORTCUTS.filter(s => (s.key === key || s.also?.includes(key)) && Boolean(s.ctrl) === ctrl);
    const found = all.find(s => Boolean(s.shift) === event.shiftKey) ?? all.find(s => !s.shift && !/[a-z]/.test(s.key));
    if (!found || event.altKey) return;
    event.preventDefault();
    found.run();
  });
}
