// Stability maps: the committed results, and a run of the simulator at a chosen cell.

import gainDelayText from "maps/gain_delay.csv";
import lossText from "maps/loss.csv";
import { Simulator } from "./api";
import { choice, make, slider } from "./dom";
import { Plot } from "./plots";
import { Outcome, playLoss, playStrength } from "./stability_live";
import { liveText, verdict } from "./stability_text";
import { MapClass, mapDrawing, mapKeys, mapLegend, mapSelection } from "./stability_map";
import { MapCell, StabilityMap, parseMap } from "./tables";
import { terms } from "./understand_layout";
import { Latest, facts, messageOf, show, status } from "./understand_tools";

interface Study {
  map: StabilityMap;
  classes: MapClass[];
  // What the number of a cell is, and its largest value that holds, °.
  quantity: string;
  limit_deg: number;
  // Whether a live run is judged by its swing, as a held angle, or by its error.
  judgesSwing: boolean;
  // Name of the largest swing or error of a live run.
  largestName: string;
  downTitle: string;
  // The same beside the drawing, with its unit.
  downAxis: string;
  downName: (name: string) => string;
  acrossTitle: string;
  acrossUnit: string;
  chosen: { panel: number; row: number; column: number };
  summary: string;
  differences: string;
}

const GAIN_DELAY: Study = {
  map: parseMap(gainDelayText),
  classes: [
    { mark: "0", upTo: 0.5, fails: false, color: "k1" },
    { mark: "1", upTo: 1, fails: false, color: "k3" },
    { mark: "2", upTo: 2, fails: false, color: "k5" },
    { mark: "5", upTo: 5, fails: true, color: "k6" },
    { mark: "8", upTo: 20, fails: true, color: "k7" },
    { mark: "X", upTo: Infinity, fails: true, color: "k8" },
  ],
  quantity: "swing of the angle, peak to peak over the last 5 of 20 s",
  limit_deg: 2,
  judgesSwing: true,
  largestName: "Largest swing within a second, after the first",
  downTitle: "Torque of the muscles relative to the file's wearer",
  downAxis: "torque (× file's wearer)",
  downName: (name) => `${name} ×`,
  acrossTitle: "Added delay",
  acrossUnit: "ms",
  chosen: { panel: 0, row: 3, column: 4 },
  summary:
    "Three controllers hold 30° on fingers that are stronger, weaker or slower than the " +
    "wearer file states. If the angle swings by more than 2° in the end, the cell fails.",
  differences:
    "The map runs the controller alone, with its full gain, on a finger whose sensor has no " +
    "noise. The live trace is the whole device. Within 0.5° of a reference that has been " +
    "constant for half a second it lowers its feedback gain to a sixteenth. When it detects a " +
    "limit cycle it multiplies the gain by 0.7, down to an eighth, and then disconnects the " +
    "outputs (fault 12). Its sensor has 0.3° of noise and a resolution of 0.1°, and the " +
    "board's converter reads it. Therefore the angle often swings at first, as in the map, " +
    "and then rests. Both use participant P's finger with one point, all pulses at one time, " +
    "every 20 ms, and no limit on rising amplitudes.",
};

const LOSS: Study = {
  map: parseMap(lossText),
  classes: [
    { mark: "0", upTo: 0.5, fails: false, color: "k1" },
    { mark: "1", upTo: 1, fails: false, color: "k2" },
    { mark: "2", upTo: 1.5, fails: false, color: "k4" },
    { mark: "3", upTo: 2, fails: false, color: "k5" },
    { mark: "4", upTo: 4, fails: true, color: "k6" },
    { mark: "6", upTo: 10, fails: true, color: "k7" },
    { mark: "X", upTo: Infinity, fails: true, color: "k8" },
  ],
  quantity: "RMSE against the reference over 10 to 30 s",
  limit_deg: 2,
  judgesSwing: false,
  largestName: "Largest error, 10 to 30 s",
  downTitle: "Longest extrapolation",
  downAxis: "extrapolation (ms)",
  downName: (name) => (name === "hold" ? "hold the last setpoint" : `${name} ms`),
  acrossTitle: "Setpoints lost",
  acrossUnit: "%",
  chosen: { panel: 1, row: 5, column: 10 },
  summary:
    "The host sends the reference, 45 ± 40° at 0.2 Hz, 90 times a second, and a share of " +
    "these setpoints is lost at random. The device holds the last one, or extrapolates it for " +
    "a while.",
  differences:
    "The map averages the mean squares of 3 seeds (16 for the setpoint track alone) and runs " +
    "the controller alone on a finger whose sensor has no noise. The live trace is one run of " +
    "the whole device, which lowers its gain when it detects a limit cycle. This page sends " +
    "each setpoint that is not lost, with the rate between it and the last one sent, as the " +
    "device estimates it. The sensor has 0.3° of noise and a resolution of 0.1°, and the " +
    "board's converter reads it; without losses the error is about half a degree larger than " +
    "in the map. Other setpoints are lost than in the map, and with few setpoints left the " +
    "result depends much on the seed. For the setpoint track alone, the live number is the " +
    "error of the reference that the device reports, under the default controller.",
};

const MARKS_TEXT =
  "The mark of a cell is a class of its number (QUANTITY), not the number itself. Click a cell, " +
  "or move through a map with the arrow keys.";

const TERMS: [string, string][] = [
  [
    "Super-twisting",
    "a nonlinear controller whose root and sign of the error resist disturbances of bounded " +
      "rate; with the lag and delay of a muscle it ends in a small steady oscillation",
  ],
  [
    "Default controller",
    "super-twisting with feed-forward, a predictor of the delay, and learning, as a wearer file " +
      "configures them; super-twisting alone has no wearer file",
  ],
  ["PID", "acts on the error, its integral and its rate; the usual controller of industry"],
  [
    "Paper's controller",
    "super-twisting as Hamana 2022 prints it, with the sign of one equation reversed; these two " +
      "maps do not have it",
  ],
  [
    "Theory",
    "a calculation without simulation: for strength and delay the describing function, which " +
      "predicts steady oscillations; for lost setpoints the expected error of the setpoints",
  ],
];

export function mountStability(root: HTMLElement, simulator: Simulator): void {
  const runs = new Latest(300);
  let study = GAIN_DELAY;
  let seed = 1;

  const common = { unit: "angle (°)", height: 260, range: [-5, 105] as [number, number] };
  const angle = { label: "angle", color: "s1" };
  const reference = { label: "reference", color: "ink", dash: [6, 4], width: 1.5 };
  const strengthPlot = new Plot({
    ...common,
    title: "Reference and angle of the simulated finger over time",
    lines: [angle, reference],
  });
  const lossPlot = new Plot({
    ...common,
    title: "Reference, reference that the device follows, and angle of the finger over time",
    lines: [angle, { label: "reference in the device", color: "s2", width: 1.5 }, reference],
  });
  const trace = make("div", {});
  const plot = ({ t_s, reference, angle, followed }: Outcome): void => {
    if (study === LOSS) {
      lossPlot.set(t_s, angle, followed, reference);
    } else {
      strengthPlot.set(t_s, angle, reference);
    }
  };
  const summary = make("p", {});
  const differences = make("p", { class: "note" });
  const controls = make("div", {});
  const picture = make("div", { class: "maps" });
  const legend = make("div", {});
  const stated = make("div", { "aria-live": "polite" });
  const live = status();
  const outcome = make("div", {});

  const run = async (isStale: () => boolean): Promise<void> => {
    const { panel, row, column } = study.chosen;
    const shown = study;
    const name = shown.map.panels[panel].rows[row].name;
    const across = shown.map.across[column];
    live.textContent = "Simulating …";
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const progress = (outcome: Outcome): void => {
      if (!still && !isStale()) {
        plot(outcome);
      }
    };
    try {
      const result =
        shown === GAIN_DELAY
          ? await playStrength(
              simulator,
              { panel, gain: Number(name), delay_ms: across },
              shown.limit_deg,
              isStale,
              progress,
            )
          : await playLoss(
              simulator,
              { panel, hold: name, lost_pct: across, seed },
              isStale,
              progress,
            );
      if (!result || isStale()) {
        return;
      }
      plot(result);
      const cell = shown.map.panels[panel].rows[row].cells[column];
      live.textContent = liveText(result, cell, shown);
      const events = result.events.map(([t_s, text]) =>
        make("li", {}, `${show(t_s)} s: ${text}`),
      );
      const numbers = result.numbers.map(([label, deg]): [string, string] => [
        label,
        deg === null ? "–" : `${show(deg)}°`,
      ]);
      const { largest } = result;
      const size = largest ? `${show(largest.deg)}° at ${show(largest.t_s)} s` : "–";
      outcome.replaceChildren(
        facts([...numbers, [shown.largestName, size]]),
        ...(result.note ? [make("p", { class: "note" }, result.note)] : []),
        ...(events.length > 0
          ? [make("p", {}, "The device reported:"), make("ul", {}, ...events)]
          : []),
      );
    } catch (error) {
      live.textContent = `✗ ${messageOf(error)}`;
      outcome.replaceChildren();
    }
  };

  const choose = (chosen: Partial<Study["chosen"]>): void => {
    Object.assign(study.chosen, chosen);
    const { panel, row, column } = study.chosen;
    controller.select.value = String(panel);
    rows.select.value = String(row);
    columns.set(column);
    for (const svg of drawings) {
      mapSelection(svg, study.chosen);
    }
    stated.replaceChildren(...stateOf(study));
    runs.ask(run);
  };

  let drawings: SVGSVGElement[] = [];
  let controller: ReturnType<typeof choice>;
  let rows: ReturnType<typeof choice>;
  let columns: ReturnType<typeof slider>;

  const open = (next: Study): void => {
    study = next;
    const { map, chosen } = study;
    summary.textContent = study.summary;
    differences.textContent = study.differences;
    trace.replaceChildren((study === LOSS ? lossPlot : strengthPlot).element);
    controller = choice({
      label: "Controller",
      values: map.panels.map((panel, index) => [String(index), panel.title]),
      value: String(chosen.panel),
      change: (value) => choose({ panel: Number(value) }),
    });
    rows = choice({
      label: study.downTitle,
      values: map.panels[0].rows.map((row, index) => [String(index), next.downName(row.name)]),
      value: String(chosen.row),
      change: (value) => choose({ row: Number(value) }),
    });
    columns = slider({
      label: study.acrossTitle,
      min: 0,
      max: map.across.length - 1,
      step: 1,
      value: chosen.column,
      format: (value) => `${next.map.across[value]} ${next.acrossUnit}`,
      change: (value) => choose({ column: value }),
    });
    drawings = map.panels.map((panel, index) =>
      mapDrawing(study, panel, (row, column) => choose({ panel: index, row, column })),
    );
    drawings.forEach((svg, index) => {
      svg.setAttribute("data-panel", String(index));
      mapKeys(svg, next, (row, column) => choose({ panel: index, row, column }));
    });
    picture.replaceChildren(
      ...drawings.map((svg, index) =>
        make("figure", {}, make("figcaption", {}, map.panels[index].title), svg),
      ),
    );
    legend.replaceChildren(
      make("p", { class: "note" }, MARKS_TEXT.replace("QUANTITY", study.quantity)),
      mapLegend(study.classes),
    );
    controls.replaceChildren(controller.element, rows.element, columns.element, ...seedControl());
    choose({});
  };

  const seedControl = (): HTMLElement[] =>
    study === LOSS
      ? [
          slider({
            label: "Seed of the random losses",
            min: 1,
            max: 20,
            step: 1,
            value: seed,
            format: String,
            change: (value) => {
              seed = value;
              runs.ask(run);
            },
          }).element,
        ]
      : [];

  const which = choice({
    label: "Map",
    values: [
      ["gain_delay", "strength and delay of the finger"],
      ["loss", "lost setpoints"],
    ],
    value: "gain_delay",
    change: (value) => open(value === "loss" ? LOSS : GAIN_DELAY),
  });
  root.append(
    summary,
    which.element,
    make("div", { class: "panel" }, picture, legend),
    make(
      "div",
      { class: "columns" },
      make("div", { class: "panel" }, make("h3", {}, "Chosen cell"), controls, stated),
      make("div", { class: "panel" }, make("h3", {}, "Live trace"), trace, live, outcome),
    ),
    make("h3", {}, "Words"),
    terms(TERMS),
    make("h3", {}, "How the live trace differs from the map"),
    differences,
    make(
      "p",
      { class: "note" },
      "Simulated; the maps are docs/maps/gain_delay.csv and docs/maps/loss.csv.",
    ),
  );
  open(GAIN_DELAY);
}

export type { Study };

function chosenCell({ map, chosen }: Study): MapCell {
  return map.panels[chosen.panel].rows[chosen.row].cells[chosen.column];
}

function stateOf(study: Study): HTMLElement[] {
  const cell = chosenCell(study);
  const limit = `limit: ${study.limit_deg}°`;
  const predicted = cell.predicted === null ? "" : `${show(cell.predicted)}°`;
  const theory =
    cell.predictedFails === null
      ? "no prediction"
      : [predicted, verdict(cell.predictedFails)].filter((text) => text !== "").join(", ");
  const disagrees = cell.predictedFails !== null && cell.predictedFails !== cell.fails;
  return [
    facts([
      ["Map", `${show(cell.number)}°, ${verdict(cell.fails)} (${limit})`],
      ["Theory", `${theory}${disagrees ? " ● map disagrees with theory" : ""}`],
    ]),
    make("p", { class: "note" }, `Number of the map: ${study.quantity}.`),
  ];
}
