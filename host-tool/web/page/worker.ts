// The worker: holds the modules, and answers the messages of `Simulator` (api.ts) in order.

import { Module } from "./module";

// A module is a file beside the page, or compressed text inside a page of one file.
declare const INLINED: { flexor: string; integrators: string } | null;

const scope = self as unknown as { onmessage: unknown; postMessage(message: unknown): void; location: Location };

interface Message {
  number: number;
  kind: "call" | "course" | "file" | "integrate" | "memory";
  request?: object;
  id?: number;
  path?: string;
  steps?: { to_us: number; send?: object }[];
  integration?: object;
}

async function load(name: "flexor" | "integrators"): Promise<Module> {
  if (typeof INLINED !== "undefined" && INLINED) {
    const packed = Uint8Array.from(atob(INLINED[name]), (c) => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    return Module.create(await new Response(stream).arrayBuffer());
  }
  const answer = await fetch(new URL(`${name}.wasm`, scope.location.href));
  if (!answer.ok) {
    throw { message: `${name}.wasm cannot be loaded (${answer.status})` };
  }
  return Module.create(await answer.arrayBuffer());
}

const flexor = load("flexor");
let integrators: Promise<Module> | null = null;

async function answer(message: Message): Promise<unknown> {
  const module = await flexor;
  switch (message.kind) {
    case "call":
      return module.json(message.request ?? {});
    case "course": {
      const news = [];
      for (const { to_us, send } of message.steps ?? []) {
        const advance = { verb: "advance", id: message.id, to_us: Math.round(to_us) };
        try {
          news.push(module.json({ ...advance, send }));
        } catch (error) {
          // A refused setpoint: nothing of it is played, and time goes on.
          const refused = (error as { message: string }).message;
          news.push({ ...(module.json(advance) as object), refused });
        }
      }
      return news;
    }
    case "file":
      return module.call({ verb: "file", id: message.id, path: message.path });
    case "integrate":
      integrators ??= load("integrators");
      return (await integrators).json(message.integration ?? {});
    case "memory":
      return module.memory;
  }
}

let queue: Promise<void> = Promise.resolve();

scope.onmessage = (event: MessageEvent<Message>) => {
  const message = event.data;
  queue = queue.then(async () => {
    try {
      scope.postMessage({ number: message.number, value: await answer(message) });
    } catch (error) {
      const told = error as { message?: string };
      scope.postMessage({ number: message.number, error: told.message ? told : { message: String(error) } });
    }
  });
};
