// Objects of Kubernetes against its schemas: kubectl kustomize FOLDER | node check.mjs
// The types refuse a field that is unknown or of another kind, the schemas a value that is out of range.
import ts from "typescript";
import { readFileSync } from "node:fs";
import path from "node:path";
import { parseAllDocuments } from "yaml";

const here = import.meta.dirname;
const problems = [];
const objects = parseAllDocuments(readFileSync(0, "utf8")).map((document) => {
  problems.push(...document.errors.map((error) => error.message));
  return document.toJS();
});
const moduleOf = ({ apiVersion }) => `kubernetes-models/${apiVersion}`;
const nameOf = ({ kind, metadata }) => `${kind} ${metadata.name}`;

for (const object of objects) {
  try {
    const Kind = (await import(moduleOf(object)))[object.kind];
    new Kind(object).validate();
  } catch (error) {
    problems.push(`${nameOf(object)}: ${error.message}`);
  }
}

const source = objects
  .map((object, i) => `import type { I${object.kind} as T${i} } from "${moduleOf(object)}";\n` +
    `export const o${i}: T${i} = ${JSON.stringify(object, null, 2)};\n`)
  .join("");
const file = path.join(here, "objects.ts");
const options = { strict: true, noEmit: true, skipLibCheck: true, module: ts.ModuleKind.NodeNext,
  moduleResolution: ts.ModuleResolutionKind.NodeNext, types: [] };
const host = ts.createCompilerHost(options);
const ofDisk = { read: host.getSourceFile, exists: host.fileExists };
host.fileExists = (name) => name === file || ofDisk.exists(name);
host.getSourceFile = (name, ...rest) =>
  name === file ? ts.createSourceFile(name, source, ...rest) : ofDisk.read.call(host, name, ...rest);
for (const found of ts.getPreEmitDiagnostics(ts.createProgram([file], options, host))) {
  const text = ts.flattenDiagnosticMessageText(found.messageText, "\n");
  const line = found.file?.getLineAndCharacterOfPosition(found.start).line;
  problems.push(`${text}${line === undefined ? "" : `\n    at ${source.split("\n")[line].trim()}`}`);
}

for (const problem of problems) console.error(problem);
if (objects.length === 0) problems.push("no objects");
console.log(`${objects.length} objects of Kubernetes, ${problems.length} problems`);
process.exitCode = problems.length === 0 ? 0 : 1;
