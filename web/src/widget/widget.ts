/** The notebook's side: an anywidget whose view is the Studio in a frame of its own. */
import studio from 'virtual:studio';
import type { FromStudio, SharedPin, ToStudio } from './messages.js';

/** What anywidget gives: see https://anywidget.dev/en/afm. */
interface Model {
  get(name: string): unknown;
  set(name: string, value: unknown): void;
  save_changes(): void;
  on(event: string, handler: () => void): void;
  off(event: string, handler: () => void): void;
}

/** Shows the Studio in `el`; what comes back takes it away again. */
function render({ model, el }: { model: Model; el: HTMLElement }): () => void {
  const frame = document.createElement('iframe');
  frame.title = 'isoswarm Studio';
  frame.style.cssText = `display:block;width:100%;height:${Number(model.get('height')) || 600}px;border:0;border-radius:8px`;
  frame.srcdoc = studio.replace('<html', '<html data-embedded="true"');
  const send = (message: ToStudio) => frame.contentWindow?.postMessage(message, '*');
  const open = () => send({ type: 'isoswarm-open', document: String(model.get('document')) });
  const assign = () =>
    send({
      type: 'isoswarm-assign',
      values: model.get('parameters') as Record<string, number>,
      pins: model.get('pins') as SharedPin[],
    });
  const resize = () => {
    frame.style.height = `${Number(model.get('height'))}px`;
  };
  let ready = false;
  /** Changes that come from the Studio are not sent back to it. */
  let mine = false;
  /** The last change that Python has made: of the whole document, or of values only. */
  const changed = () => {
    if (!ready || mine) return;
    if (model.get('revision_of') === 'values') assign();
    else open();
  };
  const receive = (event: MessageEvent<FromStudio>) => {
    if (event.source !== frame.contentWindow) return;
    const message = event.data;
    if (message.type === 'isoswarm-ready') {
      ready = true;
      open();
    } else if (message.type === 'isoswarm-changed') {
      mine = true;
      model.set('document', message.document);
      model.set('parameters', message.values);
      model.set('pins', message.pins);
      model.save_changes();
      mine = false;
    }
  };
  window.addEventListener('message', receive);
  model.on('change:revision', changed);
  model.on('change:height', resize);
  el.append(frame);
  return () => {
    window.removeEventListener('message', receive);
    model.off('change:revision', changed);
    model.off('change:height', resize);
    frame.remove();
  };
}

export default { render };
