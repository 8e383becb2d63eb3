// The link that contains the text of a session.

import { make } from "./dom";
import { linkTo } from "./share";

export class LinkRow {
  readonly element: HTMLElement;
  readonly status = make("span", { "aria-live": "polite" });
  private readonly link = make("input", { type: "text", readonly: true, class: "mono" });

  constructor() {
    this.element = make(
      "div",
      { class: "row link-row", hidden: true },
      make("label", {}, "Link ", this.link),
      make("button", { type: "button", click: () => void this.copy() }, "Copy"),
    );
  }

  // Shows the link to `text`. Fails if the link would be too long.
  show(text: string): void {
    this.hide();
    this.link.value = linkTo(text);
    this.element.hidden = false;
    this.status.textContent = "The link contains the text of the session.";
    this.link.focus();
    this.link.select();
  }

  hide(): void {
    this.element.hidden = true;
    this.status.textContent = "";
  }

  private async copy(): Promise<void> {
    try {
      await navigator.clipboard.writeText(this.link.value);
      this.status.textContent = "Copied.";
    } catch {
      this.link.focus();
      this.link.select();
      this.status.textContent = "The browser does not permit copying; use Ctrl+C.";
    }
  }
}
