// Starts the service and a browser for the tests of the page.
import { spawn } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { chromium } from 'playwright-core';

// Without the graphics of the machine, so that pictures are the same everywhere.
const kFlags = ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist', '--force-color-profile=srgb', '--font-render-hinting=none', '--disable-lcd-text'];
const kBrowsers = ['/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'];

// Seconds that anything may take on a busy machine.
const kPatience = 120;

/** Resolves once `ready` gives something, looking every 50 ms. */
export async function until(what, ready, seconds = kPatience) {
  for (const end = Date.now() + 1000 * seconds; Date.now() < end; ) {
    const value = await ready();
    if (value) return value;
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
  throw new Error(`timed out: ${what}`);
}

/** `creased serve` on a free port. With the same folder a second one takes up where the first was stopped. */
export class Service {
  constructor(bin, flags = [], folder = mkdtempSync(join(tmpdir(), 'creased-page-'))) {
    this.bin = bin;
    this.flags = flags;
    this.folder = folder;
  }

  async start(port = 0) {
    const portFile = join(this.folder, 'port');
    rmSync(portFile, { force: true });
    this.process = spawn(join(this.bin, 'creased'), ['serve', '--port', String(port), '--port-file', portFile,
      '--data-dir', join(this.folder, 'data'), '--workers', '1', '--log-level', 'warning', ...this.flags], { stdio: ['ignore', 'inherit', 'inherit'] });
    this.port = await until('the service listens', () => existsSync(portFile) && Number(readFileSync(portFile, 'utf8')));
    this.url = `http://127.0.0.1:${this.port}/`;
    return this;
  }

  async stop() {
    if (this.process.exitCode !== null || this.process.signalCode !== null) return;
    const ended = new Promise((resolve) => this.process.once('exit', resolve));
    this.process.kill('SIGTERM');
    await ended;
  }

  async remove() {
    await this.stop();
    rmSync(this.folder, { recursive: true, force: true });
  }
}

export function openBrowser() {
  const executablePath = process.env.CREASED_BROWSER ?? kBrowsers.find((path) => existsSync(path));
  if (!executablePath) throw new Error('no Chromium; set CREASED_BROWSER');
  return chromium.launch({ executablePath, args: kFlags });
}

/** A page in a window of its own that keeps what must not happen: errors on its console, requests elsewhere. */
export async function openPage(browser, url, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 720 }, reducedMotion: 'reduce', ...options });
  context.setDefaultTimeout(1000 * kPatience);
  const page = await context.newPage();
  page.faults = [];
  page.on('console', (message) => {
    // A browser reports each answer with a status of 400 or more; tests expect some of them.
    if (message.type() === 'error' && !/status of (401|404|409|422|4\d\d)|ERR_CONNECTION|ERR_EMPTY|ERR_INCOMPLETE/.test(message.text())) page.faults.push(message.text());
  });
  page.on('pageerror', (error) => page.faults.push(String(error)));
  page.on('request', (request) => {
    const own = ['blob:', 'data:'].some((scheme) => request.url().startsWith(scheme)) || new URL(request.url()).origin === new URL(url).origin;
    if (!own) page.faults.push(`a request elsewhere: ${request.url()}`);
  });
  await page.goto(url);
  return page;
}

/** A cube of the size that is smoothed at once, as OBJ. */
export function cubeObj(n = 6) {
  const vertices = new Map(), faces = [];
  const vertex = (...p) => {
    const key = p.join(' ');
    if (!vertices.has(key)) vertices.set(key, vertices.size + 1);
    return vertices.get(key);
  };
  for (let axis = 0; axis < 3; ++axis) {
    for (const side of [0, n]) {
      for (let i = 0; i < n; ++i) {
        for (let j = 0; j < n; ++j) {
          const at = (a, b) => { const p = [0, 0, 0]; p[axis] = side; p[(axis + 1) % 3] = a; p[(axis + 2) % 3] = b; return vertex(...p); };
          const quad = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
          if (side === 0) quad.reverse();
          faces.push(`f ${quad[0]} ${quad[1]} ${quad[2]}`, `f ${quad[0]} ${quad[2]} ${quad[3]}`);
        }
      }
    }
  }
  let seed = 1;
  const noise = () => { seed = (seed * 16807) % 2147483647; return (seed / 2147483647 - 0.5) * 0.4; };
  return `${[...vertices.keys()].map((p) => `v ${p.split(' ').map((x) => Number(x) + noise()).join(' ')}`).join('\n')}\n${faces.join('\n')}\n`;
}

/** Two cubes, one node above the other, as GLB. */
export function towerGlb() {
  const corners = [...Array(8).keys()].flatMap((k) => [k & 1, (k >> 1) & 1, k >> 2].map((one) => 2 * one - 1));
  const faces = [0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5];
  const binary = Buffer.concat([Buffer.from(Float32Array.from(corners).buffer), Buffer.from(Uint16Array.from(faces).buffer)]);
  const json = Buffer.from(JSON.stringify({
    asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0, 1] }], nodes: [{ mesh: 0 }, { mesh: 0, translation: [0, 0, 6] }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 }, indices: 1 }] }],
    accessors: [{ bufferView: 0, componentType: 5126, count: 8, type: 'VEC3', min: [-1, -1, -1], max: [1, 1, 1] }, { bufferView: 1, componentType: 5123, count: 36, type: 'SCALAR' }],
    bufferViews: [{ buffer: 0, byteLength: 96 }, { buffer: 0, byteOffset: 96, byteLength: 72 }], buffers: [{ byteLength: 168 }],
  }));
  const padded = Buffer.concat([json, Buffer.alloc((4 - (json.length % 4)) % 4, ' ')]);
  const words = (...numbers) => Buffer.from(Uint32Array.from(numbers).buffer);
  return Buffer.concat([words(0x46546c67, 2, 28 + padded.length + binary.length, padded.length, 0x4e4f534a), padded, words(binary.length, 0x004e4942), binary]);
}

/** A square with waves of so many vertices along a side, as binary PLY. */
export function wavesPly(side) {
  const faces = 2 * (side - 1) ** 2;
  const head = Buffer.from(`ply\nformat binary_little_endian 1.0\nelement vertex ${side * side}\nproperty float x\nproperty float y\nproperty float z\n`
    + `element face ${faces}\nproperty list uchar int vertex_indices\nend_header\n`);
  const body = Buffer.alloc(12 * side * side + 13 * faces);
  let at = 0;
  const triangle = (...corners) => {
    at = body.writeUInt8(3, at);
    for (const corner of corners) at = body.writeInt32LE(corner, at);
  };
  for (let i = 0; i < side; ++i) {
    for (let j = 0; j < side; ++j) {
      for (const value of [i, j, 8 * Math.sin(i / 20) * Math.cos(j / 25)]) at = body.writeFloatLE(value, at);
    }
  }
  for (let i = 0; i + 1 < side; ++i) {
    for (let j = 0; j + 1 < side; ++j) {
      const v = i * side + j;
      triangle(v, v + side, v + side + 1);
      triangle(v, v + side + 1, v + 1);
    }
  }
  return Buffer.concat([head, body]);
}

/** The cube as a file to upload. */
export const cube = { name: 'cube.obj', mimeType: 'model/obj', buffer: Buffer.from(cubeObj()) };

/** Resolves once the page shows a result. */
export const done = (page) => page.locator('#result .figures').waitFor();
