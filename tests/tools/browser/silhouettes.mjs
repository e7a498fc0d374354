// node silhouettes.mjs LIST
//
// LIST is a JSON file: [{"file", "pictures": [{"seconds", "eye", "right", "up", "back", "vertical_degrees", "silhouette"}]}]. Each file is
// shown by three.js as flat white with that camera at that time of its first clip, and laid over the given picture of a white figure on
// black. Prints one JSON line for each file: {"file", "overlaps": [the area that both cover, as a share of what either does]}, or "error".

import { readFile } from "node:fs/promises";

import { address, withPage } from "./browser.mjs";

const list = JSON.parse(await readFile(process.argv[2], "utf8"));
await withPage("silhouettes.html", async (page) => {
  for (const { file, pictures } of list) {
    let answer;
    try {
      const served = pictures.map((picture) => ({ ...picture, silhouette: address(picture.silhouette) }));
      answer = { file, overlaps: await page.evaluate((task) => globalThis.overlaps(task), { file: address(file), pictures: served }) };
    } catch (error) {
      answer = { file, error: String(error) };
    }
    process.stdout.write(`${JSON.stringify(answer)}\n`);
  }
});
