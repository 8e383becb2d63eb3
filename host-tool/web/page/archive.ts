// The record of a run as a zip file.

import { Zip, ZipDeflate } from "fflate";

// Length of the pieces between which the page can respond, bytes.
const PIECE = 1 << 20;

// Returns a zip file with the files of `paths` in a folder.
export async function zipRecord(
  folder: string,
  paths: string[],
  read: (path: string) => Promise<Uint8Array>,
  time: Date,
): Promise<Blob> {
  const pieces: Uint8Array<ArrayBuffer>[] = [];
  let failure: Error | null = null;
  const zip = new Zip((error, piece) => {
    failure ??= error;
    pieces.push(piece as Uint8Array<ArrayBuffer>);
  });
  for (const path of paths) {
    const bytes = await read(path);
    const entry = new ZipDeflate(`${folder}/${path}`, { level: 6 });
    entry.mtime = time;
    zip.add(entry);
    for (let at = 0; at === 0 || at < bytes.length; at += PIECE) {
      entry.push(bytes.slice(at, at + PIECE), at + PIECE >= bytes.length);
      await new Promise((resolve) => setTimeout(resolve));
    }
  }
  zip.end();
  if (failure) {
    throw failure;
  }
  return new Blob(pieces, { type: "application/zip" });
}

// Returns the name of the folder that `flexor run` gives a record: words of the title, and the
// local time. The name of a record of an edited text says so.
export function folderName(title: string, time: Date, isEdited: boolean): string {
  const words = title.toLowerCase().split(/[^\p{Alphabetic}\p{N}]+/u).filter(Boolean);
  const slug = [...words.join("-")].slice(0, 40).join("").replace(/-+$/, "") || "run";
  const two = (number: number): string => String(number).padStart(2, "0");
  const day = [time.getFullYear(), two(time.getMonth() + 1), two(time.getDate())].join("-");
  const clock = [time.getHours(), time.getMinutes(), time.getSeconds()].map(two).join("");
  return [slug, ...(isEdited ? ["edited"] : []), day, clock].join("-");
}

export function download(blob: Blob, name: string): void {
  const url = URL.createObjectURL(blob);
  const link = document.createElement("a");
  link.href = url;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
}
