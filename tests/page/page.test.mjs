// The page in a real browser against the real service: node --test, with CREASED_BIN, and CREASED_SHOTS for pictures.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdirSync, readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { openBrowser, openPage, Service } from './bench.mjs';

const bin = process.env.CREASED_BIN ?? 'build/release/bin';
const shots = process.env.CREASED_SHOTS ?? 'build/page';
const axe = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');
let browser, service;

before(async () => {
  mkdirSync(shots, { recursive: true });
  browser = await openBrowser();
  service = await new Service(bin).start();
});
after(async () => {
  await browser?.close();
  await service?.remove();
});

const shot = (page, name) => page.screenshot({ path: join(shots, `${name}.png`) });
const done = (page) => page.locator('#result .figures').waitFor({ timeout: 120_000 });

/** A cube of the size that is smoothed at once, as OBJ. */
function cubeObj(n = 6) {
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
const cube = { name: 'cube.obj', mimeType: 'model/obj', buffer: Buffer.from(cubeObj()) };

async function accessible(page) {
  // The policy of the page forbids scripts of others; playwright evaluates outside of it.
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() => window.axe.run(document, { resultTypes: ['violations'] }));
  assert.deepEqual(violations.map(({ id, nodes }) => `${id}: ${nodes.map((node) => node.html).join(' ')}`), []);
}

test('the page is there, is small, comes at once, and may load nothing else', async () => {
  const response = await fetch(service.url);
  assert.equal(response.status, 200);
  assert.match(response.headers.get('content-security-policy'), /default-src 'none'; script-src 'self'/);
  const html = await response.text();
  let size = 0;
  for (const [, path] of html.matchAll(/(?:src|href)="\.\/(assets\/[^"]+)"/g)) {
    const file = await fetch(service.url + path, { headers: { 'Accept-Encoding': 'gzip' } });
    size += Number(file.headers.get('content-length'));
  }
  assert.ok(size > 0 && size < 300_000, `${size} bytes, compressed`);
  const page = await openPage(browser, service.url);
  await page.getByRole('button', { name: 'Choose a file' }).waitFor();
  const ready = await page.evaluate(() => performance.getEntriesByType('navigation')[0].domInteractive);
  console.log(`interactive after ${Math.round(ready)} ms, ${Math.round(size / 1000)} kB compressed`);
  await accessible(page);
  await shot(page, 'welcome');
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

test('a sample is smoothed: divider, ridges, colours, section, downloads', async () => {
  const page = await openPage(browser, service.url);
  await page.getByRole('button', { name: /machined part/ }).click();
  await page.locator('.gear').waitFor();
  await page.locator('.run progress[value]').waitFor({ state: 'attached' }); // the job may be over by now
  await shot(page, 'running');
  await done(page);
  await page.getByRole('slider', { name: /Divider/ }).waitFor();
  await shot(page, 'divided');
  await accessible(page);
  const handle = await page.getByRole('slider', { name: /Divider/ }).boundingBox();
  await page.mouse.move(handle.x + 16, handle.y + handle.height / 2);
  await page.mouse.down();
  await page.mouse.move(handle.x - 200, handle.y + handle.height / 2, { steps: 4 });
  await page.mouse.up();
  assert.ok(Number(await page.getByRole('slider', { name: /Divider/ }).getAttribute('aria-valuenow')) < 40);
  await page.locator('canvas').focus();
  await page.keyboard.press('Space');
  assert.equal(await page.getByRole('button', { name: 'Before' }).getAttribute('aria-pressed'), 'true');
  await page.keyboard.press('Space');
  const edges = async () => Number((await page.locator('output[for=threshold]').textContent()).match(/: ([\d,]+)/)[1].replace(',', ''));
  const usual = await edges();
  await page.getByLabel('Ridges from label').fill('0.99');
  assert.ok((await edges()) < usual);
  for (const name of ['displacement', 'segment', 'curvature']) {
    await page.getByLabel('Colour by').selectOption(name);
    await page.locator('.histogram').waitFor();
    await shot(page, name);
  }
  await page.getByLabel('Section', { exact: true }).selectOption('x');
  await shot(page, 'section');
  await page.locator('#away summary').click();
  const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', { name: /^PLY/ }).click()]);
  assert.equal(download.suggestedFilename(), 'part-smooth.ply');
  await page.reload();
  await done(page);
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

test('a refused upload is explained where it happens, and a good one follows', async () => {
  const page = await openPage(browser, service.url);
  await page.getByLabel('Mesh file').setInputFiles({ name: 'broken.obj', mimeType: 'model/obj', buffer: Buffer.from('v 0 0 0\nf 1 2 3\n') });
  await page.getByRole('alert').getByText('Line 2 uses vertex 3').waitFor();
  await page.getByLabel('Mesh file').setInputFiles(cube);
  await done(page);
  assert.equal(await page.getByRole('alert').isVisible(), false);
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

test('a second job with other parameters is compared with the first', async () => {
  const page = await openPage(browser, service.url);
  await page.getByLabel('Mesh file').setInputFiles(cube);
  await done(page);
  await page.locator('#parameters > summary').click();
  await page.getByLabel('Strength', { exact: true }).fill('0.3');
  await page.locator('#commands > summary').click();
  assert.match(await page.locator('.commands code').textContent(), /"strength":0.3/);
  await page.getByRole('tab', { name: 'crease' }).click();
  assert.match(await page.locator('.commands code').textContent(), /-p strength=0.3/);
  await page.getByRole('button', { name: 'Smooth again' }).click();
  await page.getByRole('button', { name: 'Compare' }).waitFor();
  await page.getByRole('columnheader', { name: 'right' }).waitFor();
  await page.getByLabel('Colour by').selectOption('difference');
  await shot(page, 'compared');
  await page.getByRole('button', { name: 'Divide' }).click();
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

test('a job is cancelled, and one outlives a reload', async () => {
  const page = await openPage(browser, service.url);
  await page.getByRole('button', { name: /A scan/ }).click();
  await page.waitForURL(/#job=/);
  await page.reload();
  await page.locator('.run').waitFor();
  await page.getByRole('button', { name: 'Cancel' }).click();
  await page.getByText('The job was stopped', { exact: false }).waitFor();
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

test('on a phone', async () => {
  const page = await openPage(browser, service.url, { viewport: { width: 390, height: 844 }, deviceScaleFactor: 2, hasTouch: true, isMobile: true, colorScheme: 'dark' });
  await shot(page, 'phone-welcome');
  await page.getByLabel('Mesh file').setInputFiles(cube);
  await done(page);
  await accessible(page);
  await shot(page, 'phone');
  assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), 'nothing sticks out sideways');
  await page.context().close();
});

test('with keys the page asks for one, once', async () => {
  const keys = join(service.folder, 'keys.json');
  const key = execFileSync(join(bin, 'creased'), ['key', 'page', '--keys', keys], { encoding: 'utf8' }).trim();
  const keyed = await new Service(bin, ['--keys', keys]).start();
  try {
    const page = await openPage(browser, keyed.url);
    await page.locator('#key').fill('wrong');
    await page.getByRole('button', { name: 'Use this key' }).click();
    await page.getByText('That key is not valid here.').waitFor();
    await page.locator('#key').fill(key);
    await page.getByRole('button', { name: 'Use this key' }).click();
    await page.locator('dialog').waitFor({ state: 'detached' });
    await page.getByLabel('Mesh file').setInputFiles(cube);
    await done(page);
    await page.reload();
    await done(page);
    assert.deepEqual(page.faults, []);
    await page.context().close();
  } finally {
    await keyed.remove();
  }
});

test('the documentation of the API is a page', async () => {
  const page = await openPage(browser, `${service.url}docs`);
  await page.getByText('/v1/jobs/{id}/mesh').waitFor();
  await accessible(page);
  await shot(page, 'docs');
  assert.deepEqual(page.faults, []);
  await page.context().close();
});
