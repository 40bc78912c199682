import { useRef } from 'preact/hooks';
import { exportAs, exportPicture } from '../state/exports.ts';
import { open, openFile, saveFile } from '../state/files.ts';
import { redo, scene, title, undo } from '../state/session.ts';
import { copyLink } from '../state/share.ts';
import { dialog } from '../state/ui.ts';
import { type Theme, setView, small, view } from '../state/view.ts';
import { IconButton } from '../ui/controls.tsx';
import { Icon } from '../ui/Icon.tsx';
import { Menu, type MenuItems } from '../ui/Menu.tsx';

const THEMES: readonly { value: Theme; label: string }[] = [
  { value: 'auto', label: 'As the system' },
  { value: 'light', label: 'Light' },
  { value: 'dark', label: 'Dark' },
];

export function TopBar() {
  const input = useRef<HTMLInputElement>(null);
  const choose = () => input.current?.click();
  const { theme } = view.value;
  return (
    <header class="top">
      <div class="top-left">
        <Mark />
        <input
          class="title"
          aria-label="Name of the scene"
          value={title.value}
          spellcheck={false}
          onChange={e => (title.value = e.currentTarget.value.trim() || 'Untitled')}
          onKeyDown={e => {
            e.stopPropagation();
            if (e.key === 'Enter' || e.key === 'Escape') e.currentTarget.blur();
          }}
        />
      </div>
      <div class="top-middle" role="toolbar" aria-label="History">
        <IconButton icon="undo" label="Undo" keys="Ctrl Z" disabled={!scene.value?.undo} onClick={() => void undo()} />
        <IconButton icon="redo" label="Redo" keys="Ctrl Shift Z" disabled={!scene.value?.redo} onClick={() => void redo()} />
      </div>
      <nav class="top-right" aria-label="Scene">
        {small.value ? (
          <Menu class="icon-button" label="Menu" side="right" items={[...sceneItems(choose), null, ...exportItems(), null, ...themeItems(theme)]}>
            <Icon name="more" />
          </Menu>
        ) : (
          <>
            <button type="button" class="button" title="Gallery (G)" onClick={() => (dialog.value = 'gallery')}>
              <Icon name="gallery" size={16} /> <span class="word">Gallery</span>
            </button>
            <button type="button" class="button" title="Open a file (Ctrl O)" onClick={choose}>
              <Icon name="open" size={16} /> <span class="word">Open</span>
            </button>
            <button type="button" class="button" title="Save as a file (Ctrl S)" onClick={() => void saveFile()}>
              <Icon name="save" size={16} /> <span class="word">Save</span>
            </button>
            <button type="button" class="button" title="Copy a link with the whole scene in it" onClick={() => void copyLink()}>
              <Icon name="share" size={16} /> <span class="word">Share</span>
            </button>
            <Menu class="button" label="Export" side="right" items={exportItems()}>
              <Icon name="export" size={16} /> <span class="word">Export</span>
            </Menu>
            <span class="rule" />
            <Menu class="icon-button" label="Theme" side="right" items={themeItems(theme)}>
              <Icon name={theme === 'light' ? 'sun' : theme === 'dark' ? 'moon' : 'auto'} />
            </Menu>
            <IconButton icon="help" label="Help and keyboard shortcuts" keys="?" onClick={() => (dialog.value = 'help')} />
          </>
        )}
      </nav>
      <input
        ref={input}
        id="open-file"
        class="visually-hidden"
        type="file"
        accept=".json,.txt,.iso"
        tabIndex={-1}
        aria-label="File to open"
        onChange={event => {
          const file = event.currentTarget.files?.[0];
          event.currentTarget.value = '';
          if (file) void openFile(file);
        }}
      />
    </header>
  );
}

function Mark() {
  return (
    <svg class="mark" width="24" height="24" viewBox="0 0 32 32" role="img" aria-label="isoswarm">
      <circle cx="16" cy="7" r="4.500" />
      <circle cx="8" cy="14" r="4.500" />
      <circle cx="24" cy="14" r="4.500" />
      <circle cx="11" cy="24" r="4.500" />
      <circle cx="21" cy="24" r="4.500" />
    </svg>
  );
}

function sceneItems(choose: () => void): MenuItems {
  return [
    { label: 'Gallery', icon: 'gallery', onPick: () => (dialog.value = 'gallery') },
    { label: 'Open a file', icon: 'open', onPick: choose },
    { label: 'Save as a file', icon: 'save', onPick: () => void saveFile() },
    { label: 'Share a link', icon: 'share', onPick: () => void copyLink() },
    { label: 'Start again', icon: 'restart', onPick: () => void open.again() },
    { label: 'Help', icon: 'help', onPick: () => (dialog.value = 'help') },
  ];
}

function exportItems(): MenuItems {
  return [
    { label: 'Mesh for printing', hint: '3MF', icon: 'mesh', onPick: () => void exportAs('mesh', '3mf') },
    { label: 'Mesh', hint: 'STL', icon: 'mesh', onPick: () => void exportAs('mesh', 'stl') },
    { label: 'Mesh', hint: 'OBJ', icon: 'mesh', onPick: () => void exportAs('mesh', 'obj') },
    { label: 'Mesh', hint: 'PLY', icon: 'mesh', onPick: () => void exportAs('mesh', 'ply') },
    { label: 'Mesh for the web', hint: 'GLB', icon: 'mesh', onPick: () => void exportAs('mesh', 'glb') },
    null,
    { label: 'Points with normals', hint: 'PLY', icon: 'points', onPick: () => void exportAs('points', 'ply') },
    { label: 'Points', hint: 'CSV', icon: 'points', onPick: () => void exportAs('points', 'csv') },
    null,
    { label: 'Picture', hint: 'PNG', icon: 'image', onPick: () => void exportPicture() },
  ];
}

function themeItems(theme: Theme): MenuItems {
  return THEMES.map(t => ({ label: t.label, checked: theme === t.value, onPick: () => setView({ theme: t.value }) }));
}
