// node web/bits.mjs live.wasm EPISODES: the digests of the module, a line for each task and action space.

import { readFile } from "node:fs/promises";

const [file, episodes] = process.argv.slice(2);
const { exports: wasm } = (await WebAssembly.instantiate(await readFile(file), {})).instance;
const question = new TextEncoder().encode(JSON.stringify({ do: "bits", episodes: Number(episodes) }));
// `room` comes before the view of the memory, because growing the memory invalidates the view.
const at = wasm.room(question.length);
new Uint8Array(wasm.memory.buffer, at, question.length).set(question);
const length = wasm.ask();
const answer = JSON.parse(new TextDecoder().decode(new Uint8Array(wasm.memory.buffer, wasm.answer(), length)));
if (answer.problem) throw Error(answer.problem);
console.log(answer.join("\n"));
