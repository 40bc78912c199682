import { useState } from 'preact/hooks';
import { FaultNote, useCheck } from '../panels/FormulaField.tsx';
import { open } from '../state/files.ts';
import { complain } from '../state/session.ts';
import { dialog } from '../state/ui.ts';
import { Button } from '../ui/controls.tsx';
import { Dialog } from '../ui/Dialog.tsx';
import { type GalleryScene, scenes, thumbnail } from '../gallery/scenes.ts';

const GROUPS = ['Papers', 'Shapes', 'Formulas'] as const;

/** Scenes to begin with, and a formula of one's own. */
export function Gallery() {
  const close = () => {
    dialog.value = null;
  };
  return (
    <Dialog title="Begin with" hint="A scene from here, a formula, or a file dropped anywhere on the page." wide onClose={close}>
      <div class="gallery scroll">
        <NewFormula close={close} />
        {GROUPS.map(group => (
          <section key={group} aria-label={group}>
            <h3>{group === 'Papers' ? 'From the papers' : group}</h3>
            <ul class="cards">
              {scenes
                .filter(s => s.group === group)
                .map(s => (
                  <Card key={s.id} scene={s} close={close} />
                ))}
            </ul>
          </section>
        ))}
      </div>
    </Dialog>
  );
}

function Card({ scene, close }: { scene: GalleryScene; close: () => void }) {
  const start = async () => {
    close();
    try {
      await open(await scene.source(), scene.title);
    } catch (error) {
      complain(error);
    }
  };
  const picture = thumbnail(scene.id);
  return (
    <li>
      <button type="button" class="card" data-scene={scene.id} onClick={() => void start()}>
        <span class="card-picture">{picture && <img src={picture} alt="" width={176} height={132} loading="lazy" />}</span>
        <strong>{scene.title}</strong>
        <small>{scene.note}</small>
      </button>
    </li>
  );
}

function NewFormula({ close }: { close: () => void }) {
  const [text, setText] = useState('');
  const fault = useCheck(text);
  const start = async () => {
    if (text.trim() === '' || fault) return;
    if (await open({ text, settings: { amount: { count: 3000 } } }, 'Formula')) close();
  };
  return (
    <section class="new-formula" aria-label="A formula">
      <div class="new-formula-line">
        <input
          class="field code"
          aria-label="Formula"
          placeholder="sphere(1) | translate(box(1, 1, 1), x=1)   or   x^2 + y^2 + z^2 - 1"
          value={text}
          spellcheck={false}
          autocapitalize="off"
          aria-invalid={fault !== null}
          onInput={e => setText(e.currentTarget.value)}
          onKeyDown={e => e.key === 'Enter' && void start()}
        />
        <Button look="primary" disabled={text.trim() === '' || fault !== null} onClick={() => void start()}>
          Open
        </Button>
      </div>
      {fault && <FaultNote text={text} fault={fault} />}
    </section>
  );
}
