// The page in a real browser against the real service: node --test, with CREASED_BIN, and CREASED_SHOTS for pictures.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdirSync, readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { cube, cubeObj, done, openBrowser, openPage, Service, until, wavesPly } from './bench.mjs';
import { compare, lookAt, reduced } from './compare.mjs';

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

const shot = (page, name) => lookAt(page, shots, name);

async function accessible(page) {
  // The policy of the page forbids scripts of others; playwright evaluates outside of it.
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() => window.axe.run(document, { resultTypes: ['violations'] }));
  assert.deepEqual(violations.map(({ id, nodes }) => `${id}: ${nodes.map((node) => node.html).join(' ')}`), []);
}

test('a picture may have other edges and letters, but no other colour and no line less', () => {
  const size = 800, red = [207, 51, 19], grey = [200, 196, 188];
  /** A disc on white, its edge smooth or not, and a line across it as wide as that of a ridge. */
  const drawn = ({ smooth = true, disc = grey, line = red }) => {
    const data = Buffer.alloc(4 * size * size, 255);
    const paint = (at, colour, share) => colour.forEach((c, k) => { data[at + k] = data[at + k] * (1 - share) + c * share; });
    const cover = (depth) => Math.min(1, Math.max(0, smooth ? depth + 0.5 : Number(depth > 0)));
    for (let y = 0; y < size; ++y) {
      for (let x = 0; x < size; ++x) {
        const at = 4 * (y * size + x);
        paint(at, disc, cover(150 - Math.hypot(x - 200, y - 200)));
        paint(at, line, cover(1.3 - Math.abs(0.4 * x - y + 120) / Math.hypot(0.4, 1)));
      }
    }
    return { width: size, height: size, data };
  };
  const reference = reduced(drawn({}));
  assert.ok(compare(drawn({}), reference).alike);
  assert.ok(compare(drawn({ smooth: false }), reference).alike);
  assert.ok(!compare(drawn({ line: grey }), reference).alike);
  assert.ok(!compare(drawn({ disc: grey.map((c) => c - 20) }), reference).alike);
});

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
  // The page's own script has run by then.
  const ready = await page.evaluate(() => performance.getEntriesByType('navigation')[0].domContentLoadedEventEnd);
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
  await page.screenshot({ path: join(shots, 'running.png') });
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
  assert.equal(await page.getByRole('button', { name: 'Before', exact: true }).getAttribute('aria-pressed'), 'true');
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
  await page.getByRole('button', { name: 'Compare', exact: true }).waitFor();
  await page.getByRole('columnheader', { name: 'right' }).waitFor();
  await page.getByLabel('Colour by').selectOption('difference');
  await shot(page, 'compared');
  await page.getByRole('button', { name: 'Divide' }).click();
  await page.reload();
  await page.getByRole('columnheader', { name: 'right' }).waitFor();
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

test('a job is compared with one of before, chosen from the list', async () => {
  const submit = async (parameters, body = cube.buffer) => {
    const response = await fetch(`${service.url}v1/jobs?name=chosen.obj&${parameters}`, { method: 'POST', headers: { 'Content-Type': 'model/obj', Prefer: 'wait=60' }, body });
    return (await response.json()).id;
  };
  const gentle = await submit('strength=0.25'), other = await submit('strength=0.75', Buffer.from(cubeObj(4))), usual = await submit('strength=1');
  const page = await openPage(browser, `${service.url}#job=${usual}`);
  await done(page);
  await page.getByRole('button', { name: 'Compare', exact: true }).click();
  await accessible(page);
  await page.getByRole('dialog').getByRole('button', { name: /The same mesh with strength 0.25/ }).click();
  await page.getByRole('columnheader', { name: 'right' }).waitFor();
  assert.match(page.url(), new RegExp(`job=${usual}&with=${gentle}$`));
  assert.match(await page.getByRole('row', { name: /Strength/ }).textContent(), /0.25.*1/);
  await page.getByLabel('Colour by').selectOption('difference');
  await page.locator('.histogram').waitFor();
  await page.getByRole('button', { name: 'Compare with another job' }).click();
  await page.getByRole('dialog').getByRole('button', { name: /Another mesh/ }).first().click();
  await page.waitForURL((url) => url.hash.endsWith(`with=${other}`));
  await page.getByText('The two jobs are of different meshes.').waitFor();
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

test('what is under the pointer, lengths, the list of ridges, a section, and numbers by key', async () => {
  const page = await openPage(browser, service.url);
  await page.getByLabel('Mesh file').setInputFiles(cube);
  await done(page);
  await page.getByRole('button', { name: 'After', exact: true }).click();
  const box = await page.locator('canvas').boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(x, y);
  await page.locator('.hover').getByText(/face \d+, vertex \d+/).waitFor();
  await page.mouse.move(2, 2);
  await page.getByLabel('Colour by').selectOption('displacement');
  await page.locator('canvas').focus();
  await page.keyboard.press('i');
  await page.locator('.hover').getByText(/displacement -?\d/).waitFor();
  await page.keyboard.press('m');
  await page.mouse.click(x - 60, y);
  await page.mouse.click(x + 60, y + 20);
  await page.locator('.measure-text').getByText(/units, .* edges/).waitFor();
  await page.keyboard.press('m');
  // The same without a pointer.
  await page.locator('canvas').focus();
  for (const key of ['m', 'Enter', 'ArrowRight', 'Enter']) await page.keyboard.press(key);
  await page.locator('.measure-text').getByText(/units, .* edges/).waitFor();
  await page.keyboard.press('m');
  await page.locator('#ridges > summary').click();
  const before = await page.locator('canvas').screenshot();
  await page.locator('#ridges li button').first().focus();
  await shot(page, 'ridge-lit');
  assert.notDeepEqual(await page.locator('canvas').screenshot(), before, 'the ridge lights up');
  await page.getByLabel('Section', { exact: true }).selectOption('seen');
  await page.getByLabel('The other side').check();
  const smallest = page.getByLabel('Smallest displacement that is shown');
  await smallest.fill('0');
  await smallest.press('Enter');
  await page.locator('.histogram .band[width]:not([width="0"])').waitFor({ state: 'attached' });
  await page.getByText(/vertices in this range/).waitFor();
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

test('a large mesh is turned with few of its faces, and drawn whole at rest', async () => {
  const side = 460, faces = 2 * (side - 1) ** 2;
  const response = await fetch(`${service.url}v1/jobs?name=large.ply&method=taubin&iterations=1`, { method: 'POST', headers: { 'Content-Type': 'model/ply', Prefer: 'wait=60' }, body: wavesPly(side) });
  const { id } = await response.json();
  const page = await openPage(browser, service.url);
  // Counts the triangles of each frame.
  await page.addInitScript(() => {
    const { prototype } = WebGL2RenderingContext, { drawElements, clear } = prototype;
    prototype.clear = function (...rest) { window.drawn = 0; return clear.apply(this, rest); };
    prototype.drawElements = function (mode, count, ...rest) {
      if (mode === this.TRIANGLES) window.drawn += count / 3;
      return drawElements.call(this, mode, count, ...rest);
    };
  });
  await page.goto(`${service.url}?#job=${id}`);
  await done(page);
  await page.getByRole('button', { name: 'After', exact: true }).click();
  const drawn = (fits) => until('a frame of so many faces', async () => fits(await page.evaluate(() => window.drawn)), 60);
  await drawn((n) => n === faces);
  const { x, y, width, height } = await page.locator('canvas').boundingBox();
  await page.mouse.move(x + width / 2, y + height / 2);
  await page.mouse.down();
  await page.mouse.move(x + width / 2 + 20, y + height / 2, { steps: 2 });
  await drawn((n) => n > 0 && n < faces / 4);
  await page.mouse.up();
  // A picture before the mesh is drawn whole once hid it for good.
  const saved = page.waitForEvent('download');
  await page.getByRole('button', { name: 'Save a picture' }).click();
  await saved;
  await drawn((n) => n === faces);
  await page.mouse.move(x + width / 2, y + height / 2 + 1);
  await page.locator('.hover').getByText(/face \d+, vertex \d+/).waitFor();
  await page.getByRole('button', { name: 'Divide', exact: true }).click();
  await drawn((n) => n === 2 * faces);
  const divider = await page.getByRole('slider', { name: /Divider/ }).boundingBox();
  await page.mouse.move(divider.x + divider.width / 2, divider.y + divider.height / 2);
  await page.mouse.down();
  await page.mouse.move(divider.x - 40, divider.y + divider.height / 2, { steps: 2 });
  await drawn((n) => n > 0 && n < faces / 4);
  await page.mouse.up();
  await drawn((n) => n === 2 * faces);
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

test('uncertainty is asked for where a job has none', async () => {
  const page = await openPage(browser, service.url);
  await page.getByLabel('Mesh file').setInputFiles(cube);
  await done(page);
  await page.getByLabel('Colour by').selectOption('uncertainty');
  await page.getByRole('button', { name: 'Smooth again with uncertainty' }).click();
  await page.getByRole('columnheader', { name: 'right' }).waitFor();
  await page.getByLabel('Colour by').selectOption('uncertainty');
  await page.locator('.histogram').waitFor();
  await shot(page, 'uncertainty');
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

/** A job that runs until somebody stops it, on any machine. */
async function longJob(url) {
  const sample = await (await fetch(`${url}v1/samples/part.ply`)).arrayBuffer();
  const answer = await fetch(`${url}v1/jobs?sweeps=100000`, { method: 'POST', headers: { 'Content-Type': 'model/ply' }, body: sample });
  return (await answer.json()).id;
}

test('a job outlives a restart of the service, and the page waits for it', async () => {
  const own = await new Service(bin).start();
  const id = await longJob(own.url);
  const page = await openPage(browser, `${own.url}#job=${id}`);
  try {
    await page.locator('.run').getByText('Smoothing').waitFor();
    await own.stop();
    await page.locator('.run').getByText(/connection is lost/).waitFor();
    await own.start(own.port);
    await page.locator('.run').getByText('Smoothing').waitFor();
    await page.getByRole('button', { name: 'Cancel' }).click();
    await page.getByText('The job was stopped', { exact: false }).waitFor();
    assert.deepEqual(page.faults, []);
  } finally {
    await page.context().close();
    await own.remove();
  }
});

test('behind a path', async () => {
  const below = await new Service(bin, ['--base-path', '/tools/meshes']).start();
  const page = await openPage(browser, `${below.url}tools/meshes`);
  try {
    await page.getByLabel('Mesh file').setInputFiles(cube);
    await done(page);
    await page.locator('#away summary').click();
    const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', { name: /^STL/ }).click()]);
    assert.equal(download.suggestedFilename(), 'cube-smooth.stl');
    assert.deepEqual(page.faults, []);
  } finally {
    await page.context().close();
    await below.remove();
  }
});

test('a job is cancelled, and one outlives a reload', async () => {
  const page = await openPage(browser, `${service.url}#job=${await longJob(service.url)}`);
  await page.locator('.run').getByText('Smoothing').waitFor();
  await page.reload();
  await page.locator('.run').getByText('Smoothing').waitFor();
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
    await page.context().grantPermissions(['clipboard-read', 'clipboard-write']);
    await page.locator('#away > summary').click();
    await page.getByRole('button', { name: 'Link to this job' }).click();
    await page.getByText('It needs no key until').waitFor();
    const address = await page.evaluate(() => navigator.clipboard.readText());
    assert.ok(!address.includes(key));
    const guest = await openPage(browser, address);
    await done(guest);
    assert.equal(await guest.locator('dialog').count(), 0, 'the guest is asked for no key');
    assert.deepEqual(guest.faults, []);
    await guest.context().close();
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
  await page.screenshot({ path: join(shots, 'docs.png') }); // changes with every route
  assert.deepEqual(page.faults, []);
  await page.context().close();
});
