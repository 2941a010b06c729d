// A pane: asks for pictures of a size that keeps pace with the view, and shows the newest.

import { drawOverlay } from './overlay.js';

const PACE = [14, 32];
const SMALLEST = 0.35;
const UNDERWAY = 2;
const REST = 180;
/** Milliseconds on the link, and qualities of JPEG that adapt to them. */
const LINK = [25, 70];
const JPEG = [35, 85];

export class Pane {
  constructor(index, element, connection) {
    Object.assign(this, { index, element, connection, serial: 0, shown: 0, sharpness: 1, header: null });
    this.jpeg = 80;
    // Numbers of the picture that came last, and of the newest that is shown.
    [this.arrived, this.newest] = [0, 0];
    [this.picture, this.overlay] = element.querySelectorAll('canvas');
    this.caption = element.querySelector('figcaption');
    this.doubt = element.querySelector('.doubt');
    this.underway = new Map();
    this.dirty = false;
    this.keep = null;
    this.latencies = [];
  }

  /** Asks for the view that `view()` gives; `moving` views may be coarser. */
  ask(view, moving) {
    this.view = view;
    this.dirty = true;
    clearTimeout(this.rest);
    if (moving) this.rest = setTimeout(() => { this.coarse = false; this.dirty = true; this.flush(); }, REST);
    this.coarse = moving;
    this.flush();
  }

  flush() {
    if (!this.dirty || !this.view || this.underway.size >= UNDERWAY || !this.connection.ready) return;
    const request = this.view();
    if (!request) return;
    this.dirty = false;
    this.serial += 1;
    const quality = request.exact ? 'exact' : this.coarse ? 'moving' : 'still';
    const { exact, ...rest } = request;
    const message = { kind: 'frame', pane: this.index, serial: this.serial, quality, ...rest };
    message.size = this.size(rest.aspect, this.coarse && !exact ? this.sharpness : 1);
    delete message.aspect;
    if (quality === 'moving') message.jpeg = Math.round(this.jpeg);
    this.underway.set(this.serial, performance.now());
    this.last = message;
    this.connection.send(message);
  }

  /** Size of the picture, pixels; at the proportions of a dataset's camera inside of the pane. */
  size(aspect, sharpness) {
    const ratio = window.devicePixelRatio || 1;
    let [width, height] = [this.element.clientWidth, this.element.clientHeight];
    if (aspect) {
      if (width / height > aspect) width = height * aspect; else height = width / aspect;
    }
    this.fit(width, height);
    const most = Math.min(1, 2048 / (ratio * Math.max(width, height)));
    return [width, height].map((side) => Math.max(1, Math.round(side * ratio * sharpness * most)));
  }

  /** Canvases of this size in the middle of the pane, CSS pixels. */
  fit(width, height) {
    for (const canvas of [this.picture, this.overlay]) {
      canvas.style.width = `${width}px`;
      canvas.style.height = `${height}px`;
      canvas.style.left = `${(this.element.clientWidth - width) / 2}px`;
      canvas.style.top = `${(this.element.clientHeight - height) / 2}px`;
    }
    this.box = [width, height];
  }

  /** Where in the last picture a point of the window is, in its pixels; nothing outside. */
  pixel(clientX, clientY) {
    const box = this.picture.getBoundingClientRect();
    const at = [(clientX - box.left) / box.width, (clientY - box.top) / box.height];
    if (!this.last || at.some((x) => x < 0 || x >= 1)) return null;
    return [at[0] * this.last.size[0], at[1] * this.last.size[1]];
  }

  async receive(header, blob) {
    const begun = this.underway.get(header.serial);
    if (begun !== undefined) {
      this.latency = performance.now() - begun;
      this.latencies.push(this.latency);
      if (this.latencies.length > 200) this.latencies.shift();
    }
    for (const serial of this.underway.keys()) if (serial <= header.serial) this.underway.delete(serial);
    this.pace(header);
    this.flush();
    this.arrived += 1;
    const arrival = this.arrived;
    const bitmap = await createImageBitmap(blob);
    // Of one request several pictures come while its motion rolls out, and an older one may decode later.
    if (arrival < this.newest) return;
    this.newest = arrival;
    this.shown = header.serial;
    this.header = header;
    [this.picture.width, this.picture.height] = header.size;
    this.picture.getContext('2d').drawImage(bitmap, 0, 0);
    if (this.keep && header.mime === 'image/png') { this.keep(blob); this.keep = null; }
    this.onshown?.(header);
  }

  /** Coarser pictures where they come too slowly, finer ones where there is time. */
  pace(header) {
    if (!this.coarse) return;
    if (header.milliseconds > PACE[1]) this.sharpness = Math.max(SMALLEST, 0.85 * this.sharpness);
    if (header.milliseconds < PACE[0]) this.sharpness = Math.min(1, 1.1 * this.sharpness);
    // What drawing does not explain is the link: fewer bytes help there, fewer pixels do not.
    const link = this.latency - UNDERWAY * header.milliseconds;
    if (link > LINK[1]) this.jpeg = Math.max(JPEG[0], this.jpeg - 8);
    if (link < LINK[0]) this.jpeg = Math.min(JPEG[1], this.jpeg + 3);
  }

  /** Forgets what a lost connection owes. */
  forget() {
    this.underway.clear();
    this.dirty = true;
  }

  drawOverlay(overlay) {
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = (this.box ?? [1, 1]).map((side) => Math.max(1, Math.round(side * ratio)));
    if (this.overlay.width !== width) this.overlay.width = width;
    if (this.overlay.height !== height) this.overlay.height = height;
    drawOverlay(this.overlay.getContext('2d'), [width, height], overlay);
  }
}
