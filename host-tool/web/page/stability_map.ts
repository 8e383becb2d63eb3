// Drawing of a panel of a stability map as a grid.

import { make } from "./dom";
import type { Study } from "./stability";
import { MapCell, MapPanel } from "./tables";
import { draw, drawing, placeIn, show, symbol } from "./understand_tools";

// Cells up to a number, °, with a mark and a color of understand.css.
export interface MapClass {
  mark: string;
  upTo: number;
  fails: boolean;
  color: string;
}

const CELL = { width: 20, height: 20 };
const FRAME = { left: 72, top: 6, bottom: 62 };

function classOf(classes: MapClass[], cell: MapCell): MapClass {
  return classes.find((entry) => cell.number <= entry.upTo) ?? classes[classes.length - 1];
}

// The first row is at the bottom, as in the picture of the map.
function topOf(row: number, rows: number): number {
  return FRAME.top + (rows - 1 - row) * CELL.height;
}

type Choose = (row: number, column: number) => void;

let count = 0;

// A grid of cells, which clicks and arrow keys choose.
export function mapDrawing(study: Study, panel: MapPanel, choose: Choose): SVGSVGElement {
  const { across } = study.map;
  const rows = panel.rows.length;
  const width = FRAME.left + across.length * CELL.width + 8;
  const height = FRAME.top + rows * CELL.height + FRAME.bottom;
  const failing = panel.rows.flatMap((row) => row.cells).filter((cell) => cell.fails).length;
  const svg = drawing(width, height, "");
  const label =
    `${panel.title}: ${failing} of ${rows * across.length} cells fail. Arrow keys choose a cell.`;
  const attributes = {
    role: "grid",
    tabindex: "0",
    id: `map-${++count}`,
    "aria-label": label,
    "data-rows": String(rows),
  };
  for (const [name, value] of Object.entries(attributes)) {
    svg.setAttribute(name, value);
  }
  svg.classList.add("editable");
  const cells = panel.rows.map((_, index) => rowOf(study, panel, index, svg.id));
  // What the texts of the cells say already.
  const hidden = draw("g", { "aria-hidden": "true", "pointer-events": "none" });
  hidden.append(
    ...panel.rows.flatMap((_, index) => theoryLines(panel, index)),
    ...axisTexts(study, rows, height),
    ...["chosen-back", "chosen"].map((name) => draw("rect", { ...CELL, class: name, x: -99 })),
  );
  svg.append(...cells.reverse(), hidden);
  svg.addEventListener("click", (event) => {
    const place = placeIn(svg, event);
    const column = Math.floor((place.x - FRAME.left) / CELL.width);
    const row = rows - 1 - Math.floor((place.y - FRAME.top) / CELL.height);
    if (column >= 0 && column < across.length && row >= 0 && row < rows) {
      choose(row, column);
    }
  });
  return svg;
}

// Lets arrow keys, Home, End, Enter and the space bar choose a cell of a drawing.
export function mapKeys(
  svg: SVGSVGElement,
  study: Study,
  choose: Choose,
): void {
  svg.addEventListener("keydown", (event) => {
    const { chosen, map } = study;
    const last = { row: map.panels[0].rows.length - 1, column: map.across.length - 1 };
    const places: Record<string, [number, number]> = {
      ArrowUp: [chosen.row + 1, chosen.column],
      ArrowDown: [chosen.row - 1, chosen.column],
      ArrowLeft: [chosen.row, chosen.column - 1],
      ArrowRight: [chosen.row, chosen.column + 1],
      Home: [chosen.row, 0],
      End: [chosen.row, last.column],
      Enter: [chosen.row, chosen.column],
      " ": [chosen.row, chosen.column],
    };
    const place = places[event.key];
    if (!place || event.ctrlKey || event.altKey || event.metaKey) {
      return;
    }
    event.preventDefault();
    const limit = (value: number, most: number): number => Math.min(Math.max(value, 0), most);
    choose(limit(place[0], last.row), limit(place[1], last.column));
  });
}

function cellId(grid: string, row: number, column: number): string {
  return `${grid}-${row}-${column}`;
}

function rowOf(study: Study, panel: MapPanel, index: number, grid: string): SVGElement {
  const { name, cells } = panel.rows[index];
  const top = topOf(index, panel.rows.length);
  const head = { x: FRAME.left - 5, y: top + 14, "text-anchor": "end", role: "rowheader" };
  const group = draw("g", { role: "row" }, draw("text", head, name));
  for (const [column, cell] of cells.entries()) {
    const { color, mark } = classOf(study.classes, cell);
    const left = FRAME.left + column * CELL.width;
    const disagrees = cell.predictedFails !== null && cell.predictedFails !== cell.fails;
    const label =
      `Class ${mark}: ${study.downName(name)}, ${study.map.across[column]} ${study.acrossUnit}: ` +
      `${show(cell.number)}°, ${cell.fails ? "fails" : "holds"}` +
      (disagrees ? ", disagrees with theory" : "");
    const box = { x: left, y: top, width: CELL.width - 0.5, height: CELL.height - 0.5 };
    const text = { x: left + 9.75, y: top + 14, "text-anchor": "middle", class: `in ${color}` };
    const item = draw(
      "g",
      { role: "gridcell", id: cellId(grid, index, column), "aria-label": label },
      draw("rect", { ...box, class: color }),
      draw("text", text, mark),
    );
    if (disagrees) {
      item.append(draw("circle", { cx: left + 15.5, cy: top + 4.5, r: 3.5, class: "disagrees" }));
    }
    group.append(item);
  }
  return group;
}

// Where theory's verdict changes along a row, and from it to the row above.
function theoryLines(panel: MapPanel, index: number): SVGElement[] {
  const { cells } = panel.rows[index];
  const top = topOf(index, panel.rows.length);
  return cells.flatMap((cell, column) => {
    const left = FRAME.left + column * CELL.width;
    const before = column === 0 ? false : cells[column - 1].predictedFails;
    const above = panel.rows[index + 1]?.cells[column].predictedFails;
    const changesAlong = cell.predictedFails !== null && cell.predictedFails !== before;
    const changesUp = above !== undefined && above !== cell.predictedFails;
    return [
      ...(changesAlong ? [line(left, top, left, top + CELL.height)] : []),
      ...(changesUp ? [line(left, top, left + CELL.width, top)] : []),
    ];
  });
}

function axisTexts(study: Study, rows: number, height: number): SVGElement[] {
  const { across } = study.map;
  const bottom = FRAME.top + rows * CELL.height;
  const columns = across.map((value, column) => {
    const x = FRAME.left + (column + 0.5) * CELL.width;
    // Labels stand upright, because a cell is too narrow for three digits.
    const place = { x: x + 5, y: bottom + 6, transform: `rotate(-90 ${x + 5} ${bottom + 6})` };
    return draw("text", { ...place, "text-anchor": "end" }, String(value));
  });
  const middle = { x: FRAME.left + (across.length * CELL.width) / 2, y: height - 8 };
  const side = FRAME.top + (rows * CELL.height) / 2;
  const title = `${study.acrossTitle.toLowerCase()} (${study.acrossUnit})`;
  return [
    ...columns,
    draw("text", { ...middle, "text-anchor": "middle", class: "title" }, title),
    draw(
      "text",
      {
        x: 16,
        y: side,
        "text-anchor": "middle",
        class: "title",
        transform: `rotate(-90 16 ${side})`,
      },
      study.downAxis,
    ),
  ];
}

// Frames the chosen cell, in the drawing of its panel only.
export function mapSelection(svg: SVGSVGElement, chosen: Study["chosen"]): void {
  const isHere = svg.getAttribute("data-panel") === String(chosen.panel);
  const rows = Number(svg.getAttribute("data-rows"));
  for (const frame of svg.querySelectorAll(".chosen, .chosen-back")) {
    frame.setAttribute("x", String(isHere ? FRAME.left + chosen.column * CELL.width : -99));
    frame.setAttribute("y", String(topOf(chosen.row, rows)));
  }
  for (const cell of svg.querySelectorAll('[aria-selected="true"]')) {
    cell.removeAttribute("aria-selected");
  }
  const id = cellId(svg.id, chosen.row, chosen.column);
  svg.setAttribute("aria-activedescendant", id);
  if (isHere) {
    svg.querySelector(`#${id}`)?.setAttribute("aria-selected", "true");
  }
}

export function mapLegend(classes: MapClass[]): HTMLElement {
  const entry = (text: string, ...shapes: SVGElement[]): HTMLElement => {
    return make("li", {}, symbol(...shapes), text);
  };
  // A cell under the symbol, on which it looks as in the map, also in dark colors.
  const back = (): SVGElement => {
    return draw("rect", { x: 0, y: 0, width: 20, height: 20, class: classes[0].color });
  };
  const items = classes.map(({ mark, upTo, fails, color }, index) => {
    const isLast = index === classes.length - 1;
    const range = isLast ? `more than ${classes[index - 1].upTo}°` : `up to ${upTo}°`;
    return entry(
      `${range} ${fails ? "✗ fails" : "✓ holds"}`,
      draw("rect", { x: 0, y: 0, width: 20, height: 20, class: color }),
      draw("text", { x: 10, y: 14, "text-anchor": "middle", class: `in ${color}` }, mark),
    );
  });
  return make(
    "ul",
    { class: "legend" },
    ...items,
    entry("theory's verdict changes", back(), line(0, 10, 20, 10)),
    entry(
      "map disagrees with theory",
      back(),
      draw("circle", { cx: 10, cy: 10, r: 4.5, class: "disagrees" }),
    ),
  );
}

function line(x1: number, y1: number, x2: number, y2: number): SVGElement {
  const group = draw("g", {});
  for (const part of ["theory-back", "theory"]) {
    group.append(draw("line", { x1, y1, x2, y2, class: part }));
  }
  return group;
}
