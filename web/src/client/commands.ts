/**
 * What can be done to a scene, as data. The same JSON is what scripts and logs hold: see `docs/script.schema.json`, which is made from
 * `crates/scene/src/command.rs`. Lengths are in model units, angles in radians; an empty path is the whole model.
 */

export type Vec3 = [number, number, number];

/** A pin by its number or its name. */
export type PinRef = number | string;

/** Along what a pin may give way: a line of this direction, or the plane of this normal. */
export type Along = { line: Vec3 } | { plane: Vec3 };

/** A pin and where it is dragged to. */
export interface Hand {
  pin: PinRef;
  to: Vec3;
}

/** How many floaters: by mean distance between neighbours, or about so many. */
export type Amount = { spacing: number } | { count: number };

/** What a scene is set to; what is left out has the default. */
export interface Settings {
  /** Default: `{ count: 1000 }`. */
  amount?: Amount;
  /** Seed of every random choice, default 0. */
  seed?: number;
  /** Smallest and largest corner of the box that clips the surface; found from the model if not given. */
  bounds?: [Vec3, Vec3];
  /** Part of the way to its target that a dragged pin goes in a step, above 0 to 1, default 0.4. */
  gain?: number;
  /** Longest way of a dragged pin in a step as a part of the model's diameter, above 0 to 0.25, default 0.02. */
  speed?: number;
  /** Part of the way back to the rest shape in a step, 0 to 1, default 0. */
  recovery?: number;
  /** Denser floaters around the hand: within `radius` the spacing is `factor` (0.01 to 1) of the spacing elsewhere. */
  focus?: { radius: number; factor: number };
  /** Denser floaters where the surface is curved, 0 to 1, default 0. */
  curvature?: number;
}

/** The adapters: deformations with few parameters, which a part's own parameters follow. */
export type AdapterName = 'mover' | 'rotate' | 'scale' | 'taper' | 'twist' | 'bend' | 'lattice';

export type FitLoss = 'squares' | { huber: number } | { cauchy: number } | { soft_l1: number };

export type Command =
  /** `continued`: it goes on with the last change of this parameter, as a slider does; undo takes both back. */
  | { do: 'set'; path: string; value: number; continued?: boolean }
  /** Values by path and places of pins, all at once, exactly as they come. */
  | { do: 'assign'; values?: Record<string, number>; pins?: Hand[] }
  /** `pattern`: a path in which `*` stands for anything. */
  | { do: 'freeze'; pattern: string; frozen?: boolean }
  | { do: 'limit'; pattern: string; bounds: [number | null, number | null] }
  | { do: 'scale'; pattern: string; scale: number }
  | { do: 'pin'; at: Vec3; name?: string; weight?: number; softness?: number; along?: Along; grip?: number }
  | { do: 'unpin'; pin: PinRef }
  /** Takes hold of pins, or tells where they are dragged to now; steps move them. */
  | { do: 'grab'; hands: Hand[]; radius?: number }
  | { do: 'release' }
  /** A whole drag: until the pins arrive or nothing moves any more. */
  | { do: 'drag'; hands: Hand[]; radius?: number; steps?: number }
  | { do: 'turn'; pins: PinRef[]; centre: Vec3; rotation?: Vec3; translation?: Vec3; steps?: number }
  | { do: 'step'; count?: number }
  | { do: 'fit'; points: Vec3[]; weights?: number[]; loss?: FitLoss; iterations?: number }
  /** The present shape becomes the one to which `recovery` leads back. */
  | { do: 'rest' }
  | { do: 'settings'; settings: Settings }
  /** Another operand of the operator at a path, or the union of the node there and the part. `model`: a formula or `.iso.json`. */
  | { do: 'add'; path?: string; model: string; name?: string }
  | { do: 'replace'; path?: string; model: string }
  | { do: 'remove'; path: string }
  /** Leaves a part out of the operator above it, or (`hidden: false`) takes it in again; its parameters stay. */
  | { do: 'hide'; path: string; hidden?: boolean }
  | { do: 'wrap'; path?: string; kind: string; parameters?: Record<string, number>; name?: string }
  | { do: 'unwrap'; path: string }
  | { do: 'reorder'; path?: string; order: number[] }
  /** Gives a node a name (letters, digits and `_`); an empty one takes it away. */
  | { do: 'rename'; path?: string; name: string }
  /** A copy beside a node, with parameters of its own. */
  | { do: 'duplicate'; path?: string; name?: string }
  /** Several as one: undone together, and none is done if one fails. Not undo, redo or another of these. */
  | { do: 'together'; commands: Command[] }
  /** Puts an adapter on a part. */
  | {
      do: 'adapt';
      path?: string;
      adapter: AdapterName;
      center?: Vec3;
      axis?: 0 | 1 | 2;
      half?: Vec3;
      controls?: Vec3;
    }
  /** Takes the adapter off; the part keeps what its parameters could take on. */
  | { do: 'accept' }
  /** Leaves the adapter in the model as an operator. */
  | { do: 'keep' }
  /** Takes the adapter off; the part is as it was. */
  | { do: 'cancel' }
  /** Takes an operator off its only operand, whose parameters take its effect on. */
  | { do: 'flatten'; path: string }
  | { do: 'undo' }
  | { do: 'redo' };

/** How a drag went or goes; lengths in model units. */
export interface DragReport {
  reached: boolean;
  ending: 'reached' | 'stuck' | 'step limit' | 'released' | 'cancelled' | 'held';
  /** Largest distance between a dragged pin and where it should be. */
  distance: number;
  /** Pins that the parameters can meet independently of each other, of `pins`. Fewer: some pin cannot follow. */
  rank: number;
  pins: number;
  /** Largest distance between a pin and the surface. */
  residual: number;
  /** How far each dragged pin has slipped over the surface instead of moving it. */
  slip: { pin: number; by: Vec3 }[];
  steps: number;
  /** Paths of the parameters that their bounds hold back. */
  at_limit: string[];
}

export interface FitReport {
  converged: boolean;
  reason: string;
  rms: number;
  largest: number;
  /** Points that were left out: of weight 0, or where F has no gradient. */
  skipped: number;
  rank: number;
  freedom: number;
  iterations: number;
  at_limit: string[];
}

/** How well a part takes on the effect of an adapter. */
export interface TransferReport {
  rms: number;
  largest: number;
  /** The largest distance as a part of the size. */
  relative: number;
  rank: number;
  freedom: number;
  at_limit: string[];
}

/** What a command did. */
export interface Change {
  /** The tree is another one. */
  model: boolean;
  /** Values or settings of parameters have changed. */
  parameters: boolean;
  /** The number of the pin that was made. */
  pin: number | null;
  /** The numbers of the pins that were taken away, for the surface is not where they are any more. */
  lost: number[];
  drag: DragReport | null;
  fit: FitReport | null;
  transfer: TransferReport | null;
}
