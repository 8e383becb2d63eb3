// Edited texts in the storage of the tab, where they survive a reload.

export interface StoredText {
  // Name of the session file.
  name: string;
  // Name in the list.
  label: string;
  text: string;
  // Text before the edits.
  original: string;
}

interface Stored {
  edited: StoredText | null;
  copies: StoredText[];
  // Fragment of the address at which the text was edited.
  fragment: string;
}

const KEY = "flexor-sessions";

// Reads what is stored; nothing if the browser refuses storage.
export function readStore(): Stored {
  try {
    const stored: unknown = JSON.parse(sessionStorage.getItem(KEY) ?? "null");
    const { edited, copies, fragment } = (stored ?? {}) as Partial<Stored>;
    return {
      edited: isText(edited) ? edited : null,
      copies: Array.isArray(copies) ? copies.filter(isText) : [],
      fragment: typeof fragment === "string" ? fragment : "",
    };
  } catch {
    return { edited: null, copies: [], fragment: "" };
  }
}

// Stores edits and copies, and returns whether the browser has stored them.
export function writeStore(edited: StoredText | null, copies: StoredText[]): boolean {
  try {
    if (!edited && copies.length === 0) {
      sessionStorage.removeItem(KEY);
      return true;
    }
    const stored: Stored = { edited, copies, fragment: location.hash };
    sessionStorage.setItem(KEY, JSON.stringify(stored));
    return true;
  } catch {
    return false;
  }
}

// Whether the page was loaded again at the same address, and not through a link.
export function isReload(): boolean {
  const [entry] = performance.getEntriesByType("navigation");
  const type = (entry as PerformanceNavigationTiming | undefined)?.type;
  return type === "reload" || type === "back_forward";
}

function isText(value: unknown): value is StoredText {
  const { name, label, text, original } = (value ?? {}) as Record<string, unknown>;
  return [name, label, text, original].every((field) => typeof field === "string");
}
