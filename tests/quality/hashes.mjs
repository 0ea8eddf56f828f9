// Prints a hash of positions, labels and report for every method, process, solver, potential and term, each on the mesh
// family and on two real models. A change of structure leaves every line as it was:
//
//   node tests/quality/hashes.mjs BIN > before.txt      # BIN: a folder with crease and write_family
//   node tests/quality/hashes.mjs BIN > after.txt && diff before.txt after.txt
//
// CREASED_HASH_MESHES names a folder that keeps the meshes from run to run, so that two builds see the same ones.
import { execFile, execFileSync } from 'node:child_process';
import { createHash } from 'node:crypto';
import { existsSync, mkdirSync, mkdtempSync, readdirSync, readFileSync, renameSync, rmSync } from 'node:fs';
import { cpus, tmpdir } from 'node:os';
import { basename, join } from 'node:path';
import { promisify } from 'node:util';

const bin = process.argv[2];
if (!bin) throw new Error('usage: hashes.mjs BIN');
const run = promisify(execFile);
const scratch = mkdtempSync(join(tmpdir(), 'crease-hashes-'));
const meshes = process.env.CREASED_HASH_MESHES ?? join(scratch, 'meshes');

const mrf = [
  [],
  ['process=vertex'], ['process=face'],
  ...['huber', 'anisotropic', 'volume'].map((kind) => [`likelihood=${kind}`, 'process=vertex']),
  ['likelihood=anisotropic', 'scan_direction_z=1', 'process=vertex'],
  ...['square_root', 'huber', 'truncated'].map((shape) => [`smoothness=${shape}`]),
  ...['curvature_weight=0.5', 'ridge_line_weight=0.5'].map((term) => [term, 'process=vertex']),
  ['continuity_weight=0.5'],
  ['corner_weight=0.5'],
  ['ridge_kind=convex'], ['ridge_kind=concave'], ['sharpness_limit_deg=60'],
  ['edge_process=false'], ['support_weight=0'], ['seed=2', 'threads=2'],
].map((parameters) => ['method=mrf', 'sweeps=12', 'rounds=2', ...parameters]);

const classical = [
  'fuzzy_vector_median', 'taubin', 'mean_curvature_flow', 'anisotropic_flow', 'normal_diffusion', 'non_iterative',
  'bilateral', 'diebel',
].map((method) => [`method=${method}`]);

const sha = (value) => createHash('sha256').update(JSON.stringify(value)).digest('hex').slice(0, 16);

/** The report without what differs from run to run, and without parameters, which are asked for, not computed. */
function figures({ result, sweeps }) {
  const { seconds, ...facts } = result;
  return { facts, sweeps };
}

async function hashes(mesh, parameters, number) {
  const out = (name) => join(scratch, `${number}-${name}`);
  await run(join(bin, 'crease'), [
    'smooth', '--local', '--quiet', mesh, '-o', out('mesh.json'), '--labels', out('labels.json'), '--report', out('report.json'),
    ...parameters.flatMap((parameter) => ['-p', parameter]),
  ]);
  const read = (name) => JSON.parse(readFileSync(out(name)));
  const { positions } = read('mesh.json');
  if (!positions?.length) throw new Error(`no positions in ${out('mesh.json')}`);
  const line = [sha(positions), sha(read('labels.json').labels), sha(figures(read('report.json')))];
  for (const name of ['mesh.json', 'labels.json', 'report.json']) rmSync(out(name));
  return line.join(' ');
}

function prepareMeshes() {
  if (existsSync(meshes)) return;
  const raw = join(scratch, 'raw'), noisy = join(scratch, 'noisy');
  execFileSync(join(bin, 'write_family'), [raw]);
  const archive = '/usr/share/doc/libcgal-dev/data.tar.gz';
  for (const model of ['fandisk', 'elephant']) {
    execFileSync('tar', ['-xzf', archive, '-C', raw, '--strip-components=2', `data/meshes/${model}.off`]);
  }
  mkdirSync(noisy);
  for (const file of readdirSync(raw)) {
    const name = basename(file).replace(/\.\w+$/, '.obj');
    execFileSync(join(bin, 'crease'), ['noise', join(raw, file), '-o', join(noisy, name), '--sigma', '0.2']);
  }
  renameSync(noisy, meshes);
}

prepareMeshes();
const rows = [];
for (const file of readdirSync(meshes).sort()) {
  for (const parameters of [...mrf, ...classical]) rows.push({ file, parameters });
}
let next = 0;
const lines = new Array(rows.length);
await Promise.all(cpus().map(async () => {
  while (next < rows.length) {
    const number = next++;
    const { file, parameters } = rows[number];
    const label = `${file} ${parameters.filter((p) => !/^(sweeps|rounds)=/.test(p)).join(' ')}`;
    lines[number] = `${label}: ${await hashes(join(meshes, file), parameters, number).catch((error) => `failed: ${error.stderr ?? error}`)}`;
  }
}));
console.log(lines.join('\n'));
rmSync(scratch, { recursive: true });
