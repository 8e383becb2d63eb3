// Fields for quick changes: amplitude, rate and width of a channel in the session text.

import type { Channel, SessionInfo } from "./api";
import { choice, make } from "./dom";
import { type Place, placesOf, replaceNumber } from "./session_edit";

interface Field {
  label: HTMLElement;
  unit: HTMLElement;
  input: HTMLInputElement;
  absent: HTMLElement;
}

let count = 0;

export class QuickFields {
  readonly element: HTMLElement;
  private readonly channels: HTMLSelectElement;
  private readonly amplitude = this.field("Amplitude of the channel", (value) => value);
  private readonly rate = this.field("Pulse rate of the channel", (value) => value);
  private readonly width = this.field("Pulse width of the channel", (value) => Math.round(value));
  private readonly note = make("p", { class: "note", "aria-live": "polite" });
  private text = "";
  private info: SessionInfo | null = null;

  constructor(private readonly edit: (text: string) => void) {
    const channel = choice({
      label: "Channel to change",
      values: [],
      value: "",
      change: () => {
        this.note.textContent = "";
        this.update();
      },
    });
    this.channels = channel.select;
    const fields = [this.amplitude, this.rate, this.width];
    this.element = make(
      "fieldset",
      { class: "quick", hidden: true },
      make("legend", {}, "Quick change"),
      channel.element,
      make("div", { class: "row" }, ...fields.map(({ label }) => label)),
      ...fields.map(({ absent }) => absent),
      this.note,
    );
  }

  // Shows the numbers of the text. Without `info`, the text has mistakes, and the channels of the
  // latest text without mistakes stay.
  show(text: string, info: SessionInfo | null): void {
    this.text = text;
    if (info) {
      const chosen = this.channels.value;
      this.info = info;
      this.channels.replaceChildren(
        ...info.channels.map(({ number, name }) =>
          make("option", { value: String(number) }, `${number} ${name}`),
        ),
      );
      if (info.channels.some(({ number }) => String(number) === chosen)) {
        this.channels.value = chosen;
      }
    }
    this.update();
  }

  // Forgets the channels, because another session is shown.
  clear(): void {
    this.info = null;
    this.channels.replaceChildren();
    this.note.textContent = "";
    this.update();
  }

  private get channel(): Channel | null {
    const chosen = Number(this.channels.value);
    return this.info?.channels.find(({ number }) => number === chosen) ?? null;
  }

  private update(): void {
    const { channel } = this;
    this.element.hidden = channel === null;
    if (!channel) {
      return;
    }
    const { amplitude, rate, isPeriod, width } = placesOf(this.text, channel.number);
    const rateValue = rate && isPeriod ? 1e6 / rate.value : (rate?.value ?? null);
    const limit = `; limit ${channel.limit} ${channel.unit}`;
    this.showField(this.amplitude, amplitude?.value ?? null, `${channel.unit}${limit}`);
    this.showField(this.rate, rateValue, "Hz");
    this.showField(this.width, width?.value ?? null, "µs");
    this.amplitude.absent.textContent =
      `The amplitude of channel ${channel.number} is not among the values of [setpoints]: a ` +
      "program or a controller sets it, or the session has none. Change it in the text.";
    this.rate.absent.textContent = "The text has no pulse rate of this channel at its usual place.";
    this.width.absent.textContent =
      "The text has no pulse width of this channel at its usual place.";
  }

  private showField(field: Field, value: number | null, unit: string): void {
    field.label.hidden = value === null;
    field.absent.hidden = value !== null;
    field.unit.textContent = unit;
    if (value !== null) {
      field.input.value = String(Number(value.toFixed(4)));
    }
  }

  private field(name: string, round: (value: number) => number): Field {
    const id = `quick-${++count}`;
    const input = make("input", { type: "number", step: "any", min: "0", id });
    const unit = make("span", { id: `${id}-unit` });
    const attributes = { class: "quick-field", for: id, hidden: true };
    const label = make("label", attributes, `${name} `, input, " ", unit);
    const absent = make("p", { class: "note", hidden: true });
    const field = { label, input, unit, absent };
    input.addEventListener("change", () => this.write(field, name, round));
    return field;
  }

  private write(field: Field, name: string, round: (value: number) => number): void {
    const { channel } = this;
    const value = round(Number(field.input.value));
    if (!channel || field.input.value.trim() === "" || !Number.isFinite(value) || value < 0) {
      this.note.textContent = `${name}: type a number of at least 0. The text is unchanged.`;
      return;
    }
    const { amplitude, rate, isPeriod, width } = placesOf(this.text, channel.number);
    const isRate = field === this.rate;
    if (isRate && value === 0) {
      this.note.textContent = `${name}: type a number above 0. The text is unchanged.`;
      return;
    }
    const place: Place | null = isRate ? rate : field === this.width ? width : amplitude;
    if (!place) {
      return;
    }
    const number = isRate && isPeriod ? Math.round(1e6 / value) : value;
    const text = replaceNumber(this.text, place, number);
    if (text !== this.text) {
      this.text = text;
      this.edit(text);
    }
    const line = text.slice(0, place.from).split("\n").length;
    this.note.textContent = `Line ${line} of the text is changed.`;
  }
}
