// Every shipped session in WebAssembly, in Node and in a browser, has the bytes of the native
// program: node sessions.mjs --tools DIR --page DIR --program PATH --out DIR

import { execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import { mkdirSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { join, relative } from "node:path";
import { attempt, check, finish, launch, options, serve } from "./browser.mjs";

const SLICE_US = 50_000;

const wasm = await WebAssembly.instantiate(readFileSync(join(options.page, "flexor.wasm")), {});
const module = wasm.instance.exports;

function call(request, isFile = false) {
  const text = new TextEncoder().encode(JSON.stringify(request));
  const room = module.flexor_room(text.length); // may move the memory
  new Uint8Array(module.memory.buffer, room, text.length).set(text);
  const length = module.flexor_call();
  const answer = new Uint8Array(module.memory.buffer, module.flexor_answer(), Math.abs(length)).slice();
  if (length < 0) {
    throw new Error(new TextDecoder().decode(answer));
  }
  return isFile ? Buffer.from(answer) : JSON.parse(new TextDecoder().decode(answer));
}

// All edges of a session, taken in slices of simulated time.
function edgesOf(name, slice_us) {
  const { text } = call({ verb: "session", name });
  const { id } = call({ verb: "open", session: { name, text, seed: 1 } });
  const edges = [];
  let news = {};
  for (let to_us = slice_us; !news.end; to_us += slice_us) {
    news = call({ verb: "advance", id, to_us });
    edges.push(...news.edges);
  }
  const summary = JSON.parse(call({ verb: "file", id, path: "summary.json" }, true));
  call({ verb: "drop", id });
  return { edges, pulses: summary.trials[0].pulses };
}

function play(name) {
  const { text } = call({ verb: "session", name });
  const { id } = call({ verb: "open", session: { name, text, seed: 1 } });
  let news = {};
  for (let to_us = SLICE_US; !news.end; to_us += SLICE_US) {
    news = call({ verb: "advance", id, to_us });
  }
  const files = call({ verb: "files", id }).files.map(([path]) => path);
  const record = Object.fromEntries(files.map((path) => [path, call({ verb: "file", id, path }, true)]));
  call({ verb: "drop", id });
  return record;
}

// Files of a folder, by their paths in it, without the lock file.
function folder(dir) {
  const entries = readdirSync(dir, { recursive: true, withFileTypes: true }).filter((entry) => entry.isFile());
  const paths = entries.map((entry) => relative(dir, join(entry.parentPath ?? entry.path, entry.name)));
  return Object.fromEntries(paths.filter((path) => path !== ".lock").map((path) => [path, readFileSync(join(dir, path))]));
}

// Facts about the host, and the checkout of the build, may differ.
function withoutHost(bytes) {
  const run = JSON.parse(bytes);
  delete run.host;
  delete run.program.git;
  delete run.program.modified;
  return JSON.stringify(run);
}

function difference(native, own) {
  const names = [...new Set([...Object.keys(native), ...Object.keys(own)])].sort();
  const isEqual = (name) => {
    if (!native[name] || !own[name]) {
      return false;
    }
    return name === "run.json"
      ? withoutHost(native[name]) === withoutHost(own[name])
      : Buffer.compare(native[name], own[name]) === 0;
  };
  return names.filter((name) => !isEqual(name)).join(", ");
}

const digest = (bytes) => createHash("sha256").update(bytes).digest("hex");
const names = call({ verb: "about" }).sessions.map((session) => session.name);
const digests = {};
rmSync(options.out, { recursive: true, force: true });

for (const name of names) {
  await attempt(`${name} in Node`, () => {
    const out = join(options.out, name);
    mkdirSync(out, { recursive: true });
    execFileSync(options.program, ["run", name, "--out", out], { stdio: "pipe" });
    const native = folder(out);
    const samples = Object.keys(native).find((path) => path.endsWith("samples.csv"));
    digests[name] = digest(native[samples]);
    const different = difference(native, play(name));
    return different && `other bytes in ${different}`;
  });
}
check("there are at least 50 shipped sessions", names.length >= 50, `${names.length}`);

const browser = await launch();
const server = await serve(options.page);
try {
  const page = await browser.newPage();
  await page.goto(server.url);
  const found = await page.evaluate(async ([names, slice_us]) => {
    const worker = new Worker("worker.js");
    const waiting = new Map();
    worker.onmessage = ({ data }) => waiting.get(data.number)(data);
    let number = 0;
    const ask = (message) =>
      new Promise((resolve, reject) => {
        waiting.set(++number, (data) => (data.error ? reject(new Error(data.error.message)) : resolve(data.value)));
        worker.postMessage({ number, ...message });
      });
    const call = (request) => ask({ kind: "call", request });
    const digests = {};
    for (const name of names) {
      const { text } = await call({ verb: "session", name });
      const { id } = await call({ verb: "open", session: { name, text, seed: 1 } });
      let news = {};
      for (let to_us = slice_us; !news.end; to_us += slice_us) {
        news = await call({ verb: "advance", id, to_us });
      }
      const { files } = await call({ verb: "files", id });
      const [path] = files.find(([file]) => file.endsWith("samples.csv"));
      const bytes = await ask({ kind: "file", id, path });
      const hash = new Uint8Array(await crypto.subtle.digest("SHA-256", bytes));
      digests[name] = [...hash].map((byte) => byte.toString(16).padStart(2, "0")).join("");
      await call({ verb: "drop", id });
    }
    return digests;
  }, [names, SLICE_US]);
  for (const name of names) {
    check(`${name} in a browser`, found[name] === digests[name], "other samples.csv");
  }
} finally {
  server.close();
  await browser.close();
}

await attempt("edges do not depend on the slices, and are those of the record's pulses", () => {
  const [fine, coarse] = [10_000, 3_000_000].map((slice_us) => edgesOf("reciprocal", slice_us));
  if (fine.edges.join() !== coarse.edges.join()) {
    return `${fine.edges.length / 4} edges in fine slices, ${coarse.edges.length / 4} in coarse ones`;
  }
  // A biphasic pulse has one cathodic phase.
  let pulses = 0;
  for (let i = 0; i < fine.edges.length; i += 4) {
    pulses += fine.edges[i + 2] === 1 && fine.edges[i + 3] > 0 ? 1 : 0;
  }
  return pulses === fine.pulses ? "" : `${pulses} pulses of ${fine.pulses}`;
});

// A random wearer of a study, replayed from draws.csv, sweep.json and a recorded session.toml.
const STUDY = `
name = "replayed"
title = "Replayed"
source = "no paper"
session = "open_finger.toml"
seed = 4902
draws = 3
measures = ["peak_deg"]
[[factor]]
name = "voltage"
[[factor.level]]
name = "low"
set = { "setpoints.values" = [{ channel = 1, value = 25.5 }, { channel = 2, value = 0.0 }] }
[[factor.level]]
name = "high"
set = { "setpoints.values" = [{ channel = 1, value = 27.5 }, { channel = 2, value = 0.0 }] }
[[draw]]
field = "body.flexor_nm"
low = 0.1
high = 0.6
source = "assumed"
[[draw]]
field = "body.delay_ms"
low = 10
high = 60
even = "whole"
source = "assumed"
`;
await attempt("a random wearer of a study moves as in the study", () => {
  const dir = join(options.out, "study");
  mkdirSync(dir, { recursive: true });
  writeFileSync(join(dir, "open_finger.toml"), call({ verb: "session", name: "open_finger" }).text);
  writeFileSync(join(dir, "replayed.toml"), STUDY);
  const study = join(dir, "out");
  execFileSync(options.program, ["experiment", join(dir, "replayed.toml"), "--out", study], { stdio: "pipe" });
  const files = folder(study);
  const seed = String(files["sweep.json"]).match(/"seed":\s*(\d+)/)[1];
  const [head, ...rows] = String(files["draws.csv"]).trim().split("\n").map((line) => line.replaceAll('"', "").split(","));
  const place = head.indexOf("condition");
  for (const row of rows) {
    const session = Object.keys(files).find((path) => path.includes(`-${row[place]}`) && path.endsWith("session.toml"));
    const fields = head.slice(2, place).map((name, i) => [name, row[i + 2]]);
    const draw = call({ verb: "draw", draw: { text: String(files[session]), fields, seed, wearer: row[1] } });
    const { id } = call({ verb: "open", session: { name: "wearer", text: draw.text, seed: draw.seed } });
    let [peak, news] = [-Infinity, {}];
    for (let to_us = SLICE_US; !news.end; to_us += SLICE_US) {
      news = call({ verb: "advance", id, to_us });
      peak = Math.max(peak, ...news.samples.true_deg);
    }
    call({ verb: "drop", id });
    if (peak !== Number(row[place + 1])) {
      return `wearer ${row[1]}, ${row[place]}: ${peak}° instead of ${row[place + 1]}°`;
    }
  }
  return rows.length === 6 ? "" : `${rows.length} rows`;
});

// Speed, printed and not judged: the same session by the native program and here.
for (const name of ["ten_channels_and_hand", "ten_channels_and_finger", "full_load"]) {
  const seconds = call({ verb: "check", name, text: call({ verb: "session", name }).text }).duration_s;
  const own = performance.now();
  play(name);
  const own_s = (performance.now() - own) / 1e3;
  const native = performance.now();
  execFileSync(options.program, ["run", name, "--out", join(options.out, `speed-${name}`)], { stdio: "pipe" });
  const native_s = (performance.now() - native) / 1e3;
  const times = (s) => `${(seconds / s).toFixed(0)} × real time`;
  console.log(`note: ${name}: ${times(own_s)} in Node, ${times(native_s)} by the native program with its start and report`);
}
finish();
