// The camera of the page: it orbits a target, or stands where a camera of the dataset stands.

import { add, columns, cross, dot, length, quaternion, scale, sub, unit } from './vectors.js';

const STEEPEST = 1.55;

export class Camera {
  constructor(start) {
    this.start = start;
    this.up = unit(start.up);
    // Two directions across `up`, from which azimuths count.
    const other = Math.abs(this.up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0];
    this.east = unit(sub(other, scale(this.up, dot(other, this.up))));
    this.north = cross(this.up, this.east);
    this.reset();
  }

  reset() {
    this.dataset = null;
    this.fovY = this.start.fov_y;
    this.look(this.start.position, this.start.target);
  }

  /** Looks from a place at a target. */
  look(position, target) {
    const offset = sub(position, target);
    this.target = target;
    this.distance = Math.max(length(offset), 1e-6);
    const direction = unit(offset);
    this.pitch = Math.asin(Math.max(-1, Math.min(1, dot(direction, this.up))));
    this.yaw = Math.atan2(dot(direction, this.north), dot(direction, this.east));
  }

  /** Direction from the target to the camera. */
  direction() {
    const [c, s] = [Math.cos(this.pitch), Math.sin(this.pitch)];
    const across = add(scale(this.east, c * Math.cos(this.yaw)), scale(this.north, c * Math.sin(this.yaw)));
    return add(across, scale(this.up, s));
  }

  position() {
    return add(this.target, scale(this.direction(), this.distance));
  }

  /** Axes right, down, forward. */
  axes() {
    const forward = scale(this.direction(), -1);
    const right = unit(cross(forward, this.up));
    return [right, cross(forward, right), forward];
  }

  /** The pose as requests and overlays take it: of a dataset's camera if one is chosen. */
  pose(cameras) {
    if (this.dataset !== null && cameras[this.dataset]) {
      const { position, rotation, fov_y } = cameras[this.dataset];
      return { position, axes: columns(rotation), fovY: fov_y };
    }
    return { position: this.position(), axes: this.axes(), fovY: this.fovY };
  }

  /** What a request says of it. */
  request() {
    if (this.dataset !== null) return { dataset: this.dataset };
    return { position: this.position(), rotation: quaternion(this.axes()), fov_y: this.fovY };
  }

  /** Stands where a camera of the dataset stands. */
  jump(index) {
    this.dataset = index;
  }

  /** Leaves the camera of the dataset, from where it stands. */
  free(cameras) {
    if (this.dataset === null) return;
    const { position, axes, fovY } = this.pose(cameras);
    const depth = Math.max(dot(sub(this.start.target, position), axes[2]), 0.1 * this.distance);
    this.dataset = null;
    this.fovY = fovY;
    this.look(position, add(position, scale(axes[2], depth)));
  }

  orbit(dx, dy) {
    this.yaw -= dx;
    this.pitch = Math.max(-STEEPEST, Math.min(STEEPEST, this.pitch + dy));
  }

  /** Moves sideways by parts of the picture's height. */
  pan(dx, dy) {
    const size = 2 * this.distance * Math.tan(0.5 * this.fovY);
    const [right, down] = this.axes();
    this.target = add(this.target, add(scale(right, -dx * size), scale(down, -dy * size)));
  }

  zoom(factor) {
    const whole = length(sub(this.start.position, this.start.target));
    this.distance = Math.max(1e-3 * whole, Math.min(100 * whole, this.distance * factor));
  }

  /** Flies right, down and forward by parts of the distance to the target. */
  fly(right, down, forward) {
    const axes = this.axes();
    const step = [right, down, forward].map((part, i) => scale(axes[i], part * this.distance)).reduce(add);
    this.target = add(this.target, step);
  }

  state() {
    const { target, distance, yaw, pitch, fovY, dataset } = this;
    return { target, distance, yaw, pitch, fovY, dataset };
  }

  restore(state) {
    const numbers = [state.distance, state.yaw, state.pitch, state.fovY, ...(state.target ?? [NaN])];
    if (numbers.length === 7 && numbers.every(Number.isFinite)) Object.assign(this, state);
  }
}
