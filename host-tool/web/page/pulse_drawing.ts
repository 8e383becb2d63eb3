// Drawing of a pulse over time, with its phases and their charge.

import type { PulseValues } from "./pulse";
import { draw, drawing, show } from "./understand_tools";

// Change of a channel's output: from `t_us` on it has this state and amplitude.
export interface Edge {
  t_us: number;
  state: "isolated" | "cathodic" | "anodic" | "grounded";
  amplitude_ma: number;
}

interface Phase {
  from_us: number;
  to_us: number;
  // Negative in a cathodic phase.
  current_ma: number;
}

const HEIGHT = 300;
const FRAME = { left: 52, top: 34, bottom: 252 };
// Space at the right.
const MARGIN = 16;

// Draws the pulse that the device outputs, or, without edges, the requested one.
export function drawPulse(
  values: PulseValues,
  edges: Edge[] | null,
  width: number,
): SVGSVGElement {
  const right = width - MARGIN;
  const phases = edges ? phasesOf(edges) : requested(values);
  const isBiphasic = values.shape.startsWith("biphasic");
  const end_us = phases.at(-1)?.to_us ?? 1;
  const grounded = edges?.find((edge) => edge.state === "grounded");
  const span_us = end_us * 1.25 + 20;
  const peak = Math.max(...phases.map((phase) => Math.abs(phase.current_ma)), 1e-6);
  const middle = (FRAME.top + FRAME.bottom) / 2;
  const x = (us: number): number => FRAME.left + (us / span_us) * (right - FRAME.left);
  const y = (ma: number): number => middle - (ma / peak) * ((FRAME.bottom - FRAME.top) / 2 - 14);
  const charge = (phase: Phase): number =>
    (Math.abs(phase.current_ma) * (phase.to_us - phase.from_us)) / 1000;
  const name = (phase: Phase): string => (phase.current_ma < 0 ? "cathodic" : "anodic");

  const title = phases
    .map((phase) => {
      const length = phase.to_us - phase.from_us;
      return `${name(phase)} phase of ${length} µs, ${show(charge(phase))} µC`;
    })
    .join(", then ");
  const svg = drawing(width, HEIGHT, `${edges ? "Pulse" : "Pulse that is not output"}: ${title}`);
  svg.append(
    draw("rect", { x: 0, y: 0, width, height: HEIGHT, class: "ground" }),
    draw("line", { x1: FRAME.left, x2: right, y1: middle, y2: middle, class: "axis" }),
    draw("text", { x: 4, y: 18 }, `current (mA)${edges ? "" : ", requested, not output"}`),
    draw("text", { x: right, y: HEIGHT - 8, "text-anchor": "end" }, "time (µs)"),
  );
  for (const ma of [peak, 0, -peak]) {
    const label = draw("text", { x: FRAME.left - 8, y: y(ma) + 4, "text-anchor": "end" }, show(ma));
    svg.append(label);
  }
  for (const [index, phase] of phases.entries()) {
    const top = Math.min(y(phase.current_ma), middle);
    const length = x(phase.to_us) - x(phase.from_us);
    const height = Math.abs(y(phase.current_ma) - middle);
    const center = x((phase.from_us + phase.to_us) / 2);
    const inside = phase.current_ma < 0 ? middle + height / 2 : middle - height / 2;
    const outside = phase.current_ma < 0 ? middle - 10 : middle + 20;
    const isWide = length > 70;
    svg.append(
      draw("rect", {
        x: x(phase.from_us),
        y: top,
        width: length,
        height,
        class: `phase${index === 0 ? " first" : " second"}${edges ? "" : " refused"}`,
      }),
      draw(
        "text",
        { x: center, y: (isWide ? inside : outside) + 4, "text-anchor": "middle", class: "charge" },
        `${show(charge(phase))} µC`,
      ),
      draw(
        "text",
        {
          x: Math.max(center, FRAME.left + 40),
          y: phase.current_ma < 0 ? FRAME.bottom : FRAME.top + 2,
          "text-anchor": "middle",
        },
        `${name(phase)}, ${phase.to_us - phase.from_us} µs`,
      ),
    );
  }
  ticks(svg, phases, x);
  if (isBiphasic && phases.length > 1) {
    const [from, to] = [phases[0].to_us, phases[1].from_us];
    const at = x((from + to) / 2);
    const up = phases[0].current_ma < 0;
    const level = up ? middle + 44 : middle - 34;
    svg.append(
      draw("line", {
        x1: at,
        x2: at,
        y1: middle,
        y2: up ? level - 14 : level + 6,
        class: "lead",
      }),
      draw(
        "text",
        { x: at - 4, y: level, class: "halo" },
        `gap ${to - from} µs`,
      ),
    );
  }
  if (grounded) {
    const from = x(grounded.t_us);
    svg.append(
      draw("rect", {
        x: from,
        y: middle - 4,
        width: right - from,
        height: 8,
        class: "grounded",
      }),
      draw("text", { x: right, y: middle - 10, "text-anchor": "end" }, "grounded"),
    );
  }
  return svg;
}

function phasesOf(edges: Edge[]): Phase[] {
  return edges.flatMap((edge, index) => {
    const to = edges[index + 1]?.t_us ?? edge.t_us;
    const sign = edge.state === "cathodic" ? -1 : edge.state === "anodic" ? 1 : 0;
    const current_ma = sign * edge.amplitude_ma;
    return sign === 0 ? [] : [{ from_us: edge.t_us, to_us: to, current_ma }];
  });
}

function requested(values: PulseValues): Phase[] {
  const number = (value: number): number => (Number.isFinite(value) && value > 0 ? value : 0);
  const width = Math.min(number(values.width_us), 5000);
  const gap = Math.min(number(values.gap_us), 5000);
  const sign = values.shape.includes("anodic") ? 1 : -1;
  const current = sign * number(values.amplitude_ma);
  const first = { from_us: 0, to_us: width, current_ma: current };
  const second = { from_us: width + gap, to_us: 2 * width + gap, current_ma: -current };
  return values.shape.startsWith("biphasic") ? [first, second] : [first];
}

function ticks(svg: SVGSVGElement, phases: Phase[], x: (us: number) => number): void {
  let taken = -Infinity;
  for (const us of phases.flatMap((phase) => [phase.from_us, phase.to_us])) {
    const at = x(us);
    const y = FRAME.bottom;
    svg.append(draw("line", { x1: at, x2: at, y1: y + 8, y2: y + 14, class: "axis" }));
    if (at - taken > 34) {
      svg.append(draw("text", { x: at, y: y + 28, "text-anchor": "middle" }, String(us)));
      taken = at;
    }
  }
}
