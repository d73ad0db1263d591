// The scrubber: time, a tick per key, and the error over time; below a native slider, for keyboards and readers.

import { timeAxis } from "./axis.js";
import { begin, ink } from "./canvas.js";
import { formatLength, formatTime } from "./format.js";

const ERROR_TOP = 6; // px
const ERROR_HEIGHT = 30; // px

export class Timeline {
  /** seek: called with seconds. */
  constructor(element, seek) {
    this.slider = element.querySelector("input");
    this.canvas = element.querySelector("canvas");
    this.label = document.getElementById("time");
    this.duration = 1;
    this.slider.addEventListener("input", () => seek(Number(this.slider.value) * this.duration));
  }

  /** Draw what does not move. keys: times in s. curve: {times, errors} or null. */
  draw({ duration, keys, curve }) {
    this.duration = Math.max(duration, 1e-6);
    this.canvas.parentNode.classList.toggle("with-error", Boolean(curve));
    const { context, width, height } = begin(this.canvas);
    const axis = timeAxis(width, this.duration);
    const foot = height - 16;
    if (curve) this.#drawError(context, axis, curve);
    context.fillStyle = ink("--line");
    context.fillRect(axis.left, foot, axis.right - axis.left, 1);
    context.fillStyle = ink("--tick");
    const perPixel = keys.length / Math.max(width, 1);
    context.globalAlpha = perPixel > 0.5 ? 0.35 : 0.9;
    for (const time of keys) context.fillRect(axis.x(time) - 0.5, foot - 7, 1, 7);
    context.globalAlpha = 1;
    this.#drawSeconds(context, axis, height);
  }

  #drawError(context, { left, x }, { times, errors }) {
    const most = Math.max(...errors);
    if (!most) return;
    const y = (error) => ERROR_TOP + ERROR_HEIGHT * (1 - error / most);
    context.fillStyle = context.strokeStyle = ink("--hot");
    context.beginPath();
    context.moveTo(x(times[0]), y(0));
    times.forEach((time, i) => context.lineTo(x(time), y(errors[i])));
    context.lineTo(x(times.at(-1)), y(0));
    context.globalAlpha = 0.22;
    context.fill();
    context.globalAlpha = 1;
    context.beginPath();
    times.forEach((time, i) => context.lineTo(x(time), y(errors[i])));
    context.stroke();
    context.beginPath();
    context.arc(x(times[errors.indexOf(most)]), y(most), 2.5, 0, 7);
    context.fill();
    context.textAlign = "right";
    context.fillText(formatLength(most), left - 8, y(most) + 6);
    context.fillText("0", left - 8, y(0) + 2);
  }

  #drawSeconds(context, { x, labels }, height) {
    context.fillStyle = ink("--dim");
    context.textAlign = "center";
    for (const [i, time] of labels.entries()) {
      context.fillText(i === labels.length - 1 ? `${time} s` : `${time}`, x(time), height - 3);
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
