// The committed tables of docs/charts and docs/maps.

// Splits a table into rows of cells. The tables have no quotes.
export function parseCsv(text: string): string[][] {
  const lines = text.split(/\r?\n/).filter((line) => line !== "");
  return lines.map((line) => line.split(","));
}

// One setting of the accuracy–speed chart; docs/evidence/methods.md describes its columns.
export interface Setting {
  method: string;
  arithmetic: string;
  // Null for a method that goes from pulse to pulse.
  step_us: number | null;
  output_us: number;
  // Worst error of 140 trains, % of the peak; infinite if the method diverges.
  error_pct: number;
  cycles_per_s: number;
  front: boolean;
  reading: string;
  worst_tick_cycles: number;
}

export function parseAccuracy(text: string): Setting[] {
  const [head, ...rows] = parseCsv(text);
  const place = new Map(head.map((name, index) => [name, index]));
  return rows.map((row) => {
    const cell = (name: string): string => row[place.get(name) ?? -1] ?? "";
    const error = Number(cell("error_pct"));
    return {
      method: cell("method"),
      arithmetic: cell("arithmetic"),
      step_us: cell("step_us") === "" ? null : Number(cell("step_us")),
      output_us: Number(cell("output_us")),
      error_pct: Number.isFinite(error) ? error : Infinity,
      cycles_per_s: Number(cell("cycles_per_s")),
      front: cell("front") === "1",
      reading: cell("reading"),
      worst_tick_cycles: Number(cell("worst_tick_cycles")),
    };
  });
}

export interface MapCell {
  number: number;
  fails: boolean;
  // Null where theory predicts nothing.
  predicted: number | null;
  predictedFails: boolean | null;
}

export interface MapPanel {
  title: string;
  rows: { name: string; cells: MapCell[] }[];
}

export interface StabilityMap {
  // What the rows are, and what the columns are at.
  down: string;
  across: number[];
  panels: MapPanel[];
}

// Reads a map: each row of a panel has a line of numbers and one of verdicts, and the same two of
// theory.
export function parseMap(text: string): StabilityMap {
  const [head, ...lines] = parseCsv(text);
  const across = head.slice(3).map(Number);
  const found = new Map<string, Map<string, Map<string, number[]>>>();
  for (const [panel, row, value, ...cells] of lines) {
    const rows = found.get(panel) ?? new Map<string, Map<string, number[]>>();
    const values = rows.get(row) ?? new Map<string, number[]>();
    values.set(value, cells.map(numberOf));
    rows.set(row, values);
    found.set(panel, rows);
  }
  const panels = [...found].map(([title, rows]) => ({
    title,
    rows: [...rows].map(([name, values]) => ({
      name,
      cells: across.map((_, index) => cellOf(values, index)),
    })),
  }));
  return { down: head[1], across, panels };
}

function numberOf(text: string): number {
  const value = Number(text);
  return text !== "" && !Number.isNaN(value) ? value : Infinity;
}

function cellOf(values: Map<string, number[]>, index: number): MapCell {
  const at = (name: string): number | null => values.get(name)?.[index] ?? null;
  const predicted = at("predicted verdict");
  return {
    number: at("number") ?? Infinity,
    fails: (at("verdict") ?? 1) > 0,
    predicted: at("predicted number"),
    predictedFails: predicted === null ? null : predicted > 0,
  };
}
