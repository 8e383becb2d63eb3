// A pulse train on the muscle model: its pulses can be moved, and the force follows.

import { Simulator } from "./api";
import { choice, make, slider } from "./dom";
import { Plot } from "./plots";
import {
  Latest,
  draw,
  drawing,
  facts,
  fitWidth,
  messageOf,
  placeIn,
  show,
  status,
} from "./understand_tools";

// A in N/s, K, and τc, τ1 and τ2 in ms.
export type Muscle = [number, number, number, number, number];

// Subjects K01 to K10 of Lee 2020, table 4, as in hal-sim/src/body/muscle/mod.rs. The τ2 of K06 is
// printed as 17.6 ms, but only 176 ms reproduces tables 2 and 7.
export const SUBJECTS: Muscle[] = [
  [121.9, 0.3, 20.8, 33.1, 194.4],
  [75.9, 0.128, 15.6, 76.2, 52.0],
  [438.9, 0.326, 31.1, 40.5, 51.8],
  [183.1, 0.094, 15.9, 50.2, 117.9],
  [130.8, 0.012, 11.5, 5.0, 124.1],
  [148.7, 0.162, 22.5, 14.4, 176.0],
  [85.0, 0.113, 17.0, 11.8, 189.8],
  [218.0, 0.19, 26.3, 10.0, 98.4],
  [122.2, 0.215, 21.9, 24.1, 137.4],
  [68.5, 0.293, 29.3, 20.7, 163.6],
];

export function subjectName(index: number): string {
  return `K${String(index + 1).padStart(2, "0")}`;
}

// Time of the last pulse, and time for which the force is shown after it, ms.
const LATEST_MS = 4000;
const DECAY_MS = 600;
const MOST_PULSES = 200;
// Calcium of the model that the fixed point of the device can hold, in pulses.
const MOST_CALCIUM = 24;
// Place of the axis of pulses in its drawing.
const AXIS = { left: 16, line: 62, height: 92 };

export function mountTrain(root: HTMLElement, simulator: Simulator): void {
  let subject = 0;
  let times_ms: number[] = [];
  const runs = new Latest(120);

  const force = new Plot({
    title: "Force of the muscle over time, by the device's model and exact",
    unit: "force (N)",
    lines: [
      { label: "exact", color: "s2", width: 4 },
      { label: "device's fixed point", color: "s1", dash: [6, 4] },
    ],
    height: 240,
  });
  const difference = new Plot({
    title: "Difference of the two forces over time",
    unit: "mN",
    lines: [{ label: "device − exact", color: "s4" }],
    height: 150,
  });
  const result = make("div", {});
  const notice = status();
  const axis = drawing(300, AXIS.height, "Times of the pulses");
  axis.classList.add("editable");
  const around = make("div", {});
  around.append(axis);
  fitWidth(around, 260, 900, (width) => {
    axis.setAttribute("width", String(width));
    axis.setAttribute("viewBox", `0 0 ${width} ${AXIS.height}`);
    drawPulses(axis, times_ms);
  });

  const regular = { rate_hz: 30, count: 15, first_ms: 1000 / 30, isRegular: true };
  const fill = (): void => {
    const period_ms = 1000 / regular.rate_hz;
    const first_ms = regular.isRegular ? period_ms : regular.first_ms;
    const starts = Array.from({ length: regular.count }, (_, index) =>
      index === 0 ? 0 : first_ms + (index - 1) * period_ms,
    );
    change(starts.map((ms) => Math.round(ms * 1000) / 1000).filter((ms) => ms <= LATEST_MS));
  };
  const first = slider({
    label: "First interval",
    min: 3,
    max: 100,
    step: 1,
    value: 33,
    format: (value) =>
      regular.isRegular
        ? "as the others"
        : `${value} ms${value < 1000 / regular.rate_hz ? " (doublet)" : ""}`,
    change: (value) => {
      regular.first_ms = value;
      fill();
    },
  });
  const doublet = make("input", {
    type: "checkbox",
    id: "train-doublet",
    change: (event) => {
      regular.isRegular = !(event.target as HTMLInputElement).checked;
      first.input.disabled = regular.isRegular;
      regular.first_ms = regular.isRegular ? regular.first_ms : 8;
      first.set(regular.first_ms);
      fill();
    },
  });
  first.input.disabled = true;
  const rate = slider({
    label: "Pulse rate",
    min: 1,
    max: 100,
    step: 1,
    value: regular.rate_hz,
    format: (value) => `${value} Hz`,
    change: (value) => {
      regular.rate_hz = value;
      first.set(regular.first_ms);
      fill();
    },
  });
  const number = slider({
    label: "Number of pulses",
    min: 0,
    max: 100,
    step: 1,
    value: regular.count,
    format: String,
    change: (value) => {
      regular.count = value;
      fill();
    },
  });

  const mistake = make("p", { id: "train-mistake", class: "mistakes", "aria-live": "polite" });
  const field = make("input", {
    type: "text",
    id: "train-times",
    inputmode: "decimal",
    autocomplete: "off",
    "aria-describedby": "train-mistake train-help",
    change: () => {
      const read = readTimes(field.value);
      const isWrong = typeof read === "string";
      mistake.textContent = isWrong ? `✗ ${read}` : "";
      field.setAttribute("aria-invalid", String(isWrong));
      if (!isWrong) {
        change(read);
      }
    },
  });

  const change = (times: number[]): void => {
    times_ms = times;
    field.value = times.join(" ");
    field.removeAttribute("aria-invalid");
    mistake.textContent = "";
    drawPulses(axis, times);
    runs.ask(compute);
  };

  axis.addEventListener("click", (event) => {
    const { x } = placeIn(axis, event);
    const length_ms = axisLength(times_ms);
    const ms_per_unit = length_ms / (axis.viewBox.baseVal.width - 2 * AXIS.left);
    const at_ms = (x - AXIS.left) * ms_per_unit;
    const near_ms = 6 * ms_per_unit;
    const hit = times_ms.find((ms) => Math.abs(ms - at_ms) <= near_ms);
    const place = Math.min(Math.max(Math.round(at_ms), 0), LATEST_MS);
    const rest = times_ms.filter((ms) => ms !== (hit ?? place));
    change(hit === undefined ? [...rest, place].sort((a, b) => a - b) : rest);
  });

  const compute = async (isStale: () => boolean): Promise<void> => {
    const calcium = largestCalcium(times_ms, SUBJECTS[subject][2]);
    if (calcium >= MOST_CALCIUM) {
      notice.textContent =
        `✗ The pulses follow each other too fast: calcium would reach ${show(calcium)} pulses, ` +
        `and the model of the device holds less than ${MOST_CALCIUM}. Move pulses apart.`;
      force.set([], [], []);
      difference.set([], []);
      result.replaceChildren();
      return;
    }
    try {
      const answer = await simulator.response({
        muscle: SUBJECTS[subject],
        pulses_us: times_ms.map((ms) => Math.round(ms * 1000)),
        duration_s: (Math.ceil(times_ms.at(-1) ?? 0) + DECAY_MS) / 1000,
      });
      if (isStale()) {
        return;
      }
      const { t_s, device_n, exact_n } = answer;
      force.set(t_s, exact_n, device_n);
      difference.set(t_s, device_n.map((n, index) => (n - exact_n[index]) * 1000));
      notice.textContent = `Peak force by the device: ${show(Math.max(0, ...device_n), 4)} N.`;
      result.replaceChildren(table(t_s, device_n, exact_n, times_ms));
    } catch (error) {
      notice.textContent = messageOf(error);
    }
  };

  const subjects = choice({
    label: "Muscle of subject",
    values: SUBJECTS.map((_, index) => [String(index), subjectName(index)]),
    value: "0",
    change: (value) => {
      subject = Number(value);
      described.replaceChildren(parameters(SUBJECTS[subject]));
      runs.ask(compute);
    },
  });
  const described = make("div", {}, parameters(SUBJECTS[0]));

  root.append(
    make(
      "p",
      {},
      "Each pulse releases calcium, and calcium makes force: the plot shows the force that the " +
        "device predicts in its fixed-point arithmetic beside the exact solution of the same " +
        "equations. A doublet, two pulses close together at the start, raises the force sooner.",
    ),
    make(
      "div",
      { class: "columns" },
      make(
        "div",
        { class: "panel" },
        subjects.element,
        described,
        rate.element,
        number.element,
        make(
          "div",
          { class: "row" },
          doublet,
          make("label", { for: "train-doublet" }, "Own first interval"),
        ),
        first.element,
        make("label", { for: "train-times", class: "block" }, "Times of the pulses (ms)"),
        field,
        mistake,
        make(
          "p",
          { class: "note", id: "train-help" },
          `Numbers from 0 to ${LATEST_MS}, with spaces between them. Or click on the axis: on a ` +
            "pulse to remove it, elsewhere to add one.",
        ),
      ),
      make("div", { class: "panel" }, around, force.element, difference.element, notice, result),
    ),
    make(
      "p",
      { class: "note" },
      "Simulated: the calcium–force model of Lee 2020 (equations 2 and 3) with the parameters of " +
        "their table 4, at full recruitment, every millisecond.",
    ),
  );
  fill();
}

function parameters([a, k, tauC, tau1, tau2]: Muscle): HTMLElement {
  const text = `A ${a} N/s, K ${k}, τc ${tauC} ms, τ1 ${tau1} ms, τ2 ${tau2} ms`;
  return make("p", { class: "note" }, text);
}

// Reads times in ms, or says what is wrong with them.
export function readTimes(text: string): number[] | string {
  const words = text.split(/[\s,;]+/).filter((word) => word !== "");
  if (words.length > MOST_PULSES) {
    return `There are ${words.length} times; at most ${MOST_PULSES} are allowed.`;
  }
  const times: number[] = [];
  for (const word of words) {
    const ms = Number(word);
    if (!Number.isFinite(ms) || ms < 0 || ms > LATEST_MS) {
      return `“${word}” is not a time from 0 to ${LATEST_MS} ms.`;
    }
    times.push(Math.round(ms * 1000) / 1000);
  }
  times.sort((a, b) => a - b);
  const twice = times.find((ms, index) => index > 0 && ms === times[index - 1]);
  return twice === undefined ? times : `The time ${twice} ms occurs twice.`;
}

function largestCalcium(times: number[], tau: number): number {
  let calcium = 0;
  let largest = 0;
  times.forEach((ms, index) => {
    calcium = 1 + (index > 0 ? calcium * Math.exp((times[index - 1] - ms) / tau) : 0);
    largest = Math.max(largest, calcium);
  });
  return largest;
}

function axisLength(times: number[]): number {
  return (times.at(-1) ?? 0) + DECAY_MS;
}

function drawPulses(svg: SVGSVGElement, times: number[]): void {
  const length = axisLength(times);
  const width = svg.viewBox.baseVal.width;
  const right = width - AXIS.left;
  const x = (ms: number): number => AXIS.left + (ms / length) * (right - AXIS.left);
  const parts: SVGElement[] = [
    draw("rect", { x: 0, y: 0, width, height: AXIS.height, class: "ground" }),
    draw("line", { x1: AXIS.left, x2: right, y1: AXIS.line, y2: AXIS.line, class: "axis" }),
  ];
  const step = [50, 100, 200, 500, 1000].find((ms) => (length / ms) * 70 <= width) ?? 1000;
  for (let ms = 0; ms <= length; ms += step) {
    parts.push(
      draw("line", { x1: x(ms), x2: x(ms), y1: AXIS.line, y2: AXIS.line + 5, class: "axis" }),
      draw("text", { x: x(ms), y: AXIS.line + 20, "text-anchor": "middle" }, `${ms} ms`),
    );
  }
  for (const ms of times) {
    parts.push(draw("line", { x1: x(ms), x2: x(ms), y1: 16, y2: AXIS.line, class: "pulse" }));
  }
  svg.replaceChildren(...parts);
  svg.setAttribute("aria-label", `Times of ${times.length} pulses`);
}

function table(t_s: number[], device: number[], exact: number[], times: number[]): HTMLElement {
  const peakOf = (forces: number[]): number => Math.max(0, ...forces);
  const integralOf = (forces: number[]): number => {
    let sum = 0;
    for (let i = 1; i < forces.length; i++) {
      sum += ((forces[i] + forces[i - 1]) / 2) * (t_s[i] - t_s[i - 1]);
    }
    return sum;
  };
  // The train lasts as long after its last pulse as its last interval.
  const last = times.at(-1) ?? 0;
  const interval = times.length > 1 ? last - (times.at(-2) ?? 0) : 0;
  const end = Math.min((last + interval) / 1000, t_s.at(-1) ?? 0);
  const begin = Math.max(0, end - 0.2);
  const meanOf = (forces: number[]): number => {
    const chosen = forces.filter((_, i) => t_s[i] >= begin && t_s[i] <= end);
    return chosen.reduce((sum, n) => sum + n, 0) / Math.max(1, chosen.length);
  };
  const row = (name: string, unit: string, of: (forces: number[]) => number): HTMLElement => {
    const [a, b] = [of(device), of(exact)];
    const error = b > 0 ? `${show(((a - b) / b) * 100, 2)} %` : "–";
    const cells = [`${show(a, 4)} ${unit}`, `${show(b, 4)} ${unit}`, error];
    const data = cells.map((text) => make("td", {}, text));
    return make("tr", {}, make("th", { scope: "row" }, name), ...data);
  };
  const heads = ["", "device", "exact", "difference"].map((text) =>
    text === "" ? make("td", {}) : make("th", { scope: "col" }, text),
  );
  const at = t_s[exact.indexOf(peakOf(exact))] ?? 0;
  return make(
    "div",
    {},
    make(
      "div",
      { class: "scroll", tabindex: "0", role: "group", "aria-label": "Table of forces" },
      make(
        "table",
        {},
        make("thead", {}, make("tr", {}, ...heads)),
        make(
          "tbody",
          {},
          row("Peak force", "N", peakOf),
          row("Mean of the train's last 200 ms", "N", meanOf),
          row("Force–time integral", "N·s", integralOf),
        ),
      ),
    ),
    facts([
      ["Time of the peak", `${Math.round(at * 1000)} ms`],
      ["Last 200 ms", `${show(begin * 1000, 4)} to ${show(end * 1000, 4)} ms`],
    ]),
  );
}
