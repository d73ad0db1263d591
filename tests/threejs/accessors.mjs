// What three.js finds in the accessors that animations use: node accessors.mjs FOLDER_OF_THREE FILE
// Writes {number of the accessor: its stored numbers} as JSON.
import { readFile } from "node:fs/promises";
import { library } from "./load.mjs";

const [folder, file] = process.argv.slice(2);
const { three, GLTFLoader, MeshoptDecoder } = await library(folder);
const loader = new GLTFLoader();
loader.setMeshoptDecoder(MeshoptDecoder);
loader.register(() => ({ name: "no textures", loadTexture: async () => new three.Texture() }));
const data = await readFile(file);
const gltf = await loader.parseAsync(data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength), "");
const samplers = (gltf.parser.json.animations ?? []).flatMap((animation) => animation.samplers);
const found = {};
for (const number of new Set(samplers.flatMap(({ input, output }) => [input, output]))) {
  found[number] = Array.from((await gltf.parser.getDependency("accessor", number)).array);
}
process.stdout.write(JSON.stringify(found));
