// The scrubber: time, a tick per key, and the error over time; below a native slider, for keyboards and readers.

import { begin, ink } from "./canvas.js";
import { formatLength, formatTime } from "./format.js";

export const INSET = 10; // px on both ends, half a thumb of the slider
const ERROR_HEIGHT = 26; // px

export class Timeline {
  /** seek: called with seconds. */
  constructor(element, seek) {
    this.slider = element.querySelector("input");
    this.canvas = element.querySelector("canvas");
    this.label = document.getElementById("time");
    this.duration = 1;
    this.slider.addEventListener("input", () => seek(Number(this.slider.value) * this.duration));
  }

  /** Draw what does not move. keys: times in s. curve: {times, errors} or null; limit: m at its top. */
  draw({ duration, keys, curve }) {
    this.duration = Math.max(duration, 1e-6);
    this.canvas.parentNode.classList.toggle("with-error", Boolean(curve));
    const { context, width, height } = begin(this.canvas);
    const x = (time) => INSET + ((width - 2 * INSET) * time) / this.duration;
    const foot = height - 16;
    if (curve) this.#drawError(context, x, curve);
    context.fillStyle = ink("--line");
    context.fillRect(INSET, foot, width - 2 * INSET, 1);
    context.fillStyle = ink("--tick");
    const perPixel = keys.length / Math.max(width, 1);
    context.globalAlpha = perPixel > 0.5 ? 0.35 : 0.9;
    for (const time of keys) context.fillRect(x(time) - 0.5, foot - 7, 1, 7);
    context.globalAlpha = 1;
    this.#drawSeconds(context, x, height);
  }

  #drawError(context, x, { times, errors }) {
    const most = Math.max(...errors);
    if (!most) return;
    const y = (error) => 4 + ERROR_HEIGHT * (1 - error / most);
    context.beginPath();
    context.moveTo(x(times[0]), y(0));
    times.forEach((time, i) => context.lineTo(x(time), y(errors[i])));
    context.lineTo(x(times.at(-1)), y(0));
    context.globalAlpha = 0.22;
    context.fillStyle = ink("--hot");
    context.fill();
    context.globalAlpha = 1;
    context.beginPath();
    times.forEach((time, i) => context.lineTo(x(time), y(errors[i])));
    context.strokeStyle = ink("--hot");
    context.stroke();
    const at = times[errors.indexOf(most)];
    context.fillStyle = ink("--hot");
    context.beginPath();
    context.arc(x(at), y(most), 2.5, 0, 7);
    context.fill();
    const label = formatLength(most);
    const room = context.measureText(label).width + 8;
    const right = x(at) + room + 4 < this.canvas.clientWidth;
    context.textAlign = right ? "left" : "right";
    context.fillText(label, x(at) + (right ? 6 : -6), 12);
    context.textAlign = "left";
  }

  #drawSeconds(context, x, height) {
    const steps = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500];
    const perLabel = (70 * this.duration) / Math.max(this.canvas.clientWidth - 2 * INSET, 1);
    const step = steps.find((each) => each >= perLabel) ?? this.duration;
    context.fillStyle = ink("--dim");
    context.textAlign = "center";
    for (let i = 0; i * step <= this.duration * 1.0001; i++) {
      const text = `${Number((i * step).toFixed(2))}`;
      const isLast = (i + 1) * step > this.duration * 1.0001;
      const left = Math.min(Math.max(x(i * step), 8), this.canvas.clientWidth - 16);
      context.fillText(isLast ? `${text} s` : text, left, height - 3);
    }
    context.textAlign = "left";
  }

  move(time) {
    const fraction = time / this.duration;
    if (document.activeElement !== this.slider || Number(this.slider.value) !== fraction) this.slider.value = fraction;
    this.slider.setAttribute("aria-valuetext", `${time.toFixed(3)} of ${this.duration.toFixed(3)} seconds`);
    this.label.textContent = `${time.toFixed(3)} / ${formatTime(this.duration)}`;
  }
}
