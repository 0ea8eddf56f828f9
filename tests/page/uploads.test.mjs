// How meshes come onto the page, in a real browser against the real service: node --test, with CREASED_BIN.
import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { PNG } from 'pngjs';
import { cube, done, openBrowser, openPage, Service, towerGlb, until } from './bench.mjs';

const bin = process.env.CREASED_BIN ?? 'build/release/bin';
let browser, service;

before(async () => {
  browser = await openBrowser();
  service = await new Service(bin).start();
});
after(async () => {
  await browser?.close();
  await service?.remove();
});

test('a refused upload is explained where it happens, and a good one follows', async () => {
  const page = await openPage(browser, service.url);
  await page.getByLabel('Mesh file').setInputFiles({ name: 'broken.obj', mimeType: 'model/obj', buffer: Buffer.from('v 0 0 0\nf 1 2 3\n') });
  await page.getByRole('alert').getByText('Line 2 uses vertex 3').waitFor();
  assert.match(await page.locator('#now').textContent(), /broken.obj.*refused/);
  await page.getByLabel('Mesh file').setInputFiles({ ...cube, name: 'cube.stl', mimeType: 'model/stl' });
  await page.getByRole('alert').getByText('named as STL, but what is in it looks like OBJ. Rename it to end in .obj').waitFor();
  await page.getByLabel('Mesh file').setInputFiles(cube);
  await done(page);
  assert.equal(await page.getByRole('alert').isVisible(), false);
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

test('a file is dropped beside its materials, a mesh is pasted, and the way back leads to the start', async () => {
  const page = await openPage(browser, service.url);
  const give = (type, files, text) => page.evaluate(([type, files, text]) => {
    const data = new DataTransfer();
    for (const [name, content] of files) data.items.add(new File([content], name));
    if (text) data.setData('text/plain', text);
    const event = type === 'paste' ? new ClipboardEvent(type, { clipboardData: data, bubbles: true }) : new DragEvent(type, { dataTransfer: data, bubbles: true, cancelable: true });
    document.body.dispatchEvent(event);
  }, [type, files, text]);
  await give('drop', [['cube.mtl', 'newmtl red'], ['cube.obj', cube.buffer.toString()]]);
  await done(page);
  assert.match(await page.locator('#now').textContent(), /cube\.obj.*done/);
  await give('paste', [], cube.buffer.toString());
  await page.locator('#now').getByText('pasted').waitFor();
  await done(page);
  await page.goBack();
  await page.locator('#now').getByText('cube.obj').waitFor();
  await done(page);
  await page.goBack();
  await page.getByRole('button', { name: 'Choose a file' }).waitFor();
  await page.locator('.recent').getByRole('button', { name: /cube/ }).first().waitFor();
  assert.equal(await page.locator('#now').textContent(), '');
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

test('all parts of a scene are in view, before the job and after', async () => {
  const page = await openPage(browser, service.url);
  const inView = async () => {
    const { width, height, data } = PNG.sync.read(await page.locator('canvas').screenshot());
    const background = (x) => data[4 * ((height - 1) * width + x)] > 230;
    return [...Array(width).keys()].every(background);
  };
  let send;
  const held = new Promise((resolve) => { send = resolve; });
  await page.route('**/v1/jobs', async (route) => {
    if (route.request().method() === 'POST') await held;
    await route.continue();
  });
  await page.getByLabel('Mesh file').setInputFiles({ name: 'tower.glb', mimeType: 'model/gltf-binary', buffer: towerGlb() });
  await page.locator('.gear').waitFor();
  await page.locator('.run').evaluate((card) => { card.style.visibility = 'hidden'; });
  await until('the preview is in view', inView);
  send();
  await done(page);
  await page.getByRole('button', { name: 'After', exact: true }).click();
  await until('the result is in view', inView);
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

test('without graphics the page says so, and the result can be had all the same', async () => {
  const page = await openPage(browser, service.url);
  await page.evaluate(() => { HTMLCanvasElement.prototype.getContext = () => null; });
  await page.getByLabel('Mesh file').setInputFiles(cube);
  await page.getByRole('alert').getByText(/WebGL/).waitFor();
  await done(page);
  const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', { name: 'Download OBJ' }).click()]);
  assert.equal(download.suggestedFilename(), 'cube-smooth.obj');
  await page.context().close();
});

test('an upload is cancelled, and sent again', async () => {
  const page = await openPage(browser, service.url);
  let stalled = true;
  await page.route('**/v1/jobs', (route) => (stalled && route.request().method() === 'POST' ? undefined : route.continue()));
  await page.getByLabel('Mesh file').setInputFiles(cube);
  await page.getByRole('button', { name: 'Cancel' }).click();
  await page.locator('#now').getByText('not sent').waitFor();
  stalled = false;
  await page.getByRole('button', { name: 'Smooth again' }).click();
  await done(page);
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

test('what is wrong with a mesh is said once, in words', async () => {
  const page = await openPage(browser, service.url);
  const fan = 'v 0 0 0\nv 0 0 1\nv 1 0 0\nv 0 1 0\nv -1 -1 0\nv 9 9 9\nf 1 2 3\nf 1 2 4\nf 1 2 5\nf 3 1 2\nf 1 1 2\n';
  await page.getByLabel('Mesh file').setInputFiles({ name: 'fan.obj', mimeType: 'model/obj', buffer: Buffer.from(fan) });
  await done(page);
  const said = await page.locator('.findings li').allTextContents();
  const about = (words) => assert.equal(said.filter((text) => words.test(text)).length, 1, `${words} in ${said.join(' / ')}`);
  [/^1 edge lies between more than two faces/, /^1 face has no area/, /^1 face is there more than once/, /^1 vertex belongs to no face/].forEach(about);
  assert.equal(said.filter((text) => /^1 [a-z]+ have/.test(text)).length, 0);
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

test('what was uploaded comes back with all that is in it', async () => {
  const page = await openPage(browser, service.url);
  const buffer = Buffer.from(`# from a scanner\no cube\n${cube.buffer}`);
  await page.getByLabel('Mesh file').setInputFiles({ ...cube, buffer });
  await done(page);
  const words = async (name) => {
    const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', { name }).click()]);
    return readFileSync(await download.path(), 'utf8');
  };
  assert.match(await words('Download OBJ'), /# from a scanner\no cube\nv /);
  await page.locator('#away > summary').click();
  assert.match(await words(/^Original/), /# from a scanner\no cube\nv /);
  assert.doesNotMatch(await words(/^OBJ/), /scanner/);
  // A job that is found again is smoothed again from the same file.
  await page.reload();
  await done(page);
  await page.locator('#parameters > summary').click();
  const first = page.url();
  await page.getByRole('button', { name: 'Smooth again' }).click();
  await page.waitForURL((url) => url.href !== first);
  const { jobs } = await (await fetch(`${service.url}v1/jobs?limit=1`)).json();
  assert.equal(jobs[0].input.sha256, createHash('sha256').update(buffer).digest('hex'));
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

test('pasted text is a mesh, and what was there before is offered at the start', async () => {
  const page = await openPage(browser, service.url);
  await page.getByRole('button', { name: 'Paste' }).click();
  await page.getByLabel(/A mesh as/).fill(cube.buffer.toString());
  await page.getByRole('button', { name: 'Smooth this' }).click();
  await done(page);
  await page.goto(service.url);
  await page.locator('.recent').getByRole('button', { name: /pasted/ }).first().click();
  await done(page);
  await page.getByRole('button', { name: 'Jobs' }).click();
  await page.locator('dialog').getByText('pasted').first().waitFor();
  assert.deepEqual(page.faults, []);
  await page.context().close();
});
