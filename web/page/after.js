// ---- The simulation: a WebAssembly module that answers questions in JSON ---------------------------

const engine = { module: null, wasm: null };

async function load() {
  if (typeof WebAssembly !== "object") throw Error("This browser has no WebAssembly, in which the simulation runs.");
  const answer = await fetch("live.wasm.gz");
  if (!answer.ok) throw Error(`live.wasm.gz cannot be read (${answer.status}): it lies beside this page.`);
  const bytes = await answer.arrayBuffer();
  engine.module = await WebAssembly.compile(await unpacked(bytes));
}

// Some servers declare a .gz file as content that they have encoded; the browser has then unpacked it already.
async function unpacked(bytes) {
  const [first, second] = new Uint8Array(bytes, 0, 2);
  if (first !== 0x1f || second !== 0x8b) return bytes;
  if (typeof DecompressionStream !== "function") throw Error("This browser is too old to unpack the simulation (it has no DecompressionStream).");
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
}

// Makes the module's instance, and a new one after a trap, as the memory of the old one cannot be trusted any more.
async function wake() {
  engine.wasm ??= (await WebAssembly.instantiate(engine.module, {})).exports;
}

const text = length => new TextDecoder().decode(new Uint8Array(engine.wasm.memory.buffer, engine.wasm.answer(), length));

// The answer to a question, or an error with one sentence.
function ask(question) {
  const bytes = new TextEncoder().encode(JSON.stringify(question));
  // `room` comes before the view of the memory, because growing the memory invalidates the view.
  const at = engine.wasm.room(bytes.length);
  new Uint8Array(engine.wasm.memory.buffer, at, bytes.length).set(bytes);
  let answer;
  try {
    answer = JSON.parse(text(engine.wasm.ask()));
  } catch (trap) {
    const words = text(engine.wasm.last_words());
    engine.wasm = null;
    throw Error(`The simulation stopped itself and is made anew by Reset: ${words || trap.message}`);
  }
  if (answer?.problem) throw Error(answer.problem);
  return answer;
}

// ---- The set-up, and the address that holds it --------------------------------------------------------

let about, setup, scene = null, state = null;

// Settings that every space has: name, label, unit, factor of the unit, ends and step of the slider.
const SLIDERS = [
  ["friction", "friction", "x", 1, 0, 3, .1],
  ["payload", "payload", "kg", 1, 0, 3, .1],
  ["table", "height of the table", "mm", 1000, -50, 50, 1],
  ["delay", "delay of the torques", "ms", 1000, 0, 50, 2],
];
const CHOICES = ["task", "space", "player"];

function address({ knobs, ...fixed }) {
  const words = new URLSearchParams();
  for (const [name, value] of Object.entries(fixed))
    if (CHOICES.includes(name) || name === "seed" || value !== about.setup[name]) words.set(name, value);
  for (const [name, value] of Object.entries(knobs)) words.set(name, value);
  return "#" + words.toString().replaceAll("%2F", "/").replaceAll("%2C", ",");
}

// The set-up in an address. Values that are not numbers, and seeds that are not whole ones from 0 on, are refused here, other mistakes by the
// simulation.
function read(hash) {
  const found = { ...about.setup, knobs: {} };
  for (const [name, value] of new URLSearchParams(hash.slice(1))) {
    if (CHOICES.includes(name)) { found[name] = value; continue; }
    const number = Number(value);
    if (value.trim() === "" || !Number.isFinite(number)) throw Error(`${name} = ${value} is no number.`);
    if (name === "seed" && !(Number.isSafeInteger(number) && number >= 0)) throw Error(`seed = ${value} is no whole number from 0 on.`);
    if (name in about.setup) found[name] = number;
    else found.knobs[name] = number;
  }
  return found;
}

function complain(problem) {
  byId("problem").textContent = problem;
}

// Begins the episode of a set-up. If the set-up is refused, the present episode stays.
async function open(wanted) {
  const same = wanted === setup;
  try {
    await wake();
    const opened = ask({ do: "open", setup: wanted });
    complain("");
    [scene, setup, state] = [opened, wanted, opened.state];
  } catch (problem) {
    complain(problem.message);
    if (setup) showChoices();
    return false;
  }
  grip = null;
  owed = 0;
  rests = null;
  for (const curve of curves) curve.forget();
  view.load(scene);
  take(state);
  // If the same episode begins again, the sliders are not made anew, so that the user can keep dragging one.
  if (!same) {
    showChoices();
    history.replaceState(null, "", address(setup));
  }
  return true;
}

function options(select, entries, chosen) {
  select.replaceChildren(...entries.map(([value, label]) => new Option(label, value, false, value === chosen)));
}

function showChoices() {
  options(byId("task"), about.tasks.map(({ name, purpose }) => [name, `${name}: ${purpose}`]), setup.task);
  const kept = about.policies.filter(policy => policy.task === setup.task);
  const spaces = kept.map(policy => policy.space).filter(space => !about.spaces.includes(space));
  options(byId("space"), [...about.spaces, ...spaces].map(name => [name, name]), setup.space);
  options(byId("player"), [["script", "the script"], ["hold", "nobody: the goal stays"],
    ...kept.map(({ run, space }) => [run, `learned policy, ${space}`])], setup.player);
  byId("first").textContent = setup.player === "hold"
    ? "Pull the hand sideways with the mouse and feel the answer. Then switch the space from high to aforce, and pull again."
    : "Try first: choose the player \"nobody\" and the space high, pull the hand sideways with the mouse, then switch to aforce.";
  document.body.style.setProperty("--run0", COLORS[setup.space] ?? "#5b6470");
  const panel = byId("sliders");
  panel.replaceChildren();
  for (const [name, label, unit, factor, low, high, step] of SLIDERS)
    if (name !== "table" || scene.has_table)
      slider(panel, name, label, unit, [low, high], step, factor * setup[name], value => ({ [name]: value / factor }));
  for (const { name, what, unit, own, range } of scene.knobs) {
    // The slider is logarithmic: equal distances are equal factors.
    const now = setup.knobs[name] ?? own, parts = range.map(end => Math.log10(end / own));
    slider(panel, name, what, unit, parts, "any", Math.log10(now / own), way => {
      const value = Math.min(Math.max(+(own * 10 ** way).toPrecision(3), range[0]), range[1]);
      return { knobs: { ...setup.knobs, [name]: value } };
    }, way => own * 10 ** way);
  }
}

// Colour of each action space, as in every figure: assemble.py takes them from crates/show/src/palette.rs.
const COLORS = {};

// Changes the space's numbers and the delay while the episode runs. Any other setting begins the episode again.
function tune(wanted) {
  try {
    ask({ do: "tune", setup: wanted });
    complain("");
    setup = wanted;
  } catch (problem) {
    complain(problem.message);
    if (!engine.wasm) play(false);
  }
}

function slider(panel, name, label, unit, [low, high], step, value, change, shown = v => v) {
  const box = element(panel, "label");
  element(box, "span", "", label);
  const number = element(box, "output");
  const input = Object.assign(element(box, "input"), { type: "range", id: `slider-${name}`, min: low, max: high, step: step });
  input.value = value;
  const write = () => number.textContent = `${+shown(+input.value).toPrecision(3)} ${unit}`;
  const begins = ["friction", "payload", "table"].includes(name), wanted = () => ({ ...setup, ...change(+input.value) });
  input.oninput = () => {
    write();
    if (!begins && engine.wasm) tune(wanted());
  };
  input.onchange = () => {
    if (begins) open(wanted());
    else history.replaceState(null, "", address(setup));
  };
  write();
}

// ---- The scene -------------------------------------------------------------------------------------------

class LiveView extends View {
  // Loads the shapes of a new scene, unless they are the same as before.
  load(scene) {
    const same = JSON.stringify(scene.solids);
    Object.assign(live, { bodies: scene.bodies, cameras: scene.cameras, leash: scene.leash });
    this.path = new Float32Array(scene.state.tool);
    if (!this.gl || same === this.shapes) return;
    for (const solid of this.solids ?? []) this.gl.deleteVertexArray(solid.mesh.array);
    this.shapes = same;
    this.solids = scene.solids.map(s => ({ ...s, pose: fromPose(s.pose), mesh: this.mesh(solidShape[s.kind](...s.size)) }));
    const middle = scene.cameras[0].target;
    this.sun = multiply(orthographic(SHADOW_HALF, .1, 6), lookAt(add(middle, LIGHT, 3), middle));
    const cameras = byId("cameras");
    cameras.replaceChildren();
    for (const camera of scene.cameras) element(cameras, "button", "", camera.name).onclick = () => place(camera);
    place(scene.cameras[0]);
  }

  describe() {
    if (!state) return;
    const force = norm(state.force), parts = [`contact ${force.toFixed(1)} N`, `stiffness ${state.stiffness.map(v => v.toFixed(0)).join(", ")} N/m`];
    if (state.pull) parts.push(`your hand ${norm(state.pull.force).toFixed(1)} N, moved by ${moved().toFixed(1)} mm`);
    if (state.over_limit) parts.push("force penalty");
    this.state.textContent = parts.join("   ·   ");
    this.done.textContent = state.diverged ? "the simulation diverged" : state.fulfilled ? `task done at ${state.fulfilled.toFixed(2)} s` : "";
  }

  // On a slow machine shadows are drawn in every third picture only.
  drawShadows(placed) {
    if (!this.canvas.detail || this.canvas.detail === 1 || pace.drawn % 3 === 0) super.drawShadows(placed);
  }

  draw() {
    super.draw();
    if (!this.gl || !state?.pull) return;
    // The user's hand: a line from the point that it pulls to the place of the mouse.
    const at = state.pull.at, to = grip?.to ?? add(at, state.pull.force, .004), along = add(to, at, -1), length = norm(along);
    if (length < .002) return;
    const z = unit(along), x = unit(cross(z, Math.abs(z[2]) < .9 ? [0, 0, 1] : [1, 0, 0])), y = cross(z, x);
    const scaled = (v, s) => v.map(c => c * s), color = rgb("--accent").map(v => v / 255);
    const ball = r => frame([r, 0, 0], [0, r, 0], [0, 0, r], to);
    this.paint(this.visible, this.shaft, frame(scaled(x, .004), scaled(y, .004), along, at), { color, opacity: 1 });
    this.paint(this.visible, this.ball, ball(.012), { color, opacity: 1 });
  }

  // The ray through a place in the canvas, from -1 to 1 each way.
  ray(x, y) {
    const { eye, target, fov } = this.camera(0), aspect = this.canvas.clientWidth / this.canvas.clientHeight;
    const f = Math.min(1, aspect * 3 / 4) / Math.tan(fov / 2);
    const forward = unit(add(target, eye, -1)), right = unit(cross(forward, [0, 0, 1])), up = cross(right, forward);
    return { origin: eye, direction: unit(add(add(forward, right, x * aspect / f), up, y / f)), forward };
  }
}

// Distance of the tool from the goal (mm).
const moved = () => 1000 * norm(add(state.tool, state.goal.slice(0, 3), -1));

// Takes in the state that is drawn next.
function take(next) {
  state = next;
  live.poses = Float32Array.from(state.poses);
  for (const key of ["tool", "force", "stiffness", "goal"]) live[key] = Float32Array.from(state[key]);
  // The camera follows the hand slowly, and not while the user pulls.
  if (!grip) view.path = view.path.map((v, i) => v + .06 * (state.tool[i] - v));
  view.decals = state.decals.map(({ centre, radius, color }) => ({ centre, radius, colors: [[0, color]] }));
}

// ---- A hand on the arm ---------------------------------------------------------------------------------

let grip = null;

function seen(event) {
  const box = view.canvas.getBoundingClientRect();
  return view.ray(2 * (event.clientX - box.left) / box.width - 1, 1 - 2 * (event.clientY - box.top) / box.height);
}

// The place under the mouse, at the depth of the point that was grabbed.
function reach(event) {
  const { origin, direction, forward } = seen(event);
  return add(origin, direction, dot(add(grip.at, origin, -1), forward) / dot(direction, forward));
}

function pull(event) {
  grip.to = reach(event);
  attempt(() => ask({ do: "hold", hand: { pull: { body: grip.body, point: grip.point, to: grip.to } } }));
}

// Runs `act`. After an error the page shows its sentence, pauses and stays usable.
function attempt(act) {
  try {
    return act();
  } catch (problem) {
    complain(problem.message);
    play(false);
    return null;
  }
}

function listenToHand(canvas) {
  const mine = event => (event.stopImmediatePropagation(), event.preventDefault());
  canvas.addEventListener("pointerdown", event => {
    if (event.button !== 0 || event.shiftKey || event.ctrlKey || grip || !engine.wasm) return;
    const { origin, direction } = seen(event), found = attempt(() => ask({ do: "grab", origin, direction }));
    if (!found) return;
    mine(event);
    canvas.setPointerCapture(event.pointerId);
    grip = { ...found, to: found.at, pointer: event.pointerId };
    pull(event);
    if (!playing) play(true);
  }, { capture: true });
  canvas.addEventListener("pointermove", event => {
    if (grip?.pointer !== event.pointerId) return;
    mine(event);
    pull(event);
  }, { capture: true });
  for (const end of ["pointerup", "pointercancel"])
    canvas.addEventListener(end, event => {
      if (grip?.pointer !== event.pointerId) return;
      mine(event);
      grip = null;
      if (engine.wasm) attempt(() => ask({ do: "hold", hand: null }));
    }, { capture: true });
}

// ---- Curves of the last seconds ------------------------------------------------------------------------

const SPAN = 10, MARGIN = { left: 48, right: 8, top: 4, bottom: 16 };

class Curve {
  constructor(title, unit, labels, read, logarithmic = false) {
    Object.assign(this, { labels, read, logarithmic, points: [] });
    const figure = element(byId("panels"), "figure"), caption = element(figure, "figcaption");
    element(caption, "b", "", title);
    element(caption, "span", "", unit + (logarithmic ? ", logarithmic axis" : ""));
    this.values = labels.map((label, i) => {
      const entry = element(caption, "span");
      entry.insertAdjacentHTML("beforeend", `<svg><path d="M0 4H30" style="stroke: var(--c${i})" stroke-width="2"></path></svg>`);
      entry.append(`${label} `);
      return element(entry, "span");
    });
    this.canvas = element(element(figure, "div", "plot"), "canvas");
  }

  forget() { this.points = []; }

  add(state) {
    this.points.push([state.time, this.read(state)]);
    while (this.points[0][0] < state.time - SPAN) this.points.shift();
  }

  draw() {
    const { canvas, points, logarithmic } = this, g = canvas.getContext("2d");
    fit(canvas);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    g.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
    g.clearRect(0, 0, width, height);
    if (!points.length) return;
    const all = points.flatMap(p => p[1]).filter(v => Number.isFinite(v) && (!logarithmic || v > 0));
    if (!all.length) return;
    let low = all.reduce((a, b) => Math.min(a, b)), high = all.reduce((a, b) => Math.max(a, b));
    if (logarithmic) [low, high] = [low / 1.3, high * 1.3];
    else {
      [low, high] = [Math.min(low, 0), Math.max(high, 0)];
      const room = Math.max(.06 * (high - low), .5);
      [low, high] = [low < 0 ? low - room : 0, high + room];
    }
    const end = Math.max(points.at(-1)[0], SPAN), bottom = height - MARGIN.bottom, scale = logarithmic ? Math.log : v => v;
    const x = time => MARGIN.left + (1 - (end - time) / SPAN) * (width - MARGIN.left - MARGIN.right);
    const y = value => bottom - (scale(Math.max(value, logarithmic ? low : value)) - scale(low)) / (scale(high) - scale(low)) * (bottom - MARGIN.top);
    g.font = "11px system-ui, sans-serif";
    g.fillStyle = style("--faint");
    g.strokeStyle = style("--line");
    g.lineWidth = 1;
    g.textAlign = "right";
    g.textBaseline = "middle";
    const rows = logarithmic ? [low * 1.3, Math.sqrt(low * high), high / 1.3] : [low, (low + high) / 2, high];
    for (const value of rows) {
      g.fillText(value.toFixed(Math.abs(high - low) < 10 ? 1 : 0), MARGIN.left - 5, Math.min(y(value) + 5, bottom - 2));
      g.strokeRect(MARGIN.left, Math.round(y(value)) + .5, width - MARGIN.left - MARGIN.right, 0);
    }
    g.textAlign = "center";
    g.textBaseline = "alphabetic";
    for (let time = Math.ceil((end - SPAN) / 2) * 2; time <= end; time += 2) g.fillText(`${time} s`, x(time), height - 3);
    g.lineWidth = 1.6;
    this.labels.forEach((_, i) => {
      g.strokeStyle = hex(`--c${i}`);
      g.beginPath();
      for (const [time, values] of points) g.lineTo(x(time), y(values[i]));
      g.stroke();
      this.values[i].textContent = points.at(-1)[1][i].toFixed(1);
    });
  }
}

const view = new LiveView(live, 0);
const curves = [
  new Curve("Stiffness K", "N/m", ["x", "y", "z"], s => s.stiffness, true),
  new Curve("Feed-forward force F_ff", "N", ["x", "y", "z"], s => s.feedforward.slice(0, 3)),
  new Curve("Force", "N", ["contact", "your hand"], s => [norm(s.force), s.pull ? norm(s.pull.force) : 0]),
  new Curve("Way from goal to tool", "mm", ["x", "y", "z"], s => s.tool.map((v, i) => 1000 * (v - s.goal[i]))),
  new Curve("Energy of the joints so far", "J", ["sum of |tau qd| dt"], s => [s.energy]),
  new Curve("Power of the joints", "W", ["sum of |tau qd|"], s => [s.power]),
];

// ---- Time -------------------------------------------------------------------------------------------------

// `owed`: simulated seconds that are still to run; `rests`: when the episode begins again; `last`, `drawn`: of the last picture and curves (ms).
let playing = true, last = 0, owed = 0, rests = null, drawn = 0;
// Measured since `since` (ms), for about a second: simulated seconds, pictures, time in the simulation (ms). `drawn` counts all pictures.
const pace = { since: 0, simulated: 0, pictures: 0, busy: 0, factor: 0, rate: 0, capacity: 0, drawn: 0 };
// Longest time that one picture may wait for the simulation (ms), so that a slow machine shows slow motion instead of freezing.
const PATIENCE = 30;
// Below ENOUGH pictures per second a picture's resolution per side is multiplied by COARSER, down to the share COARSEST; above PLENTY it is
// raised again.
const ENOUGH = 30, PLENTY = 55, COARSEST = .4, COARSER = .8;
// How long an episode goes on after its task is done, and how long it stays after it is over (ms).
const WATCHED = 3000, OVER = 1500;

function play(on) {
  playing = on;
  byId("play").textContent = on ? "Pause" : "Play";
}

function advance(samples) {
  const before = performance.now(), next = attempt(() => ask({ do: "run", samples }));
  if (!next) return;
  pace.busy += performance.now() - before;
  pace.simulated += next.time - state.time;
  take(next);
  for (const curve of curves) curve.add(state);
}

function tick(now) {
  requestAnimationFrame(tick);
  const passed = Math.min(Math.max(now - last, 0), 500) / 1000;
  last = now;
  if (!scene) return;
  if (playing && engine.wasm) {
    owed += passed * byId("speed").value;
    const affordable = pace.capacity ? Math.max(1, Math.floor(pace.capacity * PATIENCE / 1000 / scene.dt)) : 25;
    const samples = Math.min(Math.floor(owed / scene.dt + 1e-6), affordable);
    if (samples > 0) advance(samples);
    // Simulated time that cannot be caught up is dropped.
    owed = Math.min(owed - samples * scene.dt, .1);
    again(now);
  }
  pace.pictures++;
  pace.drawn++;
  if (now - pace.since > 1000) {
    const wall = (now - pace.since) / 1000;
    Object.assign(pace, { factor: pace.simulated / wall, rate: pace.pictures / wall });
    if (pace.busy > 0 && pace.simulated > 0) pace.capacity = pace.simulated / (pace.busy / 1000);
    Object.assign(pace, { since: now, simulated: 0, pictures: 0, busy: 0 });
    // Without a graphics card a picture at full resolution takes long. An interval of 5 s or more means that the page was hidden.
    const { detail = 1 } = view.canvas;
    if (wall < 5 && pace.rate < ENOUGH) view.canvas.detail = Math.max(detail * COARSER, COARSEST);
    else if (wall < 5 && pace.rate > PLENTY) view.canvas.detail = Math.min(detail / COARSER, 1);
    byId("pace").textContent = `${pace.factor.toFixed(2)} x real time, ${pace.rate.toFixed(0)} pictures per second`;
  }
  view.draw();
  // Curves are drawn less often than the scene.
  if (now - drawn > 100) {
    drawn = now;
    for (const curve of curves) curve.draw();
  }
  byId("clock").textContent = `${state.time.toFixed(2)} s`;
}

// A script or a policy begins again after its task is done or the episode is over; the player `hold` only after the latter.
function again(now) {
  const ended = state.over ? OVER : state.fulfilled && setup.player !== "hold" ? WATCHED : null;
  if (ended === null || grip) return;
  rests ??= now + ended;
  if (now > rests) open(setup);
}

// ---- Start ------------------------------------------------------------------------------------------------

function listenToControls() {
  const actions = {
    play: () => play(!playing),
    step: () => (play(false), engine.wasm && advance(Math.round(1 / scene.rate / scene.dt))),
    reset: () => open(setup),
    another: () => open({ ...setup, seed: setup.seed + 1 }),
  };
  for (const [id, act] of Object.entries(actions)) byId(id).onclick = act;
  const keys = { " ": actions.play, s: actions.step, r: actions.reset, n: actions.another };
  addEventListener("keydown", event => {
    if (!keys[event.key] || event.altKey || event.ctrlKey || event.metaKey || event.target.matches("button, select, input")) return;
    event.preventDefault();
    keys[event.key]();
  });
  const kept = wanted => about.policies.some(p => p.run === wanted.player && p.task === wanted.task && p.space === wanted.space);
  const playable = wanted => ["script", "hold"].includes(wanted.player) || kept(wanted) ? wanted : { ...wanted, player: "script" };
  byId("task").onchange = event => {
    const space = about.spaces.includes(setup.space) ? setup.space : about.setup.space;
    open(playable({ ...setup, task: event.target.value, space, table: 0, knobs: {} }));
  };
  byId("space").onchange = event => open(playable({ ...setup, space: event.target.value, knobs: {} }));
  byId("player").onchange = event => {
    const policy = about.policies.find(policy => policy.run === event.target.value);
    open({ ...setup, player: event.target.value, space: policy?.space ?? setup.space, knobs: {} });
  };
  byId("link").onclick = async () => {
    const said = byId("link");
    try {
      await navigator.clipboard.writeText(location.href);
      said.textContent = "Copied";
    } catch {
      said.textContent = "It is the address of this page";
    }
    setTimeout(() => said.textContent = "Copy link", 2000);
  };
  addEventListener("hashchange", recall);
}

// Marks that are drawn over the scene, each with a switch.
function addLegend() {
  for (const [id, color, name, said] of [
    ["arrow", `rgb(${FORCE_COLOR})`, "contact force", "on the tool, sustained; 4 cm per 10 N"],
    ["ellipsoid", "var(--run0)", "stiffness", "along the world's axes; logarithmic: semi-axis "
      + [300, 3000].map(k => `${(100 * semiAxis(k)).toFixed(0)} cm at ${k} N/m`).join(", ")],
    ["goal", "var(--goal)", "goal pose", "where the last action wants the tool, its axes x red, y green, z blue"],
  ]) {
    const label = element(byId("legend"), "label"), box = element(label, "input");
    Object.assign(box, { id, type: "checkbox", checked: true });
    element(label, "i").style.background = color;
    element(element(label, "span", "", name + " "), "small", "", said);
  }
}

// Opens the episode that the address asks for. If that is refused, the page says why and opens the first episode if there is none yet.
async function recall() {
  try {
    if (await open(read(location.hash))) return;
  } catch (problem) {
    complain(problem.message);
  }
  const why = byId("problem").textContent;
  if (!setup) await open({ ...about.setup, knobs: {} });
  complain(why);
}

async function start() {
  addLegend();
  byId("panels").style.setProperty("--columns", innerWidth > 900 ? 3 : 1);
  if (view.gl) listenToHand(view.canvas), listen(view.canvas);
  try {
    await load();
    await wake();
    about = ask({ do: "about" });
  } catch (problem) {
    complain(problem.message);
    return;
  }
  listenToControls();
  await recall();
  pace.since = performance.now();
  requestAnimationFrame(tick);
}

start();
