// The part "Sessions": choose or edit a session, run it, and keep or share the result.

import { type About, CallError, type Mistake, type SessionInfo, type Simulator } from "./api";
import { choice, make } from "./dom";
import { RunPanel } from "./session_run";
import { SessionText } from "./session_text";
import { linkTo, parseFragment, textOfLink } from "./share";

// Time after the last change of the text, after which it is checked, ms.
const CHECK_DELAY_MS = 300;
// Seed of `flexor run`.
const SEED = 1;
const FIRST = "ten_channels_and_finger";

const LAWS: [string, string][] = [
  ["", "the session's own"],
  ["paper", "paper: Hamana 2022, sign corrected"],
  ["recommended", "recommended: super-twisting"],
  ["pid", "pid: PID controller"],
];

class SessionsPart {
  private readonly text: SessionText;
  private readonly panel: RunPanel;
  private readonly shipped: HTMLSelectElement;
  private readonly own = make("option", { value: "", hidden: true }, "");
  private readonly law: { element: HTMLElement; select: HTMLSelectElement };
  private readonly seed: HTMLInputElement;
  private readonly verdict = make("p", { "aria-live": "polite", class: "verdict" });
  private readonly notes = make("ul", { class: "note" });
  private readonly trouble = make("div", { class: "trouble", role: "alert", hidden: true });
  private readonly runButton: HTMLButtonElement;
  private readonly link = make("input", { type: "text", readonly: true, class: "mono" });
  private readonly linkRow: HTMLElement;
  private readonly linkStatus = make("span", { "aria-live": "polite" });
  // Name of the file that the text belongs to.
  private name = "session.toml";
  private isChecking = false;
  private isCheckDue = false;
  private timer = 0;
  private loads = 0;
  private isStarting = false;

  constructor(
    private readonly root: HTMLElement,
    private readonly simulator: Simulator,
    private readonly about: About,
  ) {
    this.text = new SessionText({
      longest: about.longest_text,
      change: () => this.changed(),
      receive: (name, text) => this.showOwn(name, `${name} (your file)`, text),
      refuse: (reason) => this.tell(reason),
    });
    this.panel = new RunPanel(simulator, (isRunning) => this.showRunning(isRunning));
    const shipped = choice({
      label: "Session",
      values: [],
      value: "",
      change: (name) => void this.choose(name),
    });
    this.shipped = shipped.select;
    this.shipped.append(this.own, ...groups(about));
    this.law = choice({ label: "Controller", values: LAWS, value: "", change: () => undefined });
    this.law.element.hidden = true;
    this.seed = make("input", {
      type: "number",
      min: "0",
      step: "1",
      value: String(SEED),
      class: "seed",
    });
    this.runButton = make(
      "button",
      { type: "button", class: "main", click: () => void this.run() },
      "Run",
    );
    const file = make("input", { type: "file", accept: ".toml,text/plain", class: "file" });
    file.addEventListener("change", () => {
      const [chosen] = file.files ?? [];
      file.value = "";
      if (chosen) {
        void this.text.read(chosen);
      }
    });
    this.linkRow = make(
      "div",
      { class: "row link-row", hidden: true },
      make("label", {}, "Link ", this.link),
      make("button", { type: "button", click: () => void this.copy() }, "Copy"),
    );
    const share = make("button", { type: "button", click: () => this.share() }, "Link to share");
    root.append(
      make("h2", {}, "Play a session"),
      make(
        "p",
        {},
        "Choose a session or edit its text, as flexor run plays it. The device code, the muscles " +
          "and the limb are simulated in this page, and nothing leaves it.",
      ),
      make(
        "div",
        { class: "sessions" },
        make(
          "div",
          { class: "panel session-choice" },
          shipped.element,
          make("div", { class: "row" }, make("label", {}, "Or open a file ", file)),
          this.text.element,
          this.verdict,
          this.notes,
          make(
            "div",
            { class: "row" },
            make("label", {}, "Seed ", this.seed),
            this.law.element,
            this.runButton,
            share,
            this.linkStatus,
          ),
          this.linkRow,
          this.trouble,
        ),
        this.panel.element,
      ),
    );
  }

  // Shows the session that the address names, or the first one.
  async openAddress(isFirst: boolean): Promise<void> {
    const target = parseFragment(location.hash);
    if (target?.kind === "text") {
      try {
        const text = textOfLink(target.data, this.about.longest_text);
        this.showOwn("session.toml", "session from a link", text);
        return;
      } catch (error) {
        this.tell((error as Error).message);
      }
    } else if (target) {
      const name = target.name.replace(/\.toml$/, "");
      if (this.about.sessions.some((session) => session.name === name)) {
        await this.choose(name);
        return;
      }
      this.tell(`There is no shipped session "${shorten(target.name)}". Choose one from the list.`);
    }
    if (isFirst) {
      const { sessions } = this.about;
      const first = sessions.find(({ name }) => name === FIRST) ?? sessions[0];
      await this.choose(first.name, false);
    }
  }

  // Loads the editor when the part is first shown.
  prepare(): void {
    if (!this.root.hidden) {
      void this.text.loadEditor().catch(() => undefined); // the plain text field stays
    }
  }

  private async choose(name: string, clearsTrouble = true): Promise<void> {
    const load = ++this.loads;
    try {
      const { file, text } = await this.simulator.session(name);
      if (load === this.loads) {
        this.shipped.value = name;
        this.own.hidden = true;
        this.show(file.endsWith(".toml") ? file : `${file}.toml`, text, clearsTrouble);
      }
    } catch (error) {
      this.tell((error as Error).message);
    }
  }

  // Shows a text that is not shipped.
  private showOwn(name: string, label: string, text: string): void {
    this.loads += 1;
    this.own.textContent = label;
    this.own.hidden = false;
    this.own.selected = true;
    this.show(name, text, true);
  }

  private show(name: string, text: string, clearsTrouble: boolean): void {
    this.name = name;
    this.text.text = text;
    this.linkRow.hidden = true;
    this.linkStatus.textContent = "";
    this.law.select.value = "";
    if (clearsTrouble) {
      this.trouble.hidden = true;
    }
    this.checkAfter(0);
  }

  private changed(): void {
    const chosen = this.shipped.selectedOptions[0];
    if (chosen && chosen !== this.own) {
      this.own.textContent = `${chosen.textContent}, edited`;
      this.own.hidden = false;
      this.own.selected = true;
    }
    this.linkRow.hidden = true;
    this.linkStatus.textContent = "";
    this.trouble.hidden = true;
    this.checkAfter(CHECK_DELAY_MS);
  }

  private checkAfter(delay_ms: number): void {
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => void this.check(), delay_ms);
  }

  // Checks the text, one check at a time: a check that chooses models plays the session.
  private async check(): Promise<void> {
    if (this.isChecking) {
      this.isCheckDue = true;
      return;
    }
    const tooLong = this.text.tooLong();
    if (tooLong !== null) {
      this.showVerdict(tooLong, [], null);
      return;
    }
    this.isChecking = true;
    const { text, name } = { text: this.text.text, name: this.name };
    const isCurrent = (): boolean => text === this.text.text;
    try {
      const info = await this.simulator.check(name, text);
      if (isCurrent()) {
        this.showVerdict(describe(info), [], info);
      }
    } catch (error) {
      if (isCurrent()) {
        this.showError(error);
      }
    }
    this.isChecking = false;
    if (this.isCheckDue) {
      this.isCheckDue = false;
      void this.check();
    }
  }

  private showError(error: unknown): void {
    const { message } = error as Error;
    const mistakes = error instanceof CallError ? error.mistakes : [];
    const count = mistakes.length === 1 ? "1 mistake" : `${mistakes.length} mistakes`;
    this.showVerdict(mistakes.length > 0 ? `The session has ${count}:` : message, mistakes, null);
  }

  private showVerdict(text: string, mistakes: Mistake[], info: SessionInfo | null): void {
    if (this.verdict.textContent !== text) {
      this.verdict.textContent = text;
    }
    this.verdict.classList.toggle("trouble", info === null);
    this.text.show(mistakes);
    this.notes.replaceChildren(...(info?.notes ?? []).map((note) => make("li", {}, note)));
    this.notes.hidden = !info?.notes.length;
    if (info) {
      this.law.element.hidden = !info.has_joint;
    }
  }

  private async run(): Promise<void> {
    if (this.isStarting || this.panel.isRunning) {
      return;
    }
    const seed = Number(this.seed.value);
    const reason = this.text.tooLong();
    if (reason !== null) {
      this.tell(reason);
      return;
    }
    if (this.seed.value.trim() === "" || !Number.isSafeInteger(seed) || seed < 0) {
      this.tell(`The seed must be a whole number from 0 to ${Number.MAX_SAFE_INTEGER}.`);
      this.seed.focus();
      return;
    }
    this.isStarting = true;
    this.trouble.hidden = true;
    this.runButton.textContent = "Starting…";
    const law = this.law.element.hidden ? "" : this.law.select.value;
    const { text, name } = { text: this.text.text, name: this.name };
    try {
      await this.panel.start({ name, text, seed, ...(law ? { law } : {}) });
    } catch (error) {
      const mistakes = error instanceof CallError ? error.mistakes : [];
      if (mistakes.length > 0) {
        this.showError(error);
        this.tell("The session was not run, because it has mistakes; they are listed here.");
      } else {
        this.tell((error as Error).message);
      }
    }
    this.isStarting = false;
    this.showRunning(this.panel.isRunning);
  }

  private showRunning(isRunning: boolean): void {
    this.runButton.disabled = isRunning;
    this.runButton.textContent = isRunning ? "Running" : "Run";
  }

  private share(): void {
    this.trouble.hidden = true;
    try {
      const reason = this.text.tooLong();
      if (reason !== null) {
        throw new Error(reason);
      }
      this.link.value = linkTo(this.text.text);
      this.linkRow.hidden = false;
      this.linkStatus.textContent = "The link contains the text of the session.";
      this.link.focus();
      this.link.select();
    } catch (error) {
      this.linkRow.hidden = true;
      this.linkStatus.textContent = "";
      this.tell((error as Error).message);
    }
  }

  private async copy(): Promise<void> {
    try {
      await navigator.clipboard.writeText(this.link.value);
      this.linkStatus.textContent = "Copied.";
    } catch {
      this.link.focus();
      this.link.select();
      this.linkStatus.textContent = "The browser does not permit copying; use Ctrl+C.";
    }
  }

  private tell(message: string): void {
    this.trouble.textContent = message;
    this.trouble.hidden = false;
  }
}

export function mountSessions(root: HTMLElement, simulator: Simulator, about: About): void {
  const part = new SessionsPart(root, simulator, about);
  void part.openAddress(true);
  part.prepare();
  addEventListener("hashchange", () => void part.openAddress(false));
  document.addEventListener("part", () => part.prepare());
}

// Returns the shipped sessions, those of a folder as a group.
function groups(about: About): HTMLElement[] {
  const folders = new Map<string, HTMLElement>();
  const single: HTMLElement[] = [];
  for (const { name, title } of about.sessions) {
    const option = make("option", { value: name }, `${title} (${name.split("/").pop()})`);
    const folder = name.includes("/") ? name.split("/")[0] : "";
    if (folder === "") {
      single.push(option);
      continue;
    }
    const group = folders.get(folder) ?? make("optgroup", { label: folder });
    folders.set(folder, group);
    group.append(option);
  }
  return [...single, ...folders.values()];
}

function describe(info: SessionInfo): string {
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

function shorten(name: string): string {
  return name.length > 60 ? `${name.slice(0, 60)}…` : name;
}
