// Reasons that the page states for a run.

import type { Action, SessionInfo } from "./api";
import { drivenChannels } from "./session_edit";

// Returns the channel that an action raises or lowers.
export function channelOf(action: Action): number | null {
  if (typeof action !== "object") {
    return null;
  }
  return "raise" in action ? action.raise : "lower" in action ? action.lower : null;
}

// Returns the channels whose amplitude a controller sets, as far as the session says so.
export function drivenReasons(info: SessionInfo, text: string): Map<number, string> {
  const driven = drivenChannels(text);
  const reasons = info.channels.flatMap(({ number, force }): [number, string][] => {
    const isDriven = force || info.has_limb || driven.includes(number);
    const controller = force ? "Force control" : info.has_wall ? "The wall" : "A controller";
    return isDriven
      ? [[number, `${controller} sets the amplitude of channel ${number}: it has no intensity.`]]
      : [];
  });
  return new Map(reasons);
}

// Returns why edges.csv of a run of `time_s` is empty.
export function reasonOfNoEdges(duration_s: number, time_s: number): string {
  const middle_s = duration_s / 2;
  const period =
    "edges.csv has only its header: its period begins in the middle of the session " +
    `(${middle_s} s) or later`;
  return time_s < middle_s
    ? `${period}, which this run did not reach.`
    : `${period}, and no channel pulsed for a whole period after that.`;
}
