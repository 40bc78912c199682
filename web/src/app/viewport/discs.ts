/**
 * Floaters as tilted discs: one draw, in which each disc is a triangle around it. The triangle lies in the disc's plane, so that depth is
 * right where discs cut each other, and light is computed at its corners, not at its pixels. Each corner has a row of its own:
 * processors that draw fetch attributes much faster than texels, and copy buffers faster than textures. Behind them the same discs are drawn once more, larger:
 * while the surface moves, and where floaters split and die, there are gaps between discs that the paper would shine through.
 */
import * as THREE from 'three';
import type { Frame } from '../../client/protocol.ts';
import { type Range, paletteTexels, rangeOf } from './colours.ts';
import { shading } from './shading.ts';
import type { Colouring } from '../state/view.ts';

/** Corners of a disc. */
const CORNERS = 3;
/** Numbers of a normal, with one that only fills up four bytes' multiple. */
const NORMAL = 4;
/** What 1 is in 16 bits. */
const UNIT = 32767;
/** How much larger discs are that fill gaps, */
const FILL = 1.7;
/** and how far they lie behind the others, in radii: more than the surface bends away under them, as seen from where they face. */
const BEHIND = 0.6;
/** Most discs that have others behind them: more are small, and so are their gaps, and twice as many take twice the time. */
const FILLED = 8000;

const vertexShader = /* glsl */ `
precision highp float;
in vec4 place;
in vec4 normal;
in float value;
uniform sampler2D palette;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform vec3 plain, up;
uniform vec4 cut;
uniform vec2 range;
uniform int colouring;
uniform float size, dot_size, flat_view;
uniform bool dots;
flat out vec3 colour;
out vec2 corner;
#ifdef CUT
out float beyond;
#endif
${shading}
void main() {
  int k = gl_VertexID % 3;
  vec4 centre = modelViewMatrix * vec4(place.xyz, 1.0);
  vec3 n = mat3(modelViewMatrix) * normal.xyz;
  vec3 v = flat_view > 0.5 ? vec3(0.0, 0.0, 1.0) : normalize(-centre.xyz);
  float inside = dot(n, v) < 0.0 ? 1.0 : 0.0;
  vec3 albedo = plain;
  if (colouring == 1) albedo = 0.5 + 0.5 * normal.xyz;
  if (colouring == 2) albedo = texture(palette, vec2(clamp((value - range.x) / (range.y - range.x), 0.002, 0.998), 0.5)).rgb;
  colour = shade(albedo, inside > 0.5 ? -n : n, v, up, colouring == 0 && !dots ? inside : 0.0);
  corner = k == 0 ? vec2(0.0, 2.0) : k == 1 ? vec2(-1.7320508, -1.0) : vec2(1.7320508, -1.0);
  vec3 at = place.xyz;
  if (dots) {
    vec4 shown = projectionMatrix * centre;
#ifdef CUT
    beyond = dot(cut.xyz, at) - cut.w;
#endif
    gl_Position = shown + vec4(corner * dot_size * vec2(projectionMatrix[0][0] / projectionMatrix[1][1], 1.0) * shown.w, 0.0, 0.0);
    return;
  }
  float s = normal.z >= 0.0 ? 1.0 : -1.0;
  float a = -1.0 / (s + normal.z);
  float b = normal.x * normal.y * a;
  vec3 e = vec3(1.0 + s * normal.x * normal.x * a, s * b, -s * normal.x);
  vec3 f = vec3(b, s + normal.y * normal.y * a, -normal.y);
  float radius = size * place.w;
#ifdef UNDER
  radius *= float(${FILL});
#endif
  at += radius * (corner.x * e + corner.y * f);
#ifdef CUT
  beyond = dot(cut.xyz, at) - cut.w;
#endif
  vec4 seen = modelViewMatrix * vec4(at, 1.0);
  gl_Position = projectionMatrix * seen;
#ifdef UNDER
  // Depth alone: the place on the screen stays, and thin parts stay in front of what is behind them.
  seen.xyz -= size * place.w * float(${BEHIND}) / (0.25 + abs(dot(n, v))) * v;
  vec4 behind = projectionMatrix * seen;
  gl_Position.z = behind.z / behind.w * gl_Position.w;
#endif
}
`;

const fragmentShader = /* glsl */ `
precision highp float;
flat in vec3 colour;
in vec2 corner;
#ifdef CUT
in float beyond;
#endif
out vec4 outColour;
void main() {
  float d = dot(corner, corner);
  if (d > 1.0) discard;
#ifdef CUT
  if (beyond > 0.0) discard;
#endif
  float rim = max(d - 0.62, 0.0);
  outColour = vec4(colour * (1.0 - 0.9 * rim * rim), 1.0);
}
`;

/** What a colouring shows of each floater. */
export function valuesOf(frame: Frame, colouring: Colouring): Float32Array | undefined {
  if (colouring === 'radius') return frame.radii;
  return colouring === 'curvature' ? frame.curvature : colouring === 'error' ? frame.error : undefined;
}

const ATTRIBUTES = ['place', 'normal', 'value'] as const;
type Attributes = [THREE.BufferAttribute, THREE.BufferAttribute, THREE.BufferAttribute];

/** Tells that the first rows of a buffer are new. */
function update(attribute: THREE.BufferAttribute, rows: number): void {
  attribute.clearUpdateRanges();
  attribute.addUpdateRange(0, rows * attribute.itemSize);
  attribute.needsUpdate = true;
}

/** Everything is on this side of it. */
const NO_PLANE = [0, 0, 0, 1] as const;

export class Discs {
  readonly object: THREE.Mesh;
  readonly uniforms;
  /** What the palette spans now; null where colours have no scale. */
  range: Range | null = null;
  private colouring: Colouring = 'plain';
  /** The discs, and those behind them. */
  private readonly materials: readonly THREE.RawShaderMaterial[];
  private readonly under: THREE.Mesh;
  private frame: Frame | null = null;
  private geometry = new THREE.BufferGeometry();
  /** Corners of the discs that face the eye; made when first needed. */
  private near: THREE.BufferAttribute | null = null;

  constructor() {
    const texels = new THREE.DataTexture(paletteTexels('plain'), 256, 1);
    texels.magFilter = texels.minFilter = THREE.LinearFilter;
    texels.needsUpdate = true;
    this.uniforms = {
      palette: { value: texels },
      plain: { value: new THREE.Vector3() },
      up: { value: new THREE.Vector3(0, 1, 0) },
      cut: { value: new THREE.Vector4(...NO_PLANE) },
      range: { value: new THREE.Vector2(0, 1) },
      colouring: { value: 0 },
      size: { value: 1 },
      dot_size: { value: 0.004 },
      flat_view: { value: 0 },
      dots: { value: false },
    };
    const material = (defines: Record<string, number>) =>
      new THREE.RawShaderMaterial({
        glslVersion: THREE.GLSL3,
        side: THREE.DoubleSide,
        uniforms: this.uniforms,
        defines,
        vertexShader,
        fragmentShader,
      });
    const [over, under] = [material({}), material({ UNDER: 1 })];
    this.materials = [over, under];
    this.object = new THREE.Mesh(this.geometry, over);
    this.under = new THREE.Mesh(this.geometry, under);
    // Last: most of it is hidden, and costs no light.
    this.under.renderOrder = 1;
    this.object.add(this.under);
    this.object.frustumCulled = this.under.frustumCulled = false;
    this.geometry.setDrawRange(0, 0);
  }

  /** Takes over a frame. */
  set(frame: Frame, colouring: Colouring): void {
    this.frame = frame;
    if (frame.count > this.room) this.grow(frame.count);
    const [place, normal, value] = ATTRIBUTES.map(name => this.geometry.getAttribute(name) as THREE.BufferAttribute) as Attributes;
    const [places, bits, shown] = [place.array, normal.array, value.array];
    const values = valuesOf(frame, colouring);
    const { positions: p, normals: n, radii } = frame;
    for (let i = 0, k = 0, j = 0, v = 0; i < frame.count; i++, k += 3) {
      const [x, y, z, radius] = [p[k]!, p[k + 1]!, p[k + 2]!, radii[i]!];
      const [nx, ny, nz] = [UNIT * n[k]!, UNIT * n[k + 1]!, UNIT * n[k + 2]!];
      for (let corner = 0; corner < CORNERS; corner++, j += 4, v++) {
        places[j] = x;
        places[j + 1] = y;
        places[j + 2] = z;
        places[j + 3] = radius;
        bits[j] = nx;
        bits[j + 1] = ny;
        bits[j + 2] = nz;
        if (values) shown[v] = values[i]!;
      }
    }
    update(place, CORNERS * frame.count);
    update(normal, CORNERS * frame.count);
    if (values) update(value, CORNERS * frame.count);
    this.colour(colouring, values);
    this.drawAll();
  }

  /** Draws both sides. */
  drawAll(): void {
    this.geometry.setIndex(null);
    this.geometry.setDrawRange(0, CORNERS * (this.frame?.count ?? 0));
    this.fill(!this.uniforms.dots.value);
  }

  private fill(wanted: boolean): void {
    this.under.visible = wanted && (this.frame?.count ?? 0) <= FILLED;
  }

  /** Leaves discs out that are seen from behind: from a point, or along a direction. */
  drawNear(eye: THREE.Vector3, flat: boolean): void {
    const { frame } = this;
    if (!frame || this.uniforms.dots.value) return this.drawAll();
    this.near ??= new THREE.BufferAttribute(new Uint32Array(CORNERS * this.room), 1).setUsage(THREE.DynamicDrawUsage);
    const corners = this.near.array;
    const { positions: p, normals: n } = frame;
    const { x, y, z } = eye;
    const by = flat ? 0 : 1;
    let used = 0;
    for (let i = 0, k = 0; i < frame.count; i++, k += 3) {
      const facing = n[k]! * (x - by * p[k]!) + n[k + 1]! * (y - by * p[k + 1]!) + n[k + 2]! * (z - by * p[k + 2]!);
      if (facing < 0) continue;
      for (let corner = 0; corner < CORNERS; corner++) corners[used++] = CORNERS * i + corner;
    }
    update(this.near, used);
    this.geometry.setIndex(this.near);
    this.geometry.setDrawRange(0, used);
    this.fill(true);
  }

  /** Leaves out what is beyond a plane: normal and offset; null: nothing. */
  cut(plane: readonly [number, number, number, number] | null): void {
    this.uniforms.cut.value.set(...(plane ?? NO_PLANE));
    for (const material of this.materials) {
      if (Boolean(plane) === 'CUT' in material.defines) continue;
      if (plane) material.defines.CUT = 1;
      else delete material.defines.CUT;
      material.needsUpdate = true;
    }
  }

  private colour(colouring: Colouring, values: Float32Array | undefined): void {
    this.range = values ? rangeOf(values, colouring) : null;
    if (this.range) this.uniforms.range.value.set(this.range.lo, this.range.hi);
    this.uniforms.colouring.value = values ? 2 : colouring === 'normal' ? 1 : 0;
    if (colouring === this.colouring) return;
    this.colouring = colouring;
    (this.uniforms.palette.value.image.data as Uint8Array).set(paletteTexels(colouring));
    this.uniforms.palette.value.needsUpdate = true;
  }

  /** Floaters that there is room for. */
  private get room(): number {
    return (this.geometry.getAttribute('place')?.count ?? 0) / CORNERS;
  }

  private grow(count: number): void {
    const corners = CORNERS * Math.ceil(1.25 * count);
    this.geometry.dispose();
    this.near = null;
    this.geometry = new THREE.BufferGeometry();
    const add = (name: string, attribute: THREE.BufferAttribute) => this.geometry.setAttribute(name, attribute.setUsage(THREE.DynamicDrawUsage));
    add('place', new THREE.BufferAttribute(new Float32Array(4 * corners), 4));
    add('normal', new THREE.BufferAttribute(new Int16Array(NORMAL * corners), NORMAL, true));
    add('value', new THREE.BufferAttribute(new Float32Array(corners), 1));
    this.object.geometry = this.under.geometry = this.geometry;
  }

  dispose(): void {
    this.uniforms.palette.value.dispose();
    this.geometry.dispose();
    for (const material of this.materials) material.dispose();
  }
}
