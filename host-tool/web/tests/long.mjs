// Hours of simulated time with a constant heap: node long.mjs --page DIR [--hours H]

import { readFileSync } from "node:fs";
import { join } from "node:path";
import { check, finish, options } from "./browser.mjs";

// Memory after this time is the one that later memory is compared with, s.
const SETTLED_S = 60;
const REFERENCE_HZ = 90;

const hours = Number(options.hours ?? 0.25);
const { instance } = await WebAssembly.instantiate(readFileSync(join(options.page, "flexor.wasm")), {});
const module = instance.exports;

function call(request) {
  const text = new TextEncoder().encode(JSON.stringify(request));
  const room = module.flexor_room(text.length); // may move the memory
  new Uint8Array(module.memory.buffer, room, text.length).set(text);
  const length = module.flexor_call();
  const answer = new Uint8Array(module.memory.buffer, module.flexor_answer(), Math.abs(length)).slice();
  const told = JSON.parse(new TextDecoder().decode(answer));
  if (length < 0) {
    throw new Error(told.message);
  }
  return told;
}

const { text } = call({ verb: "session", name: "ten_channels_and_finger" });
const session = { name: "long", text, seed: 1, live: true };
const { id } = call({ verb: "open", session });
const begun = performance.now();
const end_s = hours * 3600;
let settled = 0;
let samples = 0;
for (let i = 1; i / REFERENCE_HZ <= end_s; i++) {
  const t_s = i / REFERENCE_HZ;
  const angle_deg = [45 - 35 * Math.cos((2 * Math.PI * t_s) / 5), 44 * Math.sin((2 * Math.PI * t_s) / 5)];
  const news = call({ verb: "advance", id, to_us: Math.round(t_s * 1e6), send: { angle_deg } });
  samples += news.samples.t_s.length;
  if (news.end) {
    check("the session goes on", false, news.end.error);
    break;
  }
  if (settled === 0 && t_s >= SETTLED_S) {
    settled = module.memory.buffer.byteLength;
  }
}
const grown = module.memory.buffer.byteLength - settled;
const took_s = (performance.now() - begun) / 1e3;
check(`${hours} h of ten channels and a finger in a constant heap`, settled > 0 && grown === 0, `${grown} bytes more`);
check("every sample arrives", Math.abs(samples - end_s * 100) <= 2, `${samples} of ${end_s * 100}`);
console.log(`note: ${hours} h in ${took_s.toFixed(0)} s, ${module.memory.buffer.byteLength} bytes of memory`);
finish();
