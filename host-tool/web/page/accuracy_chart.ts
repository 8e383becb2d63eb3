// Drawing of error against cycles, both logarithmic.

import { make } from "./dom";
import { Setting } from "./tables";
import { draw, drawing, superscript, symbol } from "./understand_tools";

const WIDTH = 760;
const HEIGHT = 400;
const FRAME = { left: 66, right: 744, top: 14, bottom: 346 };
// Powers of ten of the axes: cycles per second, and % of the peak.
const CYCLES = [4.3, 7.3];
const ERRORS = [-8.5, 2.3];
// Error that the device aims for, %.
export const GOAL_PCT = 0.02;
// Distance at which a click chooses a mark.
const REACH = 14;

// Errors above the chart are drawn at its upper edge.
export function limitedError(error_pct: number): number {
  return Math.min(error_pct, 10 ** ERRORS[1]);
}

function xOf(cycles: number): number {
  const share = (Math.log10(cycles) - CYCLES[0]) / (CYCLES[1] - CYCLES[0]);
  return FRAME.left + share * (FRAME.right - FRAME.left);
}

function yOf(error_pct: number): number {
  const share = (Math.log10(limitedError(error_pct)) - ERRORS[0]) / (ERRORS[1] - ERRORS[0]);
  return FRAME.bottom - share * (FRAME.bottom - FRAME.top);
}

export class ChartDrawing {
  readonly element = drawing(WIDTH, HEIGHT, "");
  private readonly back = draw("g");
  private readonly marks = draw("g");
  private readonly chosen = draw("g");

  constructor() {
    this.element.classList.add("editable", "wide");
    this.element.append(this.back, this.marks, this.chosen);
  }

  // Draws the settings of one interval of reading.
  draw(settings: Setting[]): void {
    const title =
      `Error against cycles per second of ${settings.length} settings, both logarithmic; ` +
      "the lists below choose the same settings";
    this.element.setAttribute("aria-label", title);
    this.back.replaceChildren(...axes());
    const front = settings.filter((setting) => setting.front);
    front.sort((a, b) => a.cycles_per_s - b.cycles_per_s);
    const corners = front.flatMap((setting, index) => {
      const [x, y] = [xOf(setting.cycles_per_s), yOf(setting.error_pct)];
      const before = index === 0 ? y : yOf(front[index - 1].error_pct);
      return [`${x},${before}`, `${x},${y}`];
    });
    this.back.append(draw("polyline", { points: corners.join(" "), class: "front" }));
  }

  // Marks the settings of the chosen method, and the chosen one.
  mark(settings: Setting[], chosen: Setting): void {
    const rank = (setting: Setting): number =>
      (setting.method === chosen.method ? 1 : 0) + (setting.front ? 2 : 0);
    const sorted = [...settings].sort((a, b) => rank(a) - rank(b));
    this.marks.replaceChildren(
      ...sorted.map((setting) => mark(setting, setting.method === chosen.method)),
    );
    this.chosen.replaceChildren(
      draw("circle", {
        cx: xOf(chosen.cycles_per_s),
        cy: yOf(chosen.error_pct),
        r: 10,
        class: "ring",
      }),
    );
  }

  nearest(settings: Setting[], { x, y }: { x: number; y: number }): Setting | null {
    let best: Setting | null = null;
    let distance = REACH;
    for (const setting of settings) {
      const d = Math.hypot(xOf(setting.cycles_per_s) - x, yOf(setting.error_pct) - y);
      if (d < distance) {
        [best, distance] = [setting, d];
      }
    }
    return best;
  }

  legend(): HTMLElement {
    const entry = (shape: SVGElement, text: string): HTMLElement => {
      return make("li", {}, symbol(shape), text);
    };
    return make(
      "ul",
      { class: "legend" },
      entry(draw("circle", { cx: 10, cy: 10, r: 3.2, class: "mark" }), "a setting"),
      entry(draw("circle", { cx: 10, cy: 10, r: 4.2, class: "mark same" }), "of the chosen method"),
      entry(draw("path", { d: diamond(10, 10, 6), class: "mark best" }), "on the front"),
      entry(draw("path", { d: star(10, 10, 9), class: "mark device" }), "shipped"),
      entry(draw("path", { d: triangle(10, 10, 5), class: "mark" }), "error above 200 %"),
      entry(draw("circle", { cx: 10, cy: 10, r: 8, class: "ring" }), "chosen"),
    );
  }
}

function mark(setting: Setting, isSame: boolean): SVGElement {
  const [x, y] = [xOf(setting.cycles_per_s), yOf(setting.error_pct)];
  if (setting.method === "shipped") {
    return draw("path", { d: star(x, y, 9), class: "mark device" });
  }
  const same = isSame ? " same" : "";
  if (setting.front) {
    return draw("path", { d: diamond(x, y, 6), class: `mark best${same}` });
  }
  if (setting.error_pct > limitedError(setting.error_pct)) {
    return draw("path", { d: triangle(x, y, 5), class: `mark${same}` });
  }
  return draw("circle", { cx: x, cy: y, r: isSame ? 4.2 : 3.2, class: `mark${same}` });
}

function diamond(x: number, y: number, r: number): string {
  return `M${x},${y - r}L${x + r},${y}L${x},${y + r}L${x - r},${y}Z`;
}

function triangle(x: number, y: number, r: number): string {
  return `M${x},${y - r}L${x + r},${y + r}L${x - r},${y + r}Z`;
}

function star(x: number, y: number, r: number): string {
  const points = Array.from({ length: 10 }, (_, index) => {
    const angle = (index * Math.PI) / 5 - Math.PI / 2;
    const radius = index % 2 === 0 ? r : r * 0.45;
    return `${x + radius * Math.cos(angle)},${y + radius * Math.sin(angle)}`;
  });
  return `M${points.join("L")}Z`;
}

function axes(): SVGElement[] {
  const { left, right, top, bottom } = FRAME;
  const parts: SVGElement[] = [
    draw("rect", { x: left, y: top, width: right - left, height: bottom - top, class: "ground" }),
  ];
  for (let power = -8; power <= 2; power++) {
    const y = yOf(10 ** power);
    const text = power >= -2 ? String(10 ** power) : `10${superscript(power)}`;
    parts.push(
      draw("line", { x1: left, x2: right, y1: y, y2: y, class: "grid" }),
      draw("text", { x: left - 6, y: y + 4, "text-anchor": "end" }, text),
    );
  }
  for (const cycles of [3e4, 1e5, 3e5, 1e6, 3e6, 1e7]) {
    const x = xOf(cycles);
    const text = cycles.toLocaleString("en");
    parts.push(
      draw("line", { x1: x, x2: x, y1: top, y2: bottom, class: "grid" }),
      draw("text", { x, y: bottom + 17, "text-anchor": "middle" }, text),
    );
  }
  const goal = yOf(GOAL_PCT);
  const middle = (top + bottom) / 2;
  parts.push(
    draw("line", { x1: left, x2: right, y1: goal, y2: goal, class: "goal" }),
    draw("text", { x: right - 4, y: goal - 5, "text-anchor": "end" }, `goal: ${GOAL_PCT} %`),
    draw(
      "text",
      { x: (left + right) / 2, y: HEIGHT - 14, "text-anchor": "middle" },
      "cycles per simulated second and muscle",
    ),
    draw(
      "text",
      { x: 14, y: middle, "text-anchor": "middle", transform: `rotate(-90 14 ${middle})` },
      "worst error (% of peak)",
    ),
  );
  return parts;
}
