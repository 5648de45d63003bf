/** The page's API types from the OpenAPI of both processes: `make types`; with --check it only compares. */
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import openapiTS, { astToString } from "openapi-typescript";

const FOLDER = join(import.meta.dirname, "src/api/schema");

/** The module of a process. Of its document only the schemas matter to the page, so that the types
 * change with what is sent, and not with a summary. */
async function typesOf(side, name) {
  const document = readFileSync(join(FOLDER, `${side}.openapi.json`), "utf8");
  const nodes = await openapiTS(
    { ...JSON.parse(document), paths: {} },
    { defaultNonNullable: false, emptyObjectsUnknown: true },
  );
  const text = astToString(nodes.filter((node) => node.name?.text === "components"));
  const [, types] = /^ {4}schemas: \{\n(.*?)^ {4}\};/ms.exec(text);
  const members = types.replaceAll('components["schemas"]', name).replace(/^ {4}/gm, "");
  const about = `/** What the ${side} takes and answers. Made by \`make types\`; changes are lost. */`;
  return `${about}\nexport interface ${name} {\n${members}}\n`;
}

for (const [side, name] of [
  ["editor", "EditorApi"],
  ["runner", "RunnerApi"],
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
