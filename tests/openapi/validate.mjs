// Compares answers of the service with its OpenAPI document: node validate.mjs OPENAPI FOLDER
// FOLDER has one answer a line, as the service tests keep them: method, target, status, headers, and the body of JSON.
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import Ajv2020 from 'ajv/dist/2020.js';
import addFormats from 'ajv-formats';

const [documentPath, folder] = process.argv.slice(2);
const document = JSON.parse(readFileSync(documentPath, 'utf8'));
const ajv = new Ajv2020({ strict: false, allErrors: true });
addFormats(ajv);
ajv.addSchema(document, 'api');

const templates = Object.keys(document.paths)
  .map((path) => ({ path, pattern: new RegExp(`^${path.replaceAll(/\{\w+\}/g, '[^/]+')}$`), literal: !path.includes('{') }))
  .sort((a, b) => Number(b.literal) - Number(a.literal));

/** The template of a path, which may end in a format, and may begin with a path below which the service is. */
function templateOf(path) {
  for (let rest = path; ; rest = rest.slice(rest.indexOf('/', 1))) {
    for (const candidate of [rest, rest.replace(/\.\w+$/, '')]) {
      const found = templates.find(({ pattern }) => pattern.test(candidate));
      if (found) return found.path;
    }
    if (rest.indexOf('/', 1) < 0) return undefined;
  }
}

const compiled = new Map();
function faultsOf(pointer, value) {
  if (!compiled.has(pointer)) compiled.set(pointer, ajv.compile({ $ref: `api#${pointer}` }));
  const check = compiled.get(pointer);
  return check(value) ? [] : check.errors.slice(0, 3).map((error) => `${error.instancePath} ${error.message} ${JSON.stringify(error.params)}`);
}
const escaped = (text) => encodeURIComponent(text.replaceAll('~', '~0').replaceAll('/', '~1'));

function typed(schema, text) {
  if (schema.type === 'integer' || schema.type === 'number') return Number(text);
  return schema.type === 'boolean' ? text === 'true' : text;
}

function headerFaults(pointer, described, headers) {
  return Object.entries(described.headers ?? {}).flatMap(([name, { schema, required }]) => {
    const values = headers.filter(([key]) => key === name.toLowerCase()).map(([, value]) => value);
    if (values.length === 0) return required ? [`no header ${name}`] : [];
    return values.flatMap((value) => faultsOf(`${pointer}/headers/${escaped(name)}/schema`, typed(schema, value)).map((fault) => `header ${name}: ${value}${fault}`));
  });
}

function bodyFaults(pointer, described, headers, body) {
  const type = headers.find(([name]) => name === 'content-type')?.[1].split(';')[0].trim();
  const content = described.content ?? {};
  if (type === undefined) return [];
  if (!(type in content)) return [`content type ${type} is not described`];
  if (body === undefined || headers.some(([name]) => name === 'content-range')) return [];
  return faultsOf(`${pointer}/content/${escaped(type)}/schema`, JSON.parse(body));
}

function faults({ method, target, status, headers, body }) {
  if (headers.some(([name]) => name === 'server')) return []; // an answer of the proxy in front
  const path = decodeURI(target.split('?')[0].replace(/%(?![0-9a-f]{2})/gi, '%25'));
  const template = templateOf(path);
  const name = (method === 'HEAD' ? 'GET' : method).toLowerCase();
  const operation = template && document.paths[template][name];
  if (!operation) {
    if (status < 400) return method === 'OPTIONS' || status === 308 ? [] : ['is not described'];
    return body === undefined ? [] : faultsOf('/components/schemas/Problem', JSON.parse(body));
  }
  const described = operation.responses[status];
  if (!described) return [`status ${status} is not described`];
  const pointer = `/paths/${escaped(template)}/${name}/responses/${status}`;
  return [...headerFaults(pointer, described, headers), ...bodyFaults(pointer, described, headers, method === 'HEAD' ? undefined : body)];
}

const seen = new Map();
let count = 0;
const operations = new Set();
for (const file of readdirSync(folder).filter((name) => name.endsWith('.jsonl'))) {
  for (const line of readFileSync(join(folder, file), 'utf8').split('\n').filter(Boolean)) {
    const answer = JSON.parse(line);
    ++count;
    let found;
    try {
      found = faults(answer);
    } catch (error) {
      found = [String(error)];
    }
    operations.add(`${answer.method} ${templateOf(answer.target.split('?')[0]) ?? '?'} ${answer.status}`);
    for (const fault of found) seen.set(`${answer.method} ${templateOf(answer.target.split('?')[0]) ?? answer.target} ${answer.status}: ${fault}`, answer.target);
  }
}
for (const [fault, example] of seen) console.log(`${fault}\n    as in ${example}`);
console.log(`${count} answers of ${operations.size} kinds compared, ${seen.size} faults`);
process.exit(seen.size === 0 && count > 0 ? 0 : 1);
