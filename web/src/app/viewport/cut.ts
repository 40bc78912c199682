/** The section plane, so that what is near is cut away. */
import { section } from '../state/view.ts';
import { stage } from './Viewport.tsx';

/** Cuts across an axis; the half that is nearer to the camera goes. */
export function cutAcross(axis: 0 | 1 | 2): void {
  const on = stage.value;
  const side = on ? on.eye.camera.position.getComponent(axis) - on.eye.controls.target.getComponent(axis) : 1;
  section.value = { ...section.value, on: true, axis, flipped: side < 0 };
}

export function toggleSection(): void {
  if (section.value.on) section.value = { ...section.value, on: false };
  else cutAcross(section.value.axis);
}
