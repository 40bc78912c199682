/** What a notebook and the Studio in it tell each other. Either side sends what has changed there; the last one counts. */

/** A pin as both sides know it. */
export interface SharedPin {
  id: number;
  name: string | null;
  at: [number, number, number];
}

/** A scene, as it is shared. */
export interface Shared {
  /** The text of an `.iso.json` file. */
  document: string;
  /** Values of the parameters by path. */
  values: Record<string, number>;
  pins: SharedPin[];
}

/** From the notebook to the Studio. */
export type ToStudio =
  /** Another scene. */
  | { type: 'isoswarm-open'; document: string }
  /** The same model, other values and places of pins. */
  | { type: 'isoswarm-assign'; values: Record<string, number>; pins: SharedPin[] };

/** From the Studio to the notebook. */
export type FromStudio = { type: 'isoswarm-ready' } | ({ type: 'isoswarm-changed' } & Shared);
