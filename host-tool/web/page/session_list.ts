// The list of sessions by topic, and the copies of edited texts.

import type { About, SessionInfo } from "./api";
import { make } from "./dom";
import type { StoredText } from "./session_store";

// Topics with the beginnings of the names of their sessions.
const TOPICS: [string, string[]][] = [
  ["Joint angle in closed loop", ["ten_channels_and_", "hamana_exp4_", "full_load"]],
  ["Movements by a program", ["reciprocal", "cycling", "drop_foot", "lift"]],
  [
    "Channels without feedback",
    ["ten_channels", "five_channels", "open_finger", "width_ramp", "trigger"],
  ],
  [
    "Force and fatigue of muscles",
    ["force_", "gentle_force", "ten_forces", "strength", "distributed"],
  ],
  ["Force at the hand", ["endpoint_"]],
  ["Virtual wall (Harris 2017)", ["harris_wall/"]],
  ["Two electrodes in turn (Hamana 2022, experiment 2)", ["hamana_exp2/"]],
];
const OTHERS = "Other sessions";

// Returns the shipped sessions, in a group for each topic.
export function groups(about: About): HTMLElement[] {
  const found = new Map<string, HTMLElement[]>();
  for (const { name, title } of about.sessions) {
    const topic = topicOf(name);
    const option = make("option", { value: name }, `${title} (${name.split("/").pop()})`);
    found.set(topic, [...(found.get(topic) ?? []), option]);
  }
  const names = [...TOPICS.map(([topic]) => topic), OTHERS];
  return names.flatMap((label) => {
    const options = found.get(label);
    return options ? [make("optgroup", { label }, ...options)] : [];
  });
}

// Returns the copies of edited texts as a group.
export function copyGroup(copies: StoredText[]): HTMLElement {
  const options = copies.map((copy, i) =>
    make("option", { value: `copy:${i}` }, `${copy.label} (copy ${i + 1})`),
  );
  const group = make("optgroup", { label: "Your copies, until this tab is closed" }, ...options);
  group.hidden = copies.length === 0;
  return group;
}

// Describes a session without mistakes in a sentence.
export function describe(info: SessionInfo): string {
  const channels = info.channels.length === 1 ? "1 channel" : `${info.channels.length} channels`;
  const bodies = {
    finger: "a simulated finger",
    elbow: "a simulated elbow",
    hand: "a simulated hand",
    arm: "a simulated arm",
    still: "simulated electrodes on a limb that does not move",
  };
  const body = info.body ? bodies[info.body] : "dummy loads";
  return `No mistakes: "${info.title}", ${info.duration_s} s, ${channels}, on ${body}.`;
}

function topicOf(name: string): string {
  const matches = ([, starts]: [string, string[]]): boolean =>
    starts.some((start) => name.startsWith(start));
  return TOPICS.find(matches)?.[0] ?? OTHERS;
}
