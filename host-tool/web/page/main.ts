// The page: starts the simulator, and shows one of its parts.

import { Simulator } from "./api";
import { mountScene } from "./scene";
import { mountSessions } from "./sessions";
import { mountUnderstand } from "./understand";

declare const WORKER_TEXT: string | null;

const parts = ["watch", "sessions", "understand"] as const;
type Part = (typeof parts)[number];

function startWorker(): Worker {
  if (WORKER_TEXT === null) {
    return new Worker(new URL("worker.js", document.baseURI));
  }
  return new Worker(URL.createObjectURL(new Blob([WORKER_TEXT], { type: "text/javascript" })));
}

function trouble(message: string): void {
  const place = document.getElementById("trouble");
  if (place) {
    place.textContent = message;
    place.hidden = false;
  }
}

// The fragment is a part (#understand), or a session (#session=…), which belongs to "sessions".
function partOf(fragment: string): Part {
  const word = fragment.replace(/^#/, "").split(/[=/&]/)[0];
  if (word.startsWith("session")) {
    return "sessions";
  }
  return parts.find((part) => part === word) ?? "watch";
}

function show(part: Part): void {
  for (const section of document.querySelectorAll<HTMLElement>("main > section")) {
    section.hidden = section.dataset.part !== part;
  }
  for (const link of document.querySelectorAll<HTMLElement>("nav a")) {
    if (link.dataset.part === part) {
      link.setAttribute("aria-current", "page");
    } else {
      link.removeAttribute("aria-current");
    }
  }
  document.dispatchEvent(new CustomEvent("part", { detail: part }));
}

async function start(): Promise<void> {
  if (typeof WebAssembly !== "object" || typeof Worker !== "function") {
    trouble("This browser has no WebAssembly or no workers, which the simulator needs. Use a current browser.");
    return;
  }
  const part = (name: Part): HTMLElement => document.getElementById(`${name}-part`) as HTMLElement;
  const simulator = new Simulator(startWorker());
  try {
    const about = await simulator.about();
    (document.getElementById("version") as HTMLElement).textContent = about.program.version;
    show(partOf(location.hash));
    mountScene(part("watch"), simulator);
    mountSessions(part("sessions"), simulator, about);
    mountUnderstand(part("understand"), simulator);
    addEventListener("hashchange", () => show(partOf(location.hash)));
  } catch (error) {
    trouble(`The simulator could not be started: ${(error as Error).message}`);
  }
}

void start();
