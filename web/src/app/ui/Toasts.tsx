import { hush, job, toasts } from '../state/ui.ts';
import { Button, IconButton } from './controls.tsx';
import { Icon } from './Icon.tsx';

/** Sentences for the person, each with a way on where there is one. */
export function Toasts() {
  return (
    <div class="toasts">
      <JobBar />
      <div role="status" aria-live="polite" class="toast-list">
        {toasts.value.map(t => (
          <div key={t.id} class={`toast ${t.tone}`} role={t.tone === 'warn' ? 'alert' : undefined}>
            {t.tone === 'warn' && <Icon name="warning" size={18} />}
            {t.tone === 'good' && <Icon name="check" size={18} />}
            <p>{t.text}</p>
            {t.action && (
              <Button
                onClick={() => {
                  hush(t.id);
                  t.action!.run();
                }}
              >
                {t.action.label}
              </Button>
            )}
            <IconButton small icon="close" label="Close this note" onClick={() => hush(t.id)} />
          </div>
        ))}
      </div>
    </div>
  );
}

function JobBar() {
  const now = job.value;
  if (!now) return null;
  return (
    <div class="job" role="group" aria-label={now.title}>
      <p>{now.title}…</p>
      <progress aria-label={now.title} {...(now.done === null ? {} : { value: now.done, max: 1 })} />
      <Button onClick={now.cancel}>Cancel</Button>
    </div>
  );
}
