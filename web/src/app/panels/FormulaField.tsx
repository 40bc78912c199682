import { useEffect, useRef, useState } from 'preact/hooks';
import { apply, ask, failureOf, scene } from '../state/session.ts';
import { Button } from '../ui/controls.tsx';

/** Milliseconds after the last letter before a formula is read. */
const PAUSE = 250;

export interface Fault {
  message: string;
  position: number | null;
}

/** Reads a formula while it is typed; null: it can be read. */
export function useCheck(text: string): Fault | null {
  const [fault, setFault] = useState<Fault | null>(null);
  useEffect(() => {
    if (text.trim() === '') return setFault(null);
    const timer = setTimeout(async () => {
      try {
        await ask('check', { text });
        setFault(null);
      } catch (error) {
        const failure = failureOf(error);
        setFault({ message: failure.message, position: failure.position ?? null });
      }
    }, PAUSE);
    return () => clearTimeout(timer);
  }, [text]);
  return fault;
}

/** Where a formula cannot be read: the line, a caret below, and why. */
export function FaultNote({ text, fault }: { text: string; fault: Fault }) {
  const reason = fault.message.split('\n')[0]!;
  return (
    <div class="fault" role="alert">
      {fault.position !== null && <Caret text={text} at={fault.position} />}
      <p>{reason}</p>
    </div>
  );
}

function Caret({ text, at }: { text: string; at: number }) {
  const start = text.lastIndexOf('\n', at - 1) + 1;
  const end = text.indexOf('\n', at);
  const line = text.slice(start, end < 0 ? undefined : end);
  const from = Math.max(0, at - start - 18);
  return (
    <pre aria-label={`at character ${at + 1}`}>
      {from > 0 && '…'}
      {line.slice(from, from + 34)}
      {'\n'}
      {' '.repeat(at - start - from + (from > 0 ? 1 : 0))}
      <b>^</b>
    </pre>
  );
}

/** The whole model as a formula, to read and to type. */
export function FormulaField() {
  const formula = scene.value?.formula ?? null;
  const [text, setText] = useState<string | null>(null);
  const area = useRef<HTMLTextAreaElement>(null);
  useEffect(() => setText(null), [formula]);
  const shown = text ?? formula ?? '';
  const fault = useCheck(text ?? '');
  const commit = async () => {
    if (text === null || text.trim() === '' || fault) return;
    if (await apply({ do: 'replace', path: '', model: text })) setText(null);
  };
  const key = (event: KeyboardEvent) => {
    event.stopPropagation();
    if (event.key === 'Enter' && !event.shiftKey) {
      event.preventDefault();
      void commit();
    }
    if (event.key === 'Escape') {
      setText(null);
      area.current?.blur();
    }
  };
  return (
    <section class="formula" aria-label="Formula">
      <label for="formula">Formula</label>
      <textarea
        id="formula"
        ref={area}
        class="field code"
        rows={text === null ? 2 : 4}
        spellcheck={false}
        autocapitalize="off"
        placeholder={formula === null ? 'This model has no formula. Type one to replace it.' : ''}
        aria-invalid={fault !== null}
        value={shown}
        onInput={e => setText(e.currentTarget.value)}
        onKeyDown={key}
      />
      {text !== null && fault && <FaultNote text={text} fault={fault} />}
      {text !== null && (
        <div class="formula-actions">
          <Button onClick={() => setText(null)}>Cancel</Button>
          <Button look="primary" disabled={fault !== null} onClick={() => void commit()}>
            Replace the model
          </Button>
        </div>
      )}
    </section>
  );
}
