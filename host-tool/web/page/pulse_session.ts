// The fields of the part "A pulse", the session text of their values, and mistakes in it.

import { Mistake } from "./api";

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

export type FieldName = Exclude<keyof PulseValues, "shape">;
export const FULL_SCALE_MA = 100;
// Steps of the device's converter over the full scale.
export const CODES = 65535;

// Each with its label, its unit, and its value at the beginning.
export const FIELDS: [FieldName, string, string, number][] = [
  ["amplitude_ma", "Amplitude", "mA", 20],
  ["width_us", "Width of a phase", "µs", 200],
  ["gap_us", "Gap between the phases", "µs", 100],
  ["ground_us", "Grounding after the pulse", "µs, 0 for none", 0],
  ["frequency_hz", "Pulse rate", "Hz", 50],
];
export const LIMITS: [FieldName, string, string, number][] = [
  ["max_current_ma", "Largest current", "mA", 50],
  ["max_charge_uc", "Largest charge of a phase", "µC", 10],
  ["max_rms_ma", "Largest rms current", "mA", 10],
  ["area_mm2", "Area of the electrode", "mm²", 800],
];
// Keys of the session file, by which mistakes name these fields.
const KEYS: [string, FieldName][] = [
  ["channel.limit", "amplitude_ma"],
  ["channel.start", "amplitude_ma"],
  ["setpoints.values.value", "amplitude_ma"],
  ["channel.train.width_us", "width_us"],
  ["channel.train.gap_us", "gap_us"],
  ["channel.train.ground_us", "ground_us"],
  ["channel.train.frequency_hz", "frequency_hz"],
  ["channel.area_mm2", "area_mm2"],
  ["area_mm2", "area_mm2"],
  ["wearer.max_current_ma", "max_current_ma"],
  ["wearer.max_charge_uc", "max_charge_uc"],
  ["wearer.max_rms_ma", "max_rms_ma"],
];

export type Line = [string, FieldName | "shape" | null];

// Lines of the session text, each with the field that it holds.
export function sessionLines(values: PulseValues): Line[] {
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

// Says why a value cannot be computed with; empty if it can.
export function flaw(value: number): string {
  return !Number.isFinite(value) ? "not a number" : value < 0 ? "a negative number" : "";
}

// Texts about the fields of a pulse, by field.
export function notesOf(
  values: PulseValues,
  mistakes: Mistake[],
  lines: Line[],
): Map<string, string[]> {
  const noted = new Map<string, string[]>();
  const note = (name: string, text: string): void => {
    const texts = noted.get(name) ?? [];
    // A value that occurs twice in the text is mistaken twice.
    if (!texts.some((known) => known.slice(0, 6) === text.slice(0, 6))) {
      noted.set(name, [...texts, text]);
    }
  };
  for (const { number, line, message, help } of mistakes) {
    const name = (line === null ? null : lines[line - 1]?.[1]) ?? "shape";
    if (name !== "shape" && !Number.isFinite(values[name])) {
      note(name, `✗ ${number}: ${labelOf(name)} is not a number`);
      continue;
    }
    // The limit of the channel is the amplitude in this part.
    const remedy = help ? ` — ${help.replace("the limit", "the amplitude")}` : "";
    note(name, `✗ ${number}: ${inWords(message)}${remedy}`);
    // The other fields that the rule names.
    for (const [key, other] of KEYS) {
      if (other !== name && message.includes(`\`${key}\``)) {
        note(other, `✗ ${number}: this limit is exceeded`);
      }
    }
  }
  return noted;
}

function labelOf(name: FieldName): string {
  return [...FIELDS, ...LIMITS].find(([field]) => field === name)?.[1] ?? name;
}

// Puts the label of a field before its key of the session file.
function inWords(message: string): string {
  const words = message.replace(/(\(?)`([a-z_.]+)`/g, (whole, open, key) => {
    const name = KEYS.find(([known]) => known === key)?.[1];
    const label = name ? labelOf(name).toLowerCase() : "";
    return !name ? whole : open ? `(${label}, ${key}` : `${label} (${key})`;
  });
  // The amplitude is also printed in the unit of the stage, which is the same here.
  const short = words.replace(/([\d.]+ mA) \(\1\)/, "$1");
  return short.charAt(0).toUpperCase() + short.slice(1);
}
