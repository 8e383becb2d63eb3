// Replays a random wearer of a study: a row of its draws.csv, set in the session of a condition.

import type { Simulator } from "./api";
import { make } from "./dom";

// Largest file that is read, bytes.
const LONGEST = 20_000_000;
// Columns of draws.csv before the fields of a wearer.
const PLACE = ["unit", "wearer"];

interface Draws {
  columns: string[];
  rows: string[][];
}

// Session of a wearer, for the part "Sessions".
export interface ReplayedSession {
  name: string;
  label: string;
  text: string;
  seed: string;
}

export class DrawsPanel {
  readonly element: HTMLElement;
  private draws: Draws | null = null;
  private session: string | null = null;
  private seed: string | null = null;
  private readonly state = make("p", { class: "note", role: "status" });
  private readonly problem = make("p", { class: "trouble", role: "alert", hidden: true });
  private readonly row: HTMLInputElement;
  private readonly values = make("dl", { class: "draw-values" });
  private readonly show: HTMLButtonElement;

  constructor(
    private readonly simulator: Simulator,
    // Largest format of a record that is understood.
    private readonly format: number,
    private readonly receive: (session: ReplayedSession) => void,
  ) {
    const files = make("input", { type: "file", multiple: true, accept: ".csv,.json,.toml" });
    files.addEventListener("change", () => void this.read([...(files.files ?? [])]));
    this.row = make("input", { type: "number", min: "1", step: "1", value: "1" });
    this.row.addEventListener("input", () => this.showRow());
    this.show = make("button", { type: "button", click: () => void this.replay() }, "Show its session");
    this.show.disabled = true;
    this.element = make(
      "details",
      { class: "panel" },
      make("summary", {}, "Replay a random wearer of a study"),
      make(
        "p",
        {},
        "Open or drop three files of the study's folder: draws.csv, sweep.json (it has the seed), and ",
        "session.toml of a recorded trial of the condition that you want. A row of draws.csv is a ",
        "wearer; its numbers are set in the session, and its noise is that of the study.",
      ),
      make("div", { class: "row" }, make("label", {}, "Files ", files)),
      make("div", { class: "row" }, make("label", {}, "Row of draws.csv ", this.row), this.show),
      this.state,
      this.values,
      this.problem,
    );
    this.element.addEventListener("dragover", (event) => event.preventDefault());
    this.element.addEventListener("drop", (event) => {
      event.preventDefault();
      void this.read([...(event.dataTransfer?.files ?? [])]);
    });
    this.tell();
  }

  private async read(files: File[]): Promise<void> {
    this.problem.hidden = true;
    for (const file of files) {
      if (file.size > LONGEST) {
        this.fail(`${file.name} has more than ${LONGEST / 1e6} MB`);
        continue;
      }
      const text = await file.text();
      try {
        if (file.name.endsWith(".csv")) {
          this.draws = parseDraws(text);
        } else if (file.name.endsWith(".json")) {
          const format = Number(text.match(/"format":\s*(\d+)/)?.[1] ?? 0);
          if (format > this.format) {
            throw new Error(
              `${file.name} was written by a newer program: its record has format ${format}, and ` +
                `this page reads up to format ${this.format}`,
            );
          }
          // Seeds have 64 bits, more than a JavaScript number.
          const seed = text.match(/"seed":\s*(\d+)/);
          if (!seed) {
            throw new Error(`${file.name} has no seed; take sweep.json of the study's folder`);
          }
          this.seed = seed[1];
        } else {
          this.session = text;
        }
      } catch (error) {
        this.fail((error as Error).message);
      }
    }
    this.tell();
    this.showRow();
  }

  // Says what is there and what is missing.
  private tell(): void {
    const parts = [
      this.draws ? `draws.csv: ${this.draws.rows.length} rows` : "draws.csv is missing",
      this.seed === null ? "sweep.json is missing" : `seed ${this.seed}`,
      this.session === null ? "session.toml is missing" : "session.toml is there",
    ];
    this.state.textContent = `${parts.join("; ")}.`;
    this.show.disabled = !this.draws || this.session === null || this.seed === null;
    this.row.max = String(this.draws?.rows.length ?? 1);
  }

  private chosen(): string[] | null {
    return this.draws?.rows[Number(this.row.value) - 1] ?? null;
  }

  private showRow(): void {
    const row = this.chosen();
    const pairs = row && this.draws ? this.draws.columns.map((column, i) => [column, row[i]]) : [];
    const items = pairs.flatMap(([column, value]) => [make("dt", {}, column), make("dd", {}, value || "none")]);
    this.values.replaceChildren(...items);
  }

  private async replay(): Promise<void> {
    const [row, draws] = [this.chosen(), this.draws];
    if (!row || !draws || this.session === null || this.seed === null) {
      this.fail("There is no such row.");
      return;
    }
    const end = draws.columns.indexOf("condition");
    const columns = draws.columns.slice(PLACE.length, end);
    const fields = columns.map((column, i): [string, string] => [column, row[PLACE.length + i]]);
    try {
      const request = { text: this.session, fields, seed: this.seed, wearer: row[1] };
      const { text, seed } = await this.simulator.draw(request);
      const label = `wearer ${row[1]}, ${row[end]}`;
      this.receive({ name: "wearer.toml", label, text, seed });
      this.problem.hidden = true;
    } catch (error) {
      this.fail((error as Error).message);
    }
  }

  private fail(message: string): void {
    this.problem.textContent = message;
    this.problem.hidden = false;
  }
}

// Parses draws.csv: unit, wearer, the fields of a wearer, condition, measures.
function parseDraws(text: string): Draws {
  const lines = text.split(/\r?\n/).filter((line) => line !== "");
  const rows = lines.map((line) => line.split(",").map((cell) => cell.replace(/^"(.*)"$/, "$1")));
  const [columns, ...body] = rows;
  if (!columns || PLACE.some((name, i) => columns[i] !== name) || !columns.includes("condition")) {
    throw new Error("this is no draws.csv of a study: it must begin with the columns unit and wearer");
  }
  const broken = body.findIndex((row) => row.length !== columns.length);
  if (broken >= 0) {
    throw new Error(`row ${broken + 1} of draws.csv has ${body[broken].length} of ${columns.length} values`);
  }
  return { columns, rows: body };
}
