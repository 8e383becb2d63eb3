// The part "Sessions": choose or edit a session, run it, and keep or share the result.

import { type About, CallError, type Mistake, type SessionInfo, type Simulator } from "./api";
import { choice, make } from "./dom";
import { DrawsPanel } from "./draws";
import { openingComment } from "./session_edit";
import { QuickFields } from "./session_fields";
import { LinkRow } from "./session_link";
import { copyGroup, describe, groups } from "./session_list";
import { Question } from "./session_question";
import { RunPanel } from "./session_run";
import { type StoredText, isReload, readStore, writeStore } from "./session_store";
import { SessionText } from "./session_text";
import { parseFragment, textOfLink } from "./share";

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
  private readonly description = make("p", { class: "note description" });
  private readonly kept = make("p", { class: "note", "aria-live": "polite", hidden: true });
  private readonly question = new Question();
  private readonly fields: QuickFields;
  private readonly trouble = make("div", { class: "trouble", role: "alert", hidden: true });
  private readonly runButton: HTMLButtonElement;
  private readonly link = new LinkRow();
  // The text that was chosen: name of its file, label, and the text before any edits.
  private shown = { name: "session.toml", label: "", original: "" };
  // Entry of the list that is chosen, to return to.
  private entry = "";
  private copies: StoredText[] = [];
  private copyList = copyGroup([]);
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
      receive: (name, text) =>
        this.replace(() => this.showOwn(name, `${name} (your file)`, text)),
      refuse: (reason) => this.tell(reason),
    });
    this.panel = new RunPanel(simulator, (isRunning) => this.showRunning(isRunning));
    const shipped = choice({
      label: "Session",
      values: [],
      value: "",
      change: (value) => {
        this.shipped.value = this.entry;
        this.replace(() => this.openEntry(value));
      },
    });
    this.shipped = shipped.select;
    this.shipped.append(this.own, this.copyList, ...groups(about));
    this.fields = new QuickFields((text) => this.text.edit(text));
    this.law = choice({ label: "Controller", values: LAWS, value: "", change: () => undefined });
    this.law.element.hidden = true;
    const seed = { type: "text", inputmode: "numeric", value: String(SEED), class: "seed" };
    this.seed = make("input", seed);
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
          this.question.element,
          this.description,
          this.fields.element,
          this.text.element,
          this.kept,
          this.verdict,
          this.text.list,
          this.notes,
          make(
            "div",
            { class: "row" },
            make("label", {}, "Seed ", this.seed),
            this.law.element,
            this.runButton,
            share,
            this.link.status,
          ),
          this.link.element,
          this.trouble,
        ),
        this.panel.element,
      ),
      new DrawsPanel(simulator, about.record_format, (draw) => {
        this.replace(() => {
          this.showOwn(draw.name, draw.label, draw.text);
          this.seed.value = draw.seed;
        });
        this.root.scrollIntoView();
      }).element,
    );
  }

  // Shows the session that the address names, or the first one. A text that was edited before the
  // page was loaded again comes first.
  async openAddress(isFirst: boolean): Promise<void> {
    const target = parseFragment(location.hash);
    const stored = isFirst ? readStore() : null;
    if (stored) {
      this.copies = stored.copies;
      this.listCopies();
      const isSame = isReload() && stored.fragment === location.hash;
      if (stored.edited && (target === null || isSame)) {
        this.showStored(stored.edited);
        return;
      }
      if (stored.edited) {
        this.copies.push(stored.edited);
        this.listCopies();
        this.store();
      }
    }
    if (target?.kind === "text") {
      try {
        const text = textOfLink(target.data, this.about.longest_text);
        this.replace(() => this.showOwn("session.toml", "session from a link", text));
        return;
      } catch (error) {
        this.tell((error as Error).message);
      }
    } else if (target) {
      const name = target.name.replace(/\.toml$/, "");
      if (this.about.sessions.some((session) => session.name === name)) {
        this.replace(() => void this.choose(name));
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

  private get isEdited(): boolean {
    return this.text.text !== this.shown.original;
  }

  // Carries out `next`, which shows another text. Edits are kept or discarded first.
  private replace(next: () => void): void {
    if (!this.isEdited) {
      this.question.close();
      next();
      return;
    }
    const change = (keeps: boolean) => (): void => {
      if (keeps) {
        this.copies.push(this.storedText());
        this.listCopies();
      }
      next();
      this.shipped.focus();
    };
    this.question.ask(`The text of ${this.shown.label} is edited. Keep a copy of it in the list?`, [
      ["Keep a copy", change(true)],
      ["Discard", change(false)],
      ["Stay with this text", () => this.shipped.focus()],
    ]);
  }

  private openEntry(value: string): void {
    const copy = value.startsWith("copy:") ? this.copies[Number(value.slice(5))] : null;
    if (copy) {
      this.copies = this.copies.filter((kept) => kept !== copy);
      this.listCopies();
      this.showStored(copy);
    } else {
      void this.choose(value);
    }
  }

  private async choose(name: string, clearsTrouble = true): Promise<void> {
    const load = ++this.loads;
    try {
      const { file, text } = await this.simulator.session(name);
      if (load === this.loads) {
        this.shipped.value = name;
        this.own.hidden = true;
        const label = this.shipped.selectedOptions[0]?.textContent ?? name;
        const path = file.endsWith(".toml") ? file : `${file}.toml`;
        this.show({ name: path, label, text, original: text }, clearsTrouble);
      }
    } catch (error) {
      this.tell((error as Error).message);
    }
  }

  // Shows a text that is not shipped.
  private showOwn(name: string, label: string, text: string): void {
    this.showStored({ name, label, text, original: text });
  }

  private showStored(stored: StoredText): void {
    this.loads += 1;
    this.selectOwn(stored.text === stored.original ? stored.label : `${stored.label}, edited`);
    this.show(stored, true);
  }

  private selectOwn(label: string): void {
    this.own.textContent = label;
    this.own.hidden = false;
    this.own.selected = true;
  }

  private show(stored: StoredText, clearsTrouble: boolean): void {
    const { name, label, text, original } = stored;
    this.shown = { name, label, original };
    this.entry = this.shipped.value;
    this.text.text = text;
    this.fields.clear();
    this.link.hide();
    this.law.select.value = "";
    if (clearsTrouble) {
      this.trouble.hidden = true;
    }
    this.followText();
    this.checkAfter(0);
  }

  private changed(): void {
    this.selectOwn(this.isEdited ? `${this.shown.label}, edited` : this.shown.label);
    this.entry = this.shipped.value;
    this.link.hide();
    this.trouble.hidden = true;
    this.followText();
    this.checkAfter(CHECK_DELAY_MS);
  }

  // Updates what depends on the text.
  private followText(): void {
    const { text } = this.text;
    this.description.textContent = openingComment(text);
    this.description.hidden = this.description.textContent === "";
    this.panel.compare(text);
    const isStored = this.store();
    const copies = this.copies.length > 0 ? " The list has your copies of edited texts." : "";
    const edits = isStored
      ? "Edited. This tab keeps the text when the page is loaded again, until it is closed."
      : "Edited. The browser does not keep the text when the page is loaded again.";
    this.kept.textContent = ((this.isEdited ? edits : "") + copies).trim();
    this.kept.hidden = this.kept.textContent === "";
  }

  private storedText(): StoredText {
    return { ...this.shown, text: this.text.text };
  }

  private store(): boolean {
    return writeStore(this.isEdited ? this.storedText() : null, this.copies);
  }

  private listCopies(): void {
    const list = copyGroup(this.copies);
    this.copyList.replaceWith(list);
    this.copyList = list;
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
    const { text, name } = this.storedText();
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
    this.fields.show(this.text.text, info);
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
    const seed = this.seed.value.trim();
    const reason = this.text.tooLong();
    if (reason !== null) {
      this.tell(reason);
      return;
    }
    if (!/^\d{1,20}$/.test(seed) || BigInt(seed) >= 1n << 64n) {
      this.tell("The seed must be a whole number from 0 to 18446744073709551615 (64 bits).");
      this.seed.focus();
      return;
    }
    this.isStarting = true;
    this.trouble.hidden = true;
    this.runButton.textContent = "Starting…";
    const law = this.law.element.hidden ? "" : this.law.select.value;
    const { text, name } = this.storedText();
    try {
      await this.panel.start({ name, text, seed, ...(law ? { law } : {}) }, this.isEdited);
    } catch (error) {
      const mistakes = error instanceof CallError ? error.mistakes : [];
      if (mistakes.length > 0) {
        this.showError(error);
        this.panel.compare(""); // what is shown is an earlier run
        this.tell("The session was not run, because it has mistakes; they are listed above.");
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
      this.link.show(this.text.text);
    } catch (error) {
      this.link.hide();
      this.tell((error as Error).message);
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

function shorten(name: string): string {
  return name.length > 60 ? `${name.slice(0, 60)}…` : name;
}
