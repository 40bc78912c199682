/** The camera: perspective or orthographic, how it is moved, and what it sees where. */
import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import type { Vec3 } from '../../client/protocol.ts';

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

/** How keys move the camera: angles in radians. */
export interface Move {
  right?: number;
  up?: number;
  nearer?: number;
}

/** Least angle between the direction of sight and straight up or down, where left and right end. */
const LEAST_POLAR = 1e-3;
/** Half the field of view, in degrees. */
const HALF_FOV = 15;
const TAN = Math.tan(THREE.MathUtils.degToRad(HALF_FOV));

export class Eye {
  readonly controls: OrbitControls;
  orthographic = false;
  private readonly perspective = new THREE.PerspectiveCamera(2 * HALF_FOV, 1, 0.01, 100);
  private readonly flat = new THREE.OrthographicCamera(-1, 1, 1, -1, 0.01, 100);
  private insets: Insets = { left: 0, right: 0, top: 0, bottom: 0 };
  private size = { width: 1, height: 1 };

  constructor(
    canvas: HTMLElement,
    private readonly onChange: () => void,
  ) {
    for (const camera of [this.perspective, this.flat]) {
      camera.up.set(0, 0, 1);
      camera.position.set(6, -9, 5);
    }
    this.controls = new OrbitControls(this.perspective, canvas);
    this.controls.enableDamping = false;
    this.controls.zoomToCursor = true;
    this.controls.addEventListener('change', onChange);
  }

  get camera(): THREE.PerspectiveCamera | THREE.OrthographicCamera {
    return this.orthographic ? this.flat : this.perspective;
  }

  resize(width: number, height: number, insets: Insets): void {
    this.size = { width, height };
    this.insets = insets;
    this.frameCameras();
  }

  /** Near and far planes around what there is. */
  aim(sphere: THREE.Sphere): void {
    const camera = this.camera;
    camera.updateMatrixWorld();
    const away = camera.position.distanceTo(sphere.center);
    const radius = 1.6 * sphere.radius;
    camera.near = this.orthographic ? away - 40 * radius : Math.max((away - radius) * 0.9, away * 2e-3, radius * 1e-3);
    camera.far = away + (this.orthographic ? 40 : 1.2) * radius;
    camera.updateProjectionMatrix();
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

  /** From one projection to the other, with what is looked at as large as before. */
  project(orthographic: boolean): void {
    const from = this.camera;
    this.orthographic = orthographic;
    const to = this.camera;
    const target = this.controls.target;
    const away = from.position.distanceTo(target);
    to.position.copy(from.position);
    to.quaternion.copy(from.quaternion);
    if (orthographic) {
      this.flat.zoom = 1;
      this.flat.top = (away * TAN) / this.perspective.zoom;
      this.flat.bottom = -this.flat.top;
    } else {
      const half = this.flat.top / this.flat.zoom;
      to.position.sub(target).setLength(half / TAN).add(target);
      this.perspective.zoom = 1;
    }
    this.controls.object = to;
    this.frameCameras();
    this.controls.update();
  }

  /** Goes around what is looked at, by angles to the right and up, or nearer by a factor. */
  move({ right = 0, up = 0, nearer = 1 }: Move): void {
    const { target } = this.controls;
    const from = this.camera.position.clone().sub(target);
    // Positions have z up, spherical coordinates y.
    const at = new THREE.Spherical().setFromVector3(new THREE.Vector3(from.y, from.z, from.x));
    at.theta += right;
    at.phi = THREE.MathUtils.clamp(at.phi - up, LEAST_POLAR, Math.PI - LEAST_POLAR);
    if (this.orthographic) this.flat.zoom *= nearer;
    else at.radius /= nearer;
    const { x, y, z } = new THREE.Vector3().setFromSpherical(at);
    this.camera.position.set(z, x, y).add(target);
    this.controls.update();
    this.onChange();
  }

  /** Shows all of a sphere, from where the camera is or along a direction. */
  fit(sphere: THREE.Sphere, along?: Vec3): void {
    const direction = along ? new THREE.Vector3(...along) : this.camera.position.clone().sub(this.controls.target);
    if (direction.lengthSq() === 0) direction.set(2, -3, 1.6);
    const { width, height } = this.size;
    const free = {
      width: Math.max(80, width - this.insets.left - this.insets.right),
      height: Math.max(80, height - this.insets.top - this.insets.bottom),
    };
    const margin = 1.2 * sphere.radius * Math.max(1, free.height / free.width) * (height / free.height);
    const away = margin / TAN + 0.2 * sphere.radius;
    this.controls.target.copy(sphere.center);
    for (const camera of [this.perspective, this.flat]) {
      camera.position.copy(sphere.center).addScaledVector(direction.clone().normalize(), away);
      camera.zoom = 1;
    }
    this.flat.top = margin;
    this.flat.bottom = -margin;
    this.frameCameras();
    this.controls.update();
  }

  /** Where the eye is; with true: the direction towards it, which is the same everywhere. */
  from(): [THREE.Vector3, boolean] {
    if (!this.orthographic) return [this.camera.position, false];
    return [this.camera.getWorldDirection(new THREE.Vector3()).negate(), true];
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

  dispose(): void {
    this.controls.dispose();
  }
}
