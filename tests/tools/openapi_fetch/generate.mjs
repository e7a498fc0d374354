// Makes the types, as the manual of openapi-typescript says for bodies of bytes: `node generate.mjs openapi.json schema.d.ts`.
import { readFile, writeFile } from "node:fs/promises";
import openapiTS, { astToString } from "openapi-typescript";
import ts from "typescript";

const [document, output] = process.argv.slice(2);
const BLOB = ts.factory.createTypeReferenceNode(ts.factory.createIdentifier("Blob"));
const types = await openapiTS(JSON.parse(await readFile(document, "utf8")), {
  transform: (schema) => (schema.format === "binary" ? BLOB : undefined),
});
await writeFile(output, astToString(types));
