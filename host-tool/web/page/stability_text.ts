// What a live run says in words, beside the map.

import type { Study } from "./stability";
import type { Outcome } from "./stability_live";
import { MapCell } from "./tables";
import { show } from "./understand_tools";

export function verdict(fails: boolean): string {
  return fails ? "✗ fails" : "✓ holds";
}

// The three verdicts of a run, for a held angle and for a reference that is followed.
const HELD = { good: "settles", bad: "does not settle" };
const FOLLOWED = { good: "follows the reference", bad: "does not follow the reference" };

export function liveText(result: Outcome, cell: MapCell, study: Study): string {
  const isHeld = study.judgesSwing;
  const words = isHeld ? HELD : FOLLOWED;
  const deg = result.numbers[0][1];
  const fails = isHeld ? result.settled_s === null : deg === null || deg > study.limit_deg;
  const map = `The map: ${show(cell.number)}°, ${verdict(cell.fails)}`;
  const agreement = fails === cell.fails ? `${map}, too.` : `${map}.`;
  if (result.error) {
    const ended = `✗ Live, the finger ${words.bad}, and the device ended the session.`;
    return `${ended} ${agreement} ${result.error}`;
  }
  const until_s = isHeld ? (result.settled_s ?? Infinity) : Infinity;
  const lowered = result.gains.filter(([t_s]) => t_s <= until_s).map(([, percent]) => percent);
  const lowest = Math.min(100, ...lowered);
  const only = lowest < 100 ? ` only after the device lowered its gain (to ${lowest} %)` : "";
  const found = fails ? `✗ Live, the finger ${words.bad}` : `✓ Live, the finger ${words.good}`;
  const head = found + (fails ? "" : only);
  return [`${head}: ${detail(result, fails, isHeld)}.`, agreement, hold(fails, cell, only, isHeld)]
    .filter((text) => text !== "")
    .join(" ");
}

function detail(result: Outcome, fails: boolean, isHeld: boolean): string {
  const deg = result.numbers[0][1];
  const size = deg === null ? "–" : `${show(deg)}°`;
  const { largest, settled_s } = result;
  const most = largest ? `${show(largest.deg)}° at ${show(largest.t_s)} s` : "–";
  if (!isHeld) {
    return `${size} RMSE, largest error ${most}`;
  }
  const swing = `largest swing ${most}`;
  return fails
    ? `${size} of swing over the last 5 s, ${swing}`
    : `from ${show(settled_s ?? 0)} s on, with ${size} over the last 5 s; ${swing}`;
}

// Why a run settles where the map fails although no limit cycle was detected.
function hold(fails: boolean, cell: MapCell, only: string, isHeld: boolean): string {
  return isHeld && !fails && cell.fails && only === ""
    ? "In a hold the device lowers its feedback gain to a sixteenth; the map keeps the full gain."
    : "";
}
