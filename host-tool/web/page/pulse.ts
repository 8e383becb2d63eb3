// A pulse: its course at the output of the simulated device, and the limits that it has to respect.

import { EDGE_STATES, CallError, Mistake, SessionInfo, Simulator } from "./api";
import { choice, make } from "./dom";
import { Edge, drawPulse } from "./pulse_drawing";
import {
  CODES,
  FIELDS,
  FULL_SCALE_MA,
  FieldName,
  LIMITS,
  PulseValues,
  flaw,
  notesOf,
  sessionLines,
} from "./pulse_session";
import { stackTable } from "./understand_layout";
import {
  Latest,
  NumberField,
  fitWidth,
  messageOf,
  numberField,
  show,
  status,
} from "./understand_tools";

// Largest rms current density under an electrode, mA/cm².
const DENSITY = 2;
// Shortest grounding after a monophasic pulse, µs.
const LEAST_GROUNDING_US = 1000;

function isBiphasic(shape: string): boolean {
  return shape.startsWith("biphasic");
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
  let shown: { values: PulseValues; edges: Edge[] | null; refused: Set<string> } | null = null;
  let width = 640;
  const redraw = (): void => {
    if (!shown) {
      return;
    }
    const { values, edges, refused } = shown;
    const flawed = flawedField(values);
    const text = `Nothing is drawn: “${flawed?.[0]}” is ${flawed?.[1]}.`;
    picture.replaceChildren(
      flawed ? make("p", {}, text) : drawPulse(values, edges, refused, width),
    );
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

  // A monophasic pulse has no gap, and has to be grounded. Gap and grounding of the biphasic
  // pulse come back with it.
  const kept: [FieldName, string][] = [];
  const chooseShape = (next: string): void => {
    const field = (name: FieldName): HTMLInputElement => fields.get(name)!.input;
    if (isBiphasic(shape) && !isBiphasic(next)) {
      kept.length = 0;
      kept.push(["gap_us", field("gap_us").value], ["ground_us", field("ground_us").value]);
      field("gap_us").value = "0";
      if (!(Number(field("ground_us").value) >= LEAST_GROUNDING_US)) {
        field("ground_us").value = String(LEAST_GROUNDING_US);
      }
    } else if (!isBiphasic(shape) && isBiphasic(next)) {
      kept.forEach(([name, value]) => (field(name).value = value));
    }
    field("gap_us").disabled = !isBiphasic(next);
    shape = next;
    ask();
  };
  const shapes = choice({
    label: "Shape",
    values: [
      ["biphasic-cathodic-first", "biphasic, cathodic first"],
      ["biphasic-anodic-first", "biphasic, anodic first"],
      ["monophasic-cathodic", "monophasic, cathodic"],
      ["monophasic-anodic", "monophasic, anodic"],
    ],
    value: shape,
    change: chooseShape,
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
    const noted = notesOf(values, mistakes, lines);
    showMistakes(noted, fields, shapeNotes);
    shown = { values, edges, refused: new Set(noted.keys()) };
    redraw();
    explained.replaceChildren(...explain(values, edges));
    const rows = limitRows(values, mistakes);
    const asked = "this pulse, as requested";
    const heads = ["limit of", asked, "allowed", "result (rule)", "computed as"];
    const cells = rows.map((row) => row.cells);
    limits.replaceChildren(stackTable("Limits", heads, cells));
    if (info !== null) {
      const notes = info.notes.map((note) => ` ${note}.`).join("");
      verdict.textContent = `✓ The device accepts this pulse.${notes}${failure}`;
      return;
    }
    const rules = [...new Set(mistakes.map((mistake) => mistake.number))];
    const further = rows.filter((row) => row.isExceeded && !rules.includes(row.number)).length;
    const names = further === 1 ? "further limit" : "further limits";
    const beside = failure === "" ? [", ", linkToMistake(root)] : [failure];
    verdict.replaceChildren(
      `✗ The device refuses this pulse: ${rules.join(", ")}`,
      ...beside,
      further > 0 ? `, and ${further} ${names} in the table.` : ".",
    );
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
        make(
          "p",
          { class: "note" },
          "A monophasic pulse has no gap, and is grounded for at least " +
            `${LEAST_GROUNDING_US} µs so that its charge flows back.`,
        ),
      ),
      make("div", { class: "panel" }, make("h3", {}, "Limits of the wearer"), ...panels[1], limits),
    ),
    make("details", {}, make("summary", {}, "Session text that is checked"), source),
    make(
      "p",
      { class: "note" },
      `Simulated, on a current stage of ${FULL_SCALE_MA} mA full scale. The verdict is that of ` +
        "flexor check, which names one broken limit at a time; the table compares all of them.",
    ),
  );
  ask();
}

// The label of a field that cannot be computed with, and why.
function flawedField(values: PulseValues): [string, string] | null {
  const field = [...FIELDS, ...LIMITS].find(([name]) => flaw(values[name]) !== "");
  return field ? [field[1], flaw(values[field[0]])] : null;
}

// Leads to the first refused field. The fragment of the address names the part, and stays.
function linkToMistake(root: HTMLElement): HTMLElement {
  const click = (event: Event): void => {
    event.preventDefault();
    const invalid = root.querySelector<HTMLElement>('input[aria-invalid="true"]');
    const field = invalid ?? root.querySelector<HTMLElement>("select");
    field?.focus();
    field?.scrollIntoView({ block: "center" });
  };
  // Focus at the press of the mouse could scroll the link away before the click.
  const mousedown = (event: Event): void => event.preventDefault();
  const attributes = { href: "#understand/pulse", click, mousedown };
  return make("a", attributes, "shown beside the controls");
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
        const amplitude_ma = (code / CODES) * FULL_SCALE_MA;
        edges.push({ t_us: t_us - period_us, state: EDGE_STATES[state], amplitude_ma });
      }
    }
    return edges;
  } finally {
    await simulator.drop(id);
  }
}

function showMistakes(
  noted: Map<string, string[]>,
  fields: Map<FieldName, NumberField>,
  shapeNotes: HTMLElement,
): void {
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
  const phases = isBiphasic(shape) ? 2 : 1;
  return amplitude_ma * Math.sqrt(phases * width_us * 1e-6 * frequency_hz);
}

function explain(values: PulseValues, edges: Edge[] | null): HTMLElement[] {
  if (flawedField(values)) {
    return [];
  }
  if (!edges) {
    const text = "Dashed, in scale: the pulse as requested, which the device does not output.";
    return [make("p", {}, text)];
  }
  const amplitude = show(edges[0]?.amplitude_ma ?? 0);
  const charge = ((edges[0]?.amplitude_ma ?? 0) * values.width_us) / 1000;
  const polarity = values.shape.includes("anodic") ? "anodic" : "cathodic";
  const gap_us = isBiphasic(values.shape) && edges.length > 2 ? edges[2].t_us - edges[1].t_us : 0;
  const first =
    `The first phase is ${polarity}: ${amplitude} mA for ` +
    `${show(values.width_us)} µs carry ${amplitude} × ` +
    `${show(values.width_us)} / 1000 = ${show(charge)} µC.`;
  const second = isBiphasic(values.shape)
    ? ` After a gap of ${gap_us} µs the second phase returns the same charge.` +
      (values.gap_us < gap_us ? " The device keeps a gap of at least 5 µs." : "")
    : " There is no second phase: the grounding afterwards lets the charge flow back.";
  const period_ms = 1000 / values.frequency_hz;
  const rest = ` The next pulse begins ${show(period_ms)} ms after this one.`;
  const rounded =
    amplitude === show(values.amplitude_ma)
      ? ""
      : `The device rounds down to the steps of its converter, ${show(FULL_SCALE_MA / CODES)} ` +
        `mA: of the requested ${show(values.amplitude_ma)} mA it outputs ${amplitude} mA.`;
  return [make("p", {}, first + second + rest), ...(rounded ? [make("p", {}, rounded)] : [])];
}

interface LimitRow {
  number: string;
  isExceeded: boolean;
  cells: string[];
}

function limitRows(values: PulseValues, mistakes: Mistake[]): LimitRow[] {
  const { amplitude_ma, width_us, frequency_hz } = values;
  const charge = (amplitude_ma * width_us) / 1000;
  const rms = rmsOf(values);
  const factor = isBiphasic(values.shape) ? "2 × " : "";
  const density = (values.area_mm2 / 100) * DENSITY;
  const rmsRule = `amplitude × √(${factor}width × rate)`;
  const ofRms = [amplitude_ma, width_us, frequency_hz];
  // Each with the values from which the number of the pulse is computed.
  const rows: [string, string, number[], number, number, string, string][] = [
    ["E450", "Current", [amplitude_ma], amplitude_ma, values.max_current_ma, "mA", "amplitude"],
    [
      "E451",
      "Charge of a phase",
      [amplitude_ma, width_us],
      charge,
      values.max_charge_uc,
      "µC",
      "amplitude × width",
    ],
    ["E452", "Rms current", ofRms, rms, values.max_rms_ma, "mA", rmsRule],
    [
      "E454",
      "Rms under the electrode",
      ofRms,
      rms,
      density,
      "mA",
      `the same, at most ${DENSITY} mA/cm²`,
    ],
  ];
  return rows.map(([number, name, parts, value, limit, unit, rule]) => {
    const isNamed = mistakes.some((mistake) => mistake.number === number);
    const flaws = parts.map(flaw).filter((text) => text !== "");
    const text = (number: number, flawed: string): string =>
      flawed === "" ? `${show(number, 4)} ${unit}` : flawed;
    const [is, allowed] = [text(value, flaws[0] ?? ""), text(limit, flaw(limit))];
    const isKnown = flaws.length === 0 && flaw(limit) === "";
    const isExceeded = isKnown && (isNamed || value > limit);
    const result = !isKnown ? "✗ cannot be compared" : isExceeded ? "✗ above" : "✓ within";
    return { number, isExceeded, cells: [name, is, allowed, `${result} (${number})`, rule] };
  });
}
