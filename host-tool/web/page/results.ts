// Plots and events of a run.

import type { News, Samples, SessionInfo } from "./api";
import { make } from "./dom";
import { Plot, type Line } from "./plots";

type Value = number | null;

// Largest number of points of a line. Longer runs are plotted with every 2nd, 4th, … sample.
const MOST_POINTS = 5_000;
// Largest number of events in the list.
const MOST_EVENTS = 500;

const COLORS = ["s1", "s2", "s3", "s4"];
// Lines of the same color differ in their dashes.
const DASHES: { name: string; dash?: number[] }[] = [
  { name: "" },
  { name: ", dashed", dash: [8, 4] },
  { name: ", dotted", dash: [2, 3] },
];

// A plot with its points so far.
class Curves {
  readonly plot: Plot;
  private times: number[] = [];
  private columns: Value[][];
  private stride = 1;
  private count = 0;
  private hasChanged = false;

  constructor(
    options: { title: string; unit: string; lines: Line[] },
    private readonly pick: (samples: Samples) => Value[][],
  ) {
    this.plot = new Plot({ ...options, height: 220 });
    this.columns = options.lines.map(() => []);
  }

  add(samples: Samples): void {
    const picked = this.pick(samples);
    for (const [i, time] of samples.t_s.entries()) {
      if (this.count++ % this.stride === 0) {
        this.times.push(time);
        this.columns.forEach((column, k) => column.push(picked[k]?.[i] ?? null));
        this.hasChanged = true;
      }
      if (this.times.length > MOST_POINTS) {
        const isKept = (_: unknown, place: number): boolean => place % 2 === 0;
        this.times = this.times.filter(isKept);
        this.columns = this.columns.map((column) => column.filter(isKept));
        this.stride *= 2;
      }
    }
  }

  draw(): void {
    if (this.hasChanged) {
      this.plot.set(this.times, ...this.columns);
      this.hasChanged = false;
    }
  }
}

export class Results {
  readonly element: HTMLElement;
  private readonly curves: Curves[] = [];
  private readonly plots = make("div", { class: "run-plots" });
  private readonly events = make("ol", { class: "events" });
  private readonly noEvents = make("p", { class: "note" }, "No events so far.");
  private hasAngles = false;
  private lastDraw = 0;
  private readonly interval_ms: number;

  constructor(info: SessionInfo) {
    const isCalm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.interval_ms = isCalm ? 1_000 : 100;
    if (info.has_joint || info.has_wall) {
      this.addAngles(info.has_wall ? "position of the wall" : "reference");
    }
    this.addAmplitudes(info);
    this.addForces(info);
    if (info.has_limb) {
      this.addHand(info.body === "arm");
    }
    const attributes = { tabindex: "0", role: "region", "aria-label": "Events" };
    const list = make(
      "div",
      { class: "scroll events-box", ...attributes },
      this.noEvents,
      this.events,
    );
    this.element = make("div", {}, this.plots, make("h3", {}, "Events"), list);
  }

  // Adds what happened, and draws it if the last drawing is long enough ago, or if it `isLast`.
  add(news: News, isLast: boolean): void {
    const { samples } = news;
    if (samples && samples.t_s.length > 0) {
      if (!this.hasAngles && samples.true_deg.some((angle) => angle !== null)) {
        this.addAngles("reference");
      }
      this.curves.forEach((curves) => curves.add(samples));
    }
    for (const [time_s, text] of news.events ?? []) {
      this.addEvent(time_s, text);
    }
    const now = performance.now();
    if (isLast || now - this.lastDraw > this.interval_ms) {
      this.lastDraw = now;
      this.curves.forEach((curves) => curves.draw());
    }
  }

  addEvent(time_s: number, text: string): void {
    this.noEvents.hidden = true;
    if (this.events.childElementCount >= MOST_EVENTS) {
      this.events.firstElementChild?.remove();
    }
    const time = make("span", { class: "event-time" }, `${time_s.toFixed(3)} s`);
    const row = make("li", {}, time, " ", text);
    row.dataset.time = String(time_s);
    let later: Element | null = null;
    let before = this.events.lastElementChild;
    while (before instanceof HTMLElement && Number(before.dataset.time) > time_s) {
      later = before;
      before = before.previousElementSibling;
    }
    this.events.insertBefore(row, later);
  }

  private addCurves(
    title: string,
    unit: string,
    lines: Line[],
    pick: (samples: Samples) => Value[][],
  ): void {
    const curves = new Curves({ title, unit, lines }, pick);
    this.curves.push(curves);
    this.plots.append(make("div", {}, make("h3", {}, title), curves.plot.element));
  }

  private addAngles(reference: string): void {
    this.hasAngles = true;
    const lines = [
      { label: `${reference}, dashed`, color: "reference", dash: [6, 4] },
      { label: "measured", color: "s2" },
      { label: "true (simulated)", color: "s1" },
    ];
    this.addCurves("Joint angle", "angle (°)", lines, (samples) => [
      samples.target_deg,
      samples.measured_deg,
      samples.true_deg,
    ]);
  }

  private addAmplitudes(info: SessionInfo): void {
    for (const unit of ["mA", "V"]) {
      const places = info.channels.flatMap((channel, i) => (channel.unit === unit ? [i] : []));
      if (places.length > 0) {
        const lines = places.map((place, i) => channelLine(info, place, i));
        const quantity = unit === "mA" ? "current" : "voltage";
        this.addCurves(`Amplitudes (${quantity})`, `amplitude (${unit})`, lines, (samples) =>
          places.map((place) => samples.amplitudes[place] ?? []),
        );
      }
    }
  }

  private addForces(info: SessionInfo): void {
    const places = info.channels.flatMap((channel, i) => (channel.muscle ? [i] : []));
    if (places.length > 0) {
      const lines = places.map((place, i) => channelLine(info, place, i));
      const title = "Forces that the device predicts";
      this.addCurves(title, "force (N)", lines, (samples) => samples.forces_n);
    }
  }

  private addHand(isSimulated: boolean): void {
    const names = ["backward", "to the right", "upward"];
    const lines: Line[] = names.map((name, i) => ({
      label: `${name}, reference, dashed`,
      color: COLORS[i],
      dash: [6, 4],
    }));
    if (isSimulated) {
      names.forEach((name, i) =>
        lines.push({ label: `${name}, true (simulated)`, color: COLORS[i] }),
      );
    }
    this.addCurves("Force at the hand", "force (N)", lines, (samples) =>
      [0, 1, 2].map((i) => samples.hand_n[i] ?? []).concat(
        [0, 1, 2].map((i) => samples.hand_true_n[i] ?? []),
      ),
    );
  }
}

function channelLine(info: SessionInfo, place: number, index: number): Line {
  const { number, name } = info.channels[place];
  const pattern = DASHES[Math.floor(index / COLORS.length) % DASHES.length];
  const line = { label: `${number} ${name}${pattern.name}`, color: COLORS[index % COLORS.length] };
  return pattern.dash ? { ...line, dash: pattern.dash } : line;
}

// Returns the actions at the controls and the trigger edges in markers.csv, in words.
export function readMarkers(csv: string): { time_s: number; text: string }[] {
  const rows = csv.split("\n").slice(1).map((line) => line.split(","));
  const markers = rows.filter(([, , , kind]) => kind !== undefined && kind !== "sync");
  return markers.map(([time, , , kind, channel, percent, ...rest]) => {
    const field = rest.join(",").trim();
    const note = field.startsWith('"') ? field.slice(1, -1).replaceAll('""', '"') : field;
    const words = channel && !note ? `${kind}: channel ${channel} at ${percent} %` : kind;
    return { time_s: Number(time), text: note ? `${words}: ${note}` : words };
  });
}
