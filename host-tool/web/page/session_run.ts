// A run of a session: its controls, progress, results and record.

import type { Action, News, SessionInfo, Simulator } from "./api";
import { download, folderName, zipRecord } from "./archive";
import { choice, make } from "./dom";
import { Results, readMarkers } from "./results";
import { Keys } from "./session_keys";
import { channelOf, drivenReasons, reasonOfNoEdges } from "./session_reasons";

// Time of a slice as fast as possible, between which the page and other requests are served.
const SLICE_MS = 30;
// Longest step of the simulation, µs: it keeps the output of 0.5 s for the page.
const LONGEST_STEP_US = 250_000;
// Words of the simulator's reason why a channel cannot be raised or lowered during the whole run.
const NO_INTENSITY = "has no intensity";
// Longest note of a mark, characters.
const LONGEST_NOTE = 120;

export interface Opening {
  name: string;
  text: string;
  seed: string;
  law?: string;
}

interface Run {
  id: number;
  text: string;
  // Whether the text differs from the session that was chosen.
  isEdited: boolean;
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
  // Channels that cannot be raised or lowered, with the reasons.
  driven: Map<number, string>;
}

// Shows one run at a time. A new run replaces the previous one and its record.
export class RunPanel {
  readonly element: HTMLElement;
  private run: Run | null = null;
  private speed = 1;
  private isVisible = false;
  // Latest text of the editor.
  private latest = "";
  private readonly heading = make("h2", { tabindex: "-1" }, "Run");
  private readonly status = make("p", { "aria-live": "polite" });
  private readonly age = make("p", { class: "note", hidden: true });
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
  private readonly drive = make("p", { class: "note", id: "run-drive", "aria-live": "polite" });
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
    const change = (): void => this.showDrive();
    const channel = choice({ label: "Channel", values: [], value: "", change });
    this.channels = channel.select;
    for (const control of [this.raise, this.lower]) {
      control.setAttribute("aria-describedby", this.drive.id);
    }
    this.element = make(
      "div",
      { class: "panel run", hidden: true },
      this.heading,
      this.age,
      this.status,
      this.failure,
      make("div", { class: "row" }, this.progress, this.clock),
      make("div", { class: "row" }, speed.element, this.pause, this.stop),
      make("div", { class: "row" }, channel.element, this.lower, this.raise),
      this.drive,
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
    const dark = matchMedia("(prefers-color-scheme: dark)");
    dark.addEventListener("change", () => this.run?.results.redrawLanes());
    new Keys({
      isActive: () => this.isRunning && this.isVisible,
      isPaused: () => this.run?.isPaused ?? false,
      togglePause: () => void this.togglePause(),
      raise: () => void this.act({ raise: this.channel }),
      lower: () => void this.act({ lower: this.channel }),
      step: (places) => this.stepChannel(places),
      mark: () => void this.setMark(),
    });
  }

  get isRunning(): boolean {
    return this.run !== null && !this.run.isOver;
  }

  // Opens a session and plays it. Fails with the mistakes of the session; the previous run and its
  // record then stay.
  async start(opening: Opening, isEdited: boolean): Promise<void> {
    const { id, session } = await this.simulator.open(opening);
    const previous = this.run;
    const run: Run = {
      id,
      text: opening.text,
      isEdited,
      info: session,
      started: new Date(),
      time_us: 0,
      isPaused: false,
      isStopping: false,
      isOver: false,
      results: new Results(session),
      markers: 0,
      report: null,
      driven: drivenReasons(session, opening.text),
    };
    this.run = run;
    if (previous) {
      previous.isOver = true;
      this.simulator.drop(previous.id).catch(() => undefined);
      if (previous.report) {
        URL.revokeObjectURL(previous.report);
      }
    }
    this.compare(opening.text);
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

  // Marks the run as a previous one if `text` is no longer its text.
  compare(text: string): void {
    const { run } = this;
    if (!run) {
      return;
    }
    const title = run.isEdited ? `${run.info.title} (edited)` : run.info.title;
    const isOld = text !== run.text;
    const begun = run.started.toLocaleTimeString("en-GB");
    const name = isOld && run.isOver ? "Previous run of" : "Run:";
    const heading = isOld ? `${name} ${title}, begun at ${begun}` : `Run: ${title}`;
    if (this.heading.textContent !== heading) {
      this.heading.textContent = heading;
    }
    this.age.hidden = !isOld;
    this.age.textContent = "The text in the editor is another one than that of this run.";
    this.latest = text;
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
        const pieces = await this.advance(run, to_us);
        const factor = SLICE_MS / Math.max(performance.now() - begin, 1);
        slice_us = clamp(slice_us * clamp(factor, 0.5, 2), 2_000, LONGEST_STEP_US);
        pieces.forEach((news) => this.receive(run, news, to_us));
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

  private async advance(run: Run, to_us: number): Promise<News[]> {
    if (to_us - run.time_us <= LONGEST_STEP_US) {
      return [await this.simulator.advance(run.id, to_us)];
    }
    const steps: { to_us: number }[] = [];
    for (let at = run.time_us; at < to_us; ) {
      at = Math.min(at + LONGEST_STEP_US, to_us);
      steps.push({ to_us: at });
    }
    return this.simulator.course(run.id, steps);
  }

  private receive(run: Run, news: News, to_us: number): void {
    if (run !== this.run || run.isOver) {
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
    const wasStopped = run.isStopping && time_s < run.info.duration_s;
    const told = wasStopped
      ? `Stopped after ${time_s.toFixed(1)} s. The record says that it was stopped.`
      : `Finished after ${time_s.toFixed(1)} s. The record is complete.`;
    this.showState(run, told);
    this.compare(this.latest);
    if (error !== null) {
      this.showState(run, `Ended early after ${time_s.toFixed(1)} s. The record says so.`);
      this.tellFailure(error);
    }
    try {
      await this.listMarkers(run);
      run.results.end(await this.read(run, "summary.json"));
      const edges = await this.read(run, "edges.csv");
      if (error === null && run === this.run && edges?.trim().split("\n").length === 1) {
        this.showState(run, `${told} ${reasonOfNoEdges(run.info.duration_s, time_s)}`);
      }
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
    this.showDrive();
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

  // Enables the buttons for the intensity of the chosen channel, or says why it has none.
  private showDrive(): void {
    const reason = this.run?.driven.get(this.channel) ?? "";
    const isOver = this.run?.isOver ?? true;
    this.raise.disabled = isOver || reason !== "";
    this.lower.disabled = isOver || reason !== "";
    if (this.drive.textContent !== reason) {
      this.drive.textContent = reason;
    }
    this.drive.hidden = reason === "";
  }

  private stepChannel(places: number): void {
    const last = this.channels.options.length - 1;
    this.channels.selectedIndex = clamp(this.channels.selectedIndex + places, 0, last);
    this.status.textContent = `Channel ${this.channels.selectedOptions[0]?.textContent}`;
    this.showDrive();
  }

  private async act(action: Action): Promise<void> {
    const { run } = this;
    if (!run || run.isOver) {
      return;
    }
    const channel = channelOf(action);
    const reason = channel === null ? undefined : run.driven.get(channel);
    if (reason !== undefined) {
      this.status.textContent = reason;
      return;
    }
    try {
      const { paused } = await this.simulator.act(run.id, action);
      run.isPaused = paused;
      const latest = await this.listMarkers(run);
      if (channel !== null && latest.includes(NO_INTENSITY)) {
        run.driven.set(channel, `${latest.replace(/^\w+: c/, "C")}.`);
      }
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
    const rows = readMarkers((await this.read(run, "markers.csv")) ?? "");
    let latest = "";
    for (const { time_s, text } of rows.slice(run.markers)) {
      run.results.addEvent(time_s, text);
      latest = text;
    }
    run.markers = Math.max(rows.length, run.markers);
    return latest;
  }

  // Returns the text of a file of the record; null if there is none.
  private async read(run: Run, name: string): Promise<string | null> {
    const files = await this.simulator.files(run.id);
    const path = files.map(([path]) => path).find((path) => path.endsWith(name));
    if (path === undefined) {
      return null;
    }
    return new TextDecoder().decode(await this.simulator.file(run.id, path));
  }

  private async save(): Promise<void> {
    const { run } = this;
    if (!run || !run.isOver) {
      return;
    }
    this.status.textContent = "Compressing the record…";
    const folder = folderName(run.info.title, run.started, run.isEdited);
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
}

function clamp(value: number, least: number, most: number): number {
  return Math.min(Math.max(value, least), most);
}
