// The first part: a finger that the device moves, with everything that one can change beside it.

import { CallError, type News, type Setpoints, type Simulator } from "./api";
import { choice, make, slider } from "./dom";
import { Finger } from "./hand";
import { Lanes, Output } from "./lanes";
import { Plot } from "./plots";
import { Random, Reference } from "./scene_reference";
import { FREE_CHANNELS, type Parameters, sceneText } from "./scene_session";
import { AmplitudeTable } from "./scene_table";

// Controllers, by their names in session files.
const CONTROLLERS = [
  { law: "recommended", name: "default", color: "s1", about: "super-twisting with a model of the wearer" },
  { law: "paper", name: "paper's law", color: "s2", about: "super-twisting as Hamana 2022 prints it, sign corrected" },
  { law: "pid", name: "PID", color: "s3", about: "proportional, integral and derivative terms" },
] as const;

// Rate at which the page sends references, as the shipped sessions do.
const RATE_HZ = 90;
const STEP_US = 1e6 / RATE_HZ;
// Longest stretch of real time that a frame makes up for.
const LONGEST_FRAME_MS = 100;
// Most simulated time that a slow computer makes up for, µs.
const MOST_OWED_US = 500_000;
const WINDOW_S = 10;
const SEED = 1;

interface Trace {
  law: string;
  id: number;
  finger: Finger;
  angles: number[];
  deg: number;
  output: Output;
}

class Scene {
  private readonly parameters: Parameters = { rate_hz: 50, phase_us: 2000, strength: 1, delay_ms: 25 };
  private readonly reference = new Reference();
  private free_ma = 10;
  private external_nm = 0;
  private dropped = 0;
  private speed = 1;
  private laws: string[] = ["recommended"];
  private traces: Trace[] = [];
  private times: number[] = [];
  private wanted: number[] = [];
  private now_us = 0;
  private running = !matchMedia("(prefers-reduced-motion: reduce)").matches;
  private shown = true;
  private busy = false;
  private waiting = false;
  private reopen = 0;
  // Number of the latest request to start again; an earlier one gives way.
  private turn = 0;
  private frame_ms = 0;
  // Simulated time that has passed on the clock and is not simulated yet, µs.
  private owed_us = 0;
  private random = new Random(SEED);

  private readonly play = make("button", { class: "main", click: () => this.toggle() });
  private readonly step = make("button", { click: () => void this.single() }, "Step 20 ms");
  private readonly status = make("p", { class: "note", role: "status" });
  private readonly problem = make("p", { class: "trouble", role: "alert", hidden: true });
  private readonly fingers = make("div", { class: "fingers" });
  private readonly plotPlace = make("div");
  private plot: Plot | null = null;
  private readonly wide = new Lanes("Output of the ten channels over 100 ms", 100_000, "ms");
  private readonly fine = new Lanes("Output of the ten channels over 3 ms from a pulse on", 3_000, "µs");
  private readonly table = new AmplitudeTable();

  constructor(root: HTMLElement, private readonly simulator: Simulator) {
    root.append(
      make(
        "p",
        {},
        "The middle joint of a simulated index finger follows the dashed line: the device measures its ",
        "angle, computes the voltages of two flexor points and the extensor (channels 1 to 3), and emits ",
        "the pulses that you see. Channels 4 to 10 stimulate muscles of their own, at a constant current.",
      ),
      make(
        "div",
        { class: "row" },
        this.play,
        this.step,
        make("button", { click: () => void this.open() }, "Start again"),
        this.speedChoice(),
      ),
      this.problem,
      this.status,
      make(
        "div",
        { class: "columns" },
        make("div", { class: "panel" }, make("h2", {}, "Finger"), this.fingers, this.controllerChoice()),
        make("div", { class: "panel" }, make("h2", {}, "Angle"), this.plotPlace),
      ),
      make("div", { class: "panel" }, make("h2", {}, "Change something"), this.controls()),
      make(
        "div",
        { class: "columns" },
        make(
          "div",
          { class: "panel" },
          make("h2", {}, "Pulses, 100 ms"),
          this.wide.element,
          make(
            "p",
            { class: "note" },
            "Up: anodic. Down: cathodic; full height is the channel's limit. Thick line: grounded, after a ",
            "pulse, and while the other flexor point pulses, so that current can flow between both. Thin ",
            "line: disconnected.",
          ),
        ),
        make("div", { class: "panel" }, make("h2", {}, "The latest pulse, 3 ms"), this.fine.element, this.table.element),
      ),
    );
    this.showButtons();
    document.addEventListener("part", (event) => {
      this.shown = (event as CustomEvent<string>).detail === "watch";
    });
    this.shown = !root.hidden;
    document.addEventListener("visibilitychange", () => this.visibility());
    void this.open();
    requestAnimationFrame((at) => this.frame(at));
  }

  private speedChoice(): HTMLElement {
    return choice({
      label: "Speed",
      values: [
        ["0.05", "1/20"],
        ["0.25", "1/4"],
        ["1", "real time"],
        ["4", "× 4"],
      ],
      value: "1",
      change: (value) => {
        this.speed = Number(value);
      },
    }).element;
  }

  private controllerChoice(): HTMLElement {
    const boxes = CONTROLLERS.map(({ law, name, about }) => {
      const box = make("input", {
        type: "checkbox",
        checked: this.laws.includes(law),
        change: () => {
          const set = new Set(this.laws);
          if (box.checked) {
            set.add(law);
          } else {
            set.delete(law);
          }
          this.laws = CONTROLLERS.map((known) => known.law).filter((known) => set.has(known));
          void this.open();
        },
      });
      return make("div", {}, make("label", {}, box, ` ${name}`), make("span", { class: "note" }, `: ${about}`));
    });
    const legend = make("legend", {}, "Controllers");
    const note = "Each has its own copy of the same wearer, with the same noise. A change starts again.";
    return make("fieldset", {}, legend, ...boxes, make("p", { class: "note" }, note));
  }

  private controls(): HTMLElement {
    const p = this.parameters;
    // Changes that need a new setup of the device start the session again.
    const setup = (change: (value: number) => void) => (value: number) => {
      change(value);
      clearTimeout(this.reopen);
      this.reopen = window.setTimeout(() => void this.open(), 250);
    };
    const reference = choice({
      label: "Wanted angle",
      values: [
        ["sine", "a sine"],
        ["hold", "one angle"],
      ],
      value: "sine",
      change: (value) => {
        this.reference.isSine = value === "sine";
      },
    });
    const sliders = [
      slider({
        label: "Middle of the sine, or the one angle",
        min: 10, max: 85, step: 1, value: 45,
        format: (v) => `${v}°`,
        change: (v) => { this.reference.offset_deg = v; },
      }),
      slider({
        label: "Swing of the sine",
        min: 0, max: 45, step: 1, value: 35,
        format: (v) => `± ${v}°`,
        change: (v) => { this.reference.swing_deg = v; },
      }),
      slider({
        label: "Amplitude of channels 4 to 10",
        min: 0, max: 14, step: 0.5, value: 10,
        format: (v) => `${v} mA`,
        change: (v) => { this.free_ma = v; },
      }),
      slider({
        label: "Pulse rate",
        min: 20, max: 100, step: 5, value: p.rate_hz,
        format: (v) => `${v} Hz`,
        change: setup((v) => { p.rate_hz = v; }),
      }),
      slider({
        label: "Phase of flexor B after flexor A",
        min: 0, max: 9000, step: 100, value: p.phase_us,
        format: (v) => `${v} µs`,
        change: setup((v) => { p.phase_us = v; }),
      }),
      slider({
        label: "Strength of the muscles",
        min: 40, max: 160, step: 5, value: 100,
        format: (v) => `${v} %`,
        change: setup((v) => { p.strength = v / 100; }),
      }),
      slider({
        label: "Delay from pulse to muscle",
        min: 5, max: 150, step: 5, value: p.delay_ms,
        format: (v) => `${v} ms`,
        change: setup((v) => { p.delay_ms = v; }),
      }),
      slider({
        label: "Disturbance: somebody bends the finger",
        min: -100, max: 100, step: 5, value: 0,
        format: (v) => `${v} mN·m`,
        change: (v) => { this.external_nm = v / 1000; },
      }),
      slider({
        label: "References lost on the way to the device",
        min: 0, max: 95, step: 5, value: 0,
        format: (v) => `${v} %`,
        change: (v) => { this.dropped = v / 100; },
      }),
    ];
    const note = "Pulse rate, phase, strength and delay belong to the setup: a change starts the session again.";
    const all = make("div", { class: "scene-controls" }, reference.element, ...sliders.map((s) => s.element));
    return make("div", {}, make("p", { class: "note" }, note), all);
  }

  // Starts the session again, once for each controller.
  private async open(): Promise<void> {
    const turn = ++this.turn;
    while (this.busy) {
      await new Promise((done) => setTimeout(done, 5));
    }
    if (turn !== this.turn) {
      return;
    }
    this.busy = true;
    this.problem.hidden = true;
    for (const trace of this.traces) {
      await this.simulator.drop(trace.id);
    }
    this.traces = [];
    this.times = [];
    this.wanted = [];
    this.now_us = 0;
    this.random = new Random(SEED);
    this.fingers.replaceChildren();
    const text = sceneText(this.parameters);
    try {
      for (const { law, name } of CONTROLLERS.filter((known) => this.laws.includes(known.law))) {
        const { id, session } = await this.simulator.open({ name: "scene.toml", text, seed: SEED, law, live: true });
        const finger = new Finger(name);
        this.fingers.append(finger.element);
        const output = new Output(session.channels, 300_000);
        this.traces.push({ law, id, finger, angles: [], deg: 5, output });
      }
    } catch (error) {
      this.tell(error);
    }
    const lines = CONTROLLERS.filter((known) => this.traces.some((trace) => trace.law === known.law));
    this.plot = new Plot({
      title: "Wanted angle and simulated angles of the last ten seconds",
      unit: "angle (°)",
      range: [0, 100],
      lines: [
        { label: "wanted", color: "reference", dash: [5, 4] },
        ...lines.map((known) => ({ label: known.name, color: known.color })),
      ],
    });
    this.plotPlace.replaceChildren(this.plot.element);
    this.busy = false;
    if (this.traces.length === 0 && this.problem.hidden) {
      this.status.textContent = "Choose a controller.";
    } else {
      await this.advance(200_000); // so that there is something to see
    }
  }

  // Lets `length_us` of simulated time pass.
  private async advance(length_us: number): Promise<void> {
    if (this.busy || this.traces.length === 0) {
      return;
    }
    this.busy = true;
    const steps: { to_us: number; send?: Setpoints }[] = [];
    const end_us = this.now_us + length_us;
    // References are sent on a fixed grid, so that the result does not depend on the frames.
    while (this.now_us + STEP_US <= end_us) {
      const [deg, rate] = this.reference.at(this.now_us / 1e6);
      const send: Setpoints = { external_nm: this.external_nm };
      if (this.random.next() >= this.dropped) {
        send.angle_deg = [deg, rate];
      }
      // A request of its own, so that a refused amplitude does not hold back the reference.
      const ma: [number, number][] = FREE_CHANNELS.map((channel) => [channel, this.free_ma]);
      steps.push({ to_us: this.now_us + 1, send: { ma } });
      this.now_us += STEP_US;
      steps.push({ to_us: this.now_us, send });
      this.times.push(this.now_us / 1e6);
      this.wanted.push(deg);
    }
    try {
      let refused: string | undefined;
      for (const trace of this.traces) {
        const news = await this.simulator.course(trace.id, steps);
        this.take(trace, news);
        refused ??= news.findLast((item) => item.refused)?.refused;
      }
      this.showRefusal(refused);
    } catch (error) {
      this.tell(error);
      this.running = false;
      this.showButtons();
    }
    const kept = Math.round(WINDOW_S * RATE_HZ);
    for (const list of [this.times, this.wanted, ...this.traces.map((trace) => trace.angles)]) {
      list.splice(0, Math.max(0, list.length - kept));
    }
    this.drawAll();
    this.busy = false;
  }

  // Shows why the amplitudes of the sliders are refused; the device keeps the latest that it accepted.
  private showRefusal(refused: string | undefined): void {
    this.problem.hidden = refused === undefined;
    const first = refused?.split("; E").at(0);
    this.problem.textContent = `Refused, and the amplitudes before remain. ${first ?? ""}`;
  }

  private take(trace: Trace, news: News[]): void {
    for (const [i, item] of news.entries()) {
      const angles = item.samples?.true_deg ?? [];
      trace.deg = angles.findLast((deg) => deg !== null) ?? trace.deg;
      if (i % 2 === 1) {
        trace.angles.push(trace.deg); // two steps for each reference
      }
      trace.output.add(item.edges ?? [], (item.t_s ?? 0) * 1e6 - 1000);
      if (item.end) {
        throw new CallError(item.end.error ?? "the session has ended");
      }
    }
    const amplitudes = news.at(-1)?.samples?.amplitudes;
    if (trace === this.traces[0] && amplitudes && amplitudes.length > 0) {
      this.table.show(trace.output.channels, amplitudes.map((column) => column.at(-1) ?? null));
    }
  }

  private drawAll(): void {
    const wanted = this.wanted.at(-1) ?? null;
    for (const trace of this.traces) {
      trace.finger.show(trace.deg, wanted);
    }
    this.plot?.set(this.times, this.wanted, ...this.traces.map((trace) => trace.angles));
    const first = this.traces[0];
    if (first) {
      this.wide.draw(first.output, first.output.until_us - 100_000);
      this.fine.draw(first.output, first.output.latestPulse(3_000) - 150);
    }
    const told = `${(this.now_us / 1e6).toFixed(1)} s of simulated time`;
    this.status.textContent = this.waiting
      ? `${told}. The simulation waited while this tab was in the background.`
      : `${told}.`;
  }

  private frame(at_ms: number): void {
    requestAnimationFrame((next) => this.frame(next));
    const passed_ms = Math.min(at_ms - this.frame_ms, LONGEST_FRAME_MS);
    this.frame_ms = at_ms;
    if (!this.running || !this.shown) {
      this.owed_us = 0;
      return;
    }
    this.owed_us = Math.min(this.owed_us + passed_ms * 1000 * this.speed, MOST_OWED_US);
    if (!this.busy && this.owed_us >= STEP_US) {
      const length_us = Math.floor(this.owed_us / STEP_US) * STEP_US;
      this.owed_us -= length_us;
      void this.advance(length_us + STEP_US / 2);
    }
  }

  private async single(): Promise<void> {
    this.running = false;
    this.showButtons();
    await this.advance(20_000 + STEP_US / 2);
  }

  private toggle(): void {
    this.running = !this.running;
    this.waiting = false;
    this.showButtons();
  }

  private showButtons(): void {
    this.play.textContent = this.running ? "Pause" : "Play";
  }

  private visibility(): void {
    if (document.hidden) {
      this.waiting = this.running;
    }
  }

  private tell(error: unknown): void {
    const mistakes = error instanceof CallError ? error.mistakes : [];
    const lines = mistakes.map((m) => `${m.number} ${m.message}${m.help ? `; ${m.help}` : ""}`);
    this.problem.textContent = [(error as Error).message, ...lines].join(": ");
    this.problem.hidden = false;
  }
}

// Shows the part in `root`.
export function mountScene(root: HTMLElement, simulator: Simulator): void {
  new Scene(root, simulator);
}
