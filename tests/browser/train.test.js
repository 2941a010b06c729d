// The page of a run that is being trained.

import assert from 'node:assert/strict';
import { after, before } from 'node:test';
import { mkdirSync, mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { chromium } from 'playwright-core';
import { call, startTraining, test } from './run.js';

const executablePath = process.env.CHROMIUM ?? '/usr/bin/chromium';
const TINY = ['source.iterations=3000', 'source.initial_gaussians=600', 'distill.coordinates=particles',
  'refine_gaussians.iterations=20', 'tune_gaussians.iterations=20']
  .flatMap((setting) => ['--set', setting]);
let folder, data, browser, training;

before(async () => {
  folder = mkdtempSync(join(tmpdir(), 'lagrangegs-browser-'));
  data = join(folder, 'data');
  call('synth', 'falling-ball', '--out', data, '--size', '64', '--views', '4', '--train-fps', '10');
  browser = await chromium.launch({ executablePath, args: ['--no-sandbox'] });
});

after(async () => {
  await browser?.close();
  await training?.stop();
  rmSync(folder, { recursive: true, force: true });
});

test('a page shows training, pauses it, and changes nothing in its result', async () => {
  const [seen, unseen] = ['seen', 'unseen'].map((name) => join(folder, name));
  training = await startTraining(data, seen, ...TINY);
  const page = await browser.newPage({ viewport: { width: 1000, height: 640 } });
  const faults = [];
  page.on('pageerror', (error) => faults.push(String(error)));
  await page.goto(training.url, { timeout: 60000 });
  await page.waitForFunction(() => window.lagrangegs?.panes[0].header, null, { timeout: 60000 });
  const text = () => page.textContent('[data-part=text]');
  await page.waitForFunction(() => /source: step [1-9]/.test(document.querySelector('[data-part=text]').textContent));
  assert.match(await text(), /Gaussians/);
  await page.click('#pause');
  await page.waitForFunction(() => document.querySelector('#pause').textContent === 'Go on');
  // The steps of each stage count from one, so what is compared is the stage with its step.
  const position = async () => /^.*: step \d+/.exec(await text())[0];
  await page.waitForTimeout(1200);
  const rested = await position();
  await page.waitForTimeout(1500);
  assert.equal(await position(), rested, 'training rests');
  await page.click('#pause');
  await page.waitForFunction((before) => {
    const seen = document.querySelector('[data-part=text]').textContent;
    return !seen.startsWith(`${before} `);
  }, rested, { timeout: 60000 });
  await page.waitForFunction(() => window.lagrangegs.training.subject > 1, null, { timeout: 60000 });
  if (process.env.SCREENSHOTS) {
    mkdirSync(process.env.SCREENSHOTS, { recursive: true });
    await page.screenshot({ path: join(process.env.SCREENSHOTS, 'training.png') });
  }
  await page.close();
  assert.equal(await training.ended, 0);
  assert.deepEqual(faults, []);
  call('train', data, '--out', unseen, ...TINY);
  const scene = (run) => readFileSync(join(run, 'lagrangian.safetensors'));
  assert.ok(scene(seen).equals(scene(unseen)), 'the same bytes with and without a page');
  const events = (run) => readFileSync(join(run, 'events.jsonl'), 'utf8');
  assert.equal(events(seen), events(unseen));
});
