/** The page's API types from the OpenAPI of both processes: `make types`; with --check it only compares. */
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import openapiTS, { astToString } from "openapi-typescript";

const FOLDER = join(import.meta.dirname, "src/api/schema");

/** Return the document of a process without its summaries and refusals, so that the types change
 * only with what is sent. */
function documentOf(side) {
  const document = JSON.parse(readFileSync(join(FOLDER, `${side}.openapi.json`), "utf8"));
  for (const operation of Object.values(document.paths).flatMap(Object.values)) {
    delete operation.summary;
    delete operation.description;
    delete operation.responses.default;
  }
  return document;
}

/** Return the module of a process: its schemas, and its operations by path and method. */
async function typesOf(side, name) {
  const nodes = await openapiTS(documentOf(side), {
    defaultNonNullable: false,
    emptyObjectsUnknown: true,
  });
  const textOf = (part) => astToString(nodes.filter((node) => node.name?.text === part));
  const [, schemas] = /^ {4}schemas: \{\n(.*?)^ {4}\};/ms.exec(textOf("components"));
  const routes = `${textOf("paths")}\n${textOf("operations")}`
    .replace(/^ +\/\*\* @description .*\n/gm, "") // of a status
    .replace(/^ +"?\w+"?\?: never;\n/gm, "")
    .replace(/^ +headers: \{\n.*?^ +\};\n/gms, "")
    .replace(/^ +parameters: \{\n +\};\n/gm, "")
    .replace("export interface paths", `export interface ${name}Paths`)
    .replace("export interface operations", `interface ${name}Operations`)
    .replaceAll('operations["', `${name}Operations["`);
  const about = `/** What the ${side} takes and answers. Made by \`make types\`; changes are lost. */`;
  return [about, `export interface ${name}Api {`, `${schemas.replace(/^ {4}/gm, "")}}\n`, routes]
    .join("\n")
    .replaceAll('components["schemas"]', `${name}Api`);
}

for (const [side, name] of [
  ["editor", "Editor"],
  ["runner", "Runner"],
]) {
  const file = join(FOLDER, `${side}.ts`);
  const types = await typesOf(side, name);
  if (!process.argv.includes("--check")) {
    writeFileSync(file, types);
  } else if (readFileSync(file, "utf8") !== types) {
    console.error(`${file} is not what its OpenAPI says; \`make types\` renews it.`);
    process.exitCode = 1;
  }
}
