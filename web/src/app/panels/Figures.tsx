/** The quiet strip below: time, and how the floaters are. */
import { open } from '../state/files.ts';
import { type Sample, samples } from '../state/history.ts';
import { alive, evenness, frame, playing, setPlaying, stepOnce } from '../state/session.ts';
import { IconButton } from '../ui/controls.tsx';
import { format } from '../ui/NumberField.tsx';
import { Sparkline } from './Sparkline.tsx';

export function Figures() {
  const list = samples.value;
  // Looked at with each sample, not with each frame.
  const now = frame.peek();
  const last = list.at(-1);
  const even = evenness.value;
  const series = (key: keyof Sample) => list.map(s => s[key]);
  return (
    <>
      <Transport />
      <dl class="figures-list">
        <Figure name="Floaters" value={now ? now.count.toLocaleString('en') : '–'} line={series('floaters')} />
        <Figure name="Steps a second" value={alive.value ? Math.round(last?.steps ?? 0).toLocaleString('en') : 'at rest'} line={series('steps')} zero />
        <Figure
          name="Evenness"
          title="Variation of the distances to the nearest neighbour: 0 is perfectly even, below 0.05 very even."
          value={even ? format(even.cv, 2) : '–'}
        />
        <Figure
          name="Off the surface"
          title="Largest distance of a floater from the surface at the beginning of the last step (model units)."
          value={last ? format(last.off, 2) : '–'}
          line={series('off')}
          zero
        />
        <Figure name="Births" value={String(last?.births ?? 0)} line={series('births')} zero />
        <Figure name="Deaths" value={String(last?.deaths ?? 0)} line={series('deaths')} zero />
      </dl>
    </>
  );
}

export function Transport() {
  return (
    <div class="transport" role="group" aria-label="Time">
      <IconButton
        icon={playing.value ? 'pause' : 'play'}
        label={playing.value ? 'Pause' : 'Let time pass'}
        keys="Space"
        onClick={() => setPlaying(!playing.value)}
      />
      <IconButton icon="step" label="One step" keys="." onClick={() => void stepOnce()} />
      <IconButton icon="restart" label="Start again from how the scene was opened" onClick={() => void open.again()} />
    </div>
  );
}

function Figure({ name, value, line, zero, title }: { name: string; value: string; line?: number[]; zero?: boolean; title?: string }) {
  return (
    <div class="figure" title={title}>
      <dt>{name}</dt>
      <dd>{value}</dd>
      {line && <Sparkline values={line} zero={zero ?? false} />}
    </div>
  );
}
