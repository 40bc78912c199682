/**
 * The picture: renderer, camera and what is drawn. Draws only when something has changed; a moment later, at rest, once more with
 * more pixels.
 */
import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import type { Frame, MeshData, Vec3 } from '../../client/protocol.ts';
import type { Section, View } from '../state/view.ts';
import { plain } from './colours.ts';
import { Discs } from './discs.ts';
import { SurfaceMesh } from './surface.ts';

/** What panels cover, in CSS pixels. */
export interface Insets {
  left: number;
  right: number;
  top: number;
  bottom: number;
}

export interface Ray {
  origin: Vec3;
  direction: Vec3;
}

/** Half the field of view, in degrees. */
const HALF_FOV = 15;
/** Milliseconds without a change after which the picture is refined. */
const REST = 220;
/** Most pixels of a refined picture. */
const MOST_PIXELS = 9e6;

/** Whether pixels are made by the processor: then they are counted. */
function isSoftware(gl: WebGL2RenderingContext): boolean {
  const info = gl.getExtension('WEBGL_debug_renderer_info');
  const name = info ? String(gl.getParameter(info.UNMASKED_RENDERER_WEBGL)) : '';
  return /swiftshader|llvmpipe|software/i.test(name);
}

export class Stage {
  readonly controls: OrbitControls;
  readonly discs = new Discs();
  readonly mesh: SurfaceMesh;
  /** Called after each picture: overlays follow the camera. */
  onDraw: () => void = () => {};
  onLost: (lost: boolean) => void = () => {};
  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly perspective = new THREE.PerspectiveCamera(2 * HALF_FOV, 1, 0.01, 100);
  private readonly flat = new THREE.OrthographicCamera(-1, 1, 1, -1, 0.01, 100);
  private readonly software: boolean;
  private insets: Insets = { left: 0, right: 0, top: 0, bottom: 0 };
  private frame: Frame | null = null;
  private size = { width: 1, height: 1 };
  private pending = 0;
  private rest = 0;
  private refined = false;
  private orthographic = false;
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
    for (const camera of [this.perspective, this.flat]) {
      camera.up.set(0, 0, 1);
      camera.position.set(6, -9, 5);
    }
    this.controls = new OrbitControls(this.perspective, canvas);
    this.controls.enableDamping = false;
    this.controls.zoomToCursor = true;
    this.controls.addEventListener('change', this.request);
    canvas.addEventListener('webglcontextlost', this.lost);
    canvas.addEventListener('webglcontextrestored', this.restored);
  }

  get camera(): THREE.PerspectiveCamera | THREE.OrthographicCamera {
    return this.orthographic ? this.flat : this.perspective;
  }

  /** Draws at the next chance, once. */
  readonly request = (): void => {
    clearTimeout(this.rest);
    this.rest = window.setTimeout(this.refine, REST);
    this.schedule(false);
  };

  private schedule(refined: boolean): void {
    if (this.pending) return;
    this.pending = requestAnimationFrame(() => {
      this.pending = 0;
      this.draw(refined);
    });
  }

  private readonly refine = (): void => this.schedule(true);

  private draw(refined: boolean): void {
    if (this.renderer.getContext().isContextLost()) return;
    if (refined !== this.refined) {
      this.refined = refined;
      this.resizeBuffer();
    }
    this.aim();
    this.renderer.render(this.scene, this.camera);
    this.onDraw();
  }

  /** The light's up, and near and far planes around what there is. */
  private aim(): void {
    const camera = this.camera;
    camera.updateMatrixWorld();
    const sphere = this.sphere;
    const away = camera.position.distanceTo(sphere.center);
    const radius = 1.6 * sphere.radius;
    camera.near = this.orthographic ? away - 40 * radius : Math.max((away - radius) * 0.9, away * 2e-3, radius * 1e-3);
    camera.far = away + (this.orthographic ? 40 : 1.2) * radius;
    camera.updateProjectionMatrix();
    const u = this.discs.uniforms;
    u.up.value.set(0, 0, 1).transformDirection(camera.matrixWorldInverse);
    u.flat_view.value = this.orthographic ? 1 : 0;
    u.dot_size.value = 3.2 / this.size.height;
  }

  resize(width: number, height: number, insets: Insets): void {
    this.size = { width: Math.max(1, width), height: Math.max(1, height) };
    this.insets = insets;
    this.resizeBuffer();
    this.frameCameras();
    this.request();
  }

  private resizeBuffer(): void {
    const { width, height } = this.size;
    const dpr = Math.min(devicePixelRatio, 2);
    const still = Math.min(2 * dpr, 3, Math.sqrt(MOST_PIXELS / (width * height)));
    this.renderer.setPixelRatio(this.refined ? Math.max(still, 1) : this.software ? 1 : dpr);
    this.renderer.setSize(width, height, false);
  }

  /** The middle of what panels leave free is the middle of the picture. */
  private frameCameras(): void {
    const { width, height } = this.size;
    const { left, right, top, bottom } = this.insets;
    this.perspective.aspect = width / height;
    const half = (this.flat.top - this.flat.bottom) / 2;
    this.flat.left = (-half * width) / height;
    this.flat.right = (half * width) / height;
    for (const camera of [this.perspective, this.flat]) {
      camera.setViewOffset(width, height, (right - left) / 2, (bottom - top) / 2, width, height);
    }
  }

  setFrame(frame: Frame, view: View): void {
    this.frame = frame;
    const open = this.measure(frame);
    this.discs.set(frame, view.colouring, open);
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
    const cut = this.cut(section);
    u.cut.value.set(...cut);
    if (section.on) u.closed.value = false;
    else if (this.frame) u.closed.value = !this.measure(this.frame);
    if (view.orthographic !== this.orthographic) this.project(view.orthographic);
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

  private project(orthographic: boolean): void {
    const from = this.camera;
    this.orthographic = orthographic;
    const to = this.camera;
    const target = this.controls.target;
    const tan = Math.tan(THREE.MathUtils.degToRad(HALF_FOV));
    const away = from.position.distanceTo(target);
    to.position.copy(from.position);
    to.quaternion.copy(from.quaternion);
    if (orthographic) {
      this.flat.zoom = 1;
      this.flat.top = (away * tan) / this.perspective.zoom;
      this.flat.bottom = -this.flat.top;
    } else {
      const half = this.flat.top / this.flat.zoom;
      to.position.sub(target).setLength(half / tan).add(target);
      this.perspective.zoom = 1;
    }
    this.controls.object = to;
    this.frameCameras();
    this.controls.update();
  }

  /** Shows all of the surface, from where the camera is or along a direction. */
  fit(along?: Vec3): void {
    const sphere = this.sphere;
    const direction = along ? new THREE.Vector3(...along) : this.camera.position.clone().sub(this.controls.target);
    if (direction.lengthSq() === 0) direction.set(2, -3, 1.6);
    const { width, height } = this.size;
    const free = {
      width: Math.max(80, width - this.insets.left - this.insets.right),
      height: Math.max(80, height - this.insets.top - this.insets.bottom),
    };
    const tan = Math.tan(THREE.MathUtils.degToRad(HALF_FOV));
    const margin = 1.2 * sphere.radius * Math.max(1, free.height / free.width) * (height / free.height);
    const away = margin / tan + 0.2 * sphere.radius;
    this.controls.target.copy(sphere.center);
    for (const camera of [this.perspective, this.flat]) {
      camera.position.copy(sphere.center).addScaledVector(direction.clone().normalize(), away);
      camera.zoom = 1;
    }
    this.flat.top = margin;
    this.flat.bottom = -margin;
    this.frameCameras();
    this.controls.update();
    this.request();
  }

  /** CSS pixels; z is the depth, above 1 behind the camera. */
  toScreen(p: Vec3): [number, number, number] {
    const v = new THREE.Vector3(...p).project(this.camera);
    return [(0.5 + 0.5 * v.x) * this.size.width, (0.5 - 0.5 * v.y) * this.size.height, v.z];
  }

  /** The ray through a CSS pixel, in model coordinates. */
  ray(x: number, y: number): Ray {
    const at = (z: number) =>
      new THREE.Vector3((2 * x) / this.size.width - 1, 1 - (2 * y) / this.size.height, z).unproject(this.camera);
    const near = at(-1);
    const direction = at(1).sub(near).normalize();
    return { origin: near.toArray(), direction: direction.toArray() };
  }

  /** Where the ray through a pixel meets the plane through a point that faces the camera. */
  onViewPlane(x: number, y: number, through: Vec3): Vec3 {
    const { origin, direction } = this.ray(x, y);
    const facing = this.camera.getWorldDirection(new THREE.Vector3());
    const o = new THREE.Vector3(...origin);
    const d = new THREE.Vector3(...direction);
    const t = new THREE.Vector3(...through).sub(o).dot(facing) / d.dot(facing);
    return o.addScaledVector(d, t).toArray();
  }

  /** A picture with this many times the window's pixels, on a background or none. */
  async png(scale: number, background: string | null): Promise<Blob> {
    this.renderer.setPixelRatio(scale);
    this.renderer.setSize(this.size.width, this.size.height, false);
    if (background) this.renderer.setClearColor(new THREE.Color(background), 1);
    this.aim();
    this.renderer.render(this.scene, this.camera);
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
    this.controls.dispose();
    this.discs.dispose();
    this.mesh.dispose();
    this.renderer.dispose();
  }
}
