/** A scene in a link: its text, deflated, in the part of the address that is never sent to a server. */
import { deflateSync, inflateSync, strFromU8, strToU8 } from 'fflate';
import { ask, complain, title } from './session.ts';
import { say } from './ui.ts';

/** What a link's hash begins with; the number is the version. */
const PREFIX = '#s1=';
/** Longer links break in mail programs and chats. */
const LONG = 8000;
/** Most bytes that a link may unpack to. */
const MOST = 8e6;

export interface Shared {
  title: string;
  scene: string;
}

export function encode(shared: Shared): string {
  const bytes = deflateSync(strToU8(JSON.stringify([shared.title, shared.scene])), { level: 9 });
  let binary = '';
  for (const b of bytes) binary += String.fromCharCode(b);
  return PREFIX + btoa(binary).replaceAll('+', '-').replaceAll('/', '_').replace(/=+$/, '');
}

/** @throws where the link is broken or of another version, with a sentence. */
export function decode(hash: string): Shared {
  if (!hash.startsWith(PREFIX)) throw new Error('This link was made by another version of the Studio.');
  try {
    const binary = atob(hash.slice(PREFIX.length).replaceAll('-', '+').replaceAll('_', '/'));
    const bytes = inflateSync(Uint8Array.from(binary, c => c.charCodeAt(0)), { out: new Uint8Array(MOST) });
    const parts: unknown = JSON.parse(strFromU8(bytes));
    if (Array.isArray(parts) && typeof parts[0] === 'string' && typeof parts[1] === 'string') {
      return { title: parts[0].slice(0, 200), scene: parts[1] };
    }
  } catch {
    // What is said below holds for all of it.
  }
  throw new Error('The scene in this link is incomplete: perhaps the link was cut when it was copied.');
}

export function isShared(hash: string): boolean {
  return /^#s\d*=/.test(hash);
}

/** Whether the link in the address is still of this scene, whatever its clock and floaters do. */
export function isLinkOf(scene: string): boolean {
  const known = (text: string): string => {
    const { model, pins, settings, adapting } = JSON.parse(text) as Record<string, unknown>;
    return JSON.stringify([model, pins, settings, adapting]);
  };
  try {
    return known(decode(location.hash).scene) === known(scene);
  } catch {
    return false;
  }
}

export async function copyLink(): Promise<void> {
  try {
    const { scene } = await ask('save', {});
    const link = `${location.origin}${location.pathname}${location.search}${encode({ title: title.value, scene })}`;
    history.replaceState(null, '', link);
    const size = link.length > LONG ? ' It is long: some programs will cut it, so send a file instead.' : '';
    const copied = await navigator.clipboard.writeText(link).then(
      () => true,
      () => false,
    );
    say(copied ? `The link is on the clipboard.${size}` : `The link is in the address bar: copy it from there.${size}`, { tone: 'good' });
  } catch (error) {
    complain(error);
  }
}
