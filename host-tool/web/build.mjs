// Builds the page: node build.mjs --tools DIR --wasm DIR --out DIR
//
// DIR of --tools has the packages of package-lock.json in node_modules; DIR of --wasm has
// flexor.wasm and integrators.wasm. The result is a folder for any static server, and in it
// playground.html, which is the whole page in one file.

import { createHash } from "node:crypto";
import { mkdirSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { brotliCompressSync, constants, gzipSync } from "node:zlib";

const options = Object.fromEntries(
  process.argv.slice(2).flatMap((word, i, all) => (word.startsWith("--") ? [[word.slice(2), all[i + 1]]] : [])),
);
for (const name of ["tools", "wasm", "out"]) {
  if (!options[name]) {
    console.error("usage: node build.mjs --tools DIR --wasm DIR --out DIR");
    process.exit(2);
  }
}
const here = dirname(fileURLToPath(import.meta.url));
const root = join(here, "..", "..");
const packages = join(options.tools, "node_modules");
const resolve = createRequire(pathToFileURL(join(packages, "..", "any.js")).href).resolve;
const { build } = await import(pathToFileURL(resolve("esbuild")).href);

const shared = {
  bundle: true,
  minify: true,
  target: "es2022",
  legalComments: "none",
  nodePaths: [packages],
  loader: { ".csv": "text" },
  alias: { charts: join(root, "docs", "charts"), maps: join(root, "docs", "maps") },
  logLevel: "warning",
};

async function bundle(entry, extra = {}) {
  const built = await build({ ...shared, entryPoints: [join(here, "page", entry)], write: false, ...extra });
  return built.outputFiles[0].text;
}

mkdirSync(options.out, { recursive: true });
const sheets = readdirSync(join(here, "page")).filter((name) => name.endsWith(".css"));
sheets.sort((a, b) => Number(b === "style.css") - Number(a === "style.css") || a.localeCompare(b));
const read = (path) => readFileSync(path, "utf8");
const styles = [join(packages, "uplot", "dist", "uPlot.min.css"), ...sheets.map((name) => join(here, "page", name))];
const style = styles.map(read).join("\n");
const html = readFileSync(join(here, "page", "index.html"), "utf8");
const wasm = ["flexor", "integrators"].map((name) => [name, readFileSync(join(options.wasm, `${name}.wasm`))]);
const policy = (parts) => parts.join("; ");

// A folder: page, scripts, editor on demand, modules.
const out = (name, contents) => writeFileSync(join(options.out, name), contents);
const page = await build({
  ...shared,
  entryPoints: { page: join(here, "page", "main.ts") },
  format: "esm",
  splitting: true,
  chunkNames: "part-[hash]",
  outdir: options.out,
  define: { WORKER_TEXT: "null" },
  metafile: true,
});
const worker = await bundle("worker.ts", { format: "iife" });
out("worker.js", worker);
out("style.css", style);
for (const [name, bytes] of wasm) {
  out(`${name}.wasm`, bytes);
}
out(
  "index.html",
  html
    .replace(
      "<!-- policy -->",
      `<meta http-equiv="Content-Security-Policy" content="${policy([
        "default-src 'none'",
        "script-src 'self' 'wasm-unsafe-eval'",
        "worker-src 'self'",
        "connect-src 'self'",
        "style-src 'self' 'nonce-flexor'",
        "img-src 'self' data:",
        "base-uri 'none'",
        "form-action 'none'",
      ])}">`,
    )
    .replace("<!-- style -->", '<link rel="stylesheet" href="style.css">')
    .replace("<!-- script -->", '<script type="module" src="page.js"></script>'),
);

// One file: everything inside, the modules compressed.
const inlined = Object.fromEntries(wasm.map(([name, bytes]) => [name, gzipSync(bytes, { level: 9 }).toString("base64")]));
const whole = await bundle("main.ts", {
  format: "iife",
  define: { WORKER_TEXT: JSON.stringify(`const INLINED = ${JSON.stringify(inlined)};\n${worker}`) },
});
const script = whole.replaceAll("</script", "<\\/script");
const hash = createHash("sha256").update(script).digest("base64");
out(
  "playground.html",
  html
    .replace(
      "<!-- policy -->",
      () =>
        `<meta http-equiv="Content-Security-Policy" content="${policy([
          "default-src 'none'",
          `script-src 'sha256-${hash}' 'wasm-unsafe-eval' blob:`,
          "worker-src blob:",
          "style-src 'nonce-flexor'",
          "img-src data: blob:",
          "base-uri 'none'",
          "form-action 'none'",
        ])}">`,
    )
    .replace("<!-- style -->", () => `<style nonce="flexor">${style}</style>`)
    .replace("<!-- script -->", () => `<script>${script}</script>`),
);

// Sizes as a server would send them.
const brotli = (bytes) =>
  brotliCompressSync(bytes, {
    params: { [constants.BROTLI_PARAM_QUALITY]: 11, [constants.BROTLI_PARAM_LGWIN]: 24 },
  }).length;
const sizes = {};
for (const [name, bytes] of wasm) {
  sizes[`${name}.wasm`] = brotli(bytes);
}
// The editor: what its entry imports beyond what the page has imported already.
const outputs = Object.fromEntries(
  Object.entries(page.metafile.outputs).map(([path, output]) => [path.split("/").pop(), output]),
);
const closure = (name, found = new Set()) => {
  found.add(name);
  for (const item of outputs[name].imports) {
    const next = item.path.split("/").pop();
    if (item.kind === "import-statement" && !found.has(next)) {
      closure(next, found);
    }
  }
  return found;
};
const entry = Object.keys(outputs).find((name) => outputs[name].entryPoint?.endsWith("page/editor.ts"));
const first = closure("page.js");
const editor = closure(entry);
sizes.page = brotli(Buffer.from(style)) + brotli(Buffer.from(html)) + brotli(Buffer.from(worker));
sizes.editor = 0;
for (const name of Object.keys(outputs)) {
  const isEditor = editor.has(name) && !first.has(name);
  sizes[isEditor ? "editor" : "page"] += brotli(readFileSync(join(options.out, name)));
}
const lines = Object.entries(sizes).map(([name, size]) => `"${name}" = ${size}\n`);
out("sizes.toml", lines.join(""));
console.log(JSON.stringify(sizes));
