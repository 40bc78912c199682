import { useState } from 'preact/hooks';
import type { PinState } from '../../client/protocol.ts';
import { deletePins, weighPin } from '../state/actions.ts';
import { frame, hands, pins, scene } from '../state/session.ts';
import { chosenPins, lockedPins, toggle } from '../state/ui.ts';
import { IconButton, Slider } from '../ui/controls.tsx';
import { format } from '../ui/NumberField.tsx';
import { Fold } from './Inspector.tsx';

/** All pins: choose, lock, weigh, delete. */
export function PinList() {
  const list = pins.value;
  const tools = list.length > 0 && (
    <IconButton small icon="trash" label="Remove all pins" onClick={() => void deletePins(list.map(p => p.id))} />
  );
  return (
    <Fold title="Pins" {...(list.length > 0 ? { note: String(list.length) } : {})} tools={tools}>
      {list.length === 0 ? (
        <p class="quiet">Click the surface to set a pin, then drag it: the parameters follow.</p>
      ) : (
        <ul class="pin-list">
          {list.map(p => (
            <PinRow key={p.id} pin={p} />
          ))}
        </ul>
      )}
      <CannotFollow />
    </Fold>
  );
}

function PinRow({ pin }: { pin: PinState }) {
  const chosen = chosenPins.value.has(pin.id);
  const locked = lockedPins.value.has(pin.id);
  const [preview, setPreview] = useState<number | null>(null);
  const weight = preview ?? pin.weight;
  const name = pin.name ?? `Pin ${pin.id + 1}`;
  return (
    <li class={chosen ? 'pin-row chosen' : 'pin-row'}>
      <div class="pin-line">
        <button
          type="button"
          class="pin-name"
          aria-pressed={chosen}
          onClick={event => {
            chosenPins.value = event.shiftKey ? toggle(chosenPins.value, pin.id) : new Set([pin.id]);
          }}
        >
          <i class={locked ? 'dot locked' : 'dot'} />
          {name}
        </button>
        <span class="pin-place">{pin.at.map(v => format(v, 3)).join(', ')}</span>
        <IconButton
          small
          icon={locked ? 'lock' : 'unlock'}
          label={locked ? `Unlock ${name}` : `Lock ${name}: the hand does not move it`}
          pressed={locked}
          onClick={() => {
            lockedPins.value = toggle(lockedPins.value, pin.id);
          }}
        />
        <IconButton small icon="trash" label={`Remove ${name}`} onClick={() => void deletePins([pin.id])} />
      </div>
      {chosen && (
        <div class="pin-weight">
          <span>Weight</span>
          <Slider
            label={`Weight of ${name}`}
            value={weight}
            range={[0.1, 10]}
            log
            onInput={w => setPreview(Number(w.toPrecision(2)))}
            onDone={() => {
              setPreview(null);
              void weighPin(pin, weight);
            }}
          />
          <output>{format(weight, 2)}</output>
        </div>
      )}
    </li>
  );
}

/** Why a pin stays behind, while it is dragged. */
function CannotFollow() {
  const drag = frame.value?.drag;
  const size = scene.value?.size ?? 1;
  if (!drag || hands.value.length === 0 || drag.distance < 0.02 * size) return null;
  const why =
    drag.at_limit.length > 0
      ? `held back by the bounds of ${drag.at_limit.slice(0, 3).join(', ')}`
      : drag.rank < drag.pins
        ? `only ${drag.rank} of ${drag.pins} pins can move independently`
        : 'the free parameters do not allow it';
  return (
    <p class="quiet warn" role="status">
      The pin is {format(drag.distance, 2)} behind the hand: {why}.
    </p>
  );
}
