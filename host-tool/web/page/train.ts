// A pulse train on the muscle model: its pulses can be moved, and the force follows.

import { Simulator } from "./api";
import { choice, make, slider } from "./dom";
import { Plot } from "./plots";
import { PulseAxis } from "./train_axis";
import { ForceRow, forceTable, rowsOf } from "./train_table";
import { ScaledPlot, terms } from "./understand_layout";
import { Latest, fitWidth, messageOf, show, status } from "./understand_tools";

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

// The model: dC/dt = pulses − C/τc, x = C/(C + K), dF/dt = A·x − F/(τ1 + τ2·x).
const TERMS: [string, string][] = [
  ["A", "how fast the force grows at full activation (x = 1), in newtons per second"],
  ["K", "calcium at which activation is one half; each pulse adds 1, so a small K saturates soon"],
  ["τc", "time in which the calcium of a pulse falls to 37 %"],
  ["τ1", "time in which the force falls to 37 % once the calcium is gone"],
  ["τ2", "what full activation adds to that time: bound cross-bridges hold the force for longer"],
];

export function mountTrain(root: HTMLElement, simulator: Simulator): void {
  let subject = 0;
  let times_ms: number[] = [];
  const runs = new Latest(120);

  const common = { unit: "force (N)", height: 240 };
  const exactLine = { label: "exact", color: "s2", width: 4 };
  const deviceLine = { label: "device's fixed point", color: "s1", dash: [6, 4] };
  const forcePlot = new Plot({
    ...common,
    title: "Force of the muscle over time, by the device's model and exact",
    lines: [exactLine, deviceLine],
  });
  const comparisonPlot = new Plot({
    ...common,
    title: "Force of the muscle over time, and with a regular first interval",
    lines: [
      exactLine,
      deviceLine,
      { label: "exact, regular first interval", color: "s3", width: 2 },
    ],
  });
  const force = make("div", {}, forcePlot.element);
  const plot = (rows: ForceRow[], regularRows: ForceRow[] | null): void => {
    const longest = regularRows && regularRows.length > rows.length ? regularRows : rows;
    const t_s = longest.map((row) => row.t_s);
    const exact = t_s.map((_, index) => rows[index]?.exact_n ?? null);
    const device = t_s.map((_, index) => rows[index]?.device_n ?? null);
    const shown = regularRows ? comparisonPlot : forcePlot;
    if (force.firstChild !== shown.element) {
      force.replaceChildren(shown.element);
    }
    const other = regularRows && t_s.map((_, index) => regularRows[index]?.exact_n ?? null);
    shown.set(t_s, exact, device, ...(other ? [other] : []));
    const error = rows.map((row) => (row.device_n - row.exact_n) * 1000);
    difference.set(rows.map((row) => row.t_s), error);
  };
  const difference = new ScaledPlot({
    title: "Difference of the two forces over time",
    unit: "mN",
    lines: [{ label: "device − exact", color: "s4" }],
    height: 150,
  });
  const result = make("div", {});
  const notice = status();
  const dropped = make("p", { class: "note", "aria-live": "polite" });
  const axis = new PulseAxis(LATEST_MS, (times) => changeByHand(times, false));
  const around = make("div", {}, axis.element);
  fitWidth(around, 260, 900, (width) => axis.resize(width));

  // Values of the sliders; `isOwn` while the times were edited and the sliders say nothing.
  const regular = { rate_hz: 30, count: 15, first_ms: 33, isRegular: true, isOwn: false };
  const regularTimes = (isRegular: boolean): number[] => {
    const period_ms = 1000 / regular.rate_hz;
    const first_ms = isRegular ? period_ms : regular.first_ms;
    const starts = Array.from({ length: regular.count }, (_, index) =>
      index === 0 ? 0 : first_ms + (index - 1) * period_ms,
    );
    return starts.map((ms) => Math.round(ms * 1000) / 1000).filter((ms) => ms <= LATEST_MS);
  };
  const fill = (): void => {
    regular.isOwn = false;
    const times = regularTimes(regular.isRegular);
    change(times);
    axis.show(times, axisLength(times));
    refresh();
  };
  // `rescales`: whether the axis may get another length.
  const changeByHand = (times: number[], rescales: boolean): void => {
    regular.isOwn = true;
    change(times);
    axis.show(times, rescales ? axisLength(times) : undefined);
    refresh();
  };
  // Makes the sliders say what is used.
  const refresh = (): void => {
    rate.set(regular.rate_hz);
    number.set(regular.count);
    first.set(regular.first_ms);
    const isShort = !regular.isOwn && times_ms.length < regular.count;
    dropped.textContent = isShort
      ? `Only the ${times_ms.length} of ${regular.count} pulses within ` +
        `${LATEST_MS / 1000} s are used; the force is shown for ${DECAY_MS} ms after the last.`
      : "";
  };
  const first = slider({
    label: "First interval",
    min: 3,
    max: 100,
    step: 1,
    value: regular.first_ms,
    format: (value) => {
      const isDoublet = value < 1000 / regular.rate_hz;
      return regular.isOwn
        ? "own times"
        : regular.isRegular
          ? "as the others"
          : `${value} ms${isDoublet ? " (doublet)" : ""}`;
    },
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
    format: (value) => (regular.isOwn ? "own times" : `${value} Hz`),
    change: (value) => {
      regular.rate_hz = value;
      fill();
    },
  });
  const number = slider({
    label: "Number of pulses",
    min: 0,
    max: 100,
    step: 1,
    value: regular.count,
    format: (value) =>
      regular.isOwn
        ? `${times_ms.length} (own times)`
        : times_ms.length < value
          ? `${value}, ${times_ms.length} used`
          : String(value),
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
        changeByHand(read, true);
      }
    },
  });

  const change = (times: number[]): void => {
    times_ms = times;
    field.value = times.join(" ");
    field.removeAttribute("aria-invalid");
    mistake.textContent = "";
    runs.ask(compute);
  };

  const ask = async (times: number[], length_s: number): Promise<ForceRow[]> =>
    rowsOf(
      await simulator.response({
        muscle: SUBJECTS[subject],
        pulses_us: times.map((ms) => Math.round(ms * 1000)),
        duration_s: length_s,
      }),
    );

  const compute = async (isStale: () => boolean): Promise<void> => {
    const calcium = largestCalcium(times_ms, SUBJECTS[subject][2]);
    if (calcium >= MOST_CALCIUM) {
      notice.textContent =
        `✗ The pulses follow each other too fast: calcium would reach ${show(calcium)} pulses, ` +
        `and the model of the device holds less than ${MOST_CALCIUM}. Move pulses apart.`;
      plot([], null);
      result.replaceChildren();
      return;
    }
    try {
      const hasOwnInterval = !regular.isOwn && !regular.isRegular && times_ms.length > 1;
      const others_ms = hasOwnInterval ? regularTimes(true) : null;
      const length = (times: number[]): number => Math.ceil(times.at(-1) ?? 0) + DECAY_MS;
      const length_s = Math.max(length(times_ms), length(others_ms ?? [])) / 1000;
      const times = times_ms;
      const rows = await ask(times, length_s);
      // Of a train that is too fast in itself, there is nothing to compare with.
      const isFast = largestCalcium(others_ms ?? [], SUBJECTS[subject][2]) >= MOST_CALCIUM;
      const others = others_ms && !isFast ? await ask(others_ms, length_s) : null;
      if (isStale()) {
        return;
      }
      plot(rows, others);
      const peak = rows.reduce((largest, row) => Math.max(largest, row.device_n), 0);
      notice.textContent = `Peak force by the device: ${show(peak, 4)} N.`;
      result.replaceChildren(forceTable(rows, others, times));
    } catch (error) {
      notice.textContent = `✗ ${messageOf(error)}`;
      plot([], null);
      result.replaceChildren();
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
        "equations. A doublet, two pulses close together at the start, raises the force sooner; " +
        "with an own first interval, the plot also has the train with a regular one.",
    ),
    make(
      "div",
      { class: "columns" },
      make(
        "div",
        { class: "panel" },
        subjects.element,
        described,
        make("details", {}, make("summary", {}, "What A, K, τc, τ1 and τ2 are"), terms(TERMS)),
        rate.element,
        number.element,
        dropped,
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
            "pulse to remove it, elsewhere to add one; the axis keeps its scale meanwhile.",
        ),
      ),
      make("div", { class: "panel" }, around, force, difference.element, notice, result),
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
