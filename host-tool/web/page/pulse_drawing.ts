// Drawing of a pulse over time, with its phases and their charge.

import type { FieldName, PulseValues } from "./pulse_session";
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
  name: "cathodic" | "anodic";
  amplitude_ma: number;
}

const HEIGHT = 300;
const FRAME = { left: 58, top: 34, bottom: 252 };
// Space at the right.
const MARGIN = 16;

// Draws the pulse that the device outputs, or, without edges, the requested one, whose refused
// fields are marked.
export function drawPulse(
  values: PulseValues,
  edges: Edge[] | null,
  refused: Set<string>,
  width: number,
): SVGSVGElement {
  const right = width - MARGIN;
  const phases = edges ? phasesOf(edges) : requested(values);
  const end_us = phases.at(-1)?.to_us ?? 1;
  const span_us = end_us * 1.25 + 20;
  const peak = Math.max(...phases.map((phase) => phase.amplitude_ma)) || 1;
  const middle = (FRAME.top + FRAME.bottom) / 2;
  const x = (us: number): number => FRAME.left + (us / span_us) * (right - FRAME.left);
  const y = (ma: number): number => middle - (ma / peak) * ((FRAME.bottom - FRAME.top) / 2 - 14);
  const charge = (phase: Phase): number =>
    (phase.amplitude_ma * (phase.to_us - phase.from_us)) / 1000;
  const lengthOf = (phase: Phase): string => show(phase.to_us - phase.from_us, 6);
  const mark = (name: FieldName): string => (refused.has(name) ? ", refused" : "");

  const title = phases
    .map((phase) => `${phase.name} phase of ${lengthOf(phase)} µs, ${show(charge(phase))} µC`)
    .join(", then ");
  const svg = drawing(width, HEIGHT, `${edges ? "Pulse" : "Pulse that is not output"}: ${title}`);
  const isRefused = refused.has("amplitude_ma");
  const unit =
    `current (mA)${edges ? "" : ", requested, not output"}` +
    (isRefused ? "; amplitude refused" : "");
  svg.append(
    draw("rect", { x: 0, y: 0, width, height: HEIGHT, class: "ground" }),
    draw("line", { x1: FRAME.left, x2: right, y1: middle, y2: middle, class: "axis" }),
    draw("text", { x: 4, y: 18 }, unit),
    draw("text", { x: right, y: HEIGHT - 4, "text-anchor": "end" }, "time (µs)"),
  );
  for (const ma of [peak, 0, -peak]) {
    const label = draw("text", { x: FRAME.left - 8, y: y(ma) + 4, "text-anchor": "end" }, show(ma));
    svg.append(label);
  }
  for (const [index, phase] of phases.entries()) {
    const isBelow = phase.name === "cathodic";
    const edge = y(isBelow ? -phase.amplitude_ma : phase.amplitude_ma);
    const length = x(phase.to_us) - x(phase.from_us);
    const height = Math.abs(edge - middle);
    const center = x((phase.from_us + phase.to_us) / 2);
    const inside = isBelow ? middle + height / 2 : middle - height / 2;
    const outside = isBelow ? middle - 10 : middle + 20;
    const isWide = length > 70 && height > 30;
    // Both texts stay inside the drawing.
    const place = (half: number): number =>
      Math.min(Math.max(center, FRAME.left + half), right - half);
    svg.append(
      draw("rect", {
        x: x(phase.from_us),
        y: Math.min(edge, middle),
        width: length,
        height,
        class: `phase${index === 0 ? " first" : " second"}${edges ? "" : " refused"}`,
      }),
      draw(
        "text",
        {
          x: isWide ? center : place(30),
          y: (isWide ? inside : outside) + 4,
          "text-anchor": "middle",
          class: "charge",
        },
        `${show(charge(phase))} µC`,
      ),
      draw(
        "text",
        {
          x: place(refused.has("width_us") ? 85 : 55),
          y: isBelow ? FRAME.bottom : FRAME.top + 2,
          "text-anchor": "middle",
        },
        `${phase.name}, ${lengthOf(phase)} µs${mark("width_us")}`,
      ),
    );
  }
  ticks(svg, phases, x);
  if (phases.length > 1) {
    const [from, to] = [phases[0].to_us, phases[1].from_us];
    const at = x((from + to) / 2);
    const up = phases[0].name === "cathodic";
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
        { x: at - 4, y: level, class: "halo", ...(at > width / 2 ? { "text-anchor": "end" } : {}) },
        `gap ${show(to - from, 6)} µs${mark("gap_us")}`,
      ),
    );
  }
  drawGrounding(svg, groundingOf(values, edges, end_us), refused, { x, right, middle });
  return svg;
}

interface Grounding {
  from_us: number;
  length_us: number;
  isOutput: boolean;
}

function groundingOf(
  values: PulseValues,
  edges: Edge[] | null,
  end_us: number,
): Grounding | null {
  if (!edges) {
    const length_us = values.ground_us;
    return length_us > 0 ? { from_us: end_us, length_us, isOutput: false } : null;
  }
  const index = edges.findIndex((edge) => edge.state === "grounded");
  if (index < 0) {
    return null;
  }
  const from_us = edges[index].t_us;
  const to_us = edges[index + 1]?.t_us ?? from_us + values.ground_us;
  return { from_us, length_us: to_us - from_us, isOutput: true };
}

function drawGrounding(
  svg: SVGSVGElement,
  grounding: Grounding | null,
  refused: Set<string>,
  place: { x: (us: number) => number; right: number; middle: number },
): void {
  if (!grounding) {
    return;
  }
  const { x, right, middle } = place;
  const { from_us, length_us, isOutput } = grounding;
  const from = x(from_us);
  const to = Math.min(x(from_us + length_us), right);
  const goesOn = x(from_us + length_us) > right;
  const text =
    `grounded, ${show(length_us, 6)} µs${goesOn ? " →" : ""}` +
    (refused.has("ground_us") ? ", refused" : "");
  svg.append(
    draw("rect", {
      x: from,
      y: middle - 4,
      width: Math.max(0, to - from),
      height: 8,
      class: `grounded${isOutput ? "" : " refused"}`,
    }),
    draw("text", { x: right, y: middle + 34, "text-anchor": "end", class: "halo" }, text),
  );
}

function phasesOf(edges: Edge[]): Phase[] {
  return edges.flatMap(({ t_us, state, amplitude_ma }, index) => {
    const to_us = edges[index + 1]?.t_us ?? t_us;
    return state === "cathodic" || state === "anodic"
      ? [{ from_us: t_us, to_us, name: state, amplitude_ma }]
      : [];
  });
}

function requested({ shape, amplitude_ma, width_us, gap_us }: PulseValues): Phase[] {
  const names = ["cathodic", "anodic"] as const;
  const [one, other] = shape.includes("anodic") ? [names[1], names[0]] : names;
  const from_us = width_us + gap_us;
  const first = { from_us: 0, to_us: width_us, name: one, amplitude_ma };
  const second = { from_us, to_us: from_us + width_us, name: other, amplitude_ma };
  return shape.startsWith("biphasic") ? [first, second] : [first];
}

function ticks(svg: SVGSVGElement, phases: Phase[], x: (us: number) => number): void {
  let taken = -Infinity;
  for (const us of phases.flatMap((phase) => [phase.from_us, phase.to_us])) {
    const at = x(us);
    const y = FRAME.bottom;
    const text = show(us, 6);
    const half = text.length * 3.6;
    svg.append(draw("line", { x1: at, x2: at, y1: y + 8, y2: y + 14, class: "axis" }));
    if (at - half > taken + 4) {
      svg.append(draw("text", { x: at, y: y + 28, "text-anchor": "middle" }, text));
      taken = at + half;
    }
  }
}
