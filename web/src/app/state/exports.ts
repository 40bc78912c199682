/** Files that leave the page. */
import type { MeshFormat, PointFormat } from '../../client/protocol.ts';
import { picture } from '../viewport/Viewport.tsx';
import { withBar } from './jobs.ts';
import { ask, complain, title } from './session.ts';
import { say } from './ui.ts';

const TYPES: Record<string, string> = {
  ply: 'application/octet-stream',
  obj: 'model/obj',
  stl: 'model/stl',
  glb: 'model/gltf-binary',
  '3mf': 'model/3mf',
  csv: 'text/csv',
  npz: 'application/octet-stream',
  png: 'image/png',
  'iso.json': 'application/json',
};

export function fileName(ending: string): string {
  const stem = title.value
    .toLowerCase()
    .replace(/[^\p{L}\p{N}]+/gu, '-')
    .replace(/^-+|-+$/g, '');
  return `${stem || 'surface'}.${ending}`;
}

/** Gives a file to the browser to keep. */
export function download(data: BlobPart, ending: string): void {
  const url = URL.createObjectURL(new Blob([data], { type: TYPES[ending] ?? 'application/octet-stream' }));
  const link = document.createElement('a');
  link.href = url;
  link.download = fileName(ending);
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

export async function exportAs(what: 'mesh', format: MeshFormat): Promise<void>;
export async function exportAs(what: 'points', format: PointFormat): Promise<void>;
export async function exportAs(what: 'mesh' | 'points', format: string): Promise<void> {
  try {
    const data = await withBar(`Exporting ${format.toUpperCase()}`, options =>
      what === 'mesh'
        ? ask('exportMesh', { format: format as MeshFormat }, options)
        : ask('exportPoints', { format: format as PointFormat }, options),
    );
    download(data, format);
  } catch (error) {
    return complain(error);
  }
  say(`${fileName(format)} is in your downloads.`, { tone: 'good' });
}

export async function exportPicture(): Promise<void> {
  try {
    const blob = await picture();
    if (!blob) return;
    download(blob, 'png');
    say(`${fileName('png')} is in your downloads.`, { tone: 'good' });
  } catch (error) {
    complain(error);
  }
}
