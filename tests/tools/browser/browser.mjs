// A page in headless Chromium that sees the files that it is given and nothing else: what the scripts beside this one share.

import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { dirname, extname, join } from "node:path";
import { fileURLToPath } from "node:url";

let chromium;
try {
  ({ chromium } = await import("playwright-core"));
} catch (error) {
  console.error(`playwright-core is not installed: run 'npm ci --prefix tests/tools/browser' (${error})`);
  process.exit(2);
}

const HERE = dirname(fileURLToPath(import.meta.url));
const THREE = dirname(dirname(createRequire(import.meta.url).resolve("three")));
// Decoders of images work only where the origin is trusted.
const ORIGIN = "http://localhost:1";
const TYPES = { ".html": "text/html", ".js": "text/javascript", ".mjs": "text/javascript", ".json": "application/json" };

// Opens a page of this folder, has `work(page)` done, and closes it. `/three/...` is the package of that name; `/file?PATH` is a file.
export async function withPage(name, work) {
  const browser = await chromium.launch({
    executablePath: process.env.RETARGETD_CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
  });
  try {
    const page = await browser.newPage();
    page.on("pageerror", (error) => console.error(String(error)));
    page.on("console", (message) => console.error(message.text()));
    await page.route("**/*", serve);
    await page.goto(`${ORIGIN}/${name}`);
    await page.waitForFunction(() => globalThis.isReady === true);
    return await work(page);
  } finally {
    await browser.close();
  }
}

// Where a page finds a file of this machine.
export function address(path) {
  return `/file?${encodeURIComponent(path)}`;
}

async function serve(route) {
  const url = new URL(route.request().url());
  if (url.origin !== ORIGIN) return route.abort();
  const path = url.pathname.startsWith("/three/")
    ? join(THREE, url.pathname.slice("/three/".length))
    : url.pathname === "/file"
      ? decodeURIComponent(url.search.slice(1))
      : join(HERE, url.pathname);
  try {
    await route.fulfill({ body: await readFile(path), contentType: TYPES[extname(path)] ?? "application/octet-stream" });
  } catch (error) {
    console.error(String(error));
    await route.fulfill({ status: 404, body: "" });
  }
}
