// Canvases for curves and ticks, sharp on dense screens and in the colors of the page.

const MAX_PIXEL_RATIO = 2;

/** Context of a cleared canvas at its present size, and that size in CSS pixels. */
export function begin(canvas) {
  const ratio = Math.min(devicePixelRatio, MAX_PIXEL_RATIO);
  const { clientWidth: width, clientHeight: height } = canvas;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const context = canvas.getContext("2d");
  context.scale(ratio, ratio);
  context.font = "11px system-ui, sans-serif";
  return { context, width, height };
}

/** A color of the style sheet, for example ink("--dim"). */
export function ink(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}
