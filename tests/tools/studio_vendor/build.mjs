// Bundles entry.mjs with esbuild. Without words it writes studio/vendor; with --digest it prints the SHA-256 of the bundle alone.
import { createHash } from "node:crypto";
import { readFile, writeFile } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build, version as esbuild } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const vendor = join(here, "../../../studio/vendor");

const { outputFiles } = await build({
  absWorkingDir: here,
  entryPoints: ["entry.mjs"],
  bundle: true,
  minify: true,
  format: "esm",
  target: "es2022",
  legalComments: "inline",
  write: false,
});
const bundle = outputFiles[0].contents;
const sha256 = createHash("sha256").update(bundle).digest("hex");
if (process.argv.includes("--digest")) {
  console.log(sha256);
} else {
  const lock = JSON.parse(await readFile(join(here, "package-lock.json"), "utf8"));
  const { version, integrity } = lock.packages["node_modules/three"];
  await writeFile(join(vendor, "three.js"), bundle);
  await writeFile(join(vendor, "LICENSE.three"), await readFile(join(here, "node_modules/three/LICENSE")));
  await writeFile(join(vendor, "VERSION.json"), `${JSON.stringify({ three: version, integrity, esbuild, sha256 }, null, 2)}\n`);
  console.log(`${bundle.length} bytes`);
}
