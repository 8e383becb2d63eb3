// Plots, pulses and events of a run.

import type { News, Samples, SessionInfo } from "./api";
import { make } from "./dom";
import type { Line } from "./plots";
import { EventList } from "./session_events";
import { Curves, type Value } from "./session_plots";
import { PulseLanes, PulseTable } from "./session_pulses";

const COLORS = ["s1", "s2", "s3", "s4"];
// Lines of the same color differ in their dashes.
const DASHES: { name: string; dash?: number[] }[] = [
  { name: "" },
  { name: ", dashed", dash: [8, 4] },
  { name: ", dotted", dash: [2, 3] },
];
// Smallest movement of a limb that is plotted in a session without a joint, °.
const MOVEMENT_DEG = 0.1;

export class Results {
  readonly element: HTMLElement;
  private readonly curves: Curves[] = [];
  private readonly plots = make("div", { class: "run-plots" });
  private readonly events = new EventList();
  private readonly table: PulseTable;
  private readonly lanes: PulseLanes;
  // Plot of the angle that appears once the limb moves.
  private angles: Curves | null = null;
  private firstAngle: Value = null;
  private lastDraw = 0;
  private readonly interval_ms: number;

  constructor(info: SessionInfo) {
    const isCalm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.interval_ms = isCalm ? 1_000 : 100;
    this.table = new PulseTable(info);
    this.lanes = new PulseLanes(info);
    if (info.has_joint || info.has_wall) {
      this.addAngles(info.has_wall ? "position of the wall" : "reference");
    } else {
      const lines = [{ label: "true (simulated)", color: "s1" }];
      const options = { title: "Joint angle", unit: "angle (°)", lines };
      this.angles = new Curves(options, (samples) => [samples.true_deg]);
    }
    this.addAmplitudes(info);
    this.addForces(info);
    if (info.has_limb) {
      this.addHand(info.body === "arm");
    }
    this.element = make(
      "div",
      {},
      this.table.element,
      this.plots,
      this.lanes.element,
      this.events.element,
    );
  }

  // Adds what happened, and draws it if the last drawing is long enough ago, or if it `isLast`.
  add(news: News, isLast: boolean): void {
    const { samples } = news;
    if (samples && samples.t_s.length > 0) {
      this.curves.forEach((curves) => curves.add(samples));
      this.followAngle(samples);
    }
    this.table.add(news);
    this.lanes.add(news);
    for (const [time_s, text] of news.events ?? []) {
      this.events.add(time_s, text);
    }
    const now = performance.now();
    if (isLast || now - this.lastDraw > this.interval_ms) {
      this.lastDraw = now;
      this.draw();
    }
  }

  addEvent(time_s: number, text: string): void {
    this.events.add(time_s, text);
  }

  // Shows the end of the run, with the pulses that summary.json counts.
  end(summary: string | null): void {
    this.events.end();
    if (summary !== null) {
      this.table.addRecord(summary);
    }
  }

  draw(): void {
    this.curves.forEach((curves) => curves.draw());
    this.table.show();
    this.lanes.draw();
  }

  redrawLanes(): void {
    this.lanes.draw();
  }

  private followAngle(samples: Samples): void {
    if (!this.angles) {
      return;
    }
    this.angles.add(samples);
    for (const angle of samples.true_deg) {
      this.firstAngle ??= angle;
      if (angle !== null && Math.abs(angle - (this.firstAngle ?? angle)) > MOVEMENT_DEG) {
        this.curves.unshift(this.angles);
        this.plots.prepend(this.angles.element);
        this.angles = null;
        return;
      }
    }
  }

  private addCurves(
    title: string,
    unit: string,
    lines: Line[],
    pick: (samples: Samples) => Value[][],
  ): void {
    const curves = new Curves({ title, unit, lines }, pick);
    this.curves.push(curves);
    this.plots.append(curves.element);
  }

  private addAngles(reference: string): void {
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
        const lines = places.map((place) => channelLine(info, place));
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
      const lines = places.map((place) => channelLine(info, place));
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

// A channel has the same line in every plot; up to twelve channels have lines of their own.
function channelLine(info: SessionInfo, place: number): Line {
  const { number, name } = info.channels[place];
  const pattern = DASHES[Math.floor(place / COLORS.length) % DASHES.length];
  const line = { label: `${number} ${name}${pattern.name}`, color: COLORS[place % COLORS.length] };
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
