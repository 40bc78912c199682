/**
 * The messages between a page and the worker that runs the core. A request has a name and an id; the reply has the same id.
 * Arrays are transferred, never copied. See `client.ts` for the class that speaks this protocol.
 */
import type { AdapterName, Along, Change, Command, DragReport, Hand, Settings, TransferReport, Vec3 } from './commands.js';

export type * from './commands.js';

/** What a scene is opened from. */
export interface Source {
  /** A formula such as `sphere(1) | box(1, 1, 1)`, or the text of an `.iso.json` file (a model or a scene). */
  text: string;
  /** Values of free-standing parameters of a formula; the others are 1. */
  parameters?: Record<string, number>;
  /** Settings of a model; a scene has its own. */
  settings?: Settings;
  /** A script (its text) to carry out after opening. */
  script?: string;
  /** Floaters to begin with, 3 numbers each, as `Saved` has them; those near the surface stay. */
  points?: Float64Array;
}

/** Columns of a frame that a page asks for beside positions, normals, radii and ids. */
export type Column = 'curvature' | 'error' | 'exact' | 'faces';
/** All columns. */
export type ColumnName = Column | 'positions' | 'normals' | 'radii' | 'ids' | 'values';

/** What there is to draw: one floater a row. Positions are model coordinates; arrays belong to whoever holds the frame. */
export interface Frame {
  /** Steps since the scene was made. */
  clock: number;
  /** Floaters. */
  count: number;
  /** 3 a floater. */
  positions: Float32Array;
  /** Unit normals, 3 a floater; they point out of the solid. */
  normals: Float32Array;
  /** Repulsion radii (model units). A disc drawn with this radius touches its neighbours. */
  radii: Float32Array;
  /** Identities: never used twice in a scene (they wrap after 2³²). */
  ids: Uint32Array;
  /** Mean curvature (1/length), if asked for; above 0 where the surface is convex. */
  curvature?: Float32Array;
  /** |F|/|∇F|, distance off the surface (model units), if asked for. */
  error?: Float32Array;
  /** Positions to the last bit, if asked for (`exact`). */
  exact?: Float64Array;
  /** Triangles over the floaters, 3 row numbers each, counter-clockwise seen from outside, if asked for: a mesh that follows them. */
  faces?: Uint32Array;
  /** Values of the parameters, in the order of `SceneState.parameters`. */
  values: Float64Array;
  pins: PinState[];
  /** Mean distance between neighbours that is aimed at. */
  spacing: number;
  /** Diagonal of the box around the floaters. */
  size: number;
  /** The box that clips the surface. */
  bounds: [Vec3, Vec3];
  /** Whether pins or parameters are still on their way. */
  moving: boolean;
  /** The drag under way. */
  drag: DragReport | null;
  /** How well the part takes on the adapter that is on. */
  transfer: TransferReport | null;
  /** Where it went. */
  stats: StepStats;
}

export interface StepStats {
  /** Steps that this frame took, and the time they took (ms). */
  steps: number;
  stepMs: number;
  /** Floaters that came and went in these steps. */
  births: number;
  deaths: number;
  /** Largest |F|/|∇F| at the beginning of the last step (model units). */
  off: number;
  /** Bytes of the core's memory. */
  memory: number;
}

export interface PinState {
  id: number;
  name: string | null;
  at: Vec3;
  weight: number;
  softness: number;
  along: Along | null;
  grip: number | null;
  /** Distance from the surface (model units). */
  residual: number;
  held: boolean;
  /** How far it has slipped in the drag under way. */
  slip: Vec3 | null;
}

export interface ParameterState {
  path: string;
  /** Name within its node. */
  name: string;
  value: number;
  frozen: boolean;
  /** Whole numbers that are no part of q. */
  discrete: boolean;
  /** null: no bound. */
  bounds: [number | null, number | null];
  /** A typical change. */
  scale: number;
  /** `length`, `angle` (radians), `angle/length`, `1/length`, `value`, `index` or ``. */
  unit: string;
  /** What it means. */
  doc: string;
  /** A range for a slider: the bounds where both are finite, else around the present value by scale and model size. */
  slider: [number, number];
}

export interface NodeState {
  /** Where it is; unique. */
  path: string;
  kind: string;
  /** Its own name, if it has one. */
  name: string | null;
  category: Category;
  /** Nodes on the way from the root. */
  level: number;
  /** Number of its operands. */
  operands: number;
  /** Left out of the operator above. */
  hidden: boolean;
  /** Index in `SceneState.nodes` of the node above; -1 at the root. */
  parent: number;
  /** Place among the operands of the node above. */
  place: number;
  /** Indices in `SceneState.parameters` of its own parameters. */
  parameters: number[];
  /** A formula for it. */
  text: string;
}

/** All of a scene but its floaters. */
export interface SceneState {
  clock: number;
  /** Each before its operands, in the order of the parameters. */
  nodes: NodeState[];
  parameters: ParameterState[];
  pins: PinState[];
  settings: Settings;
  /** Commands that can be undone and redone. */
  undo: number;
  redo: number;
  held: boolean;
  /** The adapter that is on: the node's path and how well the part follows. */
  adapter: { path: string; transfer: TransferReport } | null;
  /** The model as a formula; null where it cannot be written as one. */
  formula: string | null;
  /** 3, or 2 for a plane curve. */
  axes: number;
  bounds: [Vec3, Vec3];
  spacing: number;
  size: number;
}

export type Category = 'atom' | 'formula' | 'shape' | 'operator' | 'deformation' | 'structure';

export interface ParamSpec {
  name: string;
  default: number;
  unit: string;
  bounds: [number | null, number | null];
  discrete: boolean;
  frozen: boolean;
  doc: string;
}

/** A row of the table of kinds: what there is to add. See docs/kinds.md. */
export interface Kind {
  name: string;
  aliases: string[];
  category: Category;
  doc: string;
  formula: string;
  params: ParamSpec[];
  group: ParamSpec[];
  layout: 'fixed' | 'groups' | 'monomials' | 'own' | 'function';
  operands: { exactly: number } | { at_least: number };
  payload: 'none' | 'number' | 'exponents' | 'expression' | 'program' | 'callback';
}

/** An adapter that there is. */
export interface AdapterKind {
  name: AdapterName;
  doc: string;
}

/** Where a ray meets the surface. */
export interface Hit {
  at: Vec3;
  normal: Vec3;
  /** Along the ray, in lengths of its direction. */
  t: number;
}

/** The model where it is: a piece of text that can be saved. */
export interface Saved {
  /** An `.iso.json` file, exact to the last bit, with the adapter that is on. */
  scene: string;
  /** What has been done since opening, as a script. */
  log: string;
  /** The floaters, 3 numbers each: they are no part of a file. */
  points: Float64Array;
}

/** How evenly the floaters lie: see docs/theory/metrics.md. */
export interface Evenness {
  rho_min: number;
  rho_avg: number;
  /** Coefficient of variation of the distances to the nearest neighbour. */
  cv: number;
  six_valent: number;
  coverage: number;
  /** Root mean square and largest |F|/|∇F| (model units). */
  error_rms: number;
  error_max: number;
}

export type PointFormat = 'ply' | 'obj' | 'csv' | 'npz';
export type MeshFormat = 'ply' | 'obj' | 'stl' | 'glb' | '3mf' | 'vtp' | 'npz';

/** Triangles, counter-clockwise seen from outside. */
export interface MeshData {
  positions: Float32Array;
  normals: Float32Array;
  indices: Uint32Array;
  closed: boolean;
  /** What the mesher says of it, in a sentence. */
  report: string;
}

/** Time or steps, whichever ends first. */
export interface Budget {
  /** Most steps, default 1; 0 for a frame of what is there. */
  steps?: number;
  /** Milliseconds after which no further step begins, default without end. */
  ms?: number;
}

/** The requests, by name: what goes in and what comes out. */
export interface Requests {
  /** A new scene; the old one stays where it fails. */
  open: [Source, SceneState];
  /** Carries a command out; on an error the scene is as it was. */
  apply: [{ command: Command }, { change: Change; state: SceneState }];
  /**
   * Lets time pass and gives a frame. `hands`: where held pins are dragged to now (those that are not held are taken hold of);
   * an empty list lets go.
   */
  advance: [Budget & { hands?: Hand[]; radius?: number; columns?: Column[] }, Frame];
  state: [Record<string, never>, SceneState];
  kinds: [Record<string, never>, Kind[]];
  adapters: [Record<string, never>, AdapterKind[]];
  /** Where a ray first meets the surface; null where it does not. The direction need not have length 1. */
  pick: [{ origin: Vec3; direction: Vec3 }, Hit | null];
  /** The nearest point of the surface. */
  project: [{ point: Vec3 }, Hit | null];
  /** Whether a formula or a model file can be read, and the model's size; the error says where it cannot. */
  check: [{ text: string; parameters?: Record<string, number> }, { formula: string | null; parameters: number }];
  /** The part at a path (empty: the whole) as the text of a model file: what `add` and `replace` take. */
  part: [{ path: string }, string];
  /** The box around a part as it is before the operators above it; null where none is found. */
  box: [{ path: string }, [Vec3, Vec3] | null];
  save: [Record<string, never>, Saved];
  evenness: [Record<string, never>, Evenness];
  /** The floaters as a file. */
  exportPoints: [{ format: PointFormat }, ArrayBuffer];
  /** Triangles; a long job, in a worker of its own. */
  mesh: [{ spacing?: number }, MeshData];
  exportMesh: [{ format: MeshFormat; spacing?: number }, ArrayBuffer];
  /** Even samples as a file; a long job, in a worker of its own. */
  exportSamples: [{ format: PointFormat; count?: number }, ArrayBuffer];
  /** For tests: makes the core panic, run out of memory or never come back. */
  provoke: [{ what: 'panic' | 'memory' | 'hang' }, null];
}

export type RequestName = keyof Requests;
export type Input<N extends RequestName> = Requests[N][0];
export type Output<N extends RequestName> = Requests[N][1];

/** What went wrong, as a value. */
export interface Failure {
  /**
   * `input`: what was asked makes no sense, and the scene is as it was. `vanished`: no surface would be left. `memory`: more than the
   * limit. `stopped`: the core stopped (a defect); the worker is started again from what was last saved. `cancelled`.
   * `protocol`: a message that is none.
   */
  kind: 'input' | 'vanished' | 'memory' | 'stopped' | 'cancelled' | 'protocol';
  /** A sentence for people. */
  message: string;
  /** Where in a formula, from 0, if known. */
  position?: number;
}

export interface Progress {
  done: number;
  /** 0: unknown. */
  of: number;
  /** What remains, in model units, where something is dragged. */
  remaining: number;
}

/** A WebAssembly module: compiled, its bytes or its address. */
export type Wasm = WebAssembly.Module | BufferSource | string;

/** To the worker. */
export type ToWorker =
  /** `full`: whether the module has meshes and files too. */
  | { type: 'start'; wasm: Wasm; full: boolean; memoryLimit: number; cancel?: SharedArrayBuffer }
  /** The module that has them, once it was asked for, or why there is none. */
  | { type: 'full'; wasm: Wasm | Failure }
  | { type: 'request'; id: number; name: RequestName; input: unknown };

/** From the worker. */
export type FromWorker =
  | { type: 'ready'; version: string }
  /** What was asked for needs the module that has meshes and files. */
  | { type: 'wants' }
  | { type: 'reply'; id: number; name: RequestName; value: unknown }
  | { type: 'failure'; id: number; failure: Failure }
  | { type: 'progress'; id: number; progress: Progress };
