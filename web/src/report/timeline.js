// The time that plots and replay share.

/**
 * @typedef {{time: number, label: string}} Worst a sample worth a look: its time [s] and why
 */

const kLongestFrame = 0.25;  // [s]; a page that was hidden does not jump

export class Timeline {
  /**
   * @param {{start: number, end: number, sample: number, worst: Worst[]}} run start and end [s];
   *     sample: step of the arrow keys [s]; worst: the worst first
   */
  constructor({start, end, sample, worst}) {
    this.start = start;
    this.end = end;
    this.sample = sample;
    this.worst = worst;
    this.time = start;
    this.playing = false;
    this.speed = 1;
    this.last = 0;  // when the latest frame was drawn [ms]
    /** @type {((time: number) => void)[]} */
    this.listeners = [];
  }

  /** @param {(time: number) => void} listener */
  onChange(listener) {
    this.listeners.push(listener);
  }

  /** @param {number} time */
  set(time) {
    this.time = Math.min(this.end, Math.max(this.start, time));
    for (const listener of this.listeners) listener(this.time);
  }

  play(on = !this.playing) {
    if (on === this.playing || this.end <= this.start) return;
    this.playing = on;
    if (on) {
      if (this.time >= this.end) this.time = this.start;
      this.last = performance.now();
      requestAnimationFrame((now) => this.tick(now));
    }
    this.set(this.time);
  }

  /** @param {number} now [ms] */
  tick(now) {
    if (!this.playing) return;
    const elapsed = Math.max(0, Math.min(kLongestFrame, (now - this.last) / 1000));
    this.last = now;
    const next = this.time + this.speed * elapsed;
    if (next >= this.end) this.playing = false;
    this.set(next);
    if (this.playing) requestAnimationFrame((later) => this.tick(later));
  }

  /**
   * Moves by whole samples.
   * @param {number} samples
   */
  step(samples) {
    this.play(false);
    this.set(this.start + (Math.round((this.time - this.start) / this.sample) + samples) * this.sample);
  }

  /** To the worst sample; from there to the next worst, and round again. */
  nextWorst() {
    if (this.worst.length === 0) return;
    this.play(false);
    const at = this.worst.findIndex((worst) => Math.abs(worst.time - this.time) < 1e-9);
    this.set(this.worst[(at + 1) % this.worst.length].time);
  }
}
