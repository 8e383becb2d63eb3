// List of the events of a run.

import { make } from "./dom";

// Largest number of events in the list.
const MOST_EVENTS = 500;
// Distance from the end of the list within which the list follows new events, px.
const NEAR_PX = 40;

export class EventList {
  readonly element: HTMLElement;
  private readonly events = make("ol", { class: "events" });
  private readonly none = make("p", { class: "note" }, "No events so far.");
  private readonly box: HTMLElement;

  constructor() {
    const attributes = { tabindex: "0", role: "region", "aria-label": "Events" };
    this.box = make("div", { class: "scroll events-box", ...attributes }, this.none, this.events);
    this.element = make("div", {}, make("h3", {}, "Events"), this.box);
  }

  // Adds an event at its time. One that repeats the event before raises its count.
  add(time_s: number, text: string): void {
    const { scrollTop, clientHeight, scrollHeight } = this.box;
    const isAtEnd = scrollTop + clientHeight >= scrollHeight - NEAR_PX;
    this.none.hidden = true;
    let later: Element | null = null;
    let before = this.events.lastElementChild;
    while (before instanceof HTMLElement && Number(before.dataset.time) > time_s) {
      later = before;
      before = before.previousElementSibling;
    }
    if (before instanceof HTMLElement && before.dataset.text === text) {
      const count = Number(before.dataset.count) + 1;
      before.dataset.count = String(count);
      before.dataset.time = String(time_s);
      const latest = `${count} times, the latest at ${time_s.toFixed(3)} s`;
      before.lastElementChild?.replaceChildren(` (${latest})`);
    } else {
      const row = make("li", {}, make("span", { class: "event-time" }, `${time_s.toFixed(3)} s`));
      row.append(` ${text}`, make("span"));
      Object.assign(row.dataset, { time: String(time_s), text, count: "1" });
      this.events.insertBefore(row, later);
    }
    if (this.events.childElementCount > MOST_EVENTS) {
      this.events.firstElementChild?.remove();
    }
    if (isAtEnd) {
      this.box.scrollTop = this.box.scrollHeight;
    }
  }

  end(): void {
    this.none.textContent = "The run had no events.";
  }
}
