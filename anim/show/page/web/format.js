// Numbers with units.

const STEPS = [1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10];
const LENGTHS = [[1, "m", 1], [1e-2, "cm", 1e2], [1e-4, "mm", 1e3], [1e-7, "µm", 1e6], [0, "nm", 1e9]];

/** "0.41 mm", "12 cm", "1.71 m". */
export function formatLength(metres) {
  if (!metres) return "0 mm";
  const [unit, factor] = lengthUnit(metres);
  return `${Number((metres * factor).toPrecision(3))} ${unit}`;
}

/** Unit of lengths up to `metres`, and what to multiply metres by: ["cm", 100]. */
export function lengthUnit(metres) {
  return LENGTHS.find(([least]) => metres >= least).slice(1);
}

export function formatTime(seconds) {
  return `${seconds.toFixed(seconds < 100 ? 2 : 1)} s`;
}

export function formatBytes(count) {
  if (count < 1000) return `${count} B`;
  const unit = count < 1e6 ? "kB" : "MB";
  return `${Number((count / (count < 1e6 ? 1e3 : 1e6)).toPrecision(3))} ${unit}`;
}

/** The largest of 1, 2 and 5 times a power of ten that is at most `value`. */
export function roundDown(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [5, 2, 1].find((digit) => digit * power <= value * 1.0001) * power;
}

/** A round number that is at least `value`, and little more. */
export function roundUp(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return STEPS.find((digit) => digit * power >= value * 0.9999) * power;
}

/** A value with at most `digits` significant digits and four decimals: no 1.2e-7 for what rounds to 0. */
export function formatNumber(value, digits = 4) {
  return String(Number(Number(value.toPrecision(digits)).toFixed(4)));
}
