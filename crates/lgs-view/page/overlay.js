// Paths and velocities of some Gaussians over a picture.

import { dot, scale, sub, add } from './vectors.js';

/** Pixel of a point in the view of a pose, or nothing behind it. */
function project({ position, axes, fovY }, [width, height], point) {
  const offset = sub(point, position);
  const [x, y, z] = axes.map((axis) => dot(axis, offset));
  if (z <= 1e-6) return null;
  const focal = height / (2 * Math.tan(0.5 * fovY));
  return [0.5 * width + (focal * x) / z, 0.5 * height + (focal * y) / z];
}

/** Place and velocity on a path at a time. */
function at(times, path, time) {
  const step = times[1] - times[0];
  const k = Math.max(0, Math.min(times.length - 2, Math.floor((time - times[0]) / step)));
  const change = sub(path[k + 1], path[k]);
  return { place: add(path[k], scale(change, (time - times[k]) / step)), velocity: scale(change, 1 / step) };
}

const css = ([r, g, b], alpha) => `rgb(${r * 255} ${g * 255} ${b * 255} / ${alpha})`;

function line(context, points, color, width) {
  context.beginPath();
  context.strokeStyle = color;
  context.lineWidth = width;
  let down = false;
  for (const point of points) {
    if (!point) { down = false; continue; }
    if (down) context.lineTo(...point); else context.moveTo(...point);
    down = true;
  }
  context.stroke();
}

function arrow(context, from, to, color) {
  const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
  const length = Math.hypot(dx, dy);
  if (length < 2) return;
  const head = Math.min(8, 0.4 * length);
  const side = (turn) => {
    const angle = Math.atan2(dy, dx) + turn;
    return [to[0] - head * Math.cos(angle), to[1] - head * Math.sin(angle)];
  };
  line(context, [from, to, null, side(0.45), to, side(-0.45)], color, 1.5);
}

/** A potential as a map over the picture, with its forces. */
function potential(context, size, { size: [columns, rows], values, arrows }) {
  const map = Object.assign(document.createElement('canvas'), { width: columns, height: rows });
  const image = new ImageData(columns, rows);
  values.forEach((value, i) => {
    // From blue over green to yellow, as the figures of the report.
    image.data.set([68 + 185 * value ** 2, 20 + 211 * value, 120 - 90 * value + 60 * value * (1 - value), 130], 4 * i);
  });
  map.getContext('2d').putImageData(image, 0, 0);
  context.drawImage(map, 0, 0, ...size);
  for (const [x, y, u, v] of arrows) {
    arrow(context, [x * size[0], y * size[1]], [u * size[0], v * size[1]], '#fffd');
  }
}

/** Clears the overlay and draws what is asked for. */
export function drawOverlay(context, size, overlay) {
  const { pose, paths, time, window, colors, showPaths, showArrows, slice } = overlay;
  context.clearRect(0, 0, ...size);
  if (slice) potential(context, size, slice);
  if (!paths || !pose) return;
  paths.points.forEach((path, i) => {
    const color = colors[paths.objects[i]] ?? [1, 1, 1];
    if (showPaths) {
      const seen = (k) => paths.times[k] >= -1e-6 && paths.times[k] <= window + 1e-6;
      const points = path.map((point) => project(pose, size, point));
      line(context, points.map((p, k) => (seen(k) ? p : null)), css(color, 0.8), 1.5);
      line(context, points.map((p, k) => (seen(k) ? null : p)), css(color, 0.28), 1);
    }
    if (showArrows) {
      const { place, velocity } = at(paths.times, path, time);
      const ends = [place, add(place, scale(velocity, 0.15 * window))].map((p) => project(pose, size, p));
      if (ends[0] && ends[1]) arrow(context, ends[0], ends[1], css(color, 0.95));
    }
  });
}
