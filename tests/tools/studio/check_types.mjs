// Checks the JSDoc types of the studio's modules with the TypeScript compiler. three.js is bundled and minified there, so it is the
// published types that stand for it, in a copy of the folder.
import { cp, mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { spawnSync } from "node:child_process";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const copy = await mkdtemp(join(tmpdir(), "studio-types-"));
try {
  const isOurs = (path) => !path.endsWith(join("vendor", "three.js"));
  await cp(join(here, "../../../studio"), copy, { recursive: true, filter: isOurs });
  await cp(join(here, "three.d.ts"), join(copy, "vendor/three.d.ts"));
  const types = join(here, "node_modules/@types/three");
  await writeFile(join(copy, "tsconfig.json"), JSON.stringify({
    compilerOptions: {
      strict: true, checkJs: true, allowJs: true, noEmit: true, target: "es2022", module: "es2022", moduleResolution: "bundler",
      lib: ["es2023", "dom", "dom.iterable"], types: [], skipLibCheck: true,
      paths: { three: [types], "three/addons/*": [`${types}/examples/jsm/*`] },
    },
    include: ["**/*.js"],
  }));
  const { status } = spawnSync(process.execPath, [join(here, "node_modules/typescript/bin/tsc"), "-p", copy], { stdio: "inherit", cwd: copy });
  process.exitCode = status ?? 1;
} finally {
  await rm(copy, { recursive: true });
}
