/** The mesh: smooth, flat or its edges. Colours with a scale come from the nearest floater. */
import * as THREE from 'three';
import type { Frame, MeshData } from '../../client/protocol.ts';
import type { Colouring, Shading } from '../state/view.ts';
import type { Discs } from './discs.ts';
import { valuesOf } from './discs.ts';
import { shading } from './shading.ts';

const vertexShader = /* glsl */ `
precision highp float;
in vec3 position;
in vec3 normal;
in float value;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform vec4 cut;
out vec3 eye;
out vec3 smooth_normal;
out vec3 world_normal;
out float shown;
out float beyond;
void main() {
  vec4 at = modelViewMatrix * vec4(position, 1.0);
  eye = at.xyz;
  world_normal = normal;
  smooth_normal = mat3(modelViewMatrix) * normal;
  shown = value;
  beyond = dot(cut.xyz, position) - cut.w;
  gl_Position = projectionMatrix * at;
}
`;

const fragmentShader = /* glsl */ `
precision highp float;
in vec3 eye;
in vec3 smooth_normal;
in vec3 world_normal;
in float shown;
in float beyond;
uniform sampler2D palette;
uniform vec3 plain, up;
uniform vec2 range;
uniform int colouring;
uniform float flat_view;
uniform bool faceted;
out vec4 outColour;
${shading}
void main() {
  if (beyond > 0.0) discard;
  vec3 v = flat_view > 0.5 ? vec3(0.0, 0.0, 1.0) : normalize(-eye);
  vec3 n = normalize(smooth_normal);
  if (faceted) {
    vec3 face = normalize(cross(dFdx(eye), dFdy(eye)));
    n = dot(face, n) < 0.0 ? -face : face;
  }
  float inside = dot(n, v) < 0.0 && !gl_FrontFacing ? 1.0 : 0.0;
  vec3 albedo = plain;
  if (colouring == 1) albedo = 0.5 + 0.5 * normalize(world_normal);
  if (colouring == 2) albedo = texture(palette, vec2(clamp((shown - range.x) / (range.y - range.x), 0.002, 0.998), 0.5)).rgb;
  outColour = vec4(shade(albedo, inside > 0.5 ? -n : n, v, up, colouring == 0 ? inside : 0.0), 1.0);
}
`;

export class SurfaceMesh {
  readonly object = new THREE.Group();
  private readonly material: THREE.RawShaderMaterial;
  private readonly lines = new THREE.LineBasicMaterial({ color: 0x444444, transparent: true, opacity: 0.9 });
  private geometry = new THREE.BufferGeometry();
  private edges: THREE.BufferGeometry | null = null;
  private shading: Shading = 'smooth';

  /** Shares the uniforms of the discs, so that both look alike. */
  constructor(discs: Discs) {
    this.material = new THREE.RawShaderMaterial({
      glslVersion: THREE.GLSL3,
      side: THREE.DoubleSide,
      uniforms: { ...discs.uniforms, faceted: { value: false } },
      vertexShader,
      fragmentShader,
      polygonOffset: true,
      polygonOffsetFactor: 1,
      polygonOffsetUnits: 1,
    });
  }

  set(mesh: MeshData): void {
    this.geometry.dispose();
    this.edges?.dispose();
    this.edges = null;
    this.geometry = new THREE.BufferGeometry();
    this.geometry.setAttribute('position', new THREE.BufferAttribute(mesh.positions, 3));
    this.geometry.setAttribute('normal', new THREE.BufferAttribute(mesh.normals, 3));
    this.geometry.setAttribute('value', new THREE.BufferAttribute(new Float32Array(mesh.positions.length / 3), 1));
    this.geometry.setIndex(new THREE.BufferAttribute(mesh.indices, 1));
    this.rebuild();
  }

  look(shading: Shading, ink: number): void {
    this.lines.color.set(ink);
    this.material.uniforms.faceted!.value = shading !== 'smooth';
    if (shading === this.shading) return;
    this.shading = shading;
    this.rebuild();
  }

  /** Gives each vertex the value of the nearest floater. */
  colour(frame: Frame, colouring: Colouring): void {
    const values = valuesOf(frame, colouring);
    const target = this.geometry.getAttribute('value') as THREE.BufferAttribute | undefined;
    if (!values || !target) return;
    const at = nearest(frame);
    const places = this.geometry.getAttribute('position').array as Float32Array;
    for (let i = 0; i < target.count; i++) target.array[i] = values[at(places[3 * i]!, places[3 * i + 1]!, places[3 * i + 2]!)] ?? 0;
    target.needsUpdate = true;
  }

  private rebuild(): void {
    this.object.clear();
    if (!this.geometry.index) return;
    const mesh = new THREE.Mesh(this.geometry, this.material);
    mesh.frustumCulled = false;
    this.object.add(mesh);
    if (this.shading !== 'wire') return;
    this.edges ??= new THREE.WireframeGeometry(this.geometry);
    const lines = new THREE.LineSegments(this.edges, this.lines);
    lines.frustumCulled = false;
    this.object.add(lines);
  }

  dispose(): void {
    this.geometry.dispose();
    this.edges?.dispose();
    this.material.dispose();
    this.lines.dispose();
  }
}

/** The floater nearest to a point, by a grid of cells two spacings wide. */
function nearest(frame: Frame): (x: number, y: number, z: number) => number {
  const cell = 2 * frame.spacing;
  const cells = new Map<string, number[]>();
  const key = (x: number, y: number, z: number) => `${x},${y},${z}`;
  const of = (v: number) => Math.floor(v / cell);
  const p = frame.positions;
  for (let i = 0; i < frame.count; i++) {
    const k = key(of(p[3 * i]!), of(p[3 * i + 1]!), of(p[3 * i + 2]!));
    const list = cells.get(k);
    if (list) list.push(i);
    else cells.set(k, [i]);
  }
  return (x, y, z) => {
    let best = 0;
    let least = Infinity;
    for (let a = -1; a <= 1; a++)
      for (let b = -1; b <= 1; b++)
        for (let c = -1; c <= 1; c++)
          for (const i of cells.get(key(of(x) + a, of(y) + b, of(z) + c)) ?? []) {
            const d = (p[3 * i]! - x) ** 2 + (p[3 * i + 1]! - y) ** 2 + (p[3 * i + 2]! - z) ** 2;
            if (d < least) [least, best] = [d, i];
          }
    return best;
  };
}
