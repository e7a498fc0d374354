// node validate.mjs FILE...
//
// Validates glTF files and prints one JSON line for each:
//   {"file", "errors", "warnings", "first_error", "codes": {"<CODE of an error>": count}, "warning_codes": {the same}}
// A file that cannot be validated at all has "errors": 1 and says why in "first_error". The exit code is 0 unless this
// script itself cannot work. External resources are looked up beside the file; missing ones are IO_ERROR as usual.

import { readFile } from "node:fs/promises";
import { dirname, join } from "node:path";

const ERROR = 0;
const WARNING = 1;

let validator;
try {
  validator = (await import("gltf-validator")).default;
} catch {
  console.error("gltf-validator is not installed: run 'npm ci --prefix tests/tools/gltf_validator'");
  process.exit(2);
}

for (const file of process.argv.slice(2)) {
  console.log(JSON.stringify(await validate(file)));
}

async function validate(file) {
  try {
    const bytes = new Uint8Array(await readFile(file));
    const report = await validator.validateBytes(bytes, {
      uri: file,
      maxIssues: 0,
      externalResourceFunction: async (uri) =>
        new Uint8Array(await readFile(join(dirname(file), decodeURIComponent(uri)))),
    });
    const messages = (severity) => report.issues.messages.filter((message) => message.severity === severity);
    const counted = (severity) => {
      const codes = {};
      for (const { code } of messages(severity)) codes[code] = (codes[code] ?? 0) + 1;
      return codes;
    };
    const first = messages(ERROR)[0];
    return {
      file,
      errors: report.issues.numErrors,
      warnings: report.issues.numWarnings,
      first_error: first ? `${first.pointer ?? ""}: ${first.code}: ${first.message}` : null,
      codes: counted(ERROR),
      warning_codes: counted(WARNING),
    };
  } catch (error) {
    return {
      file,
      errors: 1,
      warnings: 0,
      first_error: String(error),
      codes: { UNREADABLE: 1 },
      warning_codes: {},
    };
  }
}
