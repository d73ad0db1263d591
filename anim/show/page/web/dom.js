// Elements. Text is set as text only: names in a file may contain markup.

export const $ = (selector) => document.querySelector(selector);

/** make("button", {class: "row", onclick}, "text", child…) */
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value !== null && value !== undefined) element.setAttribute(name, value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

/** Parts of a text that may break behind the punctuation of its names. */
export function breakable(text) {
  return text.split(/(?<=[_.:|-])/).flatMap((part) => [part, make("wbr")]);
}

export function setPressed(element, isPressed) {
  element?.setAttribute("aria-pressed", isPressed ? "true" : "false");
}
