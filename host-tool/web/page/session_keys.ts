// Keys that control a run, as in `flexor run --watch`.

// Time within which a repeated press of ↑ comes from a key that is held down or bounces, and time
// for which the space bar must stay untouched before it resumes.
const HELD_MS = 150;
const SETTLED_MS = 500;

export interface KeyActions {
  // Whether keys control the run now.
  isActive: () => boolean;
  isPaused: () => boolean;
  togglePause: () => void;
  raise: () => void;
  lower: () => void;
  // Chooses the channel before (−1) or after (1) the chosen one.
  step: (places: number) => void;
  mark: () => void;
}

export class Keys {
  private raised = -Infinity;
  private spaced = -Infinity;

  constructor(private readonly actions: KeyActions) {
    document.addEventListener("keydown", (event) => this.press(event));
  }

  private press(event: KeyboardEvent): void {
    const target = event.target instanceof Element ? event.target : document.body;
    const hasModifier = event.ctrlKey || event.altKey || event.metaKey || event.defaultPrevented;
    const isField = target.closest("input, textarea, select, [contenteditable]") !== null;
    if (hasModifier || isField || !this.actions.isActive()) {
      return;
    }
    // The space bar presses a button that has the focus.
    if (event.key === " " && target.closest("button, a, summary")) {
      return;
    }
    if (this.act(event.key, event.repeat, performance.now())) {
      event.preventDefault();
    }
  }

  private act(key: string, isRepeated: boolean, now: number): boolean {
    const { actions } = this;
    switch (key) {
      case " ": {
        const isSettled = now - this.spaced >= SETTLED_MS && !isRepeated;
        this.spaced = now;
        if ((!actions.isPaused() || isSettled) && !isRepeated) {
          actions.togglePause();
        }
        return true;
      }
      case "ArrowUp": {
        const isHeld = isRepeated || now - this.raised < HELD_MS;
        this.raised = now;
        if (!isHeld) {
          actions.raise();
        }
        return true;
      }
      case "ArrowDown":
        actions.lower();
        return true;
      case "ArrowLeft":
      case "ArrowRight":
        actions.step(key === "ArrowLeft" ? -1 : 1);
        return true;
      case "m":
      case "M":
        if (!isRepeated) {
          actions.mark();
        }
        return true;
      default:
        return false;
    }
  }
}
