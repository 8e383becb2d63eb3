// What each channel emits, as a table.

import type { Channel } from "./api";
import { make } from "./dom";

const TITLES = ["channel", "muscle", "amplitude", "width", "rate"];

export class AmplitudeTable {
  readonly element: HTMLElement;
  private readonly body = make("tbody");

  constructor() {
    const head = make("tr", {}, ...TITLES.map((text) => make("th", { scope: "col" }, text)));
    const table = make("table", {}, make("thead", {}, head), this.body);
    const summary = make("summary", {}, "What each channel emits");
    this.element = make("details", { open: true }, summary, make("div", { class: "scroll" }, table));
  }

  // Shows the amplitudes in the order of the channels; `null` for a channel without pulses.
  show(channels: Channel[], amplitudes: (number | null)[]): void {
    const rows = channels.map((channel, i) => {
      const value = amplitudes[i];
      const amplitude = value === null ? "no pulses" : `${value.toFixed(2)} ${channel.unit}`;
      const rate = `${Math.round(1e6 / channel.period_us)} Hz`;
      const cells = [String(channel.number), channel.name, amplitude, `${channel.width_us} µs`, rate];
      return make("tr", {}, ...cells.map((text) => make("td", {}, text)));
    });
    this.body.replaceChildren(...rows);
  }
}
