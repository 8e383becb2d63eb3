// The wanted angle over time, and the losses on its way to the device.

// Range of the wanted angle, °, within the finger's 0° to 100°.
const LOWEST_DEG = 2;
const HIGHEST_DEG = 98;

// A sine, or one angle.
export class Reference {
  isSine = true;
  // Middle of the sine, or the one angle, °.
  offset_deg = 45;
  swing_deg = 35;
  readonly period_s = 5;

  // Wanted angle, °, and its rate, °/s.
  at(t_s: number): [number, number] {
    if (!this.isSine) {
      return [this.offset_deg, 0];
    }
    const room = Math.min(this.offset_deg - LOWEST_DEG, HIGHEST_DEG - this.offset_deg);
    const swing = Math.min(this.swing_deg, room);
    const turns = 2 * Math.PI * (t_s / this.period_s);
    const rate = (2 * Math.PI * swing) / this.period_s;
    return [this.offset_deg - swing * Math.cos(turns), rate * Math.sin(turns)];
  }
}

// Random numbers, the same in every run: xorshift32 (Marsaglia, J. Stat. Softw. 8(14), 2003).
export class Random {
  constructor(private state: number) {}

  // Uniform from 0 inclusive to 1 exclusive.
  next(): number {
    this.state ^= this.state << 13;
    this.state ^= this.state >>> 17;
    this.state ^= this.state << 5;
    return (this.state >>> 0) / 2 ** 32;
  }
}
