// A pulse: its course at the output of the simulated device, and the limits that it has to respect.

import { EDGE_STATES, CallError, Mistake, SessionInfo, Simulator } from "./api";
import { choice, make } from "./dom";
import { Edge, drawPulse } from "./pulse_drawing";
import {
  Latest,
  NumberField,
  fitWidth,
  messageOf,
  numberField,
  show,
  status,
} from "./understand_tools";

export interface PulseValues {
  shape: string;
  amplitude_ma: number;
  width_us: number;
  gap_us: number;
  ground_us: number;
  frequency_hz: number;
  area_mm2: number;
  max_current_ma: number;
  max_charge_uc: number;
  max_rms_ma: number;
}

type FieldName = Exclude<keyof PulseValues, "shape">;
const FULL_SCALE_MA = 100;
// Largest rms current density under an electrode, mA/cm².
const DENSITY = 2;

const FIELDS: [FieldName, string, string, number][] = [
  ["amplitude_ma", "Amplitude", "mA", 20],
  ["width_us", "Width of a phase", "µs", 200],
  ["gap_us", "Gap between the phases", "µs", 100],
  ["ground_us", "Grounding after the pulse", "µs, 0 for none", 0],
  ["frequency_hz", "Pulse rate", "Hz", 50],
];
const LIMITS: [FieldName, string, string, number][] = [
  ["max_current_ma", "Largest current", "mA", 50],
  ["max_charge_uc", "Largest charge of a phase", "µC", 10],
  ["max_rms_ma", "Largest rms current", "mA", 10],
  ["area_mm2", "Area of the electrode", "mm²", 800],
];
// Keys of the session file, by which mistakes name these fields.
const KEYS: Record<FieldName, string> = {
  amplitude_ma: "channel.limit",
  width_us: "channel.train.width_us",
  gap_us: "channel.train.gap_us",
  ground_us: "channel.train.ground_us",
  frequency_hz: "channel.train.frequency_hz",
  area_mm2: "channel.area_mm2",
  max_current_ma: "wearer.max_current_ma",
  max_charge_uc: "wearer.max_charge_uc",
  max_rms_ma: "wearer.max_rms_ma",
};

// Lines of the session text, each with the field that it holds.
function sessionLines(values: PulseValues): [string, FieldName | "shape" | null][] {
  const amplitude = toml(values.amplitude_ma);
  return [
    ['title = "A pulse"', null],
    ["duration_s = 10.0", null],
    ["[wearer]", null],
    [`max_current_ma = ${toml(values.max_current_ma)}`, "max_current_ma"],
    [`max_charge_uc = ${toml(values.max_charge_uc)}`, "max_charge_uc"],
    [`max_rms_ma = ${toml(values.max_rms_ma)}`, "max_rms_ma"],
    ["[[channel]]", null],
    ["number = 1", null],
    ['name = "pulse"', null],
    [`stage = { kind = "current", full_scale_ma = ${FULL_SCALE_MA}.0 }`, null],
    [`limit = ${amplitude}`, "amplitude_ma"],
    [`start = ${amplitude}`, "amplitude_ma"],
    [`area_mm2 = ${toml(values.area_mm2)}`, "area_mm2"],
    ["[channel.train]", null],
    [`shape = "${values.shape}"`, "shape"],
    [`width_us = ${toml(values.width_us)}`, "width_us"],
    [`gap_us = ${toml(values.gap_us)}`, "gap_us"],
    [`ground_us = ${toml(values.ground_us)}`, "ground_us"],
    [`frequency_hz = ${toml(values.frequency_hz)}`, "frequency_hz"],
    ["[setpoints]", null],
    ['kind = "amplitudes"', null],
    [`values = [{ channel = 1, value = ${amplitude} }]`, "amplitude_ma"],
    ["rate_hz = 50", null],
  ];
}

// A number as TOML, which calls what is not a number `nan`.
function toml(value: number): string {
  return Number.isFinite(value) ? String(value) : "nan";
}

export function mountPulse(root: HTMLElement, simulator: Simulator): void {
  const runs = new Latest(150);
  let shape = "biphasic-cathodic-first";
  const picture = make("div", { class: "scroll" });
  const verdict = status();
  const explained = make("div", {});
  const limits = make("div", {});
  const shapeNotes = make("div", { class: "mistakes", "aria-live": "polite" });
  const source = make("pre", { class: "mono scroll", tabindex: "0", "aria-label": "Session" });
  const fields = new Map<FieldName, NumberField>();

  const read = (): PulseValues => {
    const value = (name: FieldName): number => {
      const text = fields.get(name)?.input.value ?? "";
      return text === "" ? NaN : Number(text);
    };
    const names = [...FIELDS, ...LIMITS].map(([name]) => [name, value(name)]);
    return { shape, ...Object.fromEntries(names) } as PulseValues;
  };
  const ask = (): void => runs.ask(update);
  let shown: { values: PulseValues; edges: Edge[] | null } | null = null;
  let width = 640;
  const redraw = (): void => {
    if (shown) {
      picture.replaceChildren(drawPulse(shown.values, shown.edges, width));
    }
  };
  fitWidth(picture, 290, 960, (next) => {
    width = next;
    redraw();
  });
  const panels = [FIELDS, LIMITS].map((list) =>
    list.map(([name, label, unit, value]) => {
      const field = numberField({ label, unit, value, change: ask });
      fields.set(name, field);
      return field.element;
    }),
  );
  const shapes = choice({
    label: "Shape",
    values: [
      ["biphasic-cathodic-first", "biphasic, cathodic first"],
      ["biphasic-anodic-first", "biphasic, anodic first"],
      ["monophasic-cathodic", "monophasic, cathodic"],
      ["monophasic-anodic", "monophasic, anodic"],
    ],
    value: shape,
    change: (value) => {
      shape = value;
      ask();
    },
  });

  const update = async (isStale: () => boolean): Promise<void> => {
    const values = read();
    const lines = sessionLines(values);
    const text = lines.map(([line]) => line).join("\n") + "\n";
    source.textContent = text;
    let mistakes: Mistake[] = [];
    let info: SessionInfo | null = null;
    let edges: Edge[] | null = null;
    let failure = "";
    try {
      info = await simulator.check("pulse.toml", text);
    } catch (error) {
      mistakes = error instanceof CallError ? error.mistakes : [];
      failure = mistakes.length > 0 ? "" : messageOf(error);
    }
    try {
      edges = info && (await play(simulator, text, info));
    } catch (error) {
      failure = ` Its output cannot be shown: ${messageOf(error)}`;
    }
    if (isStale()) {
      return;
    }
    showMistakes(mistakes, lines, fields, shapeNotes);
    shown = { values, edges };
    redraw();
    explained.replaceChildren(...explain(values, edges));
    limits.replaceChildren(limitTable(values, mistakes));
    const notes = info?.notes.map((note) => ` ${note}.`).join("") ?? "";
    const rules = [...new Set(mistakes.map((mistake) => mistake.number))].join(", ");
    verdict.textContent =
      info !== null
        ? `✓ The device accepts this pulse.${notes}${failure}`
        : `✗ The device refuses this pulse: ${failure || `${rules}, shown beside the controls`}.`;
  };

  root.append(
    make(
      "p",
      {},
      "The drawing shows one pulse as the simulated device outputs it; the colored areas are " +
        "the charge of each phase. Change the pulse or the limits of the wearer, and the device " +
        "accepts the pulse or says which rule it breaks.",
    ),
    make("div", { class: "panel" }, picture, verdict, explained),
    make(
      "div",
      { class: "columns" },
      make(
        "div",
        { class: "panel" },
        make("h3", {}, "Pulse"),
        shapes.element,
        shapeNotes,
        ...panels[0],
      ),
      make("div", { class: "panel" }, make("h3", {}, "Limits of the wearer"), ...panels[1], limits),
    ),
    make("details", {}, make("summary", {}, "Session text that is checked"), source),
    make(
      "p",
      { class: "note" },
      `Simulated, on a current stage of ${FULL_SCALE_MA} mA full scale. The verdict is that of ` +
        "flexor check.",
    ),
  );
  ask();
}

// Runs the session for two periods and returns the edges of its second pulse.
async function play(simulator: Simulator, text: string, info: SessionInfo): Promise<Edge[]> {
  const { id } = await simulator.open({ name: "pulse.toml", text, seed: 1 });
  try {
    const period_us = info.channels[0].period_us;
    const news = await simulator.advance(id, 2 * period_us + 5000);
    const edges: Edge[] = [];
    const numbers = news.edges ?? [];
    for (let at = 0; at + 3 < numbers.length; at += 4) {
      const [t_us, , state, code] = numbers.slice(at, at + 4);
      if (t_us >= period_us && t_us < 2 * period_us) {
        const amplitude_ma = (code / 65535) * FULL_SCALE_MA;
        edges.push({ t_us: t_us - period_us, state: EDGE_STATES[state], amplitude_ma });
      }
    }
    return edges;
  } finally {
    await simulator.drop(id);
  }
}

function showMistakes(
  mistakes: Mistake[],
  lines: [string, FieldName | "shape" | null][],
  fields: Map<FieldName, NumberField>,
  shapeNotes: HTMLElement,
): void {
  const noted = new Map<string, string[]>();
  const note = (name: string, text: string): void => {
    const texts = noted.get(name) ?? [];
    // A value that occurs twice in the text is mistaken twice.
    if (!texts.some((known) => known.slice(0, 6) === text.slice(0, 6))) {
      noted.set(name, [...texts, text]);
    }
  };
  for (const { number, line, message, help } of mistakes) {
    const name = line === null ? null : lines[line - 1]?.[1];
    note(name ?? "shape", `✗ ${number}: ${message}${help ? ` — ${help}` : ""}`);
    // The other fields that the rule names.
    for (const [other, key] of Object.entries(KEYS)) {
      if (other !== name && message.includes(`\`${key.replace("channel.area", "area")}\``)) {
        note(other, `✗ ${number}: this limit is exceeded`);
      }
    }
  }
  const fill = (place: HTMLElement, name: string): boolean => {
    const texts = noted.get(name) ?? [];
    place.replaceChildren(...texts.map((text) => make("p", {}, text)));
    return texts.length > 0;
  };
  for (const [name, field] of fields) {
    field.input.setAttribute("aria-invalid", String(fill(field.notes, name)));
  }
  fill(shapeNotes, "shape");
}

function rmsOf({ amplitude_ma, width_us, frequency_hz, shape }: PulseValues): number {
  const phases = shape.startsWith("biphasic") ? 2 : 1;
  return amplitude_ma * Math.sqrt(phases * width_us * 1e-6 * frequency_hz);
}

function explain(values: PulseValues, edges: Edge[] | null): HTMLElement[] {
  if (!edges) {
    return [make("p", {}, "Dashed: the pulse as requested, which the device does not output.")];
  }
  const charge = (values.amplitude_ma * values.width_us) / 1000;
  const isBiphasic = values.shape.startsWith("biphasic");
  const polarity = values.shape.includes("anodic") ? "anodic" : "cathodic";
  const gap_us = isBiphasic && edges.length > 2 ? edges[2].t_us - edges[1].t_us : 0;
  const first =
    `The first phase is ${polarity}: ${show(values.amplitude_ma)} mA for ` +
    `${show(values.width_us)} µs carry ${show(values.amplitude_ma)} × ` +
    `${show(values.width_us)} / 1000 = ${show(charge)} µC.`;
  const second = isBiphasic
    ? ` After a gap of ${gap_us} µs the second phase returns the same charge.` +
      (values.gap_us < gap_us ? " The device keeps a gap of at least 5 µs." : "")
    : " There is no second phase: the grounding afterwards lets the charge flow back.";
  const period_ms = 1000 / values.frequency_hz;
  const rest = ` The next pulse begins ${show(period_ms)} ms after this one.`;
  return [make("p", {}, first + second + rest)];
}

function limitTable(values: PulseValues, mistakes: Mistake[]): HTMLElement {
  const charge = (values.amplitude_ma * values.width_us) / 1000;
  const rms = rmsOf(values);
  const phases = values.shape.startsWith("biphasic") ? "2 × " : "";
  const rows: [string, string, number, number, string, string][] = [
    ["E450", "Current", values.amplitude_ma, values.max_current_ma, "mA", "amplitude"],
    ["E451", "Charge of a phase", charge, values.max_charge_uc, "µC", "amplitude × width"],
    ["E452", "Rms current", rms, values.max_rms_ma, "mA", `amplitude × √(${phases}width × rate)`],
    [
      "E454",
      "Rms under the electrode",
      rms,
      (values.area_mm2 / 100) * DENSITY,
      "mA",
      `the same, at most ${DENSITY} mA/cm²`,
    ],
  ];
  const body = rows.map(([number, name, value, limit, unit, rule]) => {
    const isNamed = mistakes.some((mistake) => mistake.number === number);
    const symbol = isNamed || value > limit ? "✗ above" : "✓ within";
    const [is, allowed] = [`${show(value, 4)} ${unit}`, `${show(limit, 4)} ${unit}`];
    const texts = [is, allowed, `${symbol} (${number})`, rule];
    const cells = texts.map((text) => make("td", {}, text));
    return make("tr", {}, make("th", { scope: "row" }, name), ...cells);
  });
  const names = ["limit of", "this pulse", "allowed", "result (rule)", "computed as"];
  const heads = names.map((text) => make("th", { scope: "col" }, text));
  return make(
    "div",
    { class: "scroll", tabindex: "0", role: "group", "aria-label": "Table of limits" },
    make(
      "table",
      {},
      make("thead", {}, make("tr", {}, ...heads)),
      make("tbody", {}, ...body),
    ),
  );
}
