/**
 * Floaters as tilted discs: one draw, in which each disc is a triangle around it whose corners are pulled from two float textures by
 * gl_VertexID. The triangle lies in the disc's plane, so that depth is right where discs cut each other, and light is
 * computed once a disc.
 */
import * as THREE from 'three';
import type { Frame } from '../../client/protocol.ts';
import { type Range, paletteTexels, rangeOf } from './colours.ts';
import { shading } from './shading.ts';
import type { Colouring } from '../state/view.ts';

const WIDTH = 1024;

const vertexShader = /* glsl */ `
precision highp float;
precision highp sampler2D;
uniform sampler2D places, normals, palette;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform vec3 plain, up;
uniform vec4 cut;
uniform vec2 range;
uniform int colouring;
uniform float size, dot_size, flat_view;
uniform bool near_only, dots;
flat out vec3 colour;
out vec2 corner;
out float beyond;
${shading}
void main() {
  int id = gl_VertexID / 3;
  int k = gl_VertexID - 3 * id;
  ivec2 texel = ivec2(id % ${WIDTH}, id / ${WIDTH});
  vec4 place = texelFetch(places, texel, 0);
  vec4 normal = texelFetch(normals, texel, 0);
  vec4 centre = modelViewMatrix * vec4(place.xyz, 1.0);
  vec3 n = normalize(mat3(modelViewMatrix) * normal.xyz);
  vec3 v = flat_view > 0.5 ? vec3(0.0, 0.0, 1.0) : normalize(-centre.xyz);
  float inside = dot(n, v) < 0.0 ? 1.0 : 0.0;
  if (near_only && inside > 0.5 && !dots) {
    gl_Position = vec4(0.0, 0.0, 2.0, 1.0);
    return;
  }
  vec3 albedo = plain;
  if (colouring == 1) albedo = 0.5 + 0.5 * normal.xyz;
  if (colouring == 2) albedo = texture(palette, vec2(clamp((normal.w - range.x) / (range.y - range.x), 0.002, 0.998), 0.5)).rgb;
  colour = shade(albedo, inside > 0.5 ? -n : n, v, up, colouring == 0 && !dots ? inside : 0.0);
  corner = k == 0 ? vec2(0.0, 2.0) : k == 1 ? vec2(-1.7320508, -1.0) : vec2(1.7320508, -1.0);
  vec3 at = place.xyz;
  if (dots) {
    vec4 shown = projectionMatrix * centre;
    beyond = dot(cut.xyz, at) - cut.w;
    gl_Position = shown + vec4(corner * dot_size * vec2(projectionMatrix[0][0] / projectionMatrix[1][1], 1.0) * shown.w, 0.0, 0.0);
    return;
  }
  float s = normal.z >= 0.0 ? 1.0 : -1.0;
  float a = -1.0 / (s + normal.z);
  float b = normal.x * normal.y * a;
  vec3 e = vec3(1.0 + s * normal.x * normal.x * a, s * b, -s * normal.x);
  vec3 f = vec3(b, s + normal.y * normal.y * a, -normal.y);
  at += size * place.w * (corner.x * e + corner.y * f);
  beyond = dot(cut.xyz, at) - cut.w;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(at, 1.0);
}
`;

const fragmentShader = /* glsl */ `
precision highp float;
flat in vec3 colour;
in vec2 corner;
in float beyond;
out vec4 outColour;
void main() {
  float d = dot(corner, corner);
  if (d > 1.0 || beyond > 0.0) discard;
  outColour = vec4(colour * (1.0 - 0.13 * smoothstep(0.62, 1.0, d)), 1.0);
}
`;

/** What a colouring shows of each floater. */
export function valuesOf(frame: Frame, colouring: Colouring): Float32Array | undefined {
  if (colouring === 'radius') return frame.radii;
  return colouring === 'curvature' ? frame.curvature : colouring === 'error' ? frame.error : undefined;
}

function floatTexture(rows: number): THREE.DataTexture {
  const texture = new THREE.DataTexture(new Float32Array(4 * WIDTH * rows), WIDTH, rows, THREE.RGBAFormat, THREE.FloatType);
  texture.needsUpdate = true;
  return texture;
}

export class Discs {
  readonly object: THREE.Mesh;
  readonly uniforms;
  /** What the palette spans now; null where colours have no scale. */
  range: Range | null = null;
  private rows = 1;
  private colouring: Colouring = 'plain';
  private readonly geometry = new THREE.BufferGeometry();

  constructor() {
    const texels = new THREE.DataTexture(paletteTexels('plain'), 256, 1);
    texels.magFilter = texels.minFilter = THREE.LinearFilter;
    texels.needsUpdate = true;
    this.uniforms = {
      places: { value: floatTexture(1) },
      normals: { value: floatTexture(1) },
      palette: { value: texels },
      plain: { value: new THREE.Vector3() },
      up: { value: new THREE.Vector3(0, 1, 0) },
      cut: { value: new THREE.Vector4(0, 0, 0, 1) },
      range: { value: new THREE.Vector2(0, 1) },
      colouring: { value: 0 },
      size: { value: 1 },
      dot_size: { value: 0.004 },
      flat_view: { value: 0 },
      near_only: { value: false },
      dots: { value: false },
    };
    const material = new THREE.RawShaderMaterial({
      glslVersion: THREE.GLSL3,
      side: THREE.DoubleSide,
      uniforms: this.uniforms,
      vertexShader,
      fragmentShader,
    });
    this.object = new THREE.Mesh(this.geometry, material);
    this.object.frustumCulled = false;
    this.geometry.setDrawRange(0, 0);
  }

  /** Takes over a frame. */
  set(frame: Frame, colouring: Colouring): void {
    const rows = Math.ceil(frame.count / WIDTH);
    if (rows > this.rows) this.grow(rows);
    const places = this.uniforms.places.value.image.data as Float32Array;
    const normals = this.uniforms.normals.value.image.data as Float32Array;
    const values = valuesOf(frame, colouring);
    const { positions: p, normals: n, radii } = frame;
    for (let i = 0, j = 0, k = 0; i < frame.count; i++, j += 4, k += 3) {
      places[j] = p[k]!;
      places[j + 1] = p[k + 1]!;
      places[j + 2] = p[k + 2]!;
      places[j + 3] = radii[i]!;
      normals[j] = n[k]!;
      normals[j + 1] = n[k + 1]!;
      normals[j + 2] = n[k + 2]!;
      if (values) normals[j + 3] = values[i]!;
    }
    this.uniforms.places.value.needsUpdate = true;
    this.uniforms.normals.value.needsUpdate = true;
    this.colour(colouring, values);
    this.geometry.setDrawRange(0, 3 * frame.count);
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

  private grow(rows: number): void {
    this.rows = 2 ** Math.ceil(Math.log2(rows));
    this.uniforms.places.value.dispose();
    this.uniforms.normals.value.dispose();
    this.uniforms.places.value = floatTexture(this.rows);
    this.uniforms.normals.value = floatTexture(this.rows);
  }

  dispose(): void {
    this.uniforms.places.value.dispose();
    this.uniforms.normals.value.dispose();
    this.uniforms.palette.value.dispose();
    this.geometry.dispose();
    (this.object.material as THREE.Material).dispose();
  }
}
