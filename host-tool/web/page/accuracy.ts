// Accuracy against speed of the muscle model: the committed chart, and the force at a chosen point.

import accuracyText from "charts/accuracy.csv";
import { Simulator } from "./api";
import { ChartDrawing, GOAL_PCT, limitedError } from "./accuracy_chart";
import { choice, make, slider } from "./dom";
import { Plot } from "./plots";
import { Setting, parseAccuracy } from "./tables";
import { subjectName } from "./train";
import { ScaledPlot, scroller } from "./understand_layout";
import { Latest, facts, messageOf, placeIn, show, status } from "./understand_tools";

const CORE_HZ = 168e6;
const TRAIN_S = 1;

const METHODS: Record<string, string> = {
  shipped: "shipped (the device's own)",
  segments: "segments (the device, without a table)",
  rk4: "RK4 on C and F",
  rk4_snapped: "RK4, pulses moved to its grid (the paper's)",
  euler_exact_c: "Euler along exact C",
  heun_exact_c: "Heun along exact C",
  rk4_exact_c: "RK4 along exact C",
  hermite_simpson: "Hermite–Simpson",
  etd1: "ETD1",
  etd_midpoint: "ETD midpoint",
  gauss_exponential: "Gauss exponential",
  rosenbrock_euler: "exponential Rosenbrock–Euler",
  rosenbrock_3: "exponential Rosenbrock, order 3",
  log_table: "log-C table",
  log_flow: "log-C flow",
  event_driven_2: "event-driven, 2 nodes",
  event_driven_3: "event-driven, 3 nodes",
  event_driven_4: "event-driven, 4 nodes",
};

const ARITHMETIC: Record<string, string> = {
  f64: "f64 (double precision)",
  f32: "f32 (single precision)",
  f32_micromath: "f32, approximate exponential",
  q15_16: "fixed point Q15.16",
  q7_24: "fixed point Q7.24",
  device: "the device's formats",
};

const READINGS: Record<string, string> = {
  steps: "steps end at each reading",
  cubic: "read through a cubic",
  demand: "steps end early at a reading",
};

export function mountAccuracy(root: HTMLElement, simulator: Simulator): void {
  const settings = parseAccuracy(accuracyText);
  let output_us = 1000;
  let subject = 1;
  let rate_hz = 40;
  let listed = settings.filter((setting) => setting.output_us === output_us);
  let chosen = listed.find((setting) => setting.method === "shipped") ?? listed[0];
  const runs = new Latest();
  const chart = new ChartDrawing();

  const force = new Plot({
    title: "Force over time by the chosen method, and the exact force",
    unit: "force (N)",
    lines: [
      { label: "exact", color: "s2", width: 4 },
      { label: "chosen method", color: "s1", dash: [6, 4] },
    ],
    height: 220,
  });
  const difference = new ScaledPlot({
    title: "Difference of the forces over time, in percent of the exact peak",
    unit: "% of peak",
    lines: [{ label: "chosen method − exact", color: "s4" }],
    height: 150,
  });
  const summary = make("div", {});
  const trial = status();

  const choose = (setting: Setting): void => {
    chosen = setting;
    method.select.value = setting.method;
    listSteps();
    chart.mark(listed, chosen);
    for (const { direction, button } of front) {
      button.setAttribute("aria-disabled", String(!neighbor(direction)));
    }
    summary.replaceChildren(describe(setting));
    runs.ask(compute);
  };

  const compute = async (): Promise<void> => {
    const setting = chosen;
    trial.textContent = "Integrating …";
    try {
      const answer = await simulator.integrate({
        method: setting.method,
        arithmetic: setting.arithmetic,
        reading: setting.reading,
        step_us: setting.step_us,
        output_ms: setting.output_us / 1000,
        subject,
        rate_hz,
      });
      const peak = Math.max(...answer.exact_n);
      // What leaves this range has diverged, and would hide the exact force.
      const isShown = (n: number | null): boolean => n !== null && Math.abs(n) <= 3 * peak;
      const shown = answer.force_n.map((n) => (isShown(n) ? n : null));
      force.set(answer.t_s, answer.exact_n, shown);
      const error = (n: number | null, i: number): number | null =>
        n === null ? null : ((n - answer.exact_n[i]) / peak) * 100;
      difference.set(answer.t_s, shown.map(error));
      const lost = shown.indexOf(null);
      const leaves =
        lost < 0 ? "" : ` ✗ It diverges: from ${show(answer.t_s[lost])} s on it leaves the plot.`;
      trial.textContent =
        `In this train (${subjectName(subject - 1)}, ${rate_hz} Hz for ${TRAIN_S} s) the largest ` +
        `error is ${show(answer.error_pct ?? Infinity)} % of the peak of ${show(peak)} N.${leaves}`;
    } catch (error) {
      force.set([], [], []);
      difference.set([], []);
      trial.textContent = `✗ ${messageOf(error)}`;
    }
  };

  const interval = choice({
    label: "Force is read every",
    values: [
      ["1000", "1 ms"],
      ["20000", "20 ms"],
    ],
    value: "1000",
    change: (value) => {
      output_us = Number(value);
      listed = settings.filter((setting) => setting.output_us === output_us);
      listMethods();
      const same = (setting: Setting): boolean =>
        setting.method === chosen.method &&
        setting.arithmetic === chosen.arithmetic &&
        setting.reading === chosen.reading &&
        setting.step_us === chosen.step_us;
      const ofMethod = (setting: Setting): boolean => setting.method === chosen.method;
      const next = listed.find(same) ?? listed.find(ofMethod) ?? listed[0];
      chart.draw(listed);
      choose(next);
    },
  });
  const method = choice({
    label: "Method",
    values: [],
    value: "",
    change: (value) => {
      const ofMethod = listed.filter((setting) => setting.method === value);
      choose(ofMethod.find((setting) => setting.front) ?? ofMethod[0]);
    },
  });
  const step = choice({
    label: "Step, arithmetic, reading",
    values: [],
    value: "",
    change: (value) => choose(listed[Number(value)]),
  });
  const listMethods = (): void => {
    const isListed = (name: string): boolean => listed.some(({ method }) => method === name);
    const names = Object.keys(METHODS).filter(isListed);
    const options = names.map((name) => make("option", { value: name }, METHODS[name]));
    method.select.replaceChildren(...options);
  };
  const listSteps = (): void => {
    const options = listed.flatMap((setting, index) =>
      setting.method === chosen.method
        ? [make("option", { value: String(index) }, stepName(setting))]
        : [],
    );
    step.select.replaceChildren(...options);
    step.select.value = String(listed.indexOf(chosen));
  };

  // Returns the next point of the front that is cheaper (-1) or costs more (1).
  const neighbor = (direction: number): Setting | undefined => {
    const beyond = listed.filter(
      (setting) =>
        setting.front && (setting.cycles_per_s - chosen.cycles_per_s) * direction > 0,
    );
    beyond.sort((a, b) => (a.cycles_per_s - b.cycles_per_s) * direction);
    return beyond[0];
  };
  const front = ([-1, 1] as const).map((direction) => {
    const text = direction < 0 ? "Cheaper on the front" : "More exact on the front";
    const click = (): void => choose(neighbor(direction) ?? chosen);
    return { direction, button: make("button", { type: "button", click }, text) };
  });
  const subjects = choice({
    label: "Muscle of subject",
    values: Array.from({ length: 10 }, (_, index) => [String(index + 1), subjectName(index)]),
    value: "1",
    change: (value) => {
      subject = Number(value);
      runs.ask(compute);
    },
  });
  const rate = slider({
    label: "Pulse rate",
    min: 5,
    max: 100,
    step: 1,
    value: rate_hz,
    format: (value) => `${value} Hz`,
    change: (value) => {
      rate_hz = value;
      runs.ask(compute);
    },
  });

  chart.element.addEventListener("click", (event) => {
    const nearest = chart.nearest(listed, placeIn(chart.element, event));
    if (nearest) {
      choose(nearest);
    }
  });

  root.append(
    make(
      "p",
      {},
      "Each mark is one way of integrating the muscle model: further left is cheaper, lower is " +
        "more exact. The line joins the front, the settings that no other setting beats in both; " +
        "choose a mark to see its force beside the exact one.",
    ),
    make(
      "p",
      {},
      make("strong", {}, "If you do not program: "),
      "in all 140 tested trains the device computes the force of this muscle model to within " +
        "0.0004 % of its peak, with 0.04 % of the processor, so its arithmetic is no reason to " +
        "doubt a predicted force; how well the model describes a person is not shown here.",
    ),
    make(
      "div",
      { class: "panel" },
      interval.element,
      chart.legend(),
      scroller("Chart", chart.element),
      make(
        "p",
        { class: "note" },
        `The goal of ${GOAL_PCT} % is an aim that the project set for itself; ` +
          "docs/evidence/methods.md states it without a derivation. It is 500 times smaller than " +
          "the 10 % of the peak from which people notice a difference (docs/how/muscle.md).",
      ),
    ),
    make(
      "div",
      { class: "columns" },
      make(
        "div",
        { class: "panel" },
        method.element,
        step.element,
        make("div", { class: "row" }, ...front.map(({ button }) => button)),
        summary,
      ),
      make(
        "div",
        { class: "panel" },
        subjects.element,
        rate.element,
        force.element,
        difference.element,
        trial,
      ),
    ),
    make(
      "p",
      { class: "note" },
      "Simulated. Marks are from docs/charts/accuracy.csv: the error is the worst of 140 trains " +
        "of ten subjects of Lee 2020, and the chip simulator counted the cycles for one muscle. " +
        "The forces are integrated in this page, for one of the muscles and a regular train.",
    ),
  );
  listMethods();
  chart.draw(listed);
  choose(chosen);
}

function stepName(setting: Setting): string {
  const step =
    setting.step_us === null ? "pulse to pulse" : `${setting.step_us / 1000} ms`;
  const front = setting.front ? " ◆ front" : "";
  const arithmetic = ARITHMETIC[setting.arithmetic] ?? setting.arithmetic;
  return `${step}, ${arithmetic}, ${setting.reading}${front}`;
}

function describe(setting: Setting): HTMLElement {
  const share = (setting.cycles_per_s / CORE_HZ) * 100;
  const step = setting.step_us === null ? "from pulse to pulse" : `${setting.step_us / 1000} ms`;
  const place = setting.front ? "◆ on the front" : "not on the front";
  const clipped = setting.error_pct > limitedError(setting.error_pct) ? " (above the chart)" : "";
  return make(
    "div",
    {},
    make("h3", {}, `${METHODS[setting.method] ?? setting.method}, ${place}`),
    facts([
      ["Worst error", `${show(setting.error_pct)} % of the peak${clipped}`],
      ["Cycles per second", setting.cycles_per_s.toLocaleString("en")],
      ["Share of a 168 MHz core", `${show(share)} %`],
      ["Worst reading", `${setting.worst_tick_cycles.toLocaleString("en")} cycles`],
      ["Step", step],
      ["Arithmetic", ARITHMETIC[setting.arithmetic] ?? setting.arithmetic],
      ["Reading", READINGS[setting.reading] ?? setting.reading],
    ]),
  );
}
