// Small edits of a session text: finds the numbers of a channel, and replaces one of them.

// Place of a number in the text.
export interface Place {
  from: number;
  to: number;
  value: number;
}

// Numbers of a channel that the text has.
export interface ChannelPlaces {
  amplitude: Place | null;
  rate: Place | null;
  // Whether `rate` is a period in µs.
  isPeriod: boolean;
  width: Place | null;
}

interface Section {
  name: string;
  from: number;
  to: number;
}

const NUMBER = "[+-]?[0-9][0-9_]*(?:\\.[0-9_]+)?(?:[eE][+-]?[0-9]+)?";
const NONE: ChannelPlaces = { amplitude: null, rate: null, isPeriod: false, width: null };

// Finds the numbers of channel `number`. Texts with strings of several lines have none.
export function placesOf(text: string, number: number): ChannelPlaces {
  if (text.includes('"""') || text.includes("'''")) {
    return NONE;
  }
  const masked = mask(text);
  const sections = sectionsOf(masked);
  const amplitude = amplitudeOf(masked, sections, number);
  const spans = channelSpans(sections);
  const own = spans.find((span) => find(masked, span[0], "number")?.value === number);
  const train = own ? trainOf(masked, own) : null;
  if (!train) {
    return { ...NONE, amplitude };
  }
  const frequency = find(masked, train, "frequency_hz");
  return {
    amplitude,
    rate: frequency ?? find(masked, train, "period_us"),
    isPeriod: frequency === null,
    width: find(masked, train, "width_us"),
  };
}

// Returns the text with another number at a place.
export function replaceNumber(text: string, place: Place, value: number): string {
  const hasPoint = /[.eE]/.test(text.slice(place.from, place.to));
  const digits = String(Number(value.toFixed(6)));
  const number = hasPoint && !digits.includes(".") ? `${digits}.0` : digits;
  return text.slice(0, place.from) + number + text.slice(place.to);
}

// Returns the numbers of the channels that the joint or the wall drives.
export function drivenChannels(text: string): number[] {
  const masked = mask(text);
  const driven = sectionsOf(masked).filter(({ name }) => /^(joint|wall)(\.|$)/.test(name));
  return driven.flatMap(({ from, to }) => {
    const found = masked.slice(from, to).matchAll(/(?<![\w-])channel\s*=\s*(\d+)/g);
    return [...found].map(([, number]) => Number(number));
  });
}

// Returns the comment at the beginning of a session text, as one line.
export function openingComment(text: string): string {
  const lines: string[] = [];
  for (const line of text.split("\n")) {
    if (!line.startsWith("#")) {
      break;
    }
    if (!line.startsWith("#:")) {
      lines.push(line.replace(/^#+\s*/, "").trim());
    }
  }
  return lines.filter(Boolean).join(" ");
}

// Replaces comments by spaces and the contents of strings by underscores, at the same places.
function mask(text: string): string {
  return text.replace(/"(?:\\.|[^"\\\n])*"|'[^'\n]*'|#[^\n]*/g, (found) =>
    found.startsWith("#")
      ? " ".repeat(found.length)
      : found[0] + "_".repeat(found.length - 2) + found[0],
  );
}

function sectionsOf(masked: string): Section[] {
  const headers = [...masked.matchAll(/^[ \t]*\[{1,2}([A-Za-z][\w.\- ]*)\]{1,2}[ \t\r]*$/gm)];
  return headers.map((header, i) => ({
    name: header[1].trim(),
    from: header.index + header[0].length,
    to: headers[i + 1]?.index ?? masked.length,
  }));
}

// Returns the sections of each channel: its own, then those of its tables.
function channelSpans(sections: Section[]): Section[][] {
  const spans: Section[][] = [];
  for (const section of sections) {
    if (section.name === "channel") {
      spans.push([section]);
    } else if (section.name.startsWith("channel.")) {
      spans.at(-1)?.push(section);
    }
  }
  return spans;
}

function trainOf(masked: string, span: Section[]): Section | null {
  const table = span.find(({ name }) => name === "channel.train");
  if (table) {
    return table;
  }
  const { from, to, name } = span[0];
  const found = /(?<![\w.-])train\s*=\s*\{([^{}]*)\}/.exec(masked.slice(from, to));
  if (!found) {
    return null;
  }
  const end = from + found.index + found[0].length - 1;
  return { name, from: end - found[1].length, to: end };
}

function amplitudeOf(masked: string, sections: Section[], number: number): Place | null {
  const setpoints = sections.find(({ name }) => name === "setpoints");
  const tables = sections.filter(({ name }) => name === "setpoints.values");
  const spans = [...tables];
  if (setpoints) {
    const text = masked.slice(setpoints.from, setpoints.to);
    const list = /(?<![\w.-])values\s*=\s*\[([^\]]*)\]/.exec(text);
    if (list) {
      const start = setpoints.from + list.index + list[0].length - 1 - list[1].length;
      for (const entry of list[1].matchAll(/\{[^{}]*\}/g)) {
        const from = start + entry.index;
        spans.push({ name: "setpoints", from, to: from + entry[0].length });
      }
    }
  }
  const own = spans.filter((span) => find(masked, span, "channel")?.value === number);
  return own.length === 1 ? find(masked, own[0], "value") : null;
}

function find(masked: string, span: Section, key: string): Place | null {
  const pattern = new RegExp(`(?<![\\w.-])${key}(\\s*=\\s*)(${NUMBER})(?![\\w.])`);
  const found = pattern.exec(masked.slice(span.from, span.to));
  if (!found) {
    return null;
  }
  const from = span.from + found.index + key.length + found[1].length;
  const value = Number(found[2].replaceAll("_", ""));
  return { from, to: from + found[2].length, value };
}
