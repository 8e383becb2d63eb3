// Axis of the part "A pulse train", whose pulses are set and removed by clicks.

import { draw, drawing, placeIn } from "./understand_tools";

// Place of the axis in its drawing.
const PLACE = { left: 16, line: 62, height: 92 };
// Distance at which a click removes a pulse.
const REACH = 6;

// Pulses over time. The scale stays until `show` gets another length, so that further clicks hit
// what they aim at.
export class PulseAxis {
  readonly element = drawing(300, PLACE.height, "Times of the pulses");
  private times_ms: number[] = [];
  private length_ms = 1000;

  constructor(latest_ms: number, change: (times_ms: number[]) => void) {
    this.element.classList.add("editable");
    this.element.addEventListener("click", (event) => {
      const { x } = placeIn(this.element, event);
      const ms_per_unit = this.length_ms / (this.width - 2 * PLACE.left);
      const at_ms = (x - PLACE.left) * ms_per_unit;
      const place = Math.min(Math.max(Math.round(at_ms), 0), latest_ms);
      const distance = (ms: number): number => Math.min(Math.abs(ms - at_ms), Math.abs(ms - place));
      const near = this.times_ms.filter((ms) => distance(ms) <= REACH * ms_per_unit);
      const [hit] = near.sort((a, b) => distance(a) - distance(b));
      const rest = this.times_ms.filter((ms) => ms !== hit);
      change(hit === undefined ? [...rest, place].sort((a, b) => a - b) : rest);
    });
  }

  resize(width: number): void {
    this.element.setAttribute("width", String(width));
    this.element.setAttribute("viewBox", `0 0 ${width} ${PLACE.height}`);
    this.draw();
  }

  show(times_ms: number[], length_ms = this.length_ms): void {
    this.times_ms = times_ms;
    this.length_ms = length_ms;
    this.draw();
  }

  private get width(): number {
    return this.element.viewBox.baseVal.width;
  }

  private draw(): void {
    const { width, length_ms } = this;
    const right = width - PLACE.left;
    const x = (ms: number): number => PLACE.left + (ms / length_ms) * (right - PLACE.left);
    const parts: SVGElement[] = [
      draw("rect", { x: 0, y: 0, width, height: PLACE.height, class: "ground" }),
      draw("line", { x1: PLACE.left, x2: right, y1: PLACE.line, y2: PLACE.line, class: "axis" }),
    ];
    const step = [50, 100, 200, 500, 1000].find((ms) => (length_ms / ms) * 70 <= width) ?? 1000;
    for (let ms = 0; ms <= length_ms; ms += step) {
      // The outermost labels stay inside the drawing.
      const at = Math.min(Math.max(x(ms), 18), width - 24);
      parts.push(
        draw("line", { x1: x(ms), x2: x(ms), y1: PLACE.line, y2: PLACE.line + 5, class: "axis" }),
        draw("text", { x: at, y: PLACE.line + 20, "text-anchor": "middle" }, `${ms} ms`),
      );
    }
    for (const ms of this.times_ms) {
      parts.push(draw("line", { x1: x(ms), x2: x(ms), y1: 16, y2: PLACE.line, class: "pulse" }));
    }
    this.element.replaceChildren(...parts);
    this.element.setAttribute("aria-label", `Times of ${this.times_ms.length} pulses`);
  }
}
