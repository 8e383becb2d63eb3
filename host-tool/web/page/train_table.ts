// Numbers of the forces of a pulse train.

import { stackTable } from "./understand_layout";
import { facts, show } from "./understand_tools";
import { make } from "./dom";

export interface ForceRow {
  t_s: number;
  device_n: number;
  exact_n: number;
}

// Joins the columns of an answer by time. The exact column can have a row more than the others.
export function rowsOf(answer: {
  t_s: number[];
  device_n: (number | null)[];
  exact_n: (number | null)[];
}): ForceRow[] {
  return answer.t_s.flatMap((t_s, index) => {
    const device_n = answer.device_n[index] ?? NaN;
    const exact_n = answer.exact_n[index] ?? NaN;
    const isComplete = [t_s, device_n, exact_n].every(Number.isFinite);
    return isComplete ? [{ t_s, device_n, exact_n }] : [];
  });
}

// Time at which the exact force first reaches half of its peak, s; null without a force.
export function halfPeakTime(rows: ForceRow[]): number | null {
  const half = rows.reduce((peak, row) => Math.max(peak, row.exact_n), 0) / 2;
  return half > 0 ? (rows.find((row) => row.exact_n >= half)?.t_s ?? null) : null;
}

function integral(rows: ForceRow[], forces: number[]): number {
  let sum = 0;
  for (let i = 1; i < rows.length; i++) {
    sum += ((forces[i] + forces[i - 1]) / 2) * (rows[i].t_s - rows[i - 1].t_s);
  }
  return sum;
}

// `regular` has the forces of the train with a regular first interval, where it differs.
export function forceTable(
  rows: ForceRow[],
  regular: ForceRow[] | null,
  times_ms: number[],
): HTMLElement {
  const device = rows.map((row) => row.device_n);
  const exact = rows.map((row) => row.exact_n);
  const peakOf = (forces: number[]): number => forces.reduce((a, b) => Math.max(a, b), 0);
  // The train lasts as long after its last pulse as its last interval.
  const last = times_ms.at(-1) ?? 0;
  const interval = times_ms.length > 1 ? last - (times_ms.at(-2) ?? 0) : 0;
  const end = Math.min((last + interval) / 1000, rows.at(-1)?.t_s ?? 0);
  const begin = Math.max(0, end - 0.2);
  const meanOf = (forces: number[]): number => {
    const chosen = forces.filter((_, i) => rows[i].t_s >= begin && rows[i].t_s <= end);
    return chosen.reduce((sum, n) => sum + n, 0) / Math.max(1, chosen.length);
  };
  const row = (name: string, unit: string, of: (forces: number[]) => number): string[] => {
    const [a, b] = [of(device), of(exact)];
    const error = b > 0 ? `${show(((a - b) / b) * 100, 2)} %` : "–";
    return [name, `${show(a, 4)} ${unit}`, `${show(b, 4)} ${unit}`, error];
  };
  const ms = (s: number | null | undefined): string =>
    s === null || s === undefined ? "–" : `${Math.round(s * 1000)} ms`;
  const peakTime = rows[exact.indexOf(peakOf(exact))]?.t_s;
  const half = "Time to 50 % of the peak";
  const comparison: [string, string][] = regular
    ? [
        [`${half}, with the own first interval`, ms(halfPeakTime(rows))],
        [`${half}, with a regular one`, ms(halfPeakTime(regular))],
        [
          "Exact peak with a regular first interval",
          `${show(peakOf(regular.map((row) => row.exact_n)), 4)} N`,
        ],
      ]
    : [[half, ms(halfPeakTime(rows))]];
  return make(
    "div",
    {},
    stackTable("Forces", ["", "device", "exact", "difference"], [
      row("Peak force", "N", peakOf),
      row("Mean of the train's last 200 ms", "N", meanOf),
      row("Force–time integral", "N·s", (forces) => integral(rows, forces)),
    ]),
    facts([
      ...comparison,
      ["Time of the peak", rows.length > 0 && peakOf(exact) > 0 ? ms(peakTime) : "–"],
      ["Last 200 ms", `${show(begin * 1000, 4)} to ${show(end * 1000, 4)} ms`],
    ]),
  );
}
