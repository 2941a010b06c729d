// The viewer's page in a real browser: npm install, then npm test.

import assert from 'node:assert/strict';
import { after, before } from 'node:test';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { chromium } from 'playwright-core';
import { call, makeRun, startViewer, test } from './run.js';

const executablePath = process.env.CHROMIUM ?? '/usr/bin/chromium';
let made, viewer, browser, page, faults;

before(async () => {
  made = makeRun();
  viewer = await startViewer(made.run, '--port', '0');
  browser = await chromium.launch({ executablePath, args: ['--no-sandbox'] });
});

after(async () => {
  await browser?.close();
  await viewer?.stop();
  made?.remove();
});

/** A test whose page reports no error. */
const faultless = (name, body) => test(name, async (context) => {
  await body(context);
  assert.deepEqual(faults, []);
});

/** Opens the page and waits for its first picture; `script` runs before the page's own. */
async function open(size = { width: 1000, height: 640 }, hash = '', script = () => {}) {
  const context = await browser.newContext({ viewport: size, acceptDownloads: true });
  page = await context.newPage();
  await page.addInitScript(script);
  faults = [];
  page.on('console', (message) => { if (message.type() === 'error') faults.push(message.text()); });
  page.on('pageerror', (error) => faults.push(String(error)));
  await page.goto(viewer.url + hash);
  await settled();
}

/** What the page has of its panes, for reports of what went wrong. */
const condition = () => page.evaluate(() => {
  const { panes, timeline, connection } = window.lagrangegs;
  const of = ({ serial, shown, dirty, coarse, underway, header }) => (
    { serial, shown, dirty, coarse, underway: [...underway.keys()], time: header?.time, rolling: header?.rolling });
  const { textContent } = document.getElementById('status');
  return { panes: panes.map(of), time: timeline.time, ready: connection.ready, status: textContent };
});

/** Waits until the panes that are shown show what was asked for last. */
async function settled() {
  const wait = page.waitForFunction(() => {
    const { panes, timeline, page: state } = window.lagrangegs ?? {};
    const seen = panes?.filter((pane) => !pane.element.hidden);
    return state?.hello && seen.every((pane) => pane.header && !pane.dirty
      && pane.shown === pane.serial && !pane.header.rolling && !pane.coarse
      && (pane.last.model === 'truth' || Math.abs(pane.header.time - timeline.time) < 1e-4));
  }, null, { timeout: 60000, polling: 50 });
  await wait.catch(async (error) => {
    throw new Error(`${error.message} ${JSON.stringify(await condition())} ${JSON.stringify(faults)}`);
  });
}

/** Pixels of a pane, as bytes; in base64 on their way, since lists of numbers take many seconds. */
async function pixels(index = 0) {
  return Buffer.from(await page.evaluate((i) => {
    const { picture } = window.lagrangegs.panes[i];
    const { data } = picture.getContext('2d').getImageData(0, 0, picture.width, picture.height);
    let bytes = '';
    for (let k = 0; k < data.length; k += 16384) bytes += String.fromCharCode(...data.subarray(k, k + 16384));
    return btoa(bytes);
  }, index), 'base64');
}

/** Mean difference of two pictures, 0 to 255. */
const difference = (a, b) => {
  assert.equal(a.length, b.length, 'sizes of the pictures');
  return a.reduce((sum, value, i) => sum + Math.abs(value - b[i]), 0) / a.length;
};

function assertSame(a, b, what) {
  const apart = difference(a, b);
  assert.ok(apart < 0.05, `${what}: pictures differ by ${apart}`);
}

/** Drags from one place of the page to another. */
async function drag([fromX, fromY], [toX, toY]) {
  await page.mouse.move(fromX, fromY);
  await page.mouse.down();
  await page.mouse.move(toX, toY, { steps: 6 });
  await page.mouse.up();
}

async function goto(time) {
  await page.fill('#exact-time', String(time));
  await page.press('#exact-time', 'Enter');
  await page.evaluate(() => document.activeElement.blur());
  await settled();
}

async function setAll(name, value) {
  const entry = page.locator('.row', { has: page.locator(`#all-${name}`) }).locator('input[type=number]');
  await entry.fill(String(value));
  await entry.press('Enter');
  await settled();
}

const shot = async (name) => {
  if (!process.env.SCREENSHOTS) return;
  mkdirSync(process.env.SCREENSHOTS, { recursive: true });
  await page.screenshot({ path: join(process.env.SCREENSHOTS, name) });
};

faultless('a run shows a picture, and time runs past both ends of the recording', async () => {
  await open();
  const start = await pixels();
  assert.ok(new Set(start).size > 20, 'a picture of many colours');
  await goto(2.0);
  const future = await pixels();
  assert.ok(difference(start, future) > 0.3, 'the future looks different');
  await goto(-0.5);
  const past = await pixels();
  assert.ok(difference(past, future) > 0.3, 'the past looks different from the future');
  await page.evaluate(() => { document.querySelector('#paths').click(); });
  await goto(0.4);
  await shot('viewer.png');
});

faultless('without its potential a falling ball does not fall', async () => {
  await open();
  const start = await pixels();
  await goto(0.6);
  assert.ok(difference(start, await pixels()) > 0.3, 'it falls');
  await setAll('potential', 0);
  await setAll('velocity', 0);
  assertSame(start, await pixels(), 'it rests');
  await page.click('#reset');
  await settled();
  assert.ok(difference(start, await pixels()) > 0.3, 'it falls again');
});

faultless('original and edited motion stand side by side, and under a divider', async () => {
  await open();
  await goto(0.6);
  await setAll('potential', 0);
  await page.selectOption('#compare', 'original');
  await settled();
  assert.ok(difference(await pixels(0), await pixels(1)) > 0.3, 'edited and unedited');
  await shot('compare.png');
  await page.selectOption('#layout', 'split');
  await settled();
  const bar = await page.locator('#divider').boundingBox();
  await drag([bar.x + 6, bar.y + 100], [bar.x - 144, bar.y + 100]);
  const cut = await page.locator('#divider').getAttribute('aria-valuenow');
  assert.ok(Number(cut) < 40, `the divider is at ${cut} %`);
  await page.selectOption('#compare', 'source');
  await settled();
  await page.selectOption('#compare', 'truth');
  await settled();
  assert.ok(new Set(await pixels(1)).size > 20, 'an image of the dataset');
});

faultless('keys play, step, draw and fly; a drag orbits; a click picks an object', async () => {
  await open();
  const start = await pixels();
  await page.focus('#stage');
  await page.keyboard.press('ArrowRight');
  await settled();
  assert.ok(await page.evaluate(() => window.lagrangegs.timeline.time) > 0.01);
  await page.keyboard.press('Home');
  await page.keyboard.press(' ');
  await page.waitForFunction(() => window.lagrangegs.timeline.time > 0.2);
  await page.keyboard.press(' ');
  await page.keyboard.press('Home');
  await page.keyboard.press('o');
  await settled();
  assert.ok(difference(start, await pixels()) > 0.1, 'objects in colours of their own');
  await page.selectOption('#style', 'color');
  await page.keyboard.down('d');
  await page.waitForTimeout(150);
  await page.keyboard.up('d');
  await settled();
  const flown = await pixels();
  assert.ok(difference(start, flown) > 0.1, 'the camera flew');
  await page.keyboard.press('0');
  await settled();
  const box = await page.locator('#stage').boundingBox();
  const middle = [box.x + box.width / 2, box.y + box.height / 2];
  const ball = await page.evaluate(() => {
    const { panes } = window.lagrangegs;
    const { picture } = panes[0];
    const data = picture.getContext('2d').getImageData(0, 0, picture.width, picture.height).data;
    const back = data.slice(0, 3);
    let [x, y, n] = [0, 0, 0];
    for (let i = 0; i < data.length; i += 4) {
      const apart = [0, 1, 2].map((c) => Math.abs(data[i + c] - back[c]));
      if (apart[0] + apart[1] + apart[2] > 120) {
        x += (i / 4) % picture.width; y += Math.floor(i / 4 / picture.width); n += 1;
      }
    }
    const frame = picture.getBoundingClientRect();
    const part = [x / n / picture.width, y / n / picture.height];
    return [frame.left + part[0] * frame.width, frame.top + part[1] * frame.height];
  });
  await page.mouse.click(...ball);
  await page.waitForSelector('section.selected');
  const before = await pixels();
  await drag(middle, [middle[0] + 120, middle[1] + 30]);
  await settled();
  assert.ok(difference(before, await pixels()) > 0.1, 'the camera orbited');
});

faultless('a link shows the same view again', async () => {
  await open();
  await goto(1.25);
  await setAll('potential', 2);
  const [seen, hash] = [await pixels(), await page.evaluate(() => location.hash)];
  await open(undefined, hash);
  assertSame(seen, await pixels(), 'the view of the link');
});

faultless('pictures that decode out of order leave the newest on the page', async () => {
  await open(undefined, '', () => {
    const decode = window.createImageBitmap;
    let begun = -1e9;
    window.beginAgain = () => { begun = performance.now(); };
    // Pictures that come later wait less, for a second and a half.
    window.createImageBitmap = async (blob) => {
      const wait = Math.max(0, 3000 - 2 * (performance.now() - begun));
      await new Promise((resolve) => { setTimeout(resolve, wait); });
      return decode(blob);
    };
  });
  await goto(1.9);
  await page.evaluate(() => window.beginAgain());
  await setAll('potential', 1.5);
  await page.waitForTimeout(3000);
  const [seen, hash] = [await pixels(), await page.evaluate(() => location.hash)];
  await open(undefined, hash);
  assertSame(seen, await pixels(), 'the last picture');
});

faultless('a picture can be saved, and exact ones are PNG', async () => {
  await open();
  const [download] = await Promise.all([page.waitForEvent('download'), page.click('#shot')]);
  assert.match(download.suggestedFilename(), /^t_0\.000\.png$/);
  await page.check('#exact');
  await settled();
  assert.equal(await page.evaluate(() => window.lagrangegs.panes[0].header.mime), 'image/png');
});

faultless('views that are kept become a path that render follows', async () => {
  await open();
  await goto(0.2);
  await page.focus('#stage');
  await page.keyboard.press('k');
  await page.evaluate(() => { window.lagrangegs.page.camera.orbit(0.5, 0.1); });
  await goto(0.6);
  await page.click('#key');
  assert.equal(await page.locator('#film .key').count(), 2);
  await setAll('potential', 0.5);
  assert.match(await page.textContent('#command'), /render .*falling ball'.*--potential-scale 0.5/);
  const [download] = await Promise.all([page.waitForEvent('download'), page.click('#save-path')]);
  const file = JSON.parse(readFileSync(await download.path(), 'utf8'));
  assert.equal(file.keyframes.length, 2);
  const path = join(made.folder, 'path.json');
  writeFileSync(path, JSON.stringify(file));
  const film = join(made.folder, 'film.gif');
  call('render', made.run, '--camera', path, '--size', '96', '--fps', '5', '--out', film);
  assert.equal(readFileSync(film).subarray(0, 6).toString(), 'GIF89a');
  await page.goto(`file://${film}`);
  assert.equal(await page.evaluate(() => document.images[0].naturalWidth), 96);
});

test('videos play in the browser, with their size and their duration', async (context) => {
  await open();
  writeFileSync(join(made.folder, 'player.html'), '<video muted></video>');
  for (const name of ['film.mp4', 'film.webm']) {
    const words = ['--times', '0:1:0.1', '--fps', '10', '--size', '64', '--out', join(made.folder, name)];
    try {
      call('render', made.run, ...words);
    } catch (error) {
      if (/feature `av1`/.test(error.message)) { context.skip('a build without AV1'); return; }
      throw error;
    }
    await page.goto(`file://${join(made.folder, 'player.html')}`);
    const played = await page.evaluate(async (src) => {
      const video = document.querySelector('video');
      await new Promise((done) => { video.onloadeddata = done; video.onerror = done; video.src = src; });
      if (video.error) return video.error.message;
      await new Promise((done) => { video.onseeked = done; video.currentTime = 1; });
      return [video.videoWidth, Number(video.duration.toFixed(2)), video.currentTime];
    }, name);
    assert.deepEqual(played, [64, 1.1, 1], name);
  }
});

faultless('the potential of an object lies over the picture, and follows its scale', async () => {
  await open();
  const overlay = () => page.evaluate(() => {
    const canvas = window.lagrangegs.panes[0].overlay;
    return canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data.reduce((a, b) => a + b, 0);
  });
  assert.equal(await overlay(), 0);
  await page.check('#potential');
  await page.waitForFunction(() => window.lagrangegs.page.slice);
  assert.ok(await overlay() > 0);
  await shot('potential.png');
  const high = () => page.evaluate(() => window.lagrangegs.page.slice.range);
  const [low, top] = await high();
  await setAll('potential', 2);
  await page.waitForFunction((spread) => {
    const { range } = window.lagrangegs.page.slice;
    return Math.abs(range[1] - range[0] - 2 * spread) < 0.01 * spread;
  }, top - low);
});

faultless('small screens have room for everything', async () => {
  await open({ width: 400, height: 700 });
  const wide = await page.evaluate(() => document.documentElement.scrollWidth);
  assert.ok(wide <= 400, `the page is ${wide} wide`);
  for (const id of ['#stage', '#time', '#play', '#panel']) assert.ok(await page.locator(id).isVisible(), id);
  await shot('small.png');
});

test('pictures keep pace with a drag', async (context) => {
  await open({ width: 700, height: 494 });
  const box = await page.locator('#stage').boundingBox();
  await page.mouse.move(box.x + 150, box.y + 200);
  await page.mouse.down();
  const begun = Date.now();
  const count = () => page.evaluate(() => window.lagrangegs.panes[0].serial);
  const first = await count();
  for (let i = 0; Date.now() - begun < 3000; i += 1) {
    await page.mouse.move(box.x + 150 + 100 * Math.sin(i / 9), box.y + 200 + 40 * Math.cos(i / 7));
  }
  const rate = (await count() - first) / 3;
  await page.mouse.up();
  const latency = await page.evaluate(() => window.lagrangegs.panes[0].latencies.sort((a, b) => a - b));
  const median = latency[latency.length >> 1];
  context.diagnostic(`${rate.toFixed(0)} pictures per second, median latency ${median.toFixed(0)} ms`);
  assert.ok(rate > 2, 'pictures come at all');
});

test('the page takes up a lost connection', async () => {
  await open();
  const port = new URL(viewer.url).port;
  await viewer.stop();
  await page.waitForSelector('#status.lost');
  viewer = await startViewer(made.run, '--port', port);
  await page.waitForSelector('#status:not(.lost)', { timeout: 15000 });
  await page.keyboard.press('End');
  await settled();
  assert.ok((await page.evaluate(() => window.lagrangegs.panes[0].header.time)) > 0.1);
});
