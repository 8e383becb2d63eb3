// What the tests of the page share: options, a static server, a browser, and the count of checks.

import { createServer } from "node:http";
import { existsSync, readFileSync, statSync } from "node:fs";
import { createRequire } from "node:module";
import { extname, join, normalize } from "node:path";
import { pathToFileURL } from "node:url";

export const options = Object.fromEntries(
  process.argv.slice(2).flatMap((word, i, all) => (word.startsWith("--") ? [[word.slice(2), all[i + 1]]] : [])),
);

export const load = createRequire(pathToFileURL(join(options.tools ?? ".", "any.js")).href);

const TYPES = {
  ".html": "text/html; charset=utf-8",
  ".js": "text/javascript",
  ".css": "text/css",
  ".wasm": "application/wasm",
  ".json": "application/json",
};

// Serves a folder at a free port of this computer; returns its address and a function to end it.
export async function serve(folder) {
  const server = createServer((request, answer) => {
    const path = normalize(decodeURIComponent(new URL(request.url, "http://x").pathname));
    let file = join(folder, path);
    if (existsSync(file) && statSync(file).isDirectory()) {
      file = join(file, "index.html");
    }
    if (path === "/favicon.ico") {
      answer.writeHead(204).end();
    } else if (!existsSync(file)) {
      answer.writeHead(404).end();
    } else {
      answer.writeHead(200, { "content-type": TYPES[extname(file)] ?? "application/octet-stream" });
      answer.end(readFileSync(file));
    }
  });
  await new Promise((ready) => server.listen(0, "127.0.0.1", ready));
  return { url: `http://127.0.0.1:${server.address().port}/`, close: () => server.close() };
}

export function launch() {
  const { chromium } = load("playwright-core");
  const args = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync"];
  args.push("--disable-background-networking", "--disable-component-update");
  const path = ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find(existsSync);
  return chromium.launch({ executablePath: options.chromium ?? path, args });
}

let failed = 0;

export function check(name, holds, detail = "") {
  failed += holds ? 0 : 1;
  console.log(holds ? `ok ${name}` : `FAILED ${name}${detail ? `: ${detail}` : ""}`);
}

// Runs a test; an exception is a failure with its message.
export async function attempt(name, test) {
  try {
    const problem = await test();
    check(name, !problem, problem || "");
  } catch (error) {
    check(name, false, String(error.message ?? error).split("\n").slice(0, 4).join(" | "));
  }
}

export function finish() {
  process.exitCode = failed > 0 ? 1 : 0;
}
