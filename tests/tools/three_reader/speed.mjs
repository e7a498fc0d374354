// node speed.mjs FILE...
//
// How fast three.js' own loaders parse files that are in memory: one JSON line for each,
//   {"file", "bytes", "seconds": the shortest of all runs, "bytes_per_second"}
// Runs each at least three times and for at least three seconds.

import { readFile } from "node:fs/promises";
import { ending, parseBvh, parseFbx, parseGltf } from "./loaders.mjs";

const PARSE = { fbx: parseFbx, bvh: (bytes) => parseBvh(bytes.toString("utf8")) };

for (const file of process.argv.slice(2)) {
  const bytes = await readFile(file);
  const parse = PARSE[ending(file)] ?? parseGltf;
  const began = performance.now();
  let seconds = Infinity;
  for (let run = 0; run < 3 || performance.now() - began < 3000; run += 1) {
    const start = performance.now();
    await parse(bytes);
    seconds = Math.min(seconds, (performance.now() - start) / 1000);
  }
  process.stdout.write(
    `${JSON.stringify({ file, bytes: bytes.length, seconds, bytes_per_second: Math.round(bytes.length / seconds) })}\n`,
  );
}
