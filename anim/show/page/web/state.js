// The state of the page, its listeners, and its copy in the URL, so that links and screenshots can be repeated.

export const SHOWS = ["bones", "wire", "onion", "clay", "curves", "heat"];
export const OF_NODES = ["bones", "curves"]; // which a vertex cache has none of
export const SIDES = ["both", "a", "b", "over"]; // over: A as a ghost over B
export const LOOPS = ["loop", "once", "ping-pong"];
export const UNITS = ["degrees", "values"];
export const SPEEDS = [0.1, 0.25, 0.5, 1, 2];

export const state = {
  clip: 0,
  time: 0, // s
  playing: false,
  direction: 1, // -1 on the way back of ping-pong
  speed: 1,
  loop: "loop",
  node: null, // index in A, or null
  show: new Set(),
  side: "both",
  heatScale: 0, // m that are fully red
  unit: "degrees", // of rotation curves: degrees from rest, or values
  tab: "clips", // the list that is shown
  sort: "", // of the list of clips, "" for the file's order
  theme: "auto",
};

const listeners = [];

/** Call `listener(changed)` after every change; `changed` is the set of names in `state`. */
export function onChange(listener) {
  listeners.push(listener);
}

export function update(changes) {
  const changed = new Set(Object.keys(changes).filter((name) => state[name] !== changes[name]));
  Object.assign(state, changes);
  if (changed.size) for (const listener of listeners) listener(changed);
}

export function toggleShow(name) {
  const show = new Set(state.show);
  if (!show.delete(name)) show.add(name);
  update({ show });
}

/** The next of `choices` after the present one, cyclically. */
export function cycle(name, choices) {
  update({ [name]: choices[(choices.indexOf(state[name]) + 1) % choices.length] });
}

/** Parameters after the # of the URL; those that are absent come from the page's own defaults. */
export function readHash(defaults) {
  const hash = new URLSearchParams(location.hash.slice(1));
  const pick = (name) => hash.get(name) ?? defaults[name] ?? null;
  const show = hash.has("show") ? hash.get("show").split(",") : defaults.show ?? [];
  const number = (name) => (pick(name) === null || Number.isNaN(Number(pick(name))) ? null : Number(pick(name)));
  return {
    clip: pick("clip"),
    node: pick("node"),
    time: number("t"),
    show: new Set(show.filter((name) => SHOWS.includes(name))),
    side: SIDES.includes(pick("side")) ? pick("side") : "both",
    theme: ["light", "dark"].includes(pick("theme")) ? pick("theme") : "auto",
    unit: UNITS.includes(pick("unit")) ? pick("unit") : "degrees",
    speed: SPEEDS.includes(number("speed")) ? number("speed") : 1,
    loop: LOOPS.includes(pick("loop")) ? pick("loop") : "loop",
    scale: number("scale"),
    tab: pick("list"),
    sort: pick("sort") ?? "",
    camera: pick("camera"),
  };
}

let timer = 0;

/** What follows the page in its URL, "#clip=…"; parameters that are null are left out. */
export function hashText(parameters) {
  const hash = new URLSearchParams(Object.entries(parameters).filter(([, value]) => value !== null));
  return `#${hash.toString().replaceAll("%2C", ",")}`;
}

/** Write the state behind the # a moment later; scrubbing would otherwise write it 60 times a second. */
export function writeHash(parameters) {
  clearTimeout(timer);
  timer = setTimeout(() => {
    try {
      history.replaceState(null, "", hashText(parameters()));
    } catch {
      // a page inside a notebook has no URL of its own
    }
  }, 250);
}
