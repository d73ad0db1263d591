// Axes: the time axis that the scrubber and the curves share, and round numbers along an axis.

const MIN_LABEL_PX = 70; // between labels of seconds
const STEPS = [1, 2, 5];

/** Time axis of a canvas of this width: x(time), time(x), and its labels' times. Both ends are the style sheet's. */
export function timeAxis(width, duration) {
  const [left, right] = [pixels("--axis-left"), width - pixels("--axis-right")];
  const length = Math.max(right - left, 1);
  return {
    left,
    right,
    x: (time) => left + (length * time) / duration,
    time: (x) => Math.max(0, Math.min(1, (x - left) / length)) * duration,
    labels: roundNumbers(0, duration, length / MIN_LABEL_PX),
  };
}

/** Round numbers from `low` to `high`, at most about `count` intervals. */
export function roundNumbers(low, high, count) {
  const least = (high - low) / Math.max(count, 1);
  const power = 10 ** Math.floor(Math.log10(least));
  const step = power * (STEPS.find((digit) => digit * power >= least * 0.9999) ?? 10);
  const first = Math.ceil(low / step - 1e-6);
  const last = Math.floor(high / step + 1e-6);
  return Array.from({ length: Math.max(last - first + 1, 0) }, (_, i) => Number(((first + i) * step).toPrecision(12)));
}

function pixels(name) {
  return parseFloat(getComputedStyle(document.documentElement).getPropertyValue(name));
}
