// The page: one state, two panes, and what changes them.

import { Camera } from './camera.js';
import { Connection } from './connection.js';
import { divider, keys, pointers } from './controls.js';
import { Film } from './film.js';
import { Pane } from './pane.js';
import { Physics } from './physics.js';
import { Timeline } from './timeline.js';
import { Training } from './training.js';

const get = (id) => document.getElementById(id);
const stage = get('stage');
const page = { hello: null, camera: null, paths: null, pathsOf: null, rates: [] };

const connection = new Connection({ hello, frame, answer, state });
const panes = [0, 1].map((index) => new Pane(index, get(`pane-${index}`), connection));
const timeline = new Timeline((moving) => refresh(moving));
const physics = new Physics((moving) => refresh(moving));
const training = new Training(connection, {
  changed: () => refresh(timeline.playing),
  staged: () => connection.send({ kind: 'hello' }),
});
const film = new Film({
  shown: () => ({
    pose: page.camera.pose(page.hello.cameras), time: timeline.time, camera: page.camera.state(),
    size: panes[0].box.map((side) => Math.max(16, Math.round(side))),
  }),
  go({ camera, time }) { page.camera.restore(camera); timeline.set(time, false); },
  edits: () => ({
    run: page.hello?.run ?? 'RUN', edits: page.hello ? physics.request() : [],
    compare: { original: 'unedited', source: 'source' }[get('compare').value],
  }),
});
panes[0].onshown = shown;
panes[1].onshown = () => overlays();

function state(connected, reason) {
  const status = get('status');
  status.classList.toggle('lost', !connected);
  if (connected) return;
  status.textContent = reason ? `no connection: ${reason}` : 'no connection, trying again…';
}

function hello(message) {
  page.hello = message;
  document.title = `${message.title} – LagrangeGS`;
  get('title').textContent = message.title;
  get('title').title = message.missing.join('; ');
  if (!page.camera) page.camera = new Camera(message.start);
  timeline.begin(message.times, message.window);
  physics.begin(message.objects);
  training.begin(message.training);
  choices();
  panes.forEach((pane) => pane.forget());
  page.pathsOf = null;
  if (!page.restored) { page.restored = true; restore(); }
  if (message.missing.length) get('status').textContent = message.missing[0];
  refresh(false);
}

/** Cameras of the dataset, and models that the run does not have. */
function choices() {
  const { cameras, models } = page.hello;
  const option = (value, textContent) => (
    Object.assign(document.createElement('option'), { value, textContent }));
  get('cameras').replaceChildren(option('', 'free'), ...cameras.map(({ name }, i) => option(i, name)));
  for (const name of ['source', 'truth']) {
    get('compare').querySelector(`[value=${name}]`).disabled = !models.includes(name);
  }
}

/** The request of a pane. */
function view(index) {
  const compare = get('compare').value;
  const model = index === 0 || compare === 'original' ? page.hello.models[0] : compare;
  const edits = index === 1 ? [] : physics.request();
  const { dataset } = page.camera;
  const size = dataset === null ? null : page.hello.cameras[dataset].size;
  if (model === 'truth' && dataset === null) return null;
  return {
    camera: page.camera.request(), time: timeline.time, model, edits, style: get('style').value,
    aspect: size && size[0] / size[1], exact: get('exact').checked,
  };
}

const stageSize = () => `${stage.clientWidth} × ${stage.clientHeight}`;

function refresh(moving) {
  if (!page.hello) return;
  page.stageSize = stageSize();
  const compare = get('compare').value;
  if (compare === 'truth' && page.camera.dataset === null && page.hello.cameras.length) page.camera.jump(0);
  get('pane-1').hidden = compare === 'none';
  get('divider').hidden = compare === 'none' || get('layout').value !== 'split';
  stage.classList.toggle('split', compare !== 'none' && get('layout').value === 'split');
  get('cameras').value = page.camera.dataset ?? '';
  panes[0].ask(() => view(0), moving);
  if (compare !== 'none') panes[1].ask(() => view(1), moving);
  overlays();
  if (!moving) { paths(); remember(); film.build(); }
}

function frame(header, blob) {
  panes[header.pane]?.receive(header, blob);
  const now = performance.now();
  page.rates = [...page.rates.filter((time) => now - time < 1000), now];
}

function shown(header) {
  const rolling = header.rolling ? `, rolling out to ${timeline.time.toFixed(2)}` : '';
  const [used, most] = header.kept.map((bytes) => (bytes / 2 ** 20).toFixed(0));
  const kept = `${used} of ${most} MiB kept`;
  if (header.pane === 0) timeline.trust(header.trusted ?? [-1e9, 1e9]);
  get('status').textContent = `${page.rates.length} pictures/s, ${header.size.join(' × ')}, `
    + `${header.milliseconds.toFixed(0)} ms, ${kept}${rolling}`;
  overlays();
  slice();
}

function captions() {
  const compare = get('compare').value;
  const names = { original: 'unedited', source: 'source model', truth: 'dataset image' };
  panes.forEach((pane, index) => {
    const { header } = pane;
    if (!header) return;
    const name = index === 1 ? names[compare] : compare === 'none' ? '' : 'edited';
    pane.caption.textContent = `${name ? `${name}, ` : ''}t = ${header.time.toFixed(3)}`;
    pane.doubt.hidden = !header.untrusted.length;
    const ofSource = index === 1 && compare === 'source';
    const whose = ofSource ? 'the source model' : `object ${header.untrusted.join(', ')}`;
    pane.doubt.textContent = `beyond trust: ${whose}`;
  });
}

function overlays() {
  if (!page.hello) return;
  captions();
  const wanted = get('paths').checked || get('arrows').checked;
  panes.forEach((pane, index) => pane.drawOverlay({
    pose: page.camera.pose(page.hello.cameras),
    paths: wanted && index === 0 ? page.paths : null,
    time: timeline.time,
    window: page.hello.window,
    colors: page.hello.objects.map(({ color }) => color),
    showPaths: get('paths').checked,
    showArrows: get('arrows').checked,
    slice: index === 0 && get('potential').checked ? page.slice : null,
  }));
}

/** Asks for the potential of the chosen object, or of the first one, in the picture that is shown. */
function slice() {
  if (!get('potential').checked || !panes[0].last || !page.hello.objects.length) return;
  const { kind, ...view } = panes[0].last;
  connection.send({ kind: 'slice', view, object: physics.selected ?? 0 });
}

/** Asks for the paths of the edits at hand, once. */
function paths() {
  if (!get('paths').checked && !get('arrows').checked) return;
  const edits = physics.request();
  const key = JSON.stringify(edits);
  if (key === page.pathsOf) return;
  page.pathsOf = key;
  page.pathsSerial = (page.pathsSerial ?? 0) + 1;
  connection.send({ kind: 'paths', serial: page.pathsSerial, edits });
}

function answer(message) {
  if (message.kind === 'paths' && message.serial === page.pathsSerial) {
    page.paths = message;
    overlays();
  } else if (message.kind === 'training') {
    training.show(message);
  } else if (message.kind === 'picked') {
    physics.select(message.object);
    slice();
  } else if (message.kind === 'slice') {
    page.slice = message.slice;
    overlays();
  } else if (message.kind === 'refused') {
    get('status').textContent = message.reason;
    if (/potential|behind/.test(message.reason)) page.slice = null;
    panes[message.pane].underway.clear();
  }
}

const act = {
  move(change) {
    if (!page.camera) return;
    page.camera.free(page.hello.cameras);
    change(page.camera);
    refresh(true);
  },
  orbit: (dx, dy) => act.move((camera) => camera.orbit(0.008 * dx, 0.008 * dy)),
  pan: (dx, dy) => act.move((camera) => camera.pan(dx / stage.clientHeight, dy / stage.clientHeight)),
  zoom: (factor) => act.move((camera) => camera.zoom(factor)),
  rest: () => refresh(false),
  pick(x, y) {
    const pixel = panes[0].pixel(x, y);
    if (!pixel) return;
    const { kind, ...view } = panes[0].last;
    connection.send({ kind: 'pick', view, pixel });
  },
};

pointers(stage, act);
divider(get('divider'), stage);
const choose = (id, values) => {
  const select = get(id);
  const open = values.filter((value) => !select.querySelector(`[value="${value}"]`)?.disabled);
  select.value = open[(open.indexOf(select.value) + 1) % open.length];
  refresh(false);
};
keys({
  ' ': () => timeline.toggle(),
  ArrowLeft: (event) => timeline.step(event.shiftKey ? -10 : -1),
  ArrowRight: (event) => timeline.step(event.shiftKey ? 10 : 1),
  Home: () => timeline.set(0, false),
  End: () => timeline.set(page.hello.window, false),
  r: () => physics.reset(),
  c: () => choose('compare', ['none', 'original', 'source', 'truth']),
  o: () => choose('style', ['color', 'objects', 'points', 'ellipsoids']),
  p: () => picture(),
  t: () => panel(),
  k: () => film.add(),
  0: () => { page.camera.reset(); refresh(false); },
}, (right, down, forward) => act.move((camera) => camera.fly(right, down, forward)));

for (const id of ['compare', 'layout', 'style', 'paths', 'arrows', 'potential', 'exact']) {
  get(id).onchange = () => refresh(false);
}
get('cameras').onchange = ({ target }) => {
  if (target.value === '') page.camera.free(page.hello.cameras); else page.camera.jump(Number(target.value));
  target.blur();
  refresh(false);
};
get('shot').onclick = () => picture();
get('panel-toggle').onclick = () => panel();
// It also reports the size with which the page begins, for which pictures may be there already.
new ResizeObserver(() => { if (page.stageSize !== stageSize()) refresh(true); }).observe(stage);

function panel() {
  const shownNow = get('panel').toggleAttribute('hidden');
  get('panel-toggle').setAttribute('aria-expanded', String(!shownNow));
}

/** Saves the view as a PNG of full quality. */
function picture() {
  if (!page.hello) return;
  panes[0].keep = (blob) => {
    const link = Object.assign(document.createElement('a'), { href: URL.createObjectURL(blob) });
    link.download = `t_${timeline.time.toFixed(3)}.png`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  };
  panes[0].ask(() => ({ ...view(0), exact: true }), false);
}

/** Keeps the view in the address, so that a link shows it again. */
function remember() {
  const selects = Object.fromEntries(['compare', 'layout', 'style'].map((id) => [id, get(id).value]));
  const shownNow = { t: timeline.time, camera: page.camera.state(), edits: physics.state(), ...selects };
  history.replaceState(null, '', `${location.pathname}#${encodeURIComponent(JSON.stringify(shownNow))}`);
}

function restore() {
  let kept;
  try { kept = JSON.parse(decodeURIComponent(location.hash.slice(1))); } catch { return; }
  if (kept === null || typeof kept !== 'object') return;
  if (kept.camera) page.camera.restore(kept.camera);
  if (!page.hello.cameras[page.camera.dataset]) page.camera.dataset = null;
  if (kept.edits) physics.restore(kept.edits);
  for (const id of ['compare', 'layout', 'style']) {
    const option = [...get(id).options].find(({ value, disabled }) => value === kept[id] && !disabled);
    if (option) get(id).value = option.value;
  }
  if (Number.isFinite(kept.t)) timeline.set(kept.t, false);
}

// For scripts that look at the page.
window.lagrangegs = { panes, timeline, physics, page, connection, film, training };
