import { useEffect, useState } from 'preact/hooks';
import { Gallery } from './dialogs/Gallery.tsx';
import { Help } from './dialogs/Help.tsx';
import { KindPicker } from './dialogs/KindPicker.tsx';
import { AdapterBar } from './panels/AdapterBar.tsx';
import { Figures } from './panels/Figures.tsx';
import { Inspector } from './panels/Inspector.tsx';
import { SheetBar } from './panels/SheetBar.tsx';
import { Toolbar } from './panels/Toolbar.tsx';
import { TopBar } from './panels/TopBar.tsx';
import { Tree } from './panels/Tree.tsx';
import { ViewBar } from './panels/ViewBar.tsx';
import { openFile } from './state/files.ts';
import { frame, scene } from './state/session.ts';
import { dialog, sheet, tool } from './state/ui.ts';
import { setView, small, view } from './state/view.ts';
import { IconButton } from './ui/controls.tsx';
import { Toasts } from './ui/Toasts.tsx';
import { Viewport } from './viewport/Viewport.tsx';

export function App() {
  const isSmall = small.value;
  const { tree, inspector, figures } = view.value;
  const showTree = isSmall ? sheet.value === 'tree' : tree;
  const showInspector = isSmall ? sheet.value === 'inspector' : inspector;
  const showFigures = isSmall ? sheet.value === 'figures' : figures;
  return (
    <div class={['studio', isSmall && 'small', !tree && 'no-tree', !inspector && 'no-inspector', !figures && 'no-figures'].filter(Boolean).join(' ')}>
      <main class="view" aria-label="Surface">
        <Viewport />
        <Toolbar />
        <ViewBar />
        <Hint />
        <AdapterBar />
        {!isSmall && <PanelSwitches />}
      </main>
      <TopBar />
      {showTree && (
        <aside class="panel tree-panel" aria-label="Model">
          <Tree />
        </aside>
      )}
      {showInspector && (
        <aside class="panel inspector-panel" aria-label="Parameters">
          <Inspector />
        </aside>
      )}
      {showFigures && (
        <footer class="panel figures-panel" aria-label="Figures">
          <Figures />
        </footer>
      )}
      {isSmall && <SheetBar />}
      <Dialogs />
      <DropZone />
      <Toasts />
    </div>
  );
}

/** How to begin, until somebody has. */
function Hint() {
  if (view.value.knowsPins || view.value.colouring !== 'plain' || !frame.value || scene.value?.adapter || tool.value !== 'pin') return null;
  return <p class="hint">{small.value ? 'Tap the surface, then drag the pin' : 'Click the surface to set a pin, then drag it'}</p>;
}

/** Panels go away for a larger picture, and come back. */
function PanelSwitches() {
  const { tree, inspector } = view.value;
  return (
    <>
      <div class="panel-switch left">
        <IconButton small icon="tree" label={tree ? 'Hide the model' : 'Show the model'} pressed={tree} onClick={() => setView({ tree: !tree })} />
      </div>
      <div class="panel-switch right">
        <IconButton
          small
          icon="sliders"
          label={inspector ? 'Hide the parameters' : 'Show the parameters'}
          pressed={inspector}
          onClick={() => setView({ inspector: !inspector })}
        />
      </div>
    </>
  );
}

function Dialogs() {
  switch (dialog.value) {
    case 'gallery':
      return <Gallery />;
    case 'help':
      return <Help />;
    case 'add':
      return <KindPicker what="add" />;
    case 'wrap':
      return <KindPicker what="wrap" />;
    default:
      return null;
  }
}

/** A file dropped anywhere is opened. */
function DropZone() {
  const [over, setOver] = useState(false);
  useEffect(() => {
    const hasFile = (event: DragEvent) => event.dataTransfer?.types.includes('Files') ?? false;
    const drag = (event: DragEvent) => {
      if (!hasFile(event)) return;
      event.preventDefault();
      setOver(true);
    };
    const leave = (event: DragEvent) => event.relatedTarget === null && setOver(false);
    const drop = (event: DragEvent) => {
      setOver(false);
      const file = event.dataTransfer?.files[0];
      if (!file) return;
      event.preventDefault();
      void openFile(file);
    };
    addEventListener('dragover', drag);
    addEventListener('dragleave', leave);
    addEventListener('drop', drop);
    return () => {
      removeEventListener('dragover', drag);
      removeEventListener('dragleave', leave);
      removeEventListener('drop', drop);
    };
  }, []);
  return over ? (
    <div class="drop" aria-hidden="true">
      <p>Drop the file to open it</p>
    </div>
  ) : null;
}
