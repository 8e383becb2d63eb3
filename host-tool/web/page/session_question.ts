// A question in the page, before an edited text is replaced by another one.

import { make } from "./dom";

export class Question {
  readonly element = make("div", { class: "question", role: "group", hidden: true });

  // Asks `text`, with the answers and what they do. Each answer closes the question.
  ask(text: string, answers: [string, () => void][]): void {
    const buttons = answers.map(([name, act]) => {
      const click = (): void => {
        this.close();
        act();
      };
      return make("button", { type: "button", click }, name);
    });
    this.element.setAttribute("aria-label", text);
    this.element.replaceChildren(make("p", {}, text), make("div", { class: "row" }, ...buttons));
    this.element.hidden = false;
    this.element.scrollIntoView({ block: "nearest" });
    buttons[0]?.focus();
  }

  close(): void {
    this.element.hidden = true;
    this.element.replaceChildren();
  }
}
