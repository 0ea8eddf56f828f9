// Starts the service and a browser for the tests of the page.
import { spawn } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { chromium } from 'playwright-core';

// Without the graphics of the machine, so that pictures are the same everywhere.
const kFlags = ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist', '--force-color-profile=srgb', '--font-render-hinting=none', '--disable-lcd-text'];
const kBrowsers = ['/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'];

/** Resolves once `ready` gives something, looking every 50 ms. */
export async function until(what, ready, seconds = 40) {
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
