/** How the surface is shown, at the viewport's upper edge. */
import { cutAcross, toggleSection } from '../viewport/cut.ts';
import { stage } from '../viewport/Viewport.tsx';
import { type Colouring, type Mode, type Shading, section, setView, view } from '../state/view.ts';
import { IconButton, Segmented, Slider } from '../ui/controls.tsx';
import { Icon } from '../ui/Icon.tsx';
import { Menu } from '../ui/Menu.tsx';

const MODES = [
  { value: 'discs', label: 'Discs', icon: 'discs' },
  { value: 'points', label: 'Points', icon: 'points' },
  { value: 'mesh', label: 'Mesh', icon: 'mesh' },
] as const satisfies readonly { value: Mode; label: string; icon: string }[];

const SHADINGS: readonly { value: Shading; label: string }[] = [
  { value: 'smooth', label: 'Smooth' },
  { value: 'flat', label: 'Flat' },
  { value: 'wire', label: 'Wireframe' },
];

const COLOURINGS: readonly { value: Colouring; label: string }[] = [
  { value: 'plain', label: 'Clay' },
  { value: 'normal', label: 'Normal' },
  { value: 'curvature', label: 'Curvature' },
  { value: 'radius', label: 'Radius' },
  { value: 'error', label: 'Off the surface' },
];

export function ViewBar() {
  const { mode, shading, colouring, orthographic } = view.value;
  const cut = section.value;
  const colour = COLOURINGS.find(c => c.value === colouring)!;
  return (
    <div class="view-bar">
      <div class="view-tools" role="toolbar" aria-label="View">
        <Segmented label="Show the surface as" choices={MODES} value={mode} onChange={m => setView({ mode: m })} />
        <Menu
          class="button view-colour"
          label={`Colour: ${colour.label}`}
          items={COLOURINGS.map(c => ({ label: c.label, checked: c.value === colouring, onPick: () => setView({ colouring: c.value }) }))}
        >
          <Icon name="palette" size={16} /> <span class="word">{colour.label}</span>
        </Menu>
        <IconButton icon="section" label="Section plane" keys="X" pressed={cut.on} onClick={toggleSection} />
        <IconButton
          icon={orthographic ? 'ortho' : 'perspective'}
          label={orthographic ? 'Orthographic: switch to perspective' : 'Perspective: switch to orthographic'}
          keys="O"
          onClick={() => setView({ orthographic: !orthographic })}
        />
        <IconButton icon="fit" label="Show all of the surface" keys="F" onClick={() => stage.value?.fit()} />
      </div>
      {mode === 'mesh' && (
        <Segmented label="Shading of the mesh" choices={SHADINGS} value={shading} onChange={s => setView({ shading: s })} />
      )}
      {cut.on && <SectionControls />}
    </div>
  );
}

function SectionControls() {
  const cut = section.value;
  const axes = [
    { value: '0', label: 'X' },
    { value: '1', label: 'Y' },
    { value: '2', label: 'Z' },
  ] as const;
  return (
    <div class="section-bar" role="group" aria-label="Section plane">
      <Segmented
        label="Across the axis"
        choices={axes}
        value={String(cut.axis) as '0' | '1' | '2'}
        onChange={a => cutAcross(Number(a) as 0 | 1 | 2)}
      />
      <Slider label="Place of the section plane" value={cut.at} range={[0, 1]} onInput={at => (section.value = { ...cut, at })} />
      <IconButton small icon="turn" label="Cut the other side away" onClick={() => (section.value = { ...cut, flipped: !cut.flipped })} />
    </div>
  );
}
