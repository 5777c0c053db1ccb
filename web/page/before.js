// ---- What the viewer of the replay page needs from its page ---------------------------------------

// The viewer draws episodes of recorded frames. Here there is one episode with one frame, whose numbers change.
const live = {
  frames: 1, bodies: 0, solids: [], decals: [], penalised: [], fulfilled: [],
  cameras: [{ name: "Task", eye: [1, -1, 1.4], target: [0, 0, 1], fov: .8 }],
  decides: "", story: "", detail: "", who: "", title: "Live episode", leash: null, metresPerNewton: .004,
  poses: new Float32Array(0), tool: new Float32Array(3), force: new Float32Array(3), stiffness: new Float32Array(3),
  goal: new Float32Array([0, 0, 0, 1, 0, 0, 0]),
};
const episodes = [live], named = ["Live"], rate = 20, present = 0;
const frameOf = () => 0;
const three = values => Array.from(values.subarray(0, 3));
// The viewer calls this for a new picture. Here pictures are drawn all the time anyway.
const changed = () => {};

const style = name => getComputedStyle(document.body).getPropertyValue(name).trim();
// The colour of a style variable, which may refer to another variable.
const hex = name => {
  const value = style(name), other = value.match(/^var\((.*)\)$/);
  return other ? hex(other[1]) : value;
};
const rgb = name => [1, 3, 5].map(i => parseInt(hex(name).slice(i, i + 2), 16));
document.body.style.setProperty("--run0", "#0072b2");

// Whether WebGL runs on the processor, where smooth edges take a fifth of a picture's time.
function drawsInSoftware() {
  const gl = document.createElement("canvas").getContext("webgl2"), names = gl?.getExtension("WEBGL_debug_renderer_info");
  return /swiftshader|llvmpipe|softpipe|basic render/i.test(names ? gl.getParameter(names.UNMASKED_RENDERER_WEBGL) : "");
}
