// Output of the channels in a run: a table of their pulses, and lanes of the latest ones.

import { ANODIC, CATHODIC, type Channel, FULL_CODE, type News, type SessionInfo } from "./api";
import { make } from "./dom";
import { Lanes, Output } from "./lanes";

const WIDE_US = 100_000;
const FINE_US = 3_000;
// Time before the latest pulse in its lanes, µs.
const LEAD_US = 150;
// Output that is kept for the lanes, µs.
const KEPT_US = 5_000_000;
// Age from which the simulator returns edges, µs.
const SETTLED_US = 1_000;

const COLUMNS = [
  "channel",
  "largest amplitude",
  "limit",
  "pulse width",
  "rate",
  "charge per phase",
  "pulses",
  "pulses in the record",
];

// Pulses of a channel so far.
class Pulses {
  count = 0;
  peak: number | null = null;
  // Smallest and largest width of the first phase, µs.
  width: [number, number] | null = null;
  // Largest charge of a first phase, nC; of current stages.
  charge_nc = 0;
  private readonly first: number;
  private state = 0;
  private since_us = 0;
  private code = 0;

  constructor(private readonly channel: Channel) {
    this.first = channel.shape.includes("anodic-first") || channel.shape.endsWith("-anodic")
      ? ANODIC
      : CATHODIC;
  }

  // A pulse counts when its first phase begins, so a biphasic pulse counts once.
  add(time_us: number, state: number, code: number): void {
    if (this.state === this.first && state !== this.first && this.code > 0) {
      this.endPhase(time_us - this.since_us);
    }
    if (state === this.first && this.state !== this.first) {
      this.since_us = time_us;
      this.code = code;
      this.count += code > 0 ? 1 : 0;
    }
    this.state = state;
  }

  private endPhase(width_us: number): void {
    const [least, most] = this.width ?? [width_us, width_us];
    this.width = [Math.min(least, width_us), Math.max(most, width_us)];
    if (this.channel.unit === "mA") {
      const current_ma = (this.code / FULL_CODE) * this.channel.full_scale;
      this.charge_nc = Math.max(this.charge_nc, current_ma * width_us);
    }
  }
}

export class PulseTable {
  readonly element: HTMLElement;
  private readonly pulses: Pulses[];
  private readonly cells: HTMLElement[][];
  private recorded: (number | null)[] | null = null;

  constructor(private readonly info: SessionInfo) {
    this.pulses = info.channels.map((channel) => new Pulses(channel));
    this.cells = info.channels.map(() => COLUMNS.slice(1).map(() => make("td")));
    const rows = info.channels.map(({ number, name }, i) =>
      make("tr", {}, make("th", { scope: "row" }, `${number} ${name}`), ...this.cells[i]),
    );
    const head = make("tr", {}, ...COLUMNS.map((text) => make("th", { scope: "col" }, text)));
    const region = { tabindex: "0", role: "region", "aria-label": "Channels of the run" };
    const parts = [make("thead", {}, head), make("tbody", {}, ...rows)];
    const table = make("table", { class: "pulse-table" }, ...parts);
    const box = make("div", { class: "scroll", ...region }, table);
    const hint = make("span", { class: "sideways" }, "The table scrolls sideways. ");
    new ResizeObserver(() => {
      hint.hidden = box.scrollWidth <= box.clientWidth;
    }).observe(box);
    this.element = make(
      "div",
      {},
      make("h3", {}, "Channels"),
      box,
      make(
        "p",
        { class: "note" },
        hint,
        "Amplitudes are those that the device reports. Widths, charges and pulses are those of " +
          "the simulated output; charge is amplitude × width, and depends on the load if a stage " +
          "is set in V. " +
          "The record counts pulses by its samples: it includes those after the session's end, " +
          "until the device has stopped, and can miss the last pulse before a silence.",
      ),
    );
    this.show();
  }

  add(news: News): void {
    const { samples, edges = [] } = news;
    samples?.amplitudes.forEach((column, i) => {
      const pulses = this.pulses[i];
      for (const value of column) {
        if (pulses && value !== null && value > (pulses.peak ?? -1)) {
          pulses.peak = value;
        }
      }
    });
    for (let i = 0; i < edges.length; i += 4) {
      const place = this.info.channels.findIndex(({ number }) => number === edges[i + 1]);
      this.pulses[place]?.add(edges[i], edges[i + 2], edges[i + 3]);
    }
  }

  // Takes the number of pulses of each channel from summary.json.
  addRecord(summary: string): void {
    const { trials } = JSON.parse(summary) as {
      trials?: { channels?: { channel: number; pulses: number | null }[] }[];
    };
    const channels = trials?.[0]?.channels ?? [];
    this.recorded = this.info.channels.map(
      ({ number }) => channels.find(({ channel }) => channel === number)?.pulses ?? null,
    );
    this.show();
  }

  show(): void {
    this.info.channels.forEach((channel, i) => {
      const pulses = this.pulses[i];
      const recorded = this.recorded ? (this.recorded[i] ?? "not known") : "after the end";
      const texts = [
        pulses.peak === null ? "no pulses" : `${pulses.peak.toFixed(2)} ${channel.unit}`,
        `${channel.limit} ${channel.unit}`,
        widthOf(channel, pulses),
        rateOf(channel),
        chargeOf(channel, pulses),
        String(pulses.count),
        String(recorded),
      ];
      texts.forEach((text, k) => {
        if (this.cells[i][k].textContent !== text) {
          this.cells[i][k].textContent = text;
        }
      });
    });
  }
}

// Lanes of the latest output.
export class PulseLanes {
  readonly element: HTMLElement;
  private readonly output: Output;
  private readonly wide = new Lanes("Output of the channels, 100 ms", WIDE_US, "ms");
  private readonly fine = new Lanes("Output of the channels, 3 ms from a pulse on", FINE_US, "µs");
  private readonly wideTitle = make("h3", {}, "Pulses, 100 ms");
  private readonly fineTitle = make("h3", {}, "The latest pulse, 3 ms");

  constructor(info: SessionInfo) {
    this.output = new Output(info.channels, KEPT_US);
    this.element = make(
      "div",
      {},
      make("div", {}, this.wideTitle, this.wide.element),
      make("div", {}, this.fineTitle, this.fine.element),
      make(
        "p",
        { class: "note" },
        "Numbers of the channels at the left; times from the beginning of the picture. Up: " +
          "anodic. Down: cathodic. Thick line: grounded. Thin line: disconnected. Heights are " +
          "shares of the channel's limit.",
      ),
    );
    new ResizeObserver(() => this.draw()).observe(this.element);
  }

  add(news: News): void {
    const until_us = news.t_s === undefined ? this.output.until_us : news.t_s * 1e6 - SETTLED_US;
    this.output.add(news.edges ?? [], Math.max(until_us, this.output.until_us));
  }

  draw(): void {
    if (!this.element.isConnected) {
      return;
    }
    const { until_us } = this.output;
    const pulse_us = this.latestPulse();
    // The picture goes back to the latest pulse if the channels are silent.
    const last_us = until_us - WIDE_US;
    const begin_us = pulse_us === null ? until_us - FINE_US : pulse_us - LEAD_US;
    const wide_us = Math.max(0, pulse_us === null ? last_us : Math.min(last_us, begin_us));
    const fine_us = pulse_us === null ? Math.max(0, begin_us) : begin_us;
    this.wideTitle.textContent = `Pulses, 100 ms from ${(wide_us / 1e6).toFixed(3)} s on`;
    this.fineTitle.textContent = pulse_us === null
      ? "No pulse in the latest 5 s"
      : `The latest pulse, 3 ms from ${(fine_us / 1e6).toFixed(6)} s on`;
    this.wide.draw(this.output, wide_us);
    this.fine.draw(this.output, fine_us);
  }

  // Start of the latest pulse of any channel after which the picture has its whole length.
  private latestPulse(): number | null {
    let latest: number | null = null;
    const isDriven = (state: number | undefined): boolean => state === CATHODIC || state === ANODIC;
    this.output.channels.forEach((_, place) => {
      const lane = this.output.stretches(place);
      const found = lane.findLast(
        ({ from_us, state, share }, i) =>
          isDriven(state) &&
          share > 0 &&
          from_us <= this.output.until_us - FINE_US &&
          !(lane[i - 1] && from_us - lane[i - 1].from_us < FINE_US && hasPulse(lane[i - 1])) &&
          !(lane[i - 2] && from_us - lane[i - 2].from_us < FINE_US && hasPulse(lane[i - 2])),
      );
      if (found && found.from_us > (latest ?? -1)) {
        latest = found.from_us;
      }
    });
    return latest;

    function hasPulse(stretch: { state: number; share: number }): boolean {
      return isDriven(stretch.state) && stretch.share > 0;
    }
  }
}

function widthOf(channel: Channel, pulses: Pulses): string {
  if (pulses.width === null) {
    return `${channel.width_us} µs (session)`;
  }
  const [least, most] = pulses.width.map((width) => Math.round(width));
  return least === most ? `${most} µs` : `${least} to ${most} µs`;
}

function rateOf(channel: Channel): string {
  const rate = `${Number((1e6 / channel.period_us).toFixed(2))} Hz`;
  return channel.force ? `${rate}, varied by force control` : rate;
}

function chargeOf(channel: Channel, pulses: Pulses): string {
  if (channel.unit === "V") {
    return "set in V";
  }
  return pulses.charge_nc > 0 ? `${(pulses.charge_nc / 1e3).toFixed(2)} µC` : "no pulses";
}
