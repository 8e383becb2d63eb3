// Helpers of the parts of "Understand": drawings, number fields, and runs of the simulator.

import { CallError } from "./api";
import { make } from "./dom";

// Creates an element of an SVG drawing.
export function draw<K extends keyof SVGElementTagNameMap>(
  tag: K,
  attributes: Record<string, string | number> = {},
  ...children: (Node | string)[]
): SVGElementTagNameMap[K] {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) {
    element.setAttribute(name, String(value));
  }
  element.append(...children);
  return element;
}

// A drawing with its description for people who do not see it.
export function drawing(width: number, height: number, title: string): SVGSVGElement {
  return draw("svg", {
    viewBox: `0 0 ${width} ${height}`,
    width,
    height,
    role: "img",
    "aria-label": title,
    class: "figure",
  });
}

// A symbol of a legend, 20 by 20 units.
export function symbol(...shapes: SVGElement[]): SVGSVGElement {
  const box = { viewBox: "0 0 20 20", width: 20, height: 20 };
  return draw("svg", { ...box, class: "figure", "aria-hidden": "true" }, ...shapes);
}

// Place of a mouse event in the units of a drawing.
export function placeIn(svg: SVGSVGElement, event: MouseEvent): { x: number; y: number } {
  const box = svg.getBoundingClientRect();
  const view = svg.viewBox.baseVal;
  return {
    x: ((event.clientX - box.left) / box.width) * view.width,
    y: ((event.clientY - box.top) / box.height) * view.height,
  };
}

// Draws anew at every change of the width of `parent`, from `narrowest` to `widest`.
export function fitWidth(
  parent: HTMLElement,
  narrowest: number,
  widest: number,
  redraw: (width: number) => void,
): void {
  new ResizeObserver(() => {
    if (parent.clientWidth > 0) {
      redraw(Math.round(Math.min(Math.max(parent.clientWidth, narrowest), widest)));
    }
  }).observe(parent);
}

// Rounds to `digits` significant digits; very small and very large numbers get a power of ten.
export function show(value: number, digits = 3): string {
  if (Number.isNaN(value)) {
    return "not a number";
  }
  if (!Number.isFinite(value)) {
    return "∞";
  }
  const size = Math.abs(value);
  if (size === 0) {
    return "0";
  }
  if (size < 1e-4 || size >= 1e6) {
    const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
    return `${mantissa} × 10${superscript(Number(exponent))}`.replace("-", "−");
  }
  const rounded = Number(value.toPrecision(digits));
  return rounded.toLocaleString("en", { maximumFractionDigits: 8 }).replace("-", "−");
}

export function superscript(value: number): string {
  const digits = "⁰¹²³⁴⁵⁶⁷⁸⁹";
  const text = [...String(Math.abs(value))].map((digit) => digits[Number(digit)]).join("");
  return value < 0 ? `⁻${text}` : text;
}

// Description list of values with their names.
export function facts(pairs: [string, string][]): HTMLDListElement {
  const items = pairs.map(([name, value]) =>
    make("div", {}, make("dt", {}, name), make("dd", {}, value)),
  );
  return make("dl", { class: "facts" }, ...items);
}

// Place of messages that change, which screen readers announce.
export function status(): HTMLParagraphElement {
  return make("p", { class: "status", role: "status", "aria-live": "polite" });
}

export function messageOf(error: unknown): string {
  const message = error instanceof Error ? error.message : String(error);
  const mistakes = error instanceof CallError ? error.mistakes : [];
  const lines = mistakes.map((mistake) => `${mistake.number}: ${mistake.message}`);
  return [message, ...lines].join("; ");
}

let count = 0;

export interface NumberField {
  element: HTMLElement;
  input: HTMLInputElement;
  notes: HTMLElement;
}

// A number with its label and unit, and a place for mistakes under it.
export function numberField(options: {
  label: string;
  unit: string;
  value: number;
  change: () => void;
}): NumberField {
  const id = `number-${++count}`;
  const notes = make("div", { id: `${id}-notes`, class: "mistakes", "aria-live": "polite" });
  const input = make("input", {
    type: "number",
    id,
    step: "any",
    value: String(options.value),
    "aria-describedby": `${id}-notes`,
    input: options.change,
  });
  const label = make("label", { for: id }, `${options.label} (${options.unit})`);
  return { element: make("div", { class: "field" }, label, input, notes), input, notes };
}

// Carries out the latest task only: waits until no newer one has come for a while, and never begins
// one before the last has ended.
export class Latest {
  private timer: number | undefined;
  private isBusy = false;
  private wanted: ((isStale: () => boolean) => Promise<void>) | null = null;

  constructor(private readonly delay_ms = 250) {}

  // `task` should end early when `isStale`.
  ask(task: (isStale: () => boolean) => Promise<void>): void {
    this.wanted = task;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => void this.begin(), this.delay_ms);
  }

  private async begin(): Promise<void> {
    if (this.isBusy || !this.wanted) {
      return;
    }
    const task = this.wanted;
    this.wanted = null;
    this.isBusy = true;
    try {
      await task(() => this.wanted !== null);
    } finally {
      this.isBusy = false;
      if (this.wanted) {
        void this.begin();
      }
    }
  }
}
