// Layout of the parts of "Understand": wide things that scroll, tables that stack where there is
// little width, and plots of small numbers.

import { make } from "./dom";
import { Plot, PlotOptions } from "./plots";
import { superscript } from "./understand_tools";

// Contents that scroll sideways, with a hint while a part of them is out of sight.
export function scroller(label: string, ...contents: Element[]): HTMLElement {
  const inner = make(
    "div",
    { class: "scroll", tabindex: "0", role: "group", "aria-label": label },
    ...contents,
  );
  const hint = make("p", { class: "note hint", hidden: true }, "⟷ Scroll sideways for the rest.");
  const observer = new ResizeObserver(() => {
    hint.hidden = inner.scrollWidth <= inner.clientWidth + 1;
  });
  for (const element of [inner, ...contents]) {
    observer.observe(element);
  }
  return make("div", {}, hint, inner);
}

// A table whose first column names the rows. Where it is narrow, the cells of a row stand below
// each other with the names of their columns.
export function stackTable(label: string, heads: string[], rows: string[][]): HTMLElement {
  const cell = (text: string, column: number): HTMLElement =>
    column === 0
      ? make("th", { scope: "row", role: "rowheader" }, text)
      : make("td", { role: "cell", "data-label": heads[column] }, text);
  const head = (text: string): HTMLElement =>
    text === ""
      ? make("td", { role: "cell" })
      : make("th", { scope: "col", role: "columnheader" }, text);
  const body = rows.map((row) => make("tr", { role: "row" }, ...row.map(cell)));
  return make(
    "div",
    { class: "stack" },
    make(
      "table",
      { role: "table", "aria-label": label },
      make("thead", { role: "rowgroup" }, make("tr", { role: "row" }, ...heads.map(head))),
      make("tbody", { role: "rowgroup" }, ...body),
    ),
  );
}

// A plot of one line whose unit gets a power of a thousand that suits the data; the labels of its
// axis would otherwise round to 0.
export class ScaledPlot {
  readonly element = make("div", {});
  private readonly options: PlotOptions;
  private plot: Plot | null = null;
  private exponent = NaN;

  constructor(options: PlotOptions) {
    this.options = options;
  }

  set(x: number[], values: (number | null)[]): void {
    const sizes = values.map((value) => Math.abs(value ?? 0));
    const largest = sizes.reduce((a, b) => Math.max(a, b), 0);
    const exponent =
      largest > 0 ? Math.min(0, Math.max(-15, 3 * Math.floor(Math.log10(largest) / 3))) : 0;
    if (!this.plot || exponent !== this.exponent) {
      const unit = exponent === 0 ? "" : `10${superscript(exponent)} `;
      this.exponent = exponent;
      this.plot = new Plot({ ...this.options, unit: unit + this.options.unit });
      this.element.replaceChildren(this.plot.element);
    }
    const scale = 10 ** -exponent;
    this.plot.set(x, values.map((value) => (value === null ? null : value * scale)));
  }
}

// Terms with an explanation of a line each.
export function terms(pairs: [string, string][]): HTMLElement {
  const items = pairs.flatMap(([name, text]) => [make("dt", {}, name), make("dd", {}, text)]);
  return make("dl", { class: "terms" }, ...items);
}
