// Runs of the simulator at a cell of a stability map.

import { News, Setpoints, Simulator } from "./api";

export interface Outcome {
  t_s: number[];
  reference: (number | null)[];
  angle: (number | null)[];
  // Reference that the device follows, where it may differ from that of the study.
  followed: (number | null)[];
  // In degrees; the first is judged as in the map.
  numbers: [string, number | null][];
  // Time from which the angle stays within the limit of the swing, s; null if it never does, or
  // where the study does not judge that.
  settled_s: number | null;
  // Largest swing within a second, after the first, and the end of that second; where a moving
  // reference is followed, the largest error of the time that is judged.
  largest: { deg: number; t_s: number } | null;
  // Feedback gains in %, as the device reported them, with their times.
  gains: [number, number][];
  events: [number, string][];
  // Further text about the run.
  note: string;
  error: string | null;
}

const TORQUE_NM = { flexor: 0.22, extensor: 0.15 };
const DELAY_MS = 25;
const HELD_DEG = 30;
const SETPOINTS_HZ = 90;
// Fastest change between two setpoints of which the device estimates a rate, °/s.
const FASTEST_DEG_PER_S = 1000;

// What the default controller knows about participant P with one point.
const WEARER = `[joint.wearer]
rest_deg = 5.0
stiffness_nm_per_rad = 0.12
damping_nm_s_per_rad = 0.018
flexion_nm = ${TORQUE_NM.flexor}
extension_nm = ${TORQUE_NM.extensor}
torque_loss = 0.25

[joint.response]
`;

// Session of participant P's finger with one point, as hamana_exp4_one_point_a_finger.toml. As in
// the maps, all pulses come at the same time, and nothing limits rising amplitudes.
function sessionText(parts: {
  duration_s: number;
  law: "recommended" | "pid";
  knowsWearer: boolean;
  hold: string;
  steps: string;
  body: string;
}): string {
  const channel = (number: number, name: string, limit: number): string => `[[channel]]
number = ${number}
name = "${name}"
stage = { kind = "voltage", full_scale_v = 60.0, load_ohm = 2000 }
limit = ${limit}.0
start = ${limit}.0
train = { shape = "monophasic-cathodic", width_us = 200, ground_us = 1000, frequency_hz = 50.0 }
`;
  return `title = "Cell of a stability map"
duration_s = ${parts.duration_s}.0

[wearer]
max_current_ma = 20.0
max_charge_uc = 5.0
max_rms_ma = 10.0
rise_ms = 200
fall_ms = 50
host_timeout_ms = 100

${channel(1, "flexor A", 28)}
${channel(3, "extensor", 26)}
[joint]
law = "${parts.law}"
flexors = [{ channel = 1, threshold = 24.0, max = 28.0 }]
extensor = { channel = 3, threshold = 14.0, max = 26.0 }
${parts.hold}
sensor = "adc"

${parts.knowsWearer ? WEARER : ""}
[setpoints]
kind = "angle-steps"
steps = [${parts.steps}]
rate_hz = ${SETPOINTS_HZ}

[body]
kind = "finger"
participant = "P"
flexor_a = 1
flexor_b = 2
extensor = 3
${parts.body}`;
}

function empty(): Outcome {
  const columns = { t_s: [], reference: [], angle: [], followed: [] };
  const judged = { numbers: [], settled_s: null, largest: null, gains: [] };
  return { ...columns, ...judged, events: [], note: "", error: null };
}

function collect(
  outcome: Outcome,
  news: News,
  reference: (t_s: number) => number,
  follows: boolean,
): void {
  const samples = news.samples;
  samples?.t_s.forEach((t_s, index) => {
    outcome.t_s.push(t_s);
    outcome.reference.push(reference(t_s));
    outcome.angle.push(samples.true_deg[index]);
    outcome.followed.push(follows ? samples.target_deg[index] : null);
  });
  for (const [t_s, text] of news.events ?? []) {
    outcome.events.push([t_s, text]);
    const gain = /feedback at (\d+) %/.exec(text);
    if (gain) {
      outcome.gains.push([t_s, Number(gain[1])]);
    }
  }
  outcome.error = news.end?.error ?? outcome.error;
}

// Largest minus smallest angle between two times.
function swing(outcome: Outcome, from_s: number, to_s: number): number | null {
  const angles = outcome.angle.filter(
    (deg, index): deg is number =>
      deg !== null && outcome.t_s[index] > from_s && outcome.t_s[index] <= to_s,
  );
  return angles.length > 0 ? Math.max(...angles) - Math.min(...angles) : null;
}

// Time after which the angle swings by at most `limit_deg`, if that is before `latest_s`.
function settlingTime(outcome: Outcome, limit_deg: number, latest_s: number): number | null {
  let [least, most] = [Infinity, -Infinity];
  for (let index = outcome.angle.length - 1; index >= 0; index--) {
    const deg = outcome.angle[index] ?? NaN;
    [least, most] = [Math.min(least, deg), Math.max(most, deg)];
    if (most - least > limit_deg) {
      const t_s = outcome.t_s[index];
      return t_s <= latest_s ? t_s : null;
    }
  }
  return 0;
}

// Holds 30° on a finger of other strength and delay. Returns null if a newer run is wanted.
export async function playStrength(
  simulator: Simulator,
  cell: { panel: number; gain: number; delay_ms: number },
  limit_deg: number,
  isStale: () => boolean,
  progress: (outcome: Outcome) => void,
): Promise<Outcome | null> {
  const duration_s = 20;
  const scaled = (torque_nm: number): string => (torque_nm * cell.gain).toFixed(6);
  const text = sessionText({
    duration_s,
    law: cell.panel === 2 ? "pid" : "recommended",
    knowsWearer: cell.panel === 0,
    hold: 'hold = "hold"',
    steps: `{ at_s = 0.0, deg = ${HELD_DEG}.0 }`,
    body: `flexor_nm = ${scaled(TORQUE_NM.flexor)}
extensor_nm = ${scaled(TORQUE_NM.extensor)}
delay_ms = ${DELAY_MS + cell.delay_ms}
`,
  });
  const outcome = empty();
  const { id } = await simulator.open({ name: "cell.toml", text, seed: 1 });
  try {
    for (let second = 1; second <= duration_s + 1; second++) {
      const news = await simulator.advance(id, second * 1e6);
      if (isStale()) {
        return null;
      }
      collect(outcome, news, () => HELD_DEG, false);
      progress(outcome);
      if (news.end) {
        break;
      }
    }
  } finally {
    await simulator.drop(id);
  }
  for (let t_s = 2; t_s <= duration_s; t_s++) {
    const deg = swing(outcome, t_s - 1, t_s) ?? 0;
    if (deg > (outcome.largest?.deg ?? -1)) {
      outcome.largest = { deg, t_s };
    }
  }
  const rest_s = duration_s - 5;
  outcome.settled_s = outcome.error ? null : settlingTime(outcome, limit_deg, rest_s);
  outcome.numbers = [
    ["Swing over the last 5 s", outcome.error ? null : swing(outcome, rest_s, duration_s)],
  ];
  return outcome;
}

// Streams a sine and drops a share of the setpoints. Returns null if a newer run is wanted.
export async function playLoss(
  simulator: Simulator,
  cell: { panel: number; hold: string; lost_pct: number; seed: number },
  isStale: () => boolean,
  progress: (outcome: Outcome) => void,
): Promise<Outcome | null> {
  const duration_s = 30;
  const reach = `hold = "extrapolate"\nmax_extrapolation_ms = ${cell.hold}`;
  const text = sessionText({
    duration_s,
    law: "recommended",
    knowsWearer: cell.panel !== 2,
    hold: cell.hold === "hold" ? 'hold = "hold"' : reach,
    steps: "{ at_s = 0.0, deg = 45.0 }",
    body: "",
  });
  const reference = (t_s: number): number => 45 + 40 * Math.sin(2 * Math.PI * 0.2 * t_s);
  const random = randomNumbers(cell.seed);
  let sent = 0;
  let latest: [number, number] | null = null;
  // Setpoint of the frame `index`, unless it is lost; the first one never is.
  const setpoint = (index: number): Setpoints | undefined => {
    const isLost = random() < cell.lost_pct / 100;
    if (isLost && index > 0) {
      return undefined;
    }
    const t_s = index / SETPOINTS_HZ;
    const deg = Math.round(reference(t_s) * 100) / 100;
    const rate = latest ? (deg - latest[1]) / (t_s - latest[0]) : 0;
    latest = [t_s, deg];
    sent += 1;
    return { angle_deg: [deg, Math.abs(rate) <= FASTEST_DEG_PER_S ? rate : 0] };
  };
  const outcome = empty();
  const { id } = await simulator.open({ name: "cell.toml", text, seed: cell.seed, live: true });
  try {
    for (let second = 0; second < duration_s && !outcome.error; second++) {
      const steps = Array.from({ length: SETPOINTS_HZ }, (_, frame) => {
        const index = second * SETPOINTS_HZ + frame;
        return { to_us: ((index + 1) / SETPOINTS_HZ) * 1e6, send: setpoint(index) };
      });
      const answers = await simulator.course(id, steps);
      if (isStale()) {
        return null;
      }
      for (const news of answers) {
        collect(outcome, news, reference, true);
      }
      progress(outcome);
    }
  } finally {
    await simulator.drop(id);
  }
  const angle = rmse(outcome, outcome.angle, reference);
  const followed = rmse(outcome, outcome.followed, reference);
  const numbers: [string, number | null][] = [
    ["RMSE of the angle, 10 to 30 s", angle],
    ["RMSE of the reference that the device follows", followed],
  ];
  // The first panel is about the setpoints alone.
  outcome.numbers = cell.panel === 0 ? numbers.reverse() : numbers;
  const judged = cell.panel === 0 ? outcome.followed : outcome.angle;
  outcome.t_s.forEach((t_s, index) => {
    const deg = Math.abs((judged[index] ?? NaN) - reference(t_s));
    if (t_s >= 10 && deg > (outcome.largest?.deg ?? 0)) {
      outcome.largest = { deg, t_s };
    }
  });
  outcome.note = `This page sent ${sent} of ${duration_s * SETPOINTS_HZ} setpoints.`;
  return outcome;
}

function rmse(
  outcome: Outcome,
  column: (number | null)[],
  reference: (t_s: number) => number,
): number | null {
  let [square, count] = [0, 0];
  outcome.t_s.forEach((t_s, index) => {
    const deg = column[index];
    if (t_s >= 10 && deg !== null) {
      square += (deg - reference(t_s)) ** 2;
      count += 1;
    }
  });
  return count > 0 && !outcome.error ? Math.sqrt(square / count) : null;
}

// Random numbers from 0 to 1 that depend on the seed only (mulberry32).
function randomNumbers(seed: number): () => number {
  let state = seed | 0;
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let mixed = Math.imul(state ^ (state >>> 15), 1 | state);
    mixed = (mixed + Math.imul(mixed ^ (mixed >>> 7), 61 | mixed)) ^ mixed;
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32;
  };
}
