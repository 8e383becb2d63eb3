// The text of a session: a plain text field, which the editor replaces once it has loaded, and the
// list of mistakes.

import type { Mistake } from "./api";
import { make } from "./dom";
import type { Editor } from "./editor";
import { kilobytes } from "./share";

const LABEL = "Text of the session (TOML)";

let count = 0;

export class SessionText {
  readonly element: HTMLElement;
  private readonly area: HTMLTextAreaElement;
  private readonly box: HTMLElement;
  // List of the mistakes.
  readonly list = make("ol", { class: "session-mistakes" });
  private editor: Editor | null = null;
  private isLoading = false;
  private mistakes: Mistake[] = [];
  private isSetting = false;

  constructor(
    private readonly options: {
      longest: number;
      change: () => void;
      // Text of a file that was dropped, pasted or opened.
      receive: (name: string, text: string) => void;
      refuse: (reason: string) => void;
    },
  ) {
    const id = `session-text-${++count}`;
    this.area = make("textarea", { id, spellcheck: "false", wrap: "off", input: options.change });
    const label = make("label", { for: id }, LABEL);
    this.box = make("div", { class: "session-text" }, this.area);
    this.box.addEventListener("paste", (event) => this.take(event, event.clipboardData), true);
    this.box.addEventListener("drop", (event) => this.take(event, event.dataTransfer), true);
    this.box.addEventListener("dragover", (event) => event.preventDefault());
    this.element = make("div", {}, label, this.box);
  }

  get text(): string {
    return this.editor ? this.editor.text : this.area.value;
  }

  set text(text: string) {
    this.isSetting = true;
    if (this.editor) {
      this.editor.text = text;
    } else {
      this.area.value = text;
    }
    this.isSetting = false;
  }

  // Changes the text as an edit that can be undone.
  edit(text: string): void {
    if (this.editor) {
      this.editor.edit(text);
    } else {
      this.area.value = text;
      this.options.change();
    }
  }

  // Returns why the text is too long for the simulator; null if it is not.
  tooLong(): string | null {
    const { longest } = this.options;
    const { text } = this;
    const length = text.length > longest ? text.length : new TextEncoder().encode(text).length;
    return length > longest ? tooLong("The text", length, longest) : null;
  }

  // Loads the editor once. The plain text field stays if it cannot be loaded.
  async loadEditor(): Promise<void> {
    if (this.isLoading) {
      return;
    }
    this.isLoading = true;
    const { Editor } = await import("./editor");
    const hadFocus = document.activeElement === this.area;
    this.editor = new Editor(this.box, this.area.value, LABEL, () => {
      if (!this.isSetting) {
        this.options.change();
      }
    });
    this.area.remove();
    this.element.querySelector("label")?.replaceWith(make("p", { class: "label" }, LABEL));
    this.editor.show(this.mistakes);
    if (hadFocus) {
      this.editor.focus();
    }
  }

  // Shows mistakes at their place and as a list.
  show(mistakes: Mistake[]): void {
    this.mistakes = mistakes;
    this.editor?.show(mistakes);
    this.area.setAttribute("aria-invalid", String(mistakes.length > 0));
    this.list.replaceChildren(...mistakes.map((mistake) => this.row(mistake)));
  }

  // Reads a file as the new text.
  async read(file: File): Promise<void> {
    const { longest, receive, refuse } = this.options;
    if (file.size > longest) {
      refuse(tooLong(`The file ${file.name}`, file.size, longest));
      return;
    }
    try {
      const bytes = await file.arrayBuffer();
      receive(file.name, new TextDecoder("utf-8", { fatal: true }).decode(bytes));
    } catch {
      refuse(`The file ${file.name} is not a text in UTF-8, or cannot be read.`);
    }
  }

  private row(mistake: Mistake): HTMLElement {
    const { number, line, message, help } = mistake;
    const place = line === null ? null : `line ${line}`;
    return make(
      "li",
      {},
      make("strong", {}, number),
      " ",
      place && make("button", { type: "button", click: () => this.goTo(mistake) }, place),
      place && " ",
      message,
      help && make("div", { class: "note" }, help),
    );
  }

  private goTo(mistake: Mistake): void {
    if (this.editor) {
      this.editor.goTo(mistake);
      return;
    }
    const lines = this.area.value.split("\n");
    const before = lines.slice(0, (mistake.line ?? 1) - 1);
    const rest = [...(lines[before.length] ?? "")].slice(0, (mistake.column ?? 1) - 1).join("");
    const offset = before.reduce((sum, line) => sum + line.length + 1, 0) + rest.length;
    this.area.setSelectionRange(offset, offset);
    this.area.focus();
    this.area.scrollTop = (this.area.scrollHeight * before.length) / lines.length - 60;
  }

  // Takes files, and refuses texts that are too long before they reach the editor.
  private take(event: Event, data: DataTransfer | null): void {
    const file = data?.files[0];
    const text = data?.getData("text/plain") ?? "";
    const { longest } = this.options;
    if (!file && text.length <= longest) {
      return;
    }
    event.preventDefault();
    event.stopPropagation();
    if (file) {
      void this.read(file);
    } else {
      this.options.refuse(tooLong("The pasted or dropped text", text.length, longest));
    }
  }
}

function tooLong(subject: string, length: number, longest: number): string {
  return `${subject} has ${kilobytes(length)}; a session has at most ${kilobytes(longest)}.`;
}
