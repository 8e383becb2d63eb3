// The editor of a session text, loaded when it is first needed: TOML colors, and mistakes at their
// place.

import { HighlightStyle, StreamLanguage, syntaxHighlighting } from "@codemirror/language";
import { toml } from "@codemirror/legacy-modes/mode/toml";
import { type Diagnostic, lintGutter, setDiagnostics } from "@codemirror/lint";
import { search, searchKeymap } from "@codemirror/search";
import { EditorState, type Extension, type Text } from "@codemirror/state";
import { EditorView, keymap, lineNumbers } from "@codemirror/view";
import { tags } from "@lezer/highlight";
import { minimalSetup } from "codemirror";
import type { Mistake } from "./api";

const colors = HighlightStyle.define([
  { tag: tags.comment, color: "var(--soft)" },
  { tag: tags.propertyName, color: "var(--s1)" },
  { tag: tags.string, color: "var(--s3)" },
  { tag: tags.number, color: "var(--s4)" },
  { tag: tags.atom, color: "var(--warn)", fontWeight: "600" },
]);

const theme = EditorView.theme({
  "&": { height: "100%", backgroundColor: "var(--paper)", color: "var(--ink)" },
  "&.cm-focused": { outline: "3px solid var(--accent)", outlineOffset: "-3px" },
  ".cm-scroller": { fontFamily: "ui-monospace, monospace", fontSize: "0.88rem" },
  ".cm-content": { caretColor: "var(--ink)" },
  ".cm-cursor": { borderLeftColor: "var(--ink)" },
  ".cm-gutters": {
    backgroundColor: "var(--panel)",
    color: "var(--soft)",
    borderRight: "1px solid var(--line)",
  },
  ".cm-selectionBackground": { backgroundColor: "var(--selection) !important" },
  ".cm-tooltip": {
    backgroundColor: "var(--panel)",
    color: "var(--ink)",
    border: "1px solid var(--line)",
    maxWidth: "min(30rem, 90vw)",
  },
  ".cm-diagnostic-error": { borderLeftColor: "var(--warn)" },
  ".cm-panels": { backgroundColor: "var(--panel)", color: "var(--ink)" },
  ".cm-panels.cm-panels-top": { borderBottom: "1px solid var(--line)" },
  ".cm-textfield, .cm-button": { backgroundImage: "none", backgroundColor: "var(--paper)" },
  ".cm-searchMatch": { backgroundColor: "var(--selection)" },
  ".cm-searchMatch-selected": { outline: "2px solid var(--accent)" },
});

export class Editor {
  private readonly view: EditorView;

  private readonly extensions: Extension;

  constructor(parent: HTMLElement, text: string, label: string, change: () => void) {
    this.extensions = [
      EditorView.cspNonce.of("flexor"),
      minimalSetup,
      lineNumbers(),
      lintGutter(),
      search({ top: true }),
      keymap.of(searchKeymap),
      StreamLanguage.define(toml),
      syntaxHighlighting(colors),
      theme,
      EditorView.domEventHandlers({ beforeinput: replaceSelection }),
      EditorView.contentAttributes.of({
        "aria-label": label,
        spellcheck: "false",
        tabindex: "0",
      }),
      EditorView.updateListener.of((update) => {
        if (update.docChanged) {
          change();
        }
      }),
    ];
    this.view = new EditorView({ parent, doc: text, extensions: this.extensions });
  }

  get text(): string {
    return this.view.state.doc.toString();
  }

  // Shows another text; its history of changes begins empty.
  set text(text: string) {
    this.view.setState(EditorState.create({ doc: text, extensions: this.extensions }));
  }

  // Changes the text where `text` differs; this can be undone.
  edit(text: string): void {
    const old = this.text;
    const shorter = Math.min(old.length, text.length);
    let from = 0;
    while (from < shorter && old[from] === text[from]) {
      from++;
    }
    let same = 0;
    while (same < shorter - from && old.at(-1 - same) === text.at(-1 - same)) {
      same++;
    }
    const changes = { from, to: old.length - same, insert: text.slice(from, text.length - same) };
    const effects = EditorView.scrollIntoView(from, { y: "center" });
    this.view.dispatch({ changes, effects, userEvent: "input" });
  }

  // Marks the mistakes that have a place.
  show(mistakes: Mistake[]): void {
    const { doc } = this.view.state;
    const diagnostics = mistakes.flatMap((mistake): Diagnostic[] => {
      const from = offsetOf(doc, mistake);
      if (from === null) {
        return [];
      }
      const { number, message, help } = mistake;
      const text = help ? `${number} ${message}\n${help}` : `${number} ${message}`;
      return [{ from, to: endOfWord(doc, from), severity: "error", message: text }];
    });
    diagnostics.sort((a, b) => a.from - b.from);
    this.view.dispatch(setDiagnostics(this.view.state, diagnostics));
  }

  goTo(mistake: Mistake): void {
    const anchor = offsetOf(this.view.state.doc, mistake) ?? 0;
    const effects = EditorView.scrollIntoView(anchor, { y: "center" });
    this.view.dispatch({ selection: { anchor }, effects });
    this.view.focus();
  }

  focus(): void {
    this.view.focus();
  }
}

// Replaces selected text by typed text. A browser that does so itself adds inline styles, which the
// policy of the page does not permit.
function replaceSelection(event: InputEvent, view: EditorView): boolean {
  const isTyped = event.inputType === "insertText" && !event.isComposing && event.data !== null;
  if (!isTyped || view.state.selection.main.empty) {
    return false;
  }
  event.preventDefault();
  view.dispatch(view.state.replaceSelection(event.data ?? ""), {
    userEvent: "input.type",
    scrollIntoView: true,
  });
  return true;
}

// Columns count characters, and JavaScript counts two for some of them.
function offsetOf(doc: Text, mistake: Mistake): number | null {
  if (mistake.line === null) {
    return null;
  }
  const line = doc.line(Math.min(Math.max(mistake.line, 1), doc.lines));
  const before = [...line.text].slice(0, Math.max((mistake.column ?? 1) - 1, 0)).join("");
  return line.from + before.length;
}

function endOfWord(doc: Text, from: number): number {
  const line = doc.lineAt(from);
  const rest = line.text.slice(from - line.from);
  const word = /^(\[+[^\]]*\]+|"[^"]*"?|'[^']*'?|[^\s,=\]}#]+|.)/u.exec(rest);
  return from + (word?.[0].length ?? 0);
}
