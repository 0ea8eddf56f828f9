// The packed client in Node, under a strict compiler, and in a browser's bundle: node --test, with CREASED_BIN, and
// CREASED_CLIENT for the folder in which the page was built.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, rmSync, symlinkSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { after, before, test } from 'node:test';
import { cubeObj, openBrowser, Service } from './bench.mjs';

const bin = process.env.CREASED_BIN ?? 'build/release/bin';
const built = resolve(process.env.CREASED_CLIENT ?? 'build/release/client/page');
const tools = createRequire(join(built, 'web/package.json'));
let folder, service;

const program = `
import { Client, CreasedError, meshFormats, type JobEvent } from 'creased-client';

export async function smooth(baseUrl: string, obj: string): Promise<string[]> {
  const client = new Client({ baseUrl });
  const job = await client.submit(new TextEncoder().encode(obj), { name: 'cube.obj', parameters: { sweeps: 3 } });
  const events: JobEvent['type'][] = [];
  for await (const event of client.follow(job.id)) events.push(event.type);
  const { edges, labels, count } = await client.labels(job.id);
  if (edges.length !== 2 * count || labels.length !== count) throw new Error('labels and edges do not fit');
  const { url } = await client.link(job.id, { result: 'mesh', format: 'obj' });
  const linked: string = await (await fetch(url)).text();
  const file: File = await client.file(\`v1/jobs/\${job.id}/mesh.obj\`);
  if (linked !== (await file.text())) throw new Error('the link reads something else');
  const refused: unknown = await client.job('nope').catch((error: unknown) => error);
  return [events.at(-1) ?? '', file.name, refused instanceof CreasedError ? refused.code : '', String(meshFormats.includes('glb'))];
}
`;
const expected = ['ended', 'cube-smooth.obj', 'job_not_found', 'true'];

before(async () => {
  folder = mkdtempSync(join(tmpdir(), 'creased-client-'));
  const [{ filename }] = JSON.parse(execFileSync('npm', ['pack', '--json', '--pack-destination', folder], { cwd: join(built, 'js'), encoding: 'utf8' }));
  writeFileSync(join(folder, 'package.json'), '{ "private": true, "type": "module" }');
  execFileSync('npm', ['install', '--offline', '--no-audit', '--no-fund', join(folder, filename)], { cwd: folder });
  writeFileSync(join(folder, 'program.ts'), program);
  symlinkSync(join(built, 'node_modules', 'typescript'), join(folder, 'node_modules', 'typescript'));
  service = await new Service(bin).start();
});
after(async () => {
  await service?.remove();
  rmSync(folder, { recursive: true, force: true });
});

test('compiles under --strict, and works in Node', async () => {
  const flags = ['--strict', '--exactOptionalPropertyTypes', '--noUncheckedIndexedAccess', '--target', 'es2022', '--module', 'nodenext', '--lib', 'es2022,dom,dom.iterable'];
  execFileSync(process.execPath, [tools.resolve('typescript/lib/tsc.js'), ...flags, 'program.ts'], { cwd: folder, stdio: 'inherit' });
  const { smooth } = await import(join(folder, 'program.js'));
  assert.deepEqual(await smooth(service.url, cubeObj()), expected);
});

test('works in the bundle of a browser', async () => {
  const { build } = await import(createRequire(tools.resolve('vite')).resolve('esbuild'));
  const bundle = await build({ entryPoints: [join(folder, 'program.ts')], bundle: true, format: 'iife', globalName: 'program', write: false, minify: true });
  const browser = await openBrowser();
  try {
    const page = await (await browser.newContext()).newPage();
    await page.goto(service.url);
    const call = `program.smooth(${JSON.stringify(service.url)}, ${JSON.stringify(cubeObj())})`;
    assert.deepEqual(await page.evaluate(`(() => { ${bundle.outputFiles[0].text}; return ${call}; })()`), expected);
  } finally {
    await browser.close();
  }
});
