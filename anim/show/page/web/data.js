// What Python stored in the page: the files as gzip in base64, and facts about them as JSON.

export const facts = JSON.parse(document.getElementById("facts").textContent);

/** Whether a file of the page has nodes to show beside its meshes: not only vertex caches. */
export function hasNodes({ files }) {
  return files.some((file) => !file.cache);
}

/** Bytes of the file "a" or "b", or null if the page has none. */
export async function readFile(id) {
  const text = document.getElementById(id).textContent;
  if (!text) return null;
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}
