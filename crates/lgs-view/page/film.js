// A camera path: keyframes of what the page shows, saved as a file that `render --camera` follows.

import { dot } from './vectors.js';

const STEP = 1;

function button(textContent, onclick, title = '') {
  return Object.assign(document.createElement('button'), { textContent, onclick, title });
}

export class Film {
  /** `act` has functions shown (the view at hand), go (to a keyframe) and edits. */
  constructor(act) {
    this.act = act;
    this.keys = [];
    this.place = document.getElementById('film');
    this.build();
  }

  /** Keeps the view at hand, a second after the last one. */
  add() {
    const { pose, size, time, camera } = this.act.shown();
    const last = this.keys.at(-1);
    this.keys.push({ seconds: last ? last.seconds + STEP : 0, time, pose, size, camera });
    this.build();
  }

  build() {
    const title = Object.assign(document.createElement('h2'), { textContent: 'Camera path' });
    title.append(Object.assign(button('Add view', () => this.add(), 'Keep this camera and time (K)'), { id: 'key' }));
    const rows = this.keys.map((key, index) => this.row(key, index));
    this.place.replaceChildren(title, ...rows);
    if (!this.keys.length) return;
    const save = Object.assign(button('Save path', () => this.save()), { id: 'save-path' });
    const note = document.createElement('code');
    note.id = 'command';
    note.textContent = this.command();
    this.place.append(save, note);
  }

  row(key, index) {
    const row = Object.assign(document.createElement('div'), { className: 'key' });
    const go = button(`t = ${key.time.toFixed(2)}`, () => this.act.go(key), 'Show this view');
    const entry = Object.assign(document.createElement('input'), { type: 'number', step: 0.1, value: key.seconds });
    entry.setAttribute('aria-label', `Seconds of view ${index}`);
    entry.onchange = () => {
      if (Number.isFinite(entry.valueAsNumber)) key.seconds = entry.valueAsNumber;
      this.keys.sort((a, b) => a.seconds - b.seconds);
      this.build();
    };
    const drop = button('×', () => { this.keys.splice(index, 1); this.build(); }, 'Leave out');
    row.append(go, entry, 's', drop);
    return row;
  }

  /** The file's contents: one size for all, that of the first view. */
  file() {
    const [width, height] = this.keys[0].size;
    const key = ({ seconds, time, pose: { position, axes, fovY } }) => {
      const focal = height / (2 * Math.tan(0.5 * fovY));
      const rows = axes.map((axis) => [...axis, -dot(axis, position)]);
      return {
        seconds, time, fx: focal, fy: focal, cx: width / 2, cy: height / 2,
        camera_from_world: [...rows, [0, 0, 0, 1]],
      };
    };
    // No two views at the same second.
    const apart = this.keys.filter(({ seconds }, index) => !index || seconds > this.keys[index - 1].seconds);
    return { format: 'lagrangegs-camera-path/1', width, height, keyframes: apart.map(key) };
  }

  /** The command that renders it. */
  command() {
    const { run, edits, compare } = this.act.edits();
    const quoted = /^[\w./-]+$/.test(run) ? run : `'${run.replaceAll("'", "'\\''")}'`;
    const names = { velocity: 'velocity', potential: 'potential', force: 'force' };
    const [first] = edits;
    const flags = Object.keys(names).filter((name) => first && first[name] !== 1)
      .map((name) => `--${name}-scale ${first[name]}`);
    const alike = edits.every((edit) => !edit.terms.some((factor) => factor !== 1)
      && Object.keys(names).every((name) => edit[name] === first[name]));
    if (compare) flags.push(`--compare ${compare}`);
    const words = ['lagrangegs render', quoted, '--camera path.json', ...(alike ? flags : []), '--out film.mp4'];
    return words.join(' ') + (alike ? '' : '  # edits of single objects are not rendered');
  }

  save() {
    this.build();
    const text = JSON.stringify(this.file(), null, 1);
    const link = Object.assign(document.createElement('a'), { download: 'path.json' });
    link.href = URL.createObjectURL(new Blob([text], { type: 'application/json' }));
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }
}
