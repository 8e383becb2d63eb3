// The simulator behind the page: requests to the WebAssembly module, which runs in a worker.

export interface Channel {
  number: number;
  name: string;
  unit: "mA" | "V";
  limit: number;
  full_scale: number;
  shape: string;
  width_us: number;
  gap_us: number;
  ground_us: number;
  period_us: number;
  offset_us: number;
  muscle: boolean;
  force: boolean;
}

export interface SessionInfo {
  title: string;
  duration_s: number;
  body: "finger" | "elbow" | "hand" | "arm" | "still" | null;
  channels: Channel[];
  groups: number[][];
  has_joint: boolean;
  has_limb: boolean;
  has_wall: boolean;
  telemetry_ms: number;
  measure_s: [number, number] | null;
  notes: string[];
}

export interface Mistake {
  number: string;
  line: number | null;
  column: number | null;
  message: string;
  help: string | null;
}

export interface About {
  program: { version: string; git: string | null; schema: string };
  // Largest format of a record that the page understands.
  record_format: number;
  longest_text: number;
  sessions: { name: string; title: string }[];
  wearers: string[];
}

type Column = (number | null)[];

// Samples since the last answer, as columns.
export interface Samples {
  t_s: number[];
  target_deg: Column;
  measured_deg: Column;
  true_deg: Column;
  effort: Column;
  state: string | null;
  amplitudes: Column[];
  forces_n: Column[];
  hand_n: Column[];
  hand_true_n: Column[];
}

// Answer to `advance`. `edges` has four numbers for each edge: time in µs after the start of the
// trains, channel from 1, state (see EDGE_STATES), and amplitude code of 0 to 65535.
export interface News {
  t_s?: number;
  samples?: Samples;
  edges?: number[];
  events?: [number, string][];
  end?: { error: string | null };
  // Reason why the setpoints of a step of `course` were refused.
  refused?: string;
}

export interface Setpoints {
  // Channels with their amplitudes.
  ma?: [number, number][];
  v?: [number, number][];
  angle_deg?: [number, number];
  // Torque from outside on a simulated finger, N·m, flexion positive.
  external_nm?: number;
}

export type Action = "pause" | "resume" | "stop" | { raise: number } | { lower: number } | { mark: string };

export interface Integration {
  method: string;
  arithmetic: string;
  reading: string;
  step_us: number | null;
  output_ms: number;
  subject: number;
  rate_hz: number;
}

// Error of a request, with the mistakes of a session text if it has any.
export class CallError extends Error {
  constructor(message: string, readonly mistakes: Mistake[] = []) {
    super(message);
  }
}

interface Pending {
  resolve: (value: unknown) => void;
  reject: (error: Error) => void;
}

// Talks to the worker. Requests are answered in the order in which they were sent.
export class Simulator {
  private readonly worker: Worker;
  private readonly pending = new Map<number, Pending>();
  private next = 1;

  constructor(worker: Worker) {
    this.worker = worker;
    worker.onmessage = (event) => this.receive(event.data);
    worker.onerror = (event) => this.fail(event.message || "the simulator could not be started");
  }

  about(): Promise<About> {
    return this.call({ verb: "about" });
  }

  session(name: string): Promise<{ file: string; text: string }> {
    return this.call({ verb: "session", name });
  }

  check(name: string, text: string): Promise<SessionInfo> {
    return this.call({ verb: "check", name, text });
  }

  open(session: {
    name: string;
    text: string;
    // A whole number of 64 bits; as a text if it is larger than a JavaScript number holds.
    seed: number | string;
    law?: string;
    live?: boolean;
  }): Promise<{ id: number; session: SessionInfo }> {
    return this.call({ verb: "open", session: { ...session, now_ms: Date.now() } });
  }

  advance(id: number, to_us: number, send?: Setpoints): Promise<News> {
    return this.call({ verb: "advance", id, to_us: Math.round(to_us), send });
  }

  // Advances through several times in one message, with setpoints before each of them.
  course(id: number, steps: { to_us: number; send?: Setpoints }[]): Promise<News[]> {
    return this.message({ kind: "course", id, steps }) as Promise<News[]>;
  }

  act(id: number, action: Action): Promise<{ paused: boolean }> {
    return this.call({ verb: "act", id, action });
  }

  async files(id: number): Promise<[string, number][]> {
    return (await this.call<{ files: [string, number][] }>({ verb: "files", id })).files;
  }

  file(id: number, path: string): Promise<Uint8Array> {
    return this.message({ kind: "file", id, path }) as Promise<Uint8Array>;
  }

  drop(id: number): Promise<void> {
    return this.call({ verb: "drop", id });
  }

  response(train: {
    muscle: [number, number, number, number, number];
    pulses_us: number[];
    duration_s: number;
  }): Promise<{ t_s: number[]; device_n: number[]; exact_n: number[] }> {
    return this.call({ verb: "response", train });
  }

  // Session of a random wearer of a study, and the seed of its noise: fields of draws.csv with their
  // values, seed of the study, and number of the wearer, all as texts.
  draw(request: {
    text: string;
    fields: [string, string][];
    seed: string;
    wearer: string;
  }): Promise<{ text: string; seed: string }> {
    return this.call({ verb: "draw", draw: request });
  }

  // Force by an integrator of the accuracy–speed chart; its module is loaded at the first call.
  integrate(
    integration: Integration,
  ): Promise<{ t_s: number[]; force_n: number[]; exact_n: number[]; error_pct: number }> {
    return this.message({ kind: "integrate", integration }) as Promise<never>;
  }

  // Bytes of memory that the module has reserved.
  memory(): Promise<number> {
    return this.message({ kind: "memory" }) as Promise<number>;
  }

  private call<T>(request: object): Promise<T> {
    return this.message({ kind: "call", request }) as Promise<T>;
  }

  private message(message: object): Promise<unknown> {
    const number = this.next++;
    return new Promise((resolve, reject) => {
      this.pending.set(number, { resolve, reject });
      this.worker.postMessage({ number, ...message });
    });
  }

  private receive(answer: { number: number; value?: unknown; error?: { message: string; mistakes?: Mistake[] } }): void {
    const waiting = this.pending.get(answer.number);
    this.pending.delete(answer.number);
    if (answer.error) {
      waiting?.reject(new CallError(answer.error.message, answer.error.mistakes));
    } else {
      waiting?.resolve(answer.value);
    }
  }

  private fail(message: string): void {
    for (const waiting of this.pending.values()) {
      waiting.reject(new CallError(message));
    }
    this.pending.clear();
  }
}

// Numbers of the states of a channel's output switches in edges, and the largest amplitude code.
export const CATHODIC = 1;
export const ANODIC = 2;
export const GROUNDED = 3;
export const FULL_CODE = 65_535;

// Names of the states, by their numbers.
export const EDGE_STATES = ["isolated", "cathodic", "anodic", "grounded"] as const;
