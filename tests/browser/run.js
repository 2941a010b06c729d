// A run of a falling ball from true trajectories, and a viewer of it.

import { spawn, spawnSync } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import readline from 'node:readline';
import { test as unbounded } from 'node:test';

/** A test that fails when it hangs, which its page's scripts might without end. */
export const test = (name, body) => unbounded(name, { timeout: 300000 }, body);

const built = new URL('../../target/release/lagrangegs', import.meta.url).pathname;
const program = process.env.LAGRANGEGS ?? built;

/** Milliseconds that one command of the program may take, many times what it takes on a busy machine. */
const COMMAND_TIMEOUT = 240000;

export function call(...words) {
  const done = spawnSync(program, words, { encoding: 'utf8', timeout: COMMAND_TIMEOUT, killSignal: 'SIGKILL' });
  if (done.status !== 0) throw new Error(`lagrangegs ${words.join(' ')}: ${done.error ?? ''} ${done.stderr}`);
}

/** Interrupts a program and waits for its end, which is forced where it does not come. */
function stopOf(child) {
  const ended = new Promise((resolve) => { child.once('exit', resolve); });
  return async () => {
    if (child.exitCode !== null || child.signalCode !== null) return child.exitCode;
    child.kill('SIGINT');
    const forced = setTimeout(() => child.kill('SIGKILL'), 20000);
    const code = await ended;
    clearTimeout(forced);
    return code;
  };
}

/** Rejects when a line that a program is to print does not come in time. */
const inTime = (line, what) => Promise.race([line, new Promise((_, reject) => {
  setTimeout(() => reject(new Error(`${what} says nothing`)), COMMAND_TIMEOUT).unref();
})]);

/** A folder with a dataset and a run. */
export function makeRun() {
  const folder = mkdtempSync(join(tmpdir(), 'lagrangegs-browser-'));
  const names = ['data', 'tracks.safetensors', 'falling ball'];
  const [data, tracks, run] = names.map((name) => join(folder, name));
  call('synth', 'falling-ball', '--out', data, '--size', '96', '--views', '4', '--train-fps', '10');
  call('synth', 'falling-ball', '--tracks', '--out', tracks);
  call('train', data, '--out', run, '--source', 'frames', '--import', tracks);
  return { folder, data, run, remove: () => rmSync(folder, { recursive: true, force: true }) };
}

/** A training run with its page, once it listens; `ended` is its exit code. */
export async function startTraining(data, run, ...words) {
  const child = spawn(program, ['train', data, '--out', run, '--view', '--port', '0', ...words],
    { stdio: ['ignore', 'ignore', 'pipe'] });
  let errors = '';
  const ended = new Promise((resolve) => { child.once('exit', resolve); });
  const stop = stopOf(child);
  const url = await inTime(new Promise((resolve, reject) => {
    child.stderr.on('data', (text) => {
      errors += text;
      const found = /http:\S+/.exec(errors);
      if (found) resolve(found[0]);
    });
    child.once('exit', (code) => reject(new Error(`training ended with ${code}: ${errors}`)));
  }), 'training');
  return { url, ended, stop };
}

/** A viewer of a run, once it listens. */
export async function startViewer(run, ...words) {
  const child = spawn(program, ['view', run, ...words], { stdio: ['ignore', 'pipe', 'pipe'] });
  let errors = '';
  child.stderr.on('data', (text) => { errors += text; });
  const stop = stopOf(child);
  const url = await inTime(new Promise((resolve, reject) => {
    readline.createInterface({ input: child.stdout }).once('line', resolve);
    child.once('exit', (code) => reject(new Error(`the viewer ended with ${code}: ${errors}`)));
  }), 'the viewer');
  return { url, stop };
}
