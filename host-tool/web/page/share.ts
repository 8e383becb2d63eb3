// Links to a session: the compressed text in the fragment, or the name of a shipped session.

import { Inflate, deflateSync, strFromU8, strToU8 } from "fflate";

// Longest link, in characters, that chat programs and mail programs still pass on.
export const LONGEST_LINK = 16_384;

export type Target = { kind: "text"; data: string } | { kind: "name"; name: string };

// Reads `#session=DATA`, `#session-name=NAME` and `#sessions/NAME`; null for other fragments.
export function parseFragment(fragment: string): Target | null {
  const word = fragment.replace(/^#/, "");
  if (word.startsWith("session=")) {
    return { kind: "text", data: word.slice("session=".length) };
  }
  for (const prefix of ["session-name=", "sessions/"]) {
    if (word.startsWith(prefix) && word.length > prefix.length) {
      return { kind: "name", name: decode(word.slice(prefix.length)) };
    }
  }
  return null;
}

// Returns a link to this page that shows `text`. Fails if the link would be too long.
export function linkTo(text: string): string {
  const page = location.href.split("#")[0];
  const link = `${page}#session=${toBase64(deflateSync(strToU8(text), { level: 9 }))}`;
  if (link.length > LONGEST_LINK) {
    throw new Error(
      `The link would have ${kilobytes(link.length)}, and the longest link has ` +
        `${kilobytes(LONGEST_LINK)}. Send the session as a file instead, or shorten its comments.`,
    );
  }
  return link;
}

// Returns the session text in the data of a link. Fails if the data is not readable, or if the
// text is longer than `longest` bytes: a few bytes can decompress to gigabytes.
export function textOfLink(data: string, longest: number): string {
  if (data.length > LONGEST_LINK) {
    throw new Error(
      `The link has ${kilobytes(data.length)}, and the longest link has ` +
        `${kilobytes(LONGEST_LINK)}. Ask for the session as a file.`,
    );
  }
  let length = 0;
  let isComplete = false;
  const pieces: Uint8Array[] = [];
  const inflate = new Inflate((piece, isLast) => {
    length += piece.length;
    isComplete ||= isLast;
    pieces.push(piece);
  });
  try {
    const bytes = fromBase64(data);
    const step = 256;
    for (let at = 0; at < bytes.length && length <= longest; at += step) {
      inflate.push(bytes.subarray(at, at + step), at + step >= bytes.length);
    }
  } catch {
    throw unreadable();
  }
  if (length > longest) {
    throw new Error(`The session in the link is longer than ${kilobytes(longest)}.`);
  }
  if (!isComplete) {
    throw unreadable();
  }
  const joined = new Uint8Array(length);
  let at = 0;
  for (const piece of pieces) {
    joined.set(piece, at);
    at += piece.length;
  }
  try {
    return new TextDecoder("utf-8", { fatal: true }).decode(joined);
  } catch {
    throw unreadable();
  }
}

export function kilobytes(length: number): string {
  const kilo = length / 1024;
  return kilo >= 1024 ? `${(kilo / 1024).toFixed(1)} MB` : `${Math.ceil(kilo)} kB`;
}

function unreadable(): Error {
  return new Error(
    "The session in the link cannot be read: the link is incomplete or was changed. Ask for the " +
      "whole link, or choose a session from the list.",
  );
}

function decode(name: string): string {
  try {
    return decodeURIComponent(name);
  } catch {
    return name;
  }
}

function toBase64(bytes: Uint8Array): string {
  const text = btoa(strFromU8(bytes, true));
  return text.replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

function fromBase64(text: string): Uint8Array {
  return strToU8(atob(text.replaceAll("-", "+").replaceAll("_", "/")), true);
}
