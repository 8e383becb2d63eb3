// A run of a session: its controls, progress, results and record.

import type { Action, News, SessionInfo, Simulator } from "./api";
import { download, folderName, zipRecord } from "./archive";
import { choice, make } from "./dom";
import { Results, readMarkers } from "./results";

// Time within which a repeated press of ↑ comes from a key that is held down or bounces, and time
// for which the space bar must stay untouched before it resumes; as in `flexor run --watch`.
const HELD_MS = 150;
const SETTLED_MS = 500;
// Time of a slice as fast as possible, between which the page and other requests are served.
const SLICE_MS = 30;
// Longest note of a mark, characters.
const LONGEST_NOTE = 120;

export interface Opening {
  name: string;
  text: string;
  seed: number;
  law?: string;
}

interface Run {
  id: number;
  info: SessionInfo;
  started: Date;
  time_us: number;
  isPaused: boolean;
  isStopping: boolean;
  isOver: boolean;
  results: Results;
  // Number of rows of markers.csv that are in the list of events.
  markers: number;
  report: string | null;
}

// Shows one run at a time. A new run replaces the previous one and its record.
export class RunPanel {
  readonly element: HTMLElement;
  private run: Run | null = null;
  private speed = 1;
  private isVisible = false;
  private raised = -Infinity;
  private spaced = -Infinity;
  private readonly heading = make("h2", { tabindex: "-1" }, "Run");
  private readonly status = make("p", { "aria-live": "polite" });
  private readonly failure = make("div", { class: "trouble", role: "alert", hidden: true });
  private readonly progress = make("progress", { "aria-label": "Progress of the run", max: "1" });
  private readonly clock = make("span", { class: "mono" });
  private readonly pause = this.button("Pause", () => this.togglePause());
  private readonly stop = this.button("Stop", () => this.stopRun());
  private readonly lower = this.button("Lower", () => this.act({ lower: this.channel }));
  private readonly raise = this.button("Raise", () => this.act({ raise: this.channel }));
  private readonly mark = this.button("Mark", () => this.setMark());
  private readonly zip = this.button("Download record (.zip)", () => this.save());
  private readonly view = this.button("View report", () => this.openReport());
  private readonly note = make("input", { type: "text", maxlength: String(LONGEST_NOTE) });
  private readonly channels: HTMLSelectElement;
  private readonly place = make("div", {});

  constructor(
    private readonly simulator: Simulator,
    private readonly stateChange: (isRunning: boolean) => void,
  ) {
    const speed = choice({
      label: "Speed",
      values: [
        ["1", "real time"],
        ["5", "× 5"],
        ["20", "× 20"],
        ["Infinity", "as fast as possible"],
      ],
      value: "1",
      change: (value) => {
        this.speed = Number(value);
      },
    });
    const channel = choice({ label: "Channel", values: [], value: "", change: () => undefined });
    this.channels = channel.select;
    this.element = make(
      "div",
      { class: "panel run", hidden: true },
      this.heading,
      this.status,
      this.failure,
      make("div", { class: "row" }, this.progress, this.clock),
      make("div", { class: "row" }, speed.element, this.pause, this.stop),
      make("div", { class: "row" }, channel.element, this.lower, this.raise),
      make("div", { class: "row" }, make("label", {}, "Note ", this.note), this.mark),
      make(
        "p",
        { class: "note" },
        "Keys, outside of text fields: space pauses and resumes, ↑ and ↓ change the intensity of " +
          "the channel by 5 % of the session's amplitudes, ← and → choose the channel, M marks. " +
          "The time of the session goes on during a pause, in real time.",
      ),
      make("div", { class: "row" }, this.zip, this.view),
      this.place,
    );
    new IntersectionObserver((entries) => {
      this.isVisible = entries[entries.length - 1].isIntersecting;
    }).observe(this.element);
    document.addEventListener("keydown", (event) => this.press(event));
  }

  get isRunning(): boolean {
    return this.run !== null && !this.run.isOver;
  }

  // Opens a session and plays it. Fails with the mistakes of the session; the previous run and its
  // record then stay.
  async start(opening: Opening): Promise<void> {
    const { id, session } = await this.simulator.open(opening);
    const previous = this.run;
    const run: Run = {
      id,
      info: session,
      started: new Date(),
      time_us: 0,
      isPaused: false,
      isStopping: false,
      isOver: false,
      results: new Results(session),
      markers: 0,
      report: null,
    };
    this.run = run;
    if (previous) {
      previous.isOver = true;
      this.simulator.drop(previous.id).catch(() => undefined);
      if (previous.report) {
        URL.revokeObjectURL(previous.report);
      }
    }
    this.heading.textContent = `Run: ${session.title}`;
    this.place.replaceChildren(run.results.element);
    this.channels.replaceChildren(
      ...session.channels.map(({ number, name }) =>
        make("option", { value: String(number) }, `${number} ${name}`),
      ),
    );
    this.failure.hidden = true;
    this.element.hidden = false;
    this.showState(run, "The simulated session is running.");
    this.heading.focus();
    void this.play(run);
  }

  private get channel(): number {
    return Number(this.channels.value);
  }

  private button(text: string, click: () => unknown): HTMLButtonElement {
    return make("button", { type: "button", click: () => void click() }, text);
  }

  private async play(run: Run): Promise<void> {
    const end_us = run.info.duration_s * 1e6 + 1e6;
    let last = performance.now();
    let slice_us = 20_000;
    try {
      while (!run.isOver) {
        // A pause that lets time rush by would end the session.
        const speed = run.isPaused ? 1 : this.speed;
        const begin = performance.now();
        const passed_us = Math.min(begin - last, 100) * 1e3 * speed;
        const step_us = speed === Infinity ? slice_us : Math.max(passed_us, 1_000);
        last = begin;
        const to_us = Math.min(run.time_us + step_us, end_us);
        const news = await this.simulator.advance(run.id, to_us);
        const factor = SLICE_MS / Math.max(performance.now() - begin, 1);
        slice_us = clamp(slice_us * clamp(factor, 0.5, 2), 2_000, 1e6);
        this.receive(run, news, to_us);
        if (speed !== Infinity) {
          await new Promise((resolve) => setTimeout(resolve, 15));
        }
      }
    } catch (error) {
      if (!run.isOver) {
        run.isOver = true;
        this.showState(run, "The run has ended without a complete record.");
        this.tellFailure(error);
      }
    }
  }

  private receive(run: Run, news: News, to_us: number): void {
    if (run !== this.run) {
      return;
    }
    const { duration_s } = run.info;
    run.time_us = news.t_s === undefined ? to_us : Math.max(news.t_s * 1e6, run.time_us);
    const time_s = Math.min(run.time_us / 1e6, duration_s);
    this.progress.value = time_s / duration_s;
    this.clock.textContent = `${time_s.toFixed(1)} s of ${duration_s} s`;
    run.results.add(news, news.end !== undefined);
    if (news.end) {
      void this.finish(run, news.end.error, time_s);
    }
  }

  private async finish(run: Run, error: string | null, time_s: number): Promise<void> {
    run.isOver = true;
    const stopped = run.isStopping ? "Stopped" : "Finished";
    this.showState(run, `${stopped} after ${time_s.toFixed(1)} s. The record is complete.`);
    if (error !== null) {
      this.showState(run, `Ended early after ${time_s.toFixed(1)} s. The record says so.`);
      this.tellFailure(error);
    }
    try {
      await this.listMarkers(run);
      const bytes = await this.simulator.file(run.id, "report.html");
      // The report opens under the policy of this page, which permits only styles with this nonce.
      const html = new TextDecoder().decode(bytes);
      const styled = html.replace("<style>", '<style nonce="flexor">');
      run.report = URL.createObjectURL(new Blob([styled], { type: "text/html" }));
    } catch (reason) {
      this.tellFailure(reason);
    }
    this.showState(run);
  }

  private showState(run: Run, text?: string): void {
    if (run !== this.run) {
      return;
    }
    if (text !== undefined) {
      this.status.textContent = text;
    }
    const hadFocus = document.activeElement;
    for (const control of [this.pause, this.stop, this.lower, this.raise, this.mark]) {
      control.disabled = run.isOver;
    }
    this.pause.textContent = run.isPaused && !run.isOver ? "Resume" : "Pause";
    this.zip.disabled = !run.isOver;
    this.view.disabled = run.report === null;
    if (hadFocus instanceof HTMLButtonElement && hadFocus.disabled) {
      this.heading.focus({ preventScroll: true });
    }
    this.stateChange(!run.isOver);
  }

  private tellFailure(error: unknown): void {
    this.failure.textContent = error instanceof Error ? error.message : String(error);
    this.failure.hidden = false;
  }

  private async act(action: Action): Promise<void> {
    const { run } = this;
    if (!run || run.isOver) {
      return;
    }
    try {
      const { paused } = await this.simulator.act(run.id, action);
      run.isPaused = paused;
      const latest = await this.listMarkers(run);
      if (!run.isOver) {
        this.showState(run, `${paused ? "The session is paused. Latest action: " : ""}${latest}`);
      }
    } catch (error) {
      if (!run.isOver) {
        this.tellFailure(error);
      }
    }
  }

  private togglePause(): Promise<void> {
    return this.act(this.run?.isPaused ? "resume" : "pause");
  }

  private async stopRun(): Promise<void> {
    if (this.run) {
      this.run.isStopping = true;
      await this.act("stop");
    }
  }

  private async setMark(): Promise<void> {
    const text = this.note.value;
    this.note.value = "";
    await this.act({ mark: text });
  }

  // Adds the new actions in markers.csv to the list of events, and returns the latest one.
  private async listMarkers(run: Run): Promise<string> {
    const files = await this.simulator.files(run.id);
    const path = files.map(([name]) => name).find((name) => name.endsWith("markers.csv"));
    if (path === undefined) {
      return "";
    }
    const bytes = await this.simulator.file(run.id, path);
    const rows = readMarkers(new TextDecoder().decode(bytes));
    let latest = "";
    for (const { time_s, text } of rows.slice(run.markers)) {
      run.results.addEvent(time_s, text);
      latest = text;
    }
    run.markers = Math.max(rows.length, run.markers);
    return latest;
  }

  private async save(): Promise<void> {
    const { run } = this;
    if (!run || !run.isOver) {
      return;
    }
    this.status.textContent = "Compressing the record…";
    const folder = folderName(run.info.title, run.started);
    try {
      const paths = (await this.simulator.files(run.id)).map(([path]) => path);
      const read = (path: string): Promise<Uint8Array> => this.simulator.file(run.id, path);
      download(await zipRecord(folder, paths, read, run.started), `${folder}.zip`);
      this.status.textContent = `${folder}.zip has the folder that flexor run writes.`;
    } catch (error) {
      this.status.textContent = "";
      this.tellFailure(error);
    }
  }

  private openReport(): void {
    const report = this.run?.report;
    if (report && !open(report, "_blank")) {
      this.tellFailure(
        "The browser has not opened a new tab. Allow this page to open tabs, or download the " +
          "record, which contains report.html.",
      );
    }
  }

  private press(event: KeyboardEvent): void {
    const target = event.target instanceof Element ? event.target : document.body;
    const hasModifier = event.ctrlKey || event.altKey || event.metaKey || event.defaultPrevented;
    const isField = target.closest("input, textarea, select, [contenteditable]") !== null;
    if (!this.isRunning || !this.isVisible || hasModifier || isField) {
      return;
    }
    // The space bar presses a button that has the focus.
    if (event.key === " " && target.closest("button, a, summary")) {
      return;
    }
    if (this.actOnKey(event.key, event.repeat, performance.now())) {
      event.preventDefault();
    }
  }

  private actOnKey(key: string, isRepeated: boolean, now: number): boolean {
    switch (key) {
      case " ": {
        const isSettled = now - this.spaced >= SETTLED_MS && !isRepeated;
        this.spaced = now;
        if (!this.run?.isPaused || isSettled) {
          void (isRepeated ? null : this.togglePause());
        }
        return true;
      }
      case "ArrowUp": {
        const isHeld = isRepeated || now - this.raised < HELD_MS;
        this.raised = now;
        void (isHeld ? null : this.act({ raise: this.channel }));
        return true;
      }
      case "ArrowDown":
        void this.act({ lower: this.channel });
        return true;
      case "ArrowLeft":
      case "ArrowRight": {
        const step = key === "ArrowLeft" ? -1 : 1;
        const last = this.channels.options.length - 1;
        this.channels.selectedIndex = clamp(this.channels.selectedIndex + step, 0, last);
        this.status.textContent = `Channel ${this.channels.selectedOptions[0]?.textContent}`;
        return true;
      }
      case "m":
      case "M":
        void (isRepeated ? null : this.setMark());
        return true;
      default:
        return false;
    }
  }
}

function clamp(value: number, least: number, most: number): number {
  return Math.min(Math.max(value, least), most);
}
