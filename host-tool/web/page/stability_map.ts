// Drawing of a panel of a stability map as a grid.

import { make } from "./dom";
import type { Study } from "./stability";
import { MapCell, MapPanel } from "./tables";
import { draw, drawing, placeIn, symbol } from "./understand_tools";

// Cells up to a number, °, with the mark of the map's text and a color of understand.css.
export interface MapClass {
  mark: string;
  upTo: number;
  fails: boolean;
  color: string;
}

const CELL = { width: 20, height: 20 };
const FRAME = { left: 46, top: 6, bottom: 44 };

function classOf(classes: MapClass[], cell: MapCell): MapClass {
  return classes.find((entry) => cell.number <= entry.upTo) ?? classes[classes.length - 1];
}

// The first row is at the bottom, as in the picture of the map.
function topOf(row: number, rows: number): number {
  return FRAME.top + (rows - 1 - row) * CELL.height;
}

export function mapDrawing(
  study: Study,
  panel: MapPanel,
  choose: (row: number, column: number) => void,
): SVGSVGElement {
  const { across } = study.map;
  const count = panel.rows.length;
  const width = FRAME.left + across.length * CELL.width + 8;
  const height = FRAME.top + count * CELL.height + FRAME.bottom;
  const failing = panel.rows.flatMap((row) => row.cells).filter((cell) => cell.fails).length;
  const svg = drawing(
    width,
    height,
    `${panel.title}: ${failing} of ${count * across.length} cells fail. ` +
      "The controls choose a cell.",
  );
  svg.classList.add("editable");
  for (const [index, row] of panel.rows.entries()) {
    const top = topOf(index, count);
    svg.append(
      draw("text", { x: FRAME.left - 5, y: top + 14, "text-anchor": "end" }, row.name),
    );
    for (const [column, cell] of row.cells.entries()) {
      const { color, mark } = classOf(study.classes, cell);
      const left = FRAME.left + column * CELL.width;
      svg.append(
        draw("rect", {
          x: left,
          y: top,
          width: CELL.width - 0.5,
          height: CELL.height - 0.5,
          class: color,
        }),
        draw(
          "text",
          { x: left + 9.75, y: top + 14, "text-anchor": "middle", class: `in ${color}` },
          mark,
        ),
      );
      if (cell.predictedFails !== null && cell.predictedFails !== cell.fails) {
        svg.append(draw("circle", { cx: left + 15, cy: top + 5, r: 3, class: "disagrees" }));
      }
    }
    // Where theory's verdict changes along the row, and from row to row.
    for (const [column, cell] of row.cells.entries()) {
      const left = FRAME.left + column * CELL.width;
      const before = column === 0 ? false : row.cells[column - 1].predictedFails;
      if (cell.predictedFails !== null && cell.predictedFails !== before) {
        svg.append(line(left, top, left, top + CELL.height));
      }
      const above = panel.rows[index + 1]?.cells[column].predictedFails;
      if (above !== undefined && above !== cell.predictedFails) {
        svg.append(line(left, top, left + CELL.width, top));
      }
    }
  }
  let taken = -Infinity;
  for (const [column, value] of across.entries()) {
    const x = FRAME.left + (column + 0.5) * CELL.width;
    const y = FRAME.top + count * CELL.height + 12;
    const half = String(value).length * 3.2;
    if (x - half > taken + 2) {
      svg.append(draw("text", { x, y, "text-anchor": "middle", class: "small" }, String(value)));
      taken = x + half;
    }
  }
  const title = `${study.acrossTitle.toLowerCase()} (${study.acrossUnit})`;
  const x = FRAME.left + (across.length * CELL.width) / 2;
  svg.append(
    draw("text", { x, y: height - 8, "text-anchor": "middle" }, title),
    ...["chosen-back", "chosen"].map((name) => draw("rect", { ...CELL, class: name, x: -99 })),
  );
  svg.setAttribute("data-rows", String(count));
  svg.addEventListener("click", (event) => {
    const place = placeIn(svg, event);
    const column = Math.floor((place.x - FRAME.left) / CELL.width);
    const row = count - 1 - Math.floor((place.y - FRAME.top) / CELL.height);
    if (column >= 0 && column < across.length && row >= 0 && row < count) {
      choose(row, column);
    }
  });
  return svg;
}

// Frames the chosen cell, in the drawing of its panel only.
export function mapSelection(svg: SVGSVGElement, chosen: Study["chosen"]): void {
  const isHere = svg.getAttribute("data-panel") === String(chosen.panel);
  const rows = Number(svg.getAttribute("data-rows"));
  for (const frame of svg.querySelectorAll(".chosen, .chosen-back")) {
    frame.setAttribute("x", String(isHere ? FRAME.left + chosen.column * CELL.width : -99));
    frame.setAttribute("y", String(topOf(chosen.row, rows)));
  }
}

export function mapLegend(classes: MapClass[]): HTMLElement {
  const entry = (text: string, ...shapes: SVGElement[]): HTMLElement => {
    return make("li", {}, symbol(...shapes), text);
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
    entry("theory's verdict changes", line(0, 10, 20, 10)),
    entry("disagrees with theory", draw("circle", { cx: 10, cy: 10, r: 4, class: "disagrees" })),
  );
}

function line(x1: number, y1: number, x2: number, y2: number): SVGElement {
  const group = draw("g", {});
  for (const part of ["theory-back", "theory"]) {
    group.append(draw("line", { x1, y1, x2, y2, class: part }));
  }
  return group;
}
