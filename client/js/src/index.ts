export * from './client.js';
export { labelFormats, meshFormats, reportFormats, ridgeFormats } from './formats.js';
export { readEvents, type ServerEvent } from './events.js';
export { decodeLabels, type EdgeLabels } from './labels.js';
export { CreasedError, errorOf, type Problem } from './problem.js';
export type { components, operations, paths } from './schema.js';
