// Pulse lanes: the output of each channel over time, as on an oscilloscope.

import { ANODIC, CATHODIC, type Channel, FULL_CODE, GROUNDED } from "./api";
import { color } from "./plots";

const LANE = 20;
const LABEL = 22;
const AXIS = 18;

// A stretch of time in which a channel has one state.
interface Stretch {
  from_us: number;
  state: number;
  // Amplitude as a share of the channel's limit.
  share: number;
}

// The latest output of ten channels.
export class Output {
  private readonly lanes: Stretch[][];
  private readonly scales: number[];
  // Start of the latest pulse of the first channel that has enough output after it.
  until_us = 0;

  constructor(readonly channels: Channel[], private readonly kept_us: number) {
    this.lanes = channels.map(() => [{ from_us: 0, state: 0, share: 0 }]);
    this.scales = channels.map((channel) => channel.full_scale / channel.limit / FULL_CODE);
  }

  // Adds edges as `advance` returns them, up to the time `until_us`.
  add(edges: number[], until_us: number): void {
    for (let i = 0; i < edges.length; i += 4) {
      const place = this.channels.findIndex((channel) => channel.number === edges[i + 1]);
      if (place >= 0) {
        const share = Math.min(1, edges[i + 3] * this.scales[place]);
        this.lanes[place].push({ from_us: edges[i], state: edges[i + 2], share });
      }
    }
    this.until_us = until_us;
    const oldest = until_us - this.kept_us;
    for (const lane of this.lanes) {
      const first = lane.findIndex((stretch) => stretch.from_us > oldest);
      lane.splice(0, Math.max(0, (first < 0 ? lane.length : first) - 1));
    }
  }

  // Start of the latest pulse of any channel after which `length_us` have passed.
  latestPulse(length_us: number): number {
    for (const lane of this.lanes) {
      const driven = (s: Stretch, i: number): boolean =>
        (s.state === CATHODIC || s.state === ANODIC) &&
        s.share > 0 &&
        s.from_us <= this.until_us - length_us &&
        ![CATHODIC, ANODIC].includes(lane[i - 1]?.state ?? 0);
      const found = lane.findLastIndex(driven);
      if (found >= 0) {
        return lane[found].from_us;
      }
    }
    return this.until_us - length_us;
  }

  stretches(place: number): readonly Stretch[] {
    return this.lanes[place];
  }
}

// A canvas with a lane for each channel. Up is anodic, down is cathodic, a thick line at the middle
// is a grounded electrode.
export class Lanes {
  readonly element: HTMLCanvasElement;

  constructor(title: string, private readonly length_us: number, private readonly unit: "ms" | "µs") {
    this.element = document.createElement("canvas");
    this.element.className = "lanes";
    this.element.setAttribute("role", "img");
    this.element.setAttribute("aria-label", title);
  }

  draw(output: Output, from_us: number): void {
    const count = output.channels.length;
    const width = this.element.clientWidth || 300;
    const height = count * LANE + AXIS;
    const ratio = window.devicePixelRatio || 1;
    if (this.element.width !== Math.round(width * ratio) || this.element.height !== Math.round(height * ratio)) {
      this.element.width = Math.round(width * ratio);
      this.element.height = Math.round(height * ratio);
      this.element.style.height = `${height}px`;
    }
    const pen = this.element.getContext("2d");
    if (!pen) {
      return;
    }
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.font = "12px system-ui, sans-serif";
    pen.textBaseline = "middle";
    const x = (us: number): number => LABEL + ((us - from_us) / this.length_us) * (width - LABEL - 4);
    this.drawAxis(pen, x, from_us, width, height);
    for (let place = 0; place < count; place++) {
      const middle = place * LANE + LANE / 2;
      pen.fillStyle = color("soft");
      pen.fillText(String(output.channels[place].number), 2, middle);
      pen.fillStyle = color(`s${(place % 4) + 1}`);
      const stretches = output.stretches(place);
      stretches.forEach((stretch, i) => {
        const to_us = Math.min(stretches[i + 1]?.from_us ?? output.until_us, from_us + this.length_us);
        const begin_us = Math.max(stretch.from_us, from_us);
        if (to_us <= begin_us) {
          return;
        }
        const left = x(begin_us);
        const wide = Math.max(1, x(to_us) - left);
        const high = (LANE / 2 - 2) * stretch.share;
        if (stretch.state === CATHODIC) {
          pen.fillRect(left, middle, wide, high);
        } else if (stretch.state === ANODIC) {
          pen.fillRect(left, middle - high, wide, high);
        } else {
          const thick = stretch.state === GROUNDED ? 2.5 : 0.6;
          pen.fillRect(left, middle - thick / 2, wide, thick);
        }
      });
    }
  }

  private drawAxis(pen: CanvasRenderingContext2D, x: (us: number) => number, from_us: number, width: number, height: number): void {
    const per = this.unit === "ms" ? 1000 : 1;
    const steps = width < 420 ? 3 : 5;
    pen.strokeStyle = color("grid");
    pen.fillStyle = color("soft");
    pen.textAlign = "center";
    for (let i = 0; i <= steps; i++) {
      const us = (this.length_us * i) / steps;
      const at = x(from_us + us);
      pen.beginPath();
      pen.moveTo(at, 0);
      pen.lineTo(at, height - AXIS);
      pen.stroke();
      const text = `${Math.round(us / per)} ${this.unit}`;
      pen.textAlign = i === 0 ? "left" : i === steps ? "right" : "center";
      pen.fillText(text, i === steps ? width - 2 : at, height - AXIS / 2);
    }
    pen.textAlign = "left";
  }
}
