/**
 * The picture: renderer, camera and what is drawn. Draws only when something has changed; a moment later, at rest, once more with
 * what is left out while it moves.
 */
import * as THREE from 'three';
import type { Frame, MeshData, Vec3 } from '../../client/protocol.ts';
import type { Section, View } from '../state/view.ts';
import { plain } from './colours.ts';
import { Discs } from './discs.ts';
import { Eye, type Insets } from './eye.ts';
import { SurfaceMesh } from './surface.ts';

/** Milliseconds without a change after which the picture is completed. */
const REST = 220;
/** Most pixels of a picture. */
const MOST_PIXELS = 8e6;

/** Whether pixels are made by the processor: then they are counted. */
function isSoftware(gl: WebGL2RenderingContext): boolean {
  const info = gl.getExtension('WEBGL_debug_renderer_info');
  const name = info ? String(gl.getParameter(info.UNMASKED_RENDERER_WEBGL)) : '';
  return /swiftshader|llvmpipe|software/i.test(name);
}

export class Stage {
  readonly eye: Eye;
  readonly discs = new Discs();
  readonly mesh: SurfaceMesh;
  /** Called after each picture: overlays follow the camera. */
  onDraw: () => void = () => {};
  onLost: (lost: boolean) => void = () => {};
  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly software: boolean;
  private frame: Frame | null = null;
  private size = { width: 1, height: 1 };
  private pending = 0;
  private rest = 0;
  private moving = false;
  /** Whether the surface has no edge at the box, and whether it is cut open. */
  private closed = true;
  private cutting = false;
  private box = new THREE.Box3(new THREE.Vector3(-1, -1, -1), new THREE.Vector3(1, 1, 1));
  /** Around all floaters. */
  private readonly sphere = new THREE.Sphere(new THREE.Vector3(), 1);

  /** @throws where there is no WebGL 2. */
  constructor(readonly canvas: HTMLCanvasElement) {
    const gl = canvas.getContext('webgl2', { alpha: true, antialias: false, powerPreference: 'high-performance' });
    if (!gl) throw new Error('WebGL 2 is missing');
    this.renderer = new THREE.WebGLRenderer({ canvas, context: gl });
    this.renderer.setClearColor(0, 0);
    this.software = isSoftware(gl);
    this.mesh = new SurfaceMesh(this.discs);
    this.scene.add(this.discs.object, this.mesh.object);
    this.eye = new Eye(canvas, this.request);
    canvas.addEventListener('webglcontextlost', this.lost);
    canvas.addEventListener('webglcontextrestored', this.restored);
  }

  /** Draws at the next chance, once. */
  readonly request = (): void => {
    this.refineSoon();
    this.schedule(false);
  };

  /** Whether the surface moves: then nothing is refined. */
  setMoving(moving: boolean): void {
    this.moving = moving;
    this.refineSoon();
  }

  private refineSoon(): void {
    clearTimeout(this.rest);
    if (!this.moving) this.rest = window.setTimeout(() => this.schedule(true), REST);
  }

  private schedule(refined: boolean): void {
    if (this.pending) return;
    this.pending = requestAnimationFrame(() => {
      this.pending = 0;
      this.draw(refined);
    });
  }

  private draw(refined: boolean): void {
    if (this.renderer.getContext().isContextLost()) return;
    // While it moves, the far side is left out where pixels are dear; through gaps between discs it is seen otherwise.
    this.render(this.software && !refined && this.closed && !this.cutting);
    this.onDraw();
  }

  private render(nearOnly: boolean): void {
    this.eye.aim(this.sphere);
    const { camera } = this.eye;
    if (nearOnly) this.discs.drawNear(...this.eye.from());
    else this.discs.drawAll();
    const u = this.discs.uniforms;
    u.up.value.set(0, 0, 1).transformDirection(camera.matrixWorldInverse);
    u.flat_view.value = this.eye.orthographic ? 1 : 0;
    u.dot_size.value = 3.2 / this.size.height;
    this.renderer.render(this.scene, camera);
  }

  /** Shows all of the surface, from where the camera is or along a direction. */
  fit(along?: Vec3): void {
    this.eye.fit(this.sphere, along);
    this.request();
  }

  /** Shows what lies around a point, from where the camera is. */
  fitAround(centre: Vec3, radius: number): void {
    this.eye.fit(new THREE.Sphere(new THREE.Vector3(...centre), radius));
    this.request();
  }

  resize(width: number, height: number, insets: Insets): void {
    this.size = { width: Math.max(1, width), height: Math.max(1, height) };
    this.resizeBuffer();
    this.eye.resize(this.size.width, this.size.height, insets);
    this.request();
  }

  private resizeBuffer(): void {
    const { width, height } = this.size;
    // Edges of discs are jagged unless there are more pixels than the screen has; the processor cannot afford them.
    const most = Math.sqrt(MOST_PIXELS / (width * height));
    this.renderer.setPixelRatio(this.software ? 1 : Math.max(1, Math.min(1.5 * devicePixelRatio, 2.5, most)));
    this.renderer.setSize(width, height, false);
  }

  setFrame(frame: Frame, view: View): void {
    this.frame = frame;
    const open = this.measure(frame);
    this.closed = !open;
    this.discs.set(frame, view.colouring);
    if (view.mode === 'mesh') this.mesh.colour(frame, view.colouring);
    this.request();
  }

  /** The box around the floaters; whether they end at the box that clips the surface. */
  private measure(frame: Frame): boolean {
    const lo = [Infinity, Infinity, Infinity];
    const hi = [-Infinity, -Infinity, -Infinity];
    const p = frame.positions;
    for (let i = 0; i < 3 * frame.count; i++) {
      const a = i % 3;
      const v = p[i]!;
      if (v < lo[a]!) lo[a] = v;
      if (v > hi[a]!) hi[a] = v;
    }
    if (frame.count > 0) {
      this.box.set(new THREE.Vector3(...lo), new THREE.Vector3(...hi));
      this.enclose(p, frame.spacing);
    }
    const [low, high] = frame.bounds;
    const near = 0.5 * frame.spacing;
    return lo.some((v, a) => v < low[a]! + near) || hi.some((v, a) => v > high[a]! - near);
  }

  private enclose(p: Float32Array, margin: number): void {
    const { x, y, z } = this.box.getCenter(this.sphere.center);
    let most = 0;
    for (let k = 0; k < p.length; k += 3) most = Math.max(most, (p[k]! - x) ** 2 + (p[k + 1]! - y) ** 2 + (p[k + 2]! - z) ** 2);
    this.sphere.radius = Math.sqrt(most) + margin;
  }

  setMesh(mesh: MeshData, view: View): void {
    this.mesh.set(mesh);
    if (this.frame) this.mesh.colour(this.frame, view.colouring);
    this.request();
  }

  /** `planar`: a curve, whose discs would be seen edge on. */
  look(view: View, section: Section, dark: boolean, planar: boolean): void {
    const u = this.discs.uniforms;
    const showMesh = view.mode === 'mesh';
    this.discs.object.visible = !showMesh;
    this.mesh.object.visible = showMesh;
    this.mesh.look(view.shading, dark ? 0x1b1411 : 0x5a2d1a);
    u.dots.value = view.mode === 'points' || planar;
    u.size.value = view.discSize;
    u.plain.value.set(...plain(dark));
    this.discs.cut(section.on ? this.cut(section) : null);
    this.cutting = section.on;
    if (view.orthographic !== this.eye.orthographic) this.eye.project(view.orthographic);
    this.request();
  }

  /** Normal and offset of the section plane: what is beyond it is not shown. */
  cut(section: Section): [number, number, number, number] {
    if (!section.on) return [0, 0, 0, 1];
    const sign = section.flipped ? -1 : 1;
    const axis = section.axis;
    const [lo, hi] = [this.box.min.getComponent(axis), this.box.max.getComponent(axis)];
    const at = lo + section.at * (hi - lo);
    const normal: [number, number, number, number] = [0, 0, 0, sign * at];
    normal[axis] = sign;
    return normal;
  }

  /** A picture with this many times the window's pixels, on a background or none. */
  async png(scale: number, background: string | null): Promise<Blob> {
    this.renderer.setPixelRatio(scale);
    this.renderer.setSize(this.size.width, this.size.height, false);
    if (background) this.renderer.setClearColor(new THREE.Color(background), 1);
    this.render(false);
    const blob = await new Promise<Blob | null>(done => this.canvas.toBlob(done, 'image/png'));
    this.renderer.setClearColor(0, 0);
    this.resizeBuffer();
    this.request();
    if (!blob) throw new Error('The browser could not make a picture of this size.');
    return blob;
  }

  private readonly lost = (event: Event): void => {
    event.preventDefault();
    this.onLost(true);
  };

  private readonly restored = (): void => {
    this.onLost(false);
    this.request();
  };

  dispose(): void {
    cancelAnimationFrame(this.pending);
    clearTimeout(this.rest);
    this.canvas.removeEventListener('webglcontextlost', this.lost);
    this.canvas.removeEventListener('webglcontextrestored', this.restored);
    this.eye.dispose();
    this.discs.dispose();
    this.mesh.dispose();
    this.renderer.dispose();
  }
}
