// Plots of a run, each with a legend in which lines can be hidden.

import type { Samples } from "./api";
import { make } from "./dom";
import { Plot, type Line } from "./plots";

export type Value = number | null;

// Largest number of points of a line. Longer runs are plotted with every 2nd, 4th, … sample.
const MOST_POINTS = 5_000;
const SVG = "http://www.w3.org/2000/svg";

// A plot with its points so far.
export class Curves {
  readonly element: HTMLElement;
  private readonly plot: Plot;
  private readonly boxes: HTMLInputElement[];
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
    const change = (): void => this.redraw();
    this.boxes = options.lines.map(() =>
      make("input", { type: "checkbox", checked: true, change }),
    );
    const labels = options.lines.map((line, i) =>
      make("label", {}, this.boxes[i], swatch(line), line.label),
    );
    const isMany = labels.length > 3;
    this.element = make(
      "div",
      {},
      make("h3", {}, options.title),
      this.plot.element,
      make(
        "fieldset",
        { class: "lines" },
        make("legend", {}, `Lines shown in “${options.title}”`),
        ...labels,
        isMany ? this.button("All", true) : null,
        isMany ? this.button("None", false) : null,
      ),
    );
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
      this.redraw();
    }
  }

  private redraw(): void {
    const shown = this.columns.map((column, i) =>
      this.boxes[i].checked ? column : column.map(() => null),
    );
    this.plot.set(this.times, ...shown);
    this.hasChanged = false;
  }

  private button(text: string, isChecked: boolean): HTMLButtonElement {
    const click = (): void => {
      this.boxes.forEach((box) => {
        box.checked = isChecked;
      });
      this.redraw();
    };
    return make("button", { type: "button", click }, text);
  }
}

// Returns a short piece of the line.
function swatch(line: Line): SVGElement {
  const picture = document.createElementNS(SVG, "svg");
  const stroke = document.createElementNS(SVG, "line");
  const attributes = { x1: "0", x2: "30", y1: "4", y2: "4", "stroke-width": "3" };
  for (const [name, value] of Object.entries(attributes)) {
    stroke.setAttribute(name, value);
  }
  stroke.setAttribute("stroke", `var(--${line.color})`);
  if (line.dash) {
    stroke.setAttribute("stroke-dasharray", line.dash.join(" "));
  }
  picture.setAttribute("viewBox", "0 0 30 8");
  picture.setAttribute("aria-hidden", "true");
  picture.append(stroke);
  return picture;
}
