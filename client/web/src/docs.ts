import { applyTheme } from './ui/theme';
import { fill, h } from './ui/dom';

interface Parameter {
  name: string;
  in: string;
  required?: boolean;
  description?: string;
  schema?: Record<string, unknown>;
}
interface Operation {
  operationId: string;
  summary: string;
  tags: string[];
  parameters: Parameter[];
  responses: Record<string, { description: string; content?: Record<string, { schema?: { $ref?: string } }> }>;
  requestBody?: { content: Record<string, unknown> };
}
interface Document {
  info: { title: string; version: string; summary: string };
  tags: { name: string; description: string }[];
  paths: Record<string, Record<string, Operation>>;
  components: { schemas: Record<string, { properties?: Record<string, Record<string, unknown>>; required?: string[] }> };
}

const typeOf = (schema: Record<string, unknown> = {}): string => {
  if (Array.isArray(schema['enum'])) return schema['enum'].join(' | ');
  const reference = schema['$ref'] as string | undefined;
  if (reference) return reference.split('/').pop()!;
  if (schema['type'] === 'array') return `${typeOf(schema['items'] as Record<string, unknown>)}[]`;
  const limits = schema['minimum'] !== undefined && Number(schema['maximum']) < 1e15 ? `, ${String(schema['minimum'])} to ${String(schema['maximum'])}` : '';
  return `${String(schema['type'] ?? 'any')}${limits}`;
};

const table = (title: string, rows: [string, string, string][]): HTMLElement | false =>
  rows.length > 0 && h('div', {}, h('h3', {}, title), h('table', {}, h('tbody', {}, ...rows.map(([name, type, meaning]) =>
    h('tr', {}, h('th', { scope: 'row' }, h('code', {}, name)), h('td', {}, type), h('td', {}, meaning))))));

function operationOf(path: string, method: string, one: Operation): HTMLElement {
  const answers = Object.entries(one.responses).map(([status, { description, content }]): [string, string, string] => {
    const types = Object.entries(content ?? {}).map(([type, { schema }]) => schema?.$ref?.split('/').pop() ?? type);
    return [status, [...new Set(types)].join(', '), description];
  });
  return h('details', { class: 'operation', id: one.operationId },
    h('summary', {}, h('span', { class: 'method' }, method.toUpperCase()), h('code', {}, path), h('span', { class: 'quiet-text' }, one.summary)),
    h('div', { class: 'body' },
      table('Parameters', one.parameters.map((p) => [p.name, `${p.in}${p.required ? ', required' : ''}: ${typeOf(p.schema)}`, p.description ?? ''])),
      one.requestBody !== undefined && h('p', {}, 'Body: ', Object.keys(one.requestBody.content).join(', ')),
      table('Answers', answers)));
}

async function show(): Promise<void> {
  const main = document.getElementById('docs')!;
  const response = await fetch('openapi.json');
  const api = (await response.json()) as Document;
  const operations = Object.entries(api.paths).flatMap(([path, methods]) => Object.entries(methods).map(([method, one]) => ({ path, method, one })));
  fill(main,
    h('p', {}, h('a', { href: './' }, 'creased')),
    h('h1', {}, 'The API'),
    h('p', { class: 'quiet-text' }, `${api.info.summary} Version ${api.info.version}. `, h('a', { href: 'openapi.json' }, 'openapi.json')),
    ...api.tags.flatMap((tag) => [
      h('h2', {}, tag.name),
      h('p', { class: 'quiet-text' }, tag.description),
      ...operations.filter(({ one }) => one.tags.includes(tag.name)).map(({ path, method, one }) => operationOf(path, method, one)),
    ]),
    h('h2', {}, 'Schemas'),
    ...Object.entries(api.components.schemas).map(([name, schema]) =>
      h('details', { class: 'operation', id: `schema-${name}` }, h('summary', {}, h('code', {}, name)),
        h('div', { class: 'body' }, table('Fields', Object.entries(schema.properties ?? {}).map(([field, one]) =>
          [field, typeOf(one) + (schema.required?.includes(field) ? ', required' : ''), String(one['description'] ?? '')]))))));
}

applyTheme();
void show();
