// ---- What the viewer of the replay page asks of its page ------------------------------------------

// The viewer draws episodes of recorded frames. Here there is one, of one frame, whose numbers change.
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
// Every picture is drawn anyway.
const changed = () => {};

const style = name => getComputedStyle(document.body).getPropertyValue(name).trim();
// Names lead to other names, and to a colour in the end.
const hex = name => {
  const value = style(name), other = value.match(/^var\((.*)\)$/);
  return other ? hex(other[1]) : value;
};
const rgb = name => [1, 3, 5].map(i => parseInt(hex(name).slice(i, i + 2), 16));
document.body.style.setProperty("--run0", "#0072b2");

// Whether WebGL runs on the processor: there smooth edges cost a fifth of a picture.
function drawsInSoftware() {
  const gl = document.createElement("canvas").getContext("webgl2"), names = gl?.getExtension("WEBGL_debug_renderer_info");
  return /swiftshader|llvmpipe|softpipe|basic render/i.test(names ? gl.getParameter(names.UNMASKED_RENDERER_WEBGL) : "");
}
